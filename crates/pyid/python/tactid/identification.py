"""What an identification finds: plain data, which a program can construct as well as read.

All arrays are NumPy arrays of SI units. N, W, C and H are numbers of samples, averaging windows,
channels and points of the history.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tactid import controllers, forms, table
from tactid._native import VALUE_NAMES, MassProperties
from tactid.bodies import why_impossible
from tactid.calibrated_fit import CalibratedFit
from tactid.errors import ArgumentError
from tactid.field_docs import with_fields
from tactid.findings import DataFault, Finding
from tactid.fit import Array, Fit
from tactid.values import (
    NAMES,
    Interval,
    Observability,
    half_widths,
    known_intervals,
    noise_intervals,
    where_known,
)


@with_fields
@dataclass(frozen=True, eq=False, repr=False)
class PayloadEstimate:
    """An identified payload, expressed in one frame.

    ``print`` shows it as a table; :meth:`to_urdf`, :meth:`to_mujoco` and :meth:`to_controller`
    give it to other programs. A program can construct one, too:

    >>> import numpy as np
    >>> estimate = tactid.PayloadEstimate(
    ...     "tool0",
    ...     values=np.array([1.5, 0, 0, 0.1, 0.02, 0, 0, 0.03, 0, 0.04]),
    ...     std_devs=np.full(10, 1e-3),
    ...     observability=["identifiable"] * 10,
    ...     is_physical=True,
    ... )
    >>> estimate
    <tactid.PayloadEstimate: 1.5000 kg in tool0, 10 of 10 values known>
    """

    frame: str
    """Name of the frame in which the payload is expressed: the end-effector frame."""
    values: Array
    """Mass, kg; centre of mass, m; inertia about it, kg m²; in the order of ``VALUE_NAMES``, (10,).

    All are along the axes of the frame. The number of an unobservable value is meaningless.
    """
    std_devs: Array
    """Standard deviation of each of the ten values, (10,).

    It is infinite for an unobservable value and for one that is divided by a mass which is not
    known to a quarter, and NaN for the paper's filter, which estimates none.
    """
    observability: Sequence[Observability]
    """Whether the motion excites each of the ten values, and the noise leaves enough of it, (10,).

    - ``"identifiable"``: half of its 95 % interval is less than the largest value of its kind
      (mass, centre of mass, inertia).
    - ``"uncertain"``: the motion excites it, but noise leaves it a wider interval.
    - ``"unobservable"``: the motion does not excite it, or only as noise does.
    """
    is_physical: bool
    """Whether a body with these parameters can exist, within 1 % of its largest principal moment.

    Plates and rods lie on the boundary of what can exist, and no estimate is exact.
    """
    composite: MassProperties | None = None
    """Gripper and payload as one body, for the joint-sensing method; else None."""
    windows: int = 0
    """Number of averaging windows so far, also of those before a payload change online."""
    payload_changes: int = 0
    """Number of payload changes that online least squares detected."""
    since: float = -math.inf
    """Time of the last payload change on the samples' clock, s, or minus infinity."""
    rejected: int = 0
    """Number of rejected samples: not finite, or not later than the one before."""
    gaps: int = 0
    """Number of gaps that were too long to be bridged."""
    intervals: Array = field(default_factory=lambda: np.empty((0, 2)))
    """Lower and upper limit of the 95 % interval of each of the ten values, (10, 2).

    Each is 1.96 standard deviations to both sides, but no further than a body can reach that fits
    into the bounding box, if one was given. A limit is infinite where nothing bounds the value. By
    default they are 1.96 standard deviations to both sides.
    """

    def __post_init__(self) -> None:
        if len(self.intervals) == 0:
            found = noise_intervals(self.values, self.std_devs)
            object.__setattr__(self, "intervals", found)

    @property
    def body(self) -> MassProperties:
        """The payload alone as a body in :attr:`frame`.

        An unobservable value is meaningless: see :attr:`known_values`.
        """
        return MassProperties.from_values(self.values)

    @property
    def identifiable(self) -> list[bool]:
        """Whether each of the ten values is identifiable: see :attr:`observability`."""
        return [each == "identifiable" for each in self.observability]

    @property
    def not_identifiable(self) -> list[str]:
        """The names of the values that are uncertain or unobservable."""
        return self._named("uncertain", "unobservable")

    @property
    def uncertain(self) -> list[str]:
        """The names of the values that the motion excites, but that have wide intervals."""
        return self._named("uncertain")

    @property
    def unobservable(self) -> list[str]:
        """The names of the values that the motion does not excite."""
        return self._named("unobservable")

    @property
    def is_given(self) -> list[bool]:
        """Whether each of the ten values is a number that a reader can use with its interval.

        An uncertain value is where both limits of its interval are finite.
        """
        bounded = np.isfinite(self.intervals).all(axis=1).tolist()
        pairs = zip(self.observability, bounded, strict=True)
        return [
            each == "identifiable" or (each == "uncertain" and bool(both)) for each, both in pairs
        ]

    @property
    def known_values(self) -> list[float | None]:
        """The ten values; None for each that is unobservable, or uncertain without limits."""
        return where_known(self.is_given, self.values)

    @property
    def known_intervals(self) -> list[Interval | None]:
        """The 95 % interval of each of the ten values; None where there is none."""
        return known_intervals(self.is_given, self.intervals)

    @property
    def half_widths(self) -> list[float | None]:
        """Distance from each value to the farther limit of its 95 % interval; None without one.

        It is half of the interval, unless the interval is cut at what a body can have.
        """
        return half_widths(self.known_values, self.known_intervals)

    @property
    def why_impossible(self) -> str | None:
        """Why no body can have these values; None where one can, or where too few are known."""
        if self.is_physical or not self.is_given[0]:
            return None
        if self.values[0] <= 0 or all(self.is_given):
            return why_impossible(self.values.tolist()) or "the estimate has not converged"
        return None

    def to_urdf(self) -> str:
        """Returns the payload as the ``<inertial>`` of a URDF's link; a comment names what is uncertain.

        The link is one of its own, fixed to the link :attr:`frame` without a rotation or an offset.
        The ``<inertial>`` that the link :attr:`frame` already has is that of the tool and stays as
        it is: the payload is added to the robot and replaces nothing. See the README for the whole.

        >>> print(estimate.to_urdf())
        <!-- payload in the frame tool0: for a link of its own, fixed to tool0 without an offset -->
        <inertial>
          <origin xyz="0.0 0.0 0.1" rpy="0 0 0"/>
          <mass value="1.5"/>
          <inertia ixx="0.02" ixy="0.0" ixz="0.0" iyy="0.03" iyz="0.0" izz="0.04"/>
        </inertial>

        Raises:
            IdentificationError: A value is unknown, or no body can have these values.
        """
        return forms.urdf(self.known_values, self.frame, self._uncertain_names)

    def to_mujoco(self) -> str:
        """Returns the payload as the ``<inertial>`` of a body in MuJoCo's MJCF.

        The body is one of its own inside the body :attr:`frame`, without ``pos`` and ``quat``. The
        inertial of the body :attr:`frame` is that of the tool and stays as it is.

        >>> print(estimate.to_mujoco())
        <!-- payload in the frame tool0: for a body of its own inside tool0 without an offset -->
        <inertial pos="0.0 0.0 0.1" mass="1.5" fullinertia="0.02 0.03 0.04 0.0 0.0 0.0"/>

        Raises:
            IdentificationError: A value is unknown, or no body can have these values.
        """
        return forms.mujoco(self.known_values, self.frame, self._uncertain_names)

    def to_ros(self) -> str:
        """Returns the payload as a ``geometry_msgs/msg/InertiaStamped`` in YAML.

        The inertia is about the centre of mass, along the axes of :attr:`frame`.

        >>> print(estimate.to_ros().splitlines()[1])
          frame_id: "tool0"

        Raises:
            IdentificationError: A value is unknown, or no body can have these values.
        """
        return forms.ros(self.known_values, self.frame, self._uncertain_names)

    def to_controller(self, maker: str | None = None) -> str:
        """Returns what a robot controller asks for, as text with units.

        It gives the centre of mass in m and in mm, and the inertia about the centre of mass and
        about the frame's origin, all along the frame's axes and without exponents. An unknown
        inertia is marked as such, because most controllers accept a payload without one.

        With ``maker``, the text is a line of the language of that maker's controllers.

        >>> print(estimate.to_controller().splitlines()[2])
        mass                 kg  1.50000000
        >>> print(estimate.to_controller("abb").splitlines()[0])
        ! payload for ABB: the frame tool0 must be the coordinate system of the tool in use

        Args:
            maker: ``"ur"`` for URScript's ``set_target_payload``, ``"franka"`` for libfranka's
                ``setLoad``, ``"kuka"`` for KRL's ``LOAD_DATA``, ``"abb"`` for RAPID's ``loaddata``.

        Raises:
            ArgumentError: The maker is not known.
            IdentificationError: A value that is needed is unknown, or no body can have the values.
        """
        payload = (self.known_values, self.frame, self._uncertain_names)
        if maker is None:
            return forms.controller(*payload)
        return controllers.controller(maker, *payload)

    def __repr__(self) -> str:
        return f"<tactid.PayloadEstimate: {self.summary}>"

    def __str__(self) -> str:
        return table.plain_text([self._column()], table.heading(self.frame))

    def _repr_html_(self) -> str:
        return table.html_table(self._column(), table.heading(self.frame))

    @property
    def summary(self) -> str:
        """Mass, frame and number of known values, on one line."""
        mass = f"{table.number(self.values[0])} kg" if self.is_given[0] else "unknown mass"
        known = f"{sum(self.identifiable)} of {len(VALUE_NAMES)} values known"
        return f"{mass} in {self.frame}, {known}"

    def _named(self, *wanted: Observability, names: Sequence[str] = VALUE_NAMES) -> list[str]:
        pairs = zip(names, self.observability, strict=True)
        return [name for name, each in pairs if each in wanted]

    @property
    def _uncertain_names(self) -> list[str]:
        """The names for people of the values that are uncertain."""
        return self._named("uncertain", names=NAMES)

    def _column(self) -> table.Column:
        return table.Column(
            "value",
            self.known_values,
            intervals=self.known_intervals,
            observability=self.observability,
        )


