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

from tactid._native import VALUE_NAMES
from tactid.calibrated_fit import CalibratedFit
from tactid.equality import ComparedByValue
from tactid.errors import ArgumentError
from tactid.findings import DataFault, Finding
from tactid.fit import Array, Fit
from tactid.payload import PayloadEstimate
from tactid.values import noise_intervals


@dataclass(frozen=True, eq=False)
class PrincipalMoments(ComparedByValue):
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
class History(ComparedByValue):
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
class LinearEstimate(ComparedByValue):
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
    shared_unknowns: list[int]
    """Number of each of these unknowns, the same in all recordings that share it."""
    degrees_of_freedom: float = math.inf
    """Number of independent windows from which the noise was estimated; infinite where it is known.

    It is part of the test whether recordings agree.
    """


@dataclass(frozen=True, eq=False)
class SingularValues(ComparedByValue):
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
class IdentificationData(ComparedByValue):
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
        # An offset changes no value where none is known.
        is_known = any(self.estimate.is_reported)
        found = [each for each in self.findings if is_known or each.kind != "offset_suspected"]
        return is_impossible or any(noticed.contradicts_result for noticed in found)

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
