"""The options of an identification: each declared once, for Python and for the command line.

A field of :class:`Options` is a keyword of ``tactid.identify`` and an option of the command
``tactid identify``, and crosses to Rust by its name. All defaults are Rust's: None stands for them.
"""

from __future__ import annotations

import difflib
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, Literal

from numpy.typing import ArrayLike

from tactid import option_text
from tactid._native import MassProperties
from tactid.calibration import Calibration
from tactid.declaration import Declaration, Use, documented, option
from tactid.errors import ArgumentError

Method = Literal["tactile", "effort", "joint-sensing", "combined"]
"""Which measurements the payload is identified from."""

Estimator = Literal["least-squares", "nlms"]
"""How equations become parameters."""

ActsOn = Literal["payload", "sensor"]
"""The body on which a measured wrench acts."""

_LOG: tuple[Use, ...] = ("log",)
_RECORDING: tuple[Use, ...] = ("log", "arrays")
_LEAST_SQUARES: tuple[Use, ...] = ("log", "arrays", "online", "design")
_STREAM: tuple[Use, ...] = ("log", "arrays", "online", "paper filter", "calibration")
_METHODS: tuple[Use, ...] = ("log", "arrays", "online", "paper filter", "design")
_ALL: tuple[Use, ...] = (*_STREAM, "design")
_EFFORTS: tuple[Use, ...] = ("log", "arrays", "calibration")
_LOGS: tuple[Use, ...] = ("log", "calibration")
_PAPER: tuple[Use, ...] = ("log", "arrays", "paper filter")

ROBOT, TOPICS, MEASUREMENTS, SIGNS = "Robot", "Topics", "Measurements", "Signs"
PRIOR, NOISE, PAPER = "Prior knowledge", "Noise and filter", "Paper's filter"