@dataclass(frozen=True, eq=False)
class PrincipalMoments:
    """Principal moments of inertia about the centre of mass, ascending."""

    values: Array
    """The moments, kg m², (3,); NaN where there are none."""
    std_devs: Array
    """Standard deviations of the moments, kg m², (3,).

    They are infinite where the motion did not determine the whole inertia, and NaN for the paper's
    filter. Moments that are closer to each other than their noise share a standard deviation that
    covers the noise of all their axes, since noise drives equal moments apart.
    """
    intervals: Array = field(default_factory=lambda: np.empty((0, 2)))
    """Lower and upper limit of the 95 % interval of each moment, kg m², (3, 2).

    Each is 1.96 standard deviations to both sides, but not below zero. By default they are 1.96
    standard deviations to both sides.
    """

    def __post_init__(self) -> None:
        if len(self.intervals) == 0:
            found = noise_intervals(self.values, self.std_devs)
            object.__setattr__(self, "intervals", found)


@dataclass(frozen=True, eq=False)
class History:
    """The estimate over time."""

    epoch: NDArray[np.uint32]
    """Index of the presentation of the recording that each point belongs to, from 0, (H,)."""
    time: Array
    """Times on the recording's clock, s, (H,). They begin again with each epoch."""
    values: Array
    """The ten values at each point, not averaged, (H, 10)."""
    std_devs: Array
    """Standard deviations of the ten values at each point, (H, 10).

    They are infinite where a value was not determined yet, and NaN for the paper's filter.
    """


