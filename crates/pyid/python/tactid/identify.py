"""Identification from a log or from arrays, behind one name."""

import os
from collections.abc import Callable, Sequence
from typing import Any, Literal, overload

from numpy.typing import ArrayLike

from tactid import _native
from tactid._native import Identification, Manipulator, MassProperties

_Way = Literal["tactile", "effort", "joint-sensing", "combined"]
_Filter = Literal["rls", "nlms"]


@overload
def identify(
    source: str | os.PathLike[str],
    *,
    tool: str | None = None,
    way: _Way | None = None,
    estimator: _Filter = "rls",
    alpha: float = 1.8,
    beta: float = 0.9,
    gravity: ArrayLike | None = None,
    average: float | None = None,
    cutoff: float | None = None,
    epochs: int | None = None,
    max_gap: float | None = None,
    wrench_offset: bool = False,
    wrench_noise: ArrayLike | None = None,
    effort_noise: ArrayLike | None = None,
    urdf: str | None = None,
    joints: Sequence[str] = (),
    wrenches: Sequence[str] = (),
    odometry: str | None = None,
    imu: str | None = None,
    acceleration: str | None = None,
    wrench_acts_on: Literal["payload", "sensor"] = "payload",
    known_tool: MassProperties | None = None,
    known_mass: float | None = None,
    known_mass_deviation: float = 0.0,
    bounding_box: ArrayLike | None = None,
    delay: float | None = None,
    bare: str | os.PathLike[str] | None = None,
    effort_gain: Sequence[float] = (),
    progress: Callable[[float], object] | None = None,
) -> Identification: ...


@overload
def identify(
    source: ArrayLike,
    *,
    robot: Manipulator | None = None,
    q: ArrayLike | None = None,
    qd: ArrayLike | None = None,
    effort: ArrayLike | None = None,
    wrench: ArrayLike | None = None,
    pose: ArrayLike | None = None,
    twist: ArrayLike | None = None,
    acceleration: ArrayLike | None = None,
    sensors: Sequence[str] | None = None,
    tool: str | None = None,
    way: _Way | None = None,
    estimator: _Filter = "rls",
    alpha: float = 1.8,
    beta: float = 0.9,
    gravity: ArrayLike | None = None,
    average: float | None = None,
    cutoff: float | None = None,
    epochs: int | None = None,
    max_gap: float | None = None,
    wrench_offset: bool = False,
    wrench_noise: ArrayLike | None = None,
    effort_noise: ArrayLike | None = None,
    known_tool: MassProperties | None = None,
    known_mass: float | None = None,
    known_mass_deviation: float = 0.0,
    bounding_box: ArrayLike | None = None,
    delay: float | None = None,
    progress: Callable[[float], object] | None = None,
) -> Identification: ...


def identify(source: Any, **options: Any) -> Identification:
    """Identifies the payload from a log, or from arrays.

    A log is an ``.mcap`` file or the folder of a rosbag2 bag; its topics are found by their types.
    The motion is that of joints and a URDF, on a base that odometry moves if there is any; or,
    without joints, that of the sensor itself by odometry (and measured accelerations, where these
    explain the load better) or by an inertial unit. Memory is bounded, whatever the log's length.

    Arrays are on one clock: ``time`` (N,), s. With a ``robot``, ``q`` (N, n) and, if measured,
    ``qd``; ``pose``, ``twist`` and ``acceleration`` are then the base's. Without one they are the
    sensor's own: ``pose`` (N, 4, 4) or (N, 7) in the world; ``twist`` (N, 6), velocity of the
    origin then angular velocity, and ``acceleration`` (N, 6), classical and without gravity, then
    angular, both in world axes. What is left out is derived.

    Args:
        source: The log's path, or the times of the samples.
        **options: As follows.
        tool: The end-effector frame, a link of the robot: ``tool0`` where left out, or the sensor's
            frame without a robot.
        way: ``"tactile"``, from wrenches; ``"effort"``, from what the joints exert beyond what the
            arm itself needs; ``"joint-sensing"``, from the motion of a free-floating robot, the
            known gripper taken off; or ``"combined"``, from all that is measured, each channel
            weighted by its own residuals. Tactile where there are wrenches, else effort.
        estimator: ``"rls"``, robust least squares over the whole recording, or ``"nlms"``, the
            paper's filter.
        alpha: Of NLMS, in (0, 2).
        beta: Of NLMS, in (0, 1).
        gravity: Gravitational acceleration in world axes, (3,), m/s², pointing down. Where left
            out: zero for a floating base, 9.81 along -z for a fixed one and for a sensor alone.
        average: The estimate is the mean over this last time, s, for NLMS: 10, as in the paper.
        cutoff: Both sides of the equations pass a low-pass that has lost 3 dB here, Hz. Chosen from
            the data where left out (10 for NLMS).
        epochs: How often the recording is presented to NLMS: 2.
        max_gap: Samples further apart are not bridged, s: five periods of the slowest stream.
        wrench_offset: Whether the wrenches, summed in the tool frame, may be off by a constant, a
            zero that was not set: six more unknowns.
        wrench_noise: White noise of a sensor's wrench where it is known: standard deviations of one
            sample, (6,), N and N m, or (S, 6) for S sensors. They weigh the channels; where left
            out, the residuals do.
        effort_noise: The same of a joint's effort, () or (n,), N m or N.
        urdf: The robot's URDF as text; the log's robot description where left out.
        joints: Topics of joint states; several where each has a part of the joints.
        wrenches: Topics of wrenches, whose sum acts on the payload.
        odometry: Topic of the base's motion, or the sensor's own.
        imu: Topic of an inertial unit on the tool, where there is neither joint nor odometry; or in
            the frame of a moving base, whose acceleration and turning it then tells.
        acceleration: Topic of the accelerations of what the odometry moves.
        wrench_acts_on: ``"payload"``, or ``"sensor"`` for what the payload exerts on the sensor.
        known_tool: A body that the load holds besides the payload, in the tool frame: taken off.
        known_mass: The payload's mass where it was weighed, kg: it makes the others known better.
        known_mass_deviation: Standard deviation of the weighing, kg; 0 for an exact mass.
        bounding_box: Least and largest corner of a box that holds the whole payload, along the axes
            of the tool frame, (2, 3), m: the result is a body that fits in.
        delay: By how much later than the motion wrenches are stamped, s; estimated where left out,
            and corrected where significant.
        bare: A recording of the same motion without the payload, whose efforts are taken off.
        effort_gain: What a unit of effort is in N m, one a joint in the robot's order.
        robot: For arrays: the robot with its gripper and without the payload.
        q: Joint positions, (N, n), rad or m.
        qd: Joint velocities, (N, n), rad/s or m/s.
        effort: What the joints exert, (N, n), N m or N.
        wrench: Force then moment on the payload, each in its sensor's frame and about its origin,
            (N, 6), or (N, S, 6) for S sensors.
        pose: See above.
        twist: See above.
        sensors: The links in whose frames the wrenches are; the tool where left out.
        progress: Called with the fraction done, about twenty times a second. An exception that it
            raises stops the work, as Ctrl-C does.

    Raises:
        LogError: The log cannot be read.
        ModelError: The robot cannot be modelled, or has no such link.
        IdentificationError: Something that is needed is not there.
        ArgumentError: A shape does not fit, or a setting is out of range.
    """
    if isinstance(source, str | os.PathLike):
        return _native.identify_log(source, **options)
    return _native.identify_arrays(source, **options)