@dataclass(frozen=True, kw_only=True)
class Options:
    """What to identify from a recording, and how: every option once, each optional.

    <options>
    """

    urdf: str | os.PathLike[str] | None = option(
        "The robot's URDF file. Its base is fixed, unless the motion of the base is measured.",
        ROBOT,
        _EFFORTS,
        python="A text that begins with ``<`` is the URDF itself.",
        rust_field="Request::urdf",
        default="the robot description in the log",
        argument=Path,
    )
    tip: str | None = option(
        "End-effector frame, a link of the robot.",
        ROBOT,
        _ALL,
        rust_field="Request::tip",
        default="tool0, or the frame of the sensor where there is no robot",
        metavar="LINK",
    )
    rename_joints: Mapping[str, str] | None = option(
        "Joints that have another name in the log than in the URDF: the name in the log, then that"
        " in the URDF.",
        ROBOT,
        _LOGS,
        rust_field="Request::joint_names",
        default="none; where no name in the log fits, joints whose names are the same behind a"
        " prefix",
        metavar="RECORDED=JOINT,...",
        argument=str,
        parse=option_text.names,
    )
    sensor_frame: Sequence[Any] | None = option(
        "Frame of the only wrench sensor, where it is no link of the robot or to replace it: the"
        " link that it is fixed to, then its origin x, y, z and its quaternion qx, qy, qz, qw in"
        " the frame of this link.",
        ROBOT,
        rust_field="Request::sensor_frame",
        default="the frame that the messages name; for arrays, the links of the sensors",
        unit="m",
        metavar="LINK,X,Y,Z,QX,QY,QZ,QW",
        argument=str,
        parse=option_text.frame,
    )
    joint_topic: str | Sequence[str] | None = option(
        "Topic of joint states; several where each has some of the joints.",
        TOPICS,
        _LOGS,
        rust_field="Topics::joints",
        default="found by its type",
        argument=list[str],
    )
    wrench_topic: str | Sequence[str] | None = option(
        "Topic of wrenches; the sum of several acts on the payload.",
        TOPICS,
        _LOG,
        rust_field="Topics::wrenches",
        default="found by its type; several only where each is of another finger, a link that"
        " joints beyond the tip move",
        argument=list[str],
    )
    odometry_topic: str | None = option(
        "Topic of the odometry of the base, or of the sensor itself where there are no joints.",
        TOPICS,
        _LOG,
        rust_field="Topics::odometry",
        default="found by its type",
    )
    imu_topic: str | None = option(
        "Topic of an inertial unit: on the sensor where there are neither joints nor odometry, or"
        " on a moving base, in its frame.",
        TOPICS,
        _LOG,
        rust_field="Topics::imu",
        default="found by its type on a sensor; none on a base",
    )
    acceleration_topic: str | None = option(
        "Topic of the accelerations of the body that the odometry moves.",
        TOPICS,
        _LOG,
        rust_field="Topics::acceleration",
        default="found by its type, and used where it is better than the derived accelerations",
    )
    method: Method | None = option(
        "Measurements that the payload is identified from: wrenches (tactile); joint efforts beyond"
        " those that the arm itself needs (effort); the motion of a free-floating base, from which"
        " the known gripper is subtracted (joint-sensing); or all that is measured, each channel"
        " weighted by its own residuals (combined).",
        MEASUREMENTS,
        _METHODS,
        rust_field="Request::method",
        default="tactile where there are wrenches, else effort",
        python="Online, the default is tactile, as it is for a design.",
    )
    unloaded: str | os.PathLike[str] | Mapping[str, ArrayLike] | None = option(
        "An unloaded recording of the same motion, whose joint efforts are subtracted by the effort"
        " method. With a calibration: one of the same day and any motion, which updates it.",
        MEASUREMENTS,
        python="That of a log is a log; that of arrays is a dict of the arrays ``time``, (M,), and"
        " ``q`` and ``effort``, (M, n).",
        rust_field="Request::unloaded, Arrays::unloaded",
        argument=Path,
    )
    calibration: str | os.PathLike[str] | Calibration | None = option(
        "Calibration of the arm, which tactid calibrate wrote: the effort method then identifies"
        " the payload together with what is known of the arm. It sets the tip, gravity, cutoff and"
        " gains.",
        MEASUREMENTS,
        rust_field="Request::calibration",
        python="The path of its file, or what ``tactid.calibrate`` returned.",
        argument=Path,
    )
    delay: float | None = option(
        "Delay of the wrenches' stamps relative to the motion.",
        MEASUREMENTS,
        rust_field="Request::delay_s",
        default="estimated by the tactile method with least squares, and corrected where it is"
        " significant; else 0",
        unit="s",
    )
    max_gap: float | None = option(
        "Longest time between two samples that is bridged.",
        MEASUREMENTS,
        _STREAM,
        rust_field="Request::max_gap_s",
        default="five periods of the slowest stream; 0.1 online and for the paper's filter",
        unit="s",
    )
    wrench_offset: bool | None = option(
        "Whether the sum of the wrenches may have an unknown constant offset, a sensor zero that"
        " was not set: six more unknowns.",
        MEASUREMENTS,
        _LEAST_SQUARES,
        rust_field="Request::wrench_offset",
        default="false",
    )
    gravity: ArrayLike | None = option(
        "Gravitational acceleration in world axes, (3,), pointing down.",
        SIGNS,
        _ALL,
        rust_field="Request::gravity",
        default="0,0,0 for a floating base, 0,0,-9.81 for a fixed one and for a sensor without a"
        " robot",
        unit="m/s²",
        metavar="X,Y,Z",
        argument=str,
        parse=option_text.vector,
    )
    wrench_acts_on: ActsOn | None = option(
        "Body on which the measured wrenches act. Most force-torque sensors report the wrench on"
        " the sensor.",
        SIGNS,
        rust_field="Request::wrench_acts_on",
        default="payload",
    )
    effort_gain: Sequence[float] | None = option(
        "Effort of each joint for one unit of the recorded value, in the robot's order.",
        SIGNS,
        _EFFORTS,
        rust_field="Request::effort_gain",
        default="1",
        unit="N m (N) per unit",
        metavar="G,G,...",
        argument=str,
        parse=option_text.numbers,
    )
    effort_gain_std_dev: ArrayLike | None = option(
        "Standard deviation of the relative error of each gain, for all joints or for each: a"
        " fraction in Python, 0.05, and a percentage on the command line, 5%. The intervals contain"
        " it for the methods that use efforts; the paper's filter has none.",
        SIGNS,
        rust_field="Request::effort_gain_std_dev",
        default="5 % where gains are given, else 0",
        metavar="P%,P%,...",
        argument=str,
        parse=option_text.gain_std_devs,
    )
    known_tool: MassProperties | None = option(
        "A known body that the measured load contains besides the payload, in the tip's frame: it"
        " is subtracted. On the command line: mass, centre of mass, and inertia about it.",
        PRIOR,
        rust_field="Request::known_tool",
        unit="kg, m, kg m²",
        metavar="M,X,Y,Z,XX,XY,XZ,YY,YZ,ZZ",
        argument=str,
        parse=option_text.body,
    )
    known_mass: float | None = option(
        "Mass of the payload from a scale: it improves the other values, too.",
        PRIOR,
        rust_field="KnownMass::mass_kg",
        unit="kg",
    )
    known_mass_std_dev: float | None = option(
        "Standard deviation of the known mass.",
        PRIOR,
        rust_field="KnownMass::std_dev_kg",
        default="0, an exact mass",
        unit="kg",
    )
    bounding_box: ArrayLike | None = option(
        "Least and largest corner of a box that contains the whole payload, in the tip's frame,"
        " (2, 3): the result is a body that fits into it.",
        PRIOR,
        rust_field="Request::bounding_box",
        unit="m",
        metavar="X,Y,Z,X,Y,Z",
        argument=str,
        parse=option_text.box,
    )
    estimator: Estimator | None = option(
        "Robust least squares over the whole recording, or the paper's filter (nlms).",
        NOISE,
        rust_field="Request::estimator",
        default="least-squares",
    )
    cutoff: float | None = option(
        "Cutoff of the low-pass on both sides of the equations (-3 dB).",
        NOISE,
        _ALL,
        rust_field="Request::cutoff_hz",
        default="chosen from the data of a recording; 10 online, for the paper's filter and for a"
        " design; 2 for a calibration",
        unit="Hz",
    )
    wrench_noise: ArrayLike | None = option(
        "Standard deviations of the white noise of one wrench, (6,), or (S, 6) for S sensors; on"
        " the command line, once for all sensors or once for each. Their ratios weight the"
        " channels; the intervals follow from the residuals.",
        NOISE,
        _LEAST_SQUARES,
        rust_field="Request::wrench_noise",
        default="estimated from the residuals; for a design 0.5 N and 0.05 N m",
        unit="N and N m",
        metavar="FX,FY,FZ,MX,MY,MZ",
        argument=list[str],
        parse=option_text.wrenches,
    )
    effort_noise: ArrayLike | None = option(
        "Standard deviation of the white noise of one joint effort, for all joints or for each.",
        NOISE,
        _LEAST_SQUARES,
        rust_field="Request::effort_noise",
        default="estimated from the residuals; for a design 0.5",
        unit="N m or N",
        metavar="S,S,...",
        argument=str,
        parse=option_text.numbers,
    )
    alpha: float | None = option(
        "Step size of the paper's filter, in (0, 2).",
        PAPER,
        _PAPER,
        rust_field="PaperSettings::alpha",
        default="1.8, as in the paper",
    )
    beta: float | None = option(
        "Regularisation of the paper's filter, in (0, 1).",
        PAPER,
        _PAPER,
        rust_field="PaperSettings::beta",
        default="0.9, as in the paper",
    )
    average: float | None = option(
        "The estimate of the paper's filter is the mean over this last time, or the latest value"
        " for 0.",
        PAPER,
        _PAPER,
        rust_field="PaperSettings::average_s",
        default="10, as in the paper",
        unit="s",
    )
    epochs: int | None = option(
        "Number of times that the recording is presented to the paper's filter.",
        PAPER,
        rust_field="PaperSettings::epochs",
        default="2",
    )