@dataclass(frozen=True, eq=False)
class LinearEstimate:
    """What one recording says about the linear parameters of the payload.

    An information matrix describes directions of the parameters that the motion leaves
    unobservable, too: it is zero along them. The information of independent recordings is additive.
    A known mass and a bounding box are not in it: see :func:`tactid.combine`.
    """

    parameters: Array
    """Mass, kg; first moments, kg m; inertia about the frame's origin, kg m², (10,).

    They need not be physically consistent, and are arbitrary in unobservable directions.
    """
    information: Array
    """Information of the parameters, the weight of the recording among others, (10, 10).

    It follows from the motion and from the mean size of the noise of each channel, so that it does
    not depend on the errors of the parameters.
    """
    covariance: Array
    """Covariance of the errors of the parameters that no other recording shares, (10, 10): zero in
    unobservable directions."""
    shared_changes: Array
    """Change of the parameters by an error of one standard deviation of each unknown that other
    recordings share, as the gain of a joint, (unknowns, 10)."""
    shared_source: int
    """Number that is the same for recordings which share these unknowns."""
    degrees_of_freedom: float = math.inf
    """Number of independent windows from which the noise was estimated; infinite where it is known.

    It is part of the test whether recordings agree.
    """


@dataclass(frozen=True, eq=False)
class SingularValues:
    """How strongly the motion excited the rows of the paper's filter: rms singular values."""

    mass: Array
    """Singular values of equation (48), for mass and centre of mass, descending, m/s², (4,)."""
    inertia: Array
    """Singular values of equation (46), for the inertia, descending, rad/s², (6,)."""


@dataclass(frozen=True)
class PaperSettings:
    """The settings that the paper's filter used."""

    alpha: float
    """Step size α of equation (54)."""
    beta: float
    """Regularisation β of equation (54)."""
    average: float
    """Length of the final span of time over which the estimate is the mean, s; 0 for none."""
    epochs: int
    """Number of times that the recording was presented to the filter."""


@dataclass(frozen=True)
class Delay:
    """An estimated delay of the wrenches' stamps relative to the motion."""

    value: float
    """Delay, s; positive where the wrenches are stamped later than the motion."""
    std_dev: float
    """Standard deviation of the delay, s."""


@dataclass(frozen=True)
class KnownMass:
    """The mass of the payload as it was given."""

    value: float
    """Mass, kg."""
    std_dev: float
    """Standard deviation of the mass, kg; 0 for an exact mass."""


