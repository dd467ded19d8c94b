"""Identification sample by sample: least squares, and the paper's filter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from tactid import _native
from tactid._base.field_docs import with_fields
from tactid._base.findings import Finding
from tactid._base.naming import counted
from tactid._base.values import Array
from tactid._native import Manipulator
from tactid._options.arrays import with_arrays
from tactid._options.declaration import documented
from tactid._options.options import OPTIONS, Options, collect
from tactid._results.payload import PaperEstimate, Payload, PayloadEstimate
from tactid._results.records import SingularValues, WrenchOffset

if TYPE_CHECKING:
    from tactid._results.records import MotionEstimate


@with_fields
@dataclass(frozen=True)
class WrenchEstimate:
    """A wrench of a load or of a contact with its uncertainty."""

    time: float
    """Time to which the wrench belongs, on the clock of the samples, s."""
    values: Array
    """Force, N, and moment, N m, (6,), with the sign of the measured wrenches.

    NaN stands for a channel of a contact that the sensor does not measure."""
    covariance: Array
    """Covariance of the values, (6, 6); a channel that is not measured has an infinite variance."""
    is_changing: bool
    """Whether the payload may have changed: the covariance then contains the contact itself."""

    @property
    def std_devs(self) -> Array:
        """Standard deviations of the values, (6,)."""
        return np.sqrt(np.diagonal(self.covariance))


class _Online:
    """Base class of the online solvers: samples in."""

    _native: _native.OnlineSolver

    def estimate(self) -> Payload | None:
        """Returns the payload as known now."""
        raise NotImplementedError

    def __repr__(self) -> str:
        estimate = self.estimate()
        if estimate is None:
            return f"<tactid.{type(self).__name__}: no estimate yet>"
        windows = counted(estimate.windows, "window")
        return f"<tactid.{type(self).__name__}: {estimate.summary}, {windows}>"

    @with_arrays("online")
    def push(  # noqa: D417 - arrays are documented by their declarations
        self,
        time: ArrayLike,
        q: ArrayLike | None = None,
        qd: ArrayLike | None = None,
        wrench: ArrayLike | None = None,
        *,
        effort: ArrayLike | None = None,
        pose: ArrayLike | None = None,
        twist: ArrayLike | None = None,
        acceleration: ArrayLike | None = None,
    ) -> int:
        """Takes one sample, or N in a row.

        The arrays are those of :func:`tactid.identify`, of n joints and S sensors; without a robot
        there are no joints. Efforts are given where the method uses them.

        Args:
            <arrays>

        Returns:
            Number of samples that were used: they gave rows once a window was full. Bad samples
            (not finite, not later than the one before) are rejected and counted. The first sample
            of all, or after a gap, only starts a window; so does the one after two in a row that
            are earlier than the last one used, because the clock has gone back.

        Raises:
            ArgumentError: A shape does not fit, or something is missing.
        """
        base = {"pose": pose, "twist": twist, "acceleration": acceleration}
        return self._native.push(time, q, qd, wrench, effort=effort, **base)


@documented(OPTIONS, "online")
class Identifier(_Online):
    """Identifies the payload of one robot online by least squares.

    It estimates its uncertainty, returns a physically consistent body and detects payload changes.
    It learns the noise from the first 32 windows, 1 s at a cutoff of 10 Hz; before, intervals are
    rough and no change is detected. One sample takes some microseconds, a call from Python more:
    push many at once where possible.

    A sensor without a robot, such as one that is swung by hand, is ``Identifier()``: each sample
    then has its ``pose``, ``twist`` and ``wrench``.

    Args:
        robot: The robot with its gripper and without the payload; None for a sensor alone.
        sensors: The links in whose frames the wrenches of each sample are, one name or several.
            Default: the tip for the tactile method, none for other methods.
        effort: For the combined method, whether each sample has the joints' efforts.
        options: Options to start from; keywords replace them.
        **keywords: The fields of :class:`tactid.Options` that apply online, as follows.

            <options>

    Raises:
        ModelError: The robot has no such link.
        ArgumentError: An option does not exist, does not apply online, or is out of range.
        IdentificationError: The method does not fit the robot or the sensors.
    """

    _native: _native.Identifier

    def __init__(
        self,
        robot: Manipulator | None = None,
        sensors: str | Sequence[str] | None = None,
        *,
        effort: bool = True,
        options: Options | None = None,
        **keywords: Any,
    ) -> None:
        collected = collect(options, keywords, "online", ("robot", "sensors", "effort", "options"))
        self._native = _native.Identifier(robot, sensors, effort, collected.plain())

    def estimate(self) -> PayloadEstimate:
        """Returns the payload as known now."""
        return PayloadEstimate(**self._native.estimate())

    def covariance(self) -> Array | None:
        """Returns the covariance of the payload's linear parameters, (10, 10).

        The parameters are mass, kg; first moments, kg m; inertia about the tip's origin,
        kg m², xx, xy, xz, yy, yz, zz. A direction that the motion does not determine has the
        variance of a parameter of plausible size. None stands during the first seven windows, in
        which the noise is not known.
        """
        return self._native.covariance()

    def estimate_before_change(self) -> PayloadEstimate | None:
        """Returns the payload before the last change, without the windows that showed the change.

        None stands before a change, and where that payload had not been known for 32 windows.
        """
        estimate = self._native.estimate_before_change()
        return None if estimate is None else PayloadEstimate(**estimate)

    def is_settled(self) -> bool:
        """Returns whether the estimate is one of the payload that is held now.

        At least 32 windows contribute to it, 1 s at a cutoff of 10 Hz, the most recent ones show no
        evidence of a change, and since the last change they show a payload that no contact could
        be: at rest, a constant vertical force could.
        """
        return self._native.is_settled()

    def time_since_change(self) -> float:
        """Returns the time since the last payload change, s: infinite before one, never below 0."""
        return self._native.time_since_change()

    def hold_payload(self, is_held: bool = True) -> bool:
        """Holds the payload, from when it has settled until the gripper opens, or ends that.

        Samples of such a time neither update the estimate nor show a payload change: whatever the
        load does not explain is a contact.

        Args:
            is_held: Whether the payload stays what it is from now on.

        Returns:
            Whether that is so: a payload that fewer than 32 windows determine is not held, because
            nothing more would be known of it.
        """
        return self._native.hold_payload(is_held)

    def tare(self) -> bool:
        """Sets the zero of the wrench sensor, as after its drift, and keeps the payload's estimate.

        The samples that follow determine the :meth:`wrench_offset` anew, the first of them within
        0.2 s at a cutoff of 10 Hz. A payload change that was the zero's is taken back. Nothing may
        touch the payload meanwhile; the arm may move.

        Returns:
            Whether that is possible: ``wrench_offset`` makes the zero an unknown, 32 windows have
            determined the load, and the payload is not held.
        """
        return self._native.tare()

    def knows_weight(self) -> bool:
        """Returns whether the motion has determined what a contact is measured against.

        That is mass and centre of mass of the load, and the offset where it is an unknown. Until
        then, the wrench of a contact is relative to the attitudes so far.
        """
        return self._native.knows_weight()

    def contact_wrench(self, point: str, axes: str | None = None) -> WrenchEstimate | None:
        """Returns the wrench of a contact: the measured wrench less offset and load.

        It has the sign of the measured wrenches: where these act on the payload, it is what the
        payload exerts on what it touches. It passes a causal low-pass with the cutoff of the
        identifier, and belongs to the time :attr:`WrenchEstimate.time`. What the load does not
        explain may also be a payload change: ``is_changing`` is then true, and the covariance
        contains the contact itself, until the samples decide or :meth:`hold_payload` does. A
        channel that the sensor does not measure is NaN, with an infinite variance.

        Args:
            point: The link about whose origin the moment is; it moves with the tip.
            axes: The link along whose axes the wrench is, which moves with the tip or is fixed to
                the ground, or "world". Default: those of ``point``.

        Returns:
            The wrench; None before 32 windows determine the load, and after a gap.

        Raises:
            ArgumentError: The robot has no such link, or it does not move with the tip.
        """
        wrenches = self._native.wrenches(point, axes)
        return None if wrenches is None else WrenchEstimate(*wrenches[1])

    def load_wrench(self, point: str, axes: str | None = None) -> WrenchEstimate | None:
        """Returns the wrench by which the robot carries and accelerates payload and known tool.

        It is what the sensor would measure of them without offset, noise and contact, with the
        sign of the measured wrenches.

        Args:
            point: As for :meth:`contact_wrench`.
            axes: As for :meth:`contact_wrench`.

        Returns:
            The wrench; None as for :meth:`contact_wrench`.

        Raises:
            ArgumentError: The robot has no such link, or it does not move with the tip.
        """
        wrenches = self._native.wrenches(point, axes)
        return None if wrenches is None else WrenchEstimate(*wrenches[0])

    def contact_latency(self) -> float | None:
        """Returns the time by which the wrenches of contact and load lag the last sample, s.

        None stands before the first of them.
        """
        return self._native.contact_latency()

    def joint_covariance(self) -> Array | None:
        """Returns the joint covariance of the payload's parameters and of the offset, (16, 16).

        The parameters are those of :meth:`covariance`; the offset of the wrenches follows in the
        tip's frame, N and N m. None stands where the offset is not an unknown.
        """
        return self._native.joint_covariance()

    def wrench_offset(self) -> WrenchOffset | None:
        """Returns the constant offset of the wrenches: what the sensor measures without a load.

        It is in the sensor's own frame and about its origin where there is one sensor that does not
        move relative to the tip, and otherwise in the tip's frame. It is the sensor's, so that
        what is known of it outlives a payload change. None stands where the option
        ``wrench_offset`` does not make it an unknown.
        """
        offset = self._native.wrench_offset()
        return None if offset is None else WrenchOffset(**offset)

    def findings(self) -> list[Finding]:
        """Returns what the recent samples show about the assumptions of the identification.

        A wrong sign, an offset of the wrench sensor, a load that the model does not explain, or
        outliers, a velocity or a twist that is not the derivative of the position or the pose, a
        channel of the wrench that never changes, and defects of the robot's URDF that matter for
        the method: as ``tactid.identify`` finds them in the same samples. The samples are those of
        the last 10 s (at a cutoff of 10 Hz) since the last payload change. Samples of which none
        could be used are reported, too. It takes some 10 ms: in a control loop, call it in another
        thread, where it works on a copy.

        Online, a delay of the wrenches is neither estimated nor corrected; it is named where it
        leaves a load unexplained. To measure it once, identify a recording of the same sensors.
        """
        return self._native.findings()


@documented(OPTIONS, "online")
class LagIdentifier(_Online):
    """Estimates the motion of a free-floating robot together with its payload, while samples come.

    Where base, joints and wrenches are all noisy, its estimate is much more precise than the one of
    :class:`Identifier`, and comes close to the one of a recording: it is a fixed-lag smoother,
    which marginalises out the motion that is older than the lag. The first estimate needs 0.8 s of
    samples, or the lag and 0.05 s where that is longer; then it is renewed every 0.05 s. Everything
    begins again after a payload change.

    There is an estimate where velocities of the joints and the base are measured, and where it is
    more precise than the one of windows; :meth:`motion` says why there is none, and
    :meth:`window_estimate` has the one that serves then. A sample that completes 0.05 s takes some
    milliseconds and allocates memory: push samples in a thread beside the control loop. Splines
    follow 10 Hz; the cutoff is that of the windows alone, whose estimate comes first: where
    :meth:`motion` stays ``smoothed``, a lower cutoff lets less noise through.

    Args:
        robot: The robot, with joints and a floating base, with its gripper and without the payload.
        sensors: The links in whose frames the wrenches of each sample are, one name or several.
            Default: the tip for the tactile method, none for other methods.
        effort: For the combined method, whether each sample has the joints' efforts.
        lag_s: Time before the last sample in which the motion may still change, s, 0.1 to 10,
            rounded up to intervals of 0.05 s. Time and memory grow with it.
        options: Options to start from; keywords replace them.
        **keywords: The fields of :class:`tactid.Options` that apply online, as follows.

            <options>

    Raises:
        ModelError: The robot has no such link.
        ArgumentError: An option does not exist, does not apply online, or is out of range; or there
            is never an estimate, because the base is fixed or has no joints, or ``wrench_offset``
            makes the offset an unknown.
        IdentificationError: The method does not fit the robot or the sensors.
    """

    _native: _native.LagIdentifier

    def __init__(
        self,
        robot: Manipulator,
        sensors: str | Sequence[str] | None = None,
        *,
        effort: bool = True,
        lag_s: float = 0.1,
        options: Options | None = None,
        **keywords: Any,
    ) -> None:
        named = ("robot", "sensors", "effort", "lag_s", "options")
        collected = collect(options, keywords, "online", named, "LagIdentifier")
        self._native = _native.LagIdentifier(robot, sensors, effort, lag_s, collected.plain())

    def finish(self) -> None:
        """Uses the samples that later ones would complete: after the last sample of a run.

        Up to the last 0.05 s stay unused.
        """
        self._native.finish()

    def estimate(self) -> PayloadEstimate | None:
        """Returns the payload as known now; None where :meth:`motion` says why."""
        estimate = self._native.estimate()
        return None if estimate is None else PayloadEstimate(**estimate)

    def window_estimate(self) -> PayloadEstimate:
        """Returns the estimate that an :class:`Identifier` has of the same samples."""
        return PayloadEstimate(**self._native.window_estimate())

    def motion(self) -> MotionEstimate:
        """Returns ``"with-payload"`` where there is an estimate, or why there is none.

        ==================  ====================================================================
        reason              meaning
        ==================  ====================================================================
        ``smoothed``        A value is unobservable, or samples had other accelerations of the base
                            than before.
        ``no-velocities``   The last samples had no velocities.
        ``too-few``         Fewer than 0.8 s, or than the lag and 0.05 s, since the begin, a gap
                            or a payload change, or fewer than 40 samples in a second.
        ``too-fast``        The last second had frequencies that splines do not follow.
        ``unexplained``     Residuals were larger than their noise, of all samples or of any second:
                            everything begins again.
        ``exact``           The estimate of windows is at least as precise, so far.
        ==================  ====================================================================
        """
        motion: MotionEstimate = self._native.motion()
        return motion

    def until_s(self) -> float:
        """Returns the time until which samples are in the last estimate, s.

        It stays behind where a gap or a fast motion interrupts the estimate, and is minus infinity
        before the first one.
        """
        return self._native.until_s()

    def findings(self) -> list[Finding]:
        """Returns what the recent samples show, as :meth:`Identifier.findings` does."""
        return self._native.findings()


@documented(OPTIONS, "paper filter")
class PaperFilter(_Online):
    """The paper's two-stage NLMS filter, online: equations (48), then (46), by (53)-(54).

    It estimates no uncertainty, detects no payload change and needs exact measurements: for
    anything but a comparison with the paper use :class:`Identifier`.

    Args:
        robot: The robot with its gripper and without the payload; None for a sensor alone.
        sensors: The links in whose frames the wrenches of each sample are, one name or several.
            Default: the tip for the tactile method, none for other methods.
        options: Options to start from; keywords replace them.
        **keywords: The fields of :class:`tactid.Options` that apply to the filter, as follows.

            <options>

    Raises:
        ModelError: The robot has no such link.
        ArgumentError: An option does not exist, does not apply to the filter, or is out of range.
        IdentificationError: The method does not fit the robot, the sensors or the filter.
    """

    _native: _native.PaperFilter

    def __init__(
        self,
        robot: Manipulator | None = None,
        sensors: str | Sequence[str] | None = None,
        *,
        options: Options | None = None,
        **keywords: Any,
    ) -> None:
        collected = collect(options, keywords, "paper filter", ("robot", "sensors", "options"))
        self._native = _native.PaperFilter(robot, sensors, collected.plain())

    def estimate(self) -> PaperEstimate:
        """Returns the payload as known now."""
        return PaperEstimate(**self._native.estimate())

    def rewind(self) -> None:
        """Prepares for the same samples once more.

        The parameters stay; times, counts and the mean start again.
        """
        self._native.rewind()

    def singular_values(self) -> SingularValues:
        """Returns how strongly the motion excited mass and inertia."""
        return SingularValues(**self._native.singular_values())