def option_names(use: Use | None = None) -> list[str]:
    """Returns the names of all options, or of those that apply to one use, in order."""
    every = fields(Options)
    return [one.name for one in every if use is None or use in Declaration.of(one).uses]


def collect(
    options: Options | None, keywords: dict[str, Any], use: Use, own: Sequence[str] = ()
) -> Options:
    """Merges keywords into options, and checks that all of them exist and apply.

    Args:
        options: Options to start from; none of them is set where it is None.
        keywords: Further options by name, which replace those of ``options``.
        use: Where the options are to apply.
        own: Keywords of the caller that are no options, for the list of an error.

    Raises:
        ArgumentError: ``options`` is something else, a keyword is no option, or an option does not
            apply.
    """
    if options is not None and not isinstance(options, Options):
        raise ArgumentError(
            f"`options` is of type {type(options).__name__}: expected tactid.Options"
        )
    every, allowed = option_names(), option_names(use)
    for name in keywords:
        if name not in every:
            raise ArgumentError(_unknown(name, [*own, *allowed]))
    collected = replace(options or Options(), **keywords)
    for name in every:
        if getattr(collected, name) is not None and name not in allowed:
            raise ArgumentError(f"`{name}` does not apply to {_NAMES[use]}", option=name)
    return collected


_NAMES: dict[Use, str] = {
    "log": "a log",
    "arrays": "arrays",
    "online": "Identifier",
    "paper filter": "PaperFilter",
    "calibration": "a calibration",
    "design": "the design of a motion",
}


def _unknown(name: str, allowed: Sequence[str]) -> str:
    """Says that there is no such keyword, and lists those that there are, the closest first."""
    closest = difflib.get_close_matches(name, allowed, n=3)
    hint = f"; did you mean `{closest[0]}`?" if closest else "."
    listed = [*closest, *(other for other in allowed if other not in closest)]
    return f"there is no keyword `{name}`{hint} The keywords are {', '.join(listed)}."


documented(Options)(Options)