class Forecast(Protocol):
    """How the ten values become known when the motion goes on as in the recording's second half."""

    def remaining(self, within: float) -> Array:
        """Returns the time until half of each 95 % interval is small enough, s, (10,).

        Args:
            within: The target as a fraction of the largest value of its kind.
        """


@dataclass(frozen=True, eq=False, repr=False)
class IdentificationData:
    """The fields of :class:`tactid.Identification`."""

    estimate: PayloadEstimate
    """The payload, in the end-effector's frame."""
    method: str
    """Method: ``"tactile"``, ``"effort"``, ``"joint-sensing"`` or ``"combined"``."""
    estimator: str
    """Estimator: ``"least-squares"`` or ``"nlms"``."""
    principal_moments: PrincipalMoments
    """Principal moments of inertia of the payload about its centre of mass, kg m²."""
    history: History
    """The estimate over time."""
    gravity: Array
    """Gravitational acceleration that was assumed, in world axes, m/s², (3,)."""
    cutoff: float
    """Cutoff of the low-pass on both sides of the equations, Hz."""
    max_gap: float
    """Longest time between two samples that was bridged, s."""
    duration: float
    """Time from the first sample to the last, s."""
    delay: float = 0.0
    """Delay of the wrenches' stamps that was corrected, s."""
    estimated_delay: Delay | None = None
    """Estimated delay of the wrenches' stamps, corrected or not; None where none was estimated."""
    subtracts_unloaded: bool = False
    """Whether the efforts of an unloaded recording were subtracted."""
    calibrated: CalibratedFit | None = None
    """What the calibration of the arm contributed; None where there is none."""
    known_mass: KnownMass | None = None
    """The payload's mass as it was given; None where it was not."""
    bounding_box: Array | None = None
    """Least and largest corner of the box, m, in the estimate's frame, (2, 3); None without one."""
    clock: str = "stamps"
    """Clock of the times: ``"stamps"`` of the headers, ``"log times"`` where there are none, and
    ``"given"`` for those of arrays."""
    start_ns: int = 0
    """Stamp of time zero, ns since the epoch."""
    linear: LinearEstimate | None = None
    """The information on the linear parameters; None for the paper's filter."""
    fit: Fit | None = None
    """How well least squares explains the measurements; None for the paper's filter."""
    forecast: Forecast | None = None
    """How the values become known when the motion goes on; None for the paper's filter."""
    singular_values: SingularValues | None = None
    """How strongly the motion excited the paper's filter; None for least squares."""
    paper_settings: PaperSettings | None = None
    """The settings of the paper's filter; None for least squares."""
    faults: Sequence[DataFault] = ()
    """What was wrong with messages or samples, and how often."""
    findings: Sequence[Finding] = ()
    """What was noticed on the way from the recording to the payload."""
    interrupted: bool = False
    """Whether the user interrupted the reading: the result then uses what was read before."""
    damage: Sequence[str] = ()
    """Where the log could not be read further, and why, a line each; empty for a sound log."""
    inputs: Mapping[str, Path] = field(default_factory=dict)
    """Files and folders that were read, by the words that name them; empty for arrays."""

    @property
    def source_name(self) -> str:
        """Name of the log's file or folder; ``arrays`` where there is none."""
        return self.inputs["the log"].name if "the log" in self.inputs else "arrays"

    @property
    def is_contradicted(self) -> bool:
        """Whether the data show the result to be wrong.

        No body can have the values, though something is held, or a finding says so: it stands
        first in ``print(result)``. The command ``tactid identify`` then ends with exit code 1.
        """
        is_nothing = any(noticed.kind == "nothing_held" for noticed in self.findings)
        is_impossible = self.estimate.why_impossible is not None and not is_nothing
        return is_impossible or any(noticed.contradicts_result for noticed in self.findings)

    def remaining(self, within: float = 0.01) -> Array:
        """Returns how much longer the motion must go on until every value is known well enough.

        The information is assumed to grow as in the recording's second half. An error of the model
        (a sign, a frame, friction) is a bias, which no time reduces.

        Args:
            within: Target for half of each 95 % interval, as a fraction of the largest value of its
                kind (mass, centre of mass, inertia): 0.01 for 1 %.

        Returns:
            Time for each of ``VALUE_NAMES``, (10,), s: 0 where the target is reached already,
            infinite where the motion does not determine the value, NaN for the paper's filter.

        Raises:
            ArgumentError: ``within`` is not positive.
        """
        if not within > 0:
            raise ArgumentError(f"`within` is {within}: expected a positive fraction, such as 0.01")
        if self.forecast is None:
            return np.full(len(VALUE_NAMES), np.nan)
        return self.forecast.remaining(within)
