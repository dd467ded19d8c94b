"""What several recordings of one payload say together: plain data."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from tactid.equality import ComparedByValue
from tactid.findings import Finding
from tactid.fit import Array
from tactid.identification import IdentificationData, PrincipalMoments
from tactid.payload import PayloadEstimate


@dataclass(frozen=True)
class RunDistance:
    """Distance of one recording from all others together."""

    chi_square: float
    """Squared distance of this recording from the mean of the others, as that of
    :class:`Agreement`."""
    degrees_of_freedom: float
    """Degrees of freedom of this distance."""
    p_value: float
    """Probability of at least this distance if noise were the only difference."""
    others_agree: bool
    """Whether the other recordings agree among themselves."""


@dataclass(frozen=True, eq=False)
class Agreement(ComparedByValue):
    """Whether several recordings agree within the noise of each."""

    agree: bool
    """Whether the recordings agree: ``p_value`` is at least 1 %, and each of ``value_p_values`` at
    least 0.1 %."""
    chi_square: float
    """Distance of the linear parameters of the recordings from the combined ones: the weighted sum
    of its squares, in the unit in which it would be as large as ``degrees_of_freedom`` on average
    if noise were the only difference."""
    degrees_of_freedom: float
    """About the number of parameters that the recordings determine, each on its own, less the
    number that all determine together; smaller, and no integer, where noise differs between
    directions."""
    noise_degrees_of_freedom: float
    """Degrees of freedom from which the noise was estimated: the windows of all recordings, less
    their overlap; infinite where it is known."""
    p_value: float
    """Probability of at least this chi-square if noise were the only difference.

    It is that of Fisher's distribution: ``scipy.stats.f.sf(chi_square / degrees_of_freedom,
    degrees_of_freedom, noise_degrees_of_freedom)``. It is 1 where the recordings determine nothing
    in common.
    """
    value_p_values: Array
    """The same probability for each of ``VALUE_NAMES`` alone, (10,)."""
    between_runs: Array
    """Standard deviation of each of ``VALUE_NAMES`` from recording to recording, beyond the noise
    within each, (10,); zero where noise explains the differences."""
    runs: Sequence[RunDistance]
    """Distance of each recording from all others, in the order of the recordings."""


@dataclass(frozen=True, eq=False, repr=False)
class CombinationData(ComparedByValue):
    """The fields of :class:`tactid.Combination`."""

    estimate: PayloadEstimate
    """The payload from all recordings, in the end-effector's frame.

    ``std_devs`` and ``intervals`` include what varies between the recordings.
    """
    principal_moments: PrincipalMoments
    """Principal moments of inertia of the payload about its centre of mass, kg m²."""
    agreement: Agreement
    """Whether the recordings agree, and the distance of each from the others."""
    runs: Sequence[IdentificationData]
    """The result of each recording alone, in the order in which they were given."""
    names: Sequence[str]
    """Name of each recording: that of its log, or ``recording 1`` where it is not one."""
    findings: Sequence[Finding] = ()
    """What was noticed about the recordings together; each of ``runs`` has its own."""

    @property
    def is_contradicted(self) -> bool:
        """Whether the data of a recording show its result to be wrong, or that of all.

        A disagreement alone is no contradiction, because the intervals include it.
        """
        wrong = any(noticed.contradicts_result for noticed in self.findings)
        wrong = wrong or any(run.is_contradicted for run in self.runs)
        return wrong or self.estimate.why_impossible is not None

    @property
    def inputs(self) -> Mapping[str, Path]:
        """Files and folders that were read, by the words that name them."""
        return {
            f"{words} of {name}" if words == "the log" else words: path
            for name, run in zip(self.names, self.runs, strict=True)
            for words, path in run.inputs.items()
        }
