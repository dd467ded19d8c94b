"""What several recordings of one payload say together: plain data."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from tactid._base.findings import Finding
from tactid._results import records
from tactid._results.formats import Formats
from tactid._results.identification import IdentificationData
from tactid._results.payload import PayloadEstimate
from tactid._results.table import number


@dataclass(frozen=True, eq=False, repr=False)
class CombinationData(Formats, records.Combination):
    """The fields of :class:`tactid.Combination`."""

    if TYPE_CHECKING:
        estimate: PayloadEstimate

    runs: Sequence[IdentificationData] = ()
    """The result of each recording alone, in the order in which they were given."""
    names: Sequence[str] = ()
    """Name of each recording: that of its log, or ``recording 1`` where it is not one."""
    findings: Sequence[Finding] = ()
    """What was noticed about the recordings together; each of ``runs`` has its own."""

    @property
    def is_contradicted(self) -> bool:
        """Whether the data of a recording show its result to be wrong, or that of all.

        A disagreement alone is no contradiction, because the intervals include it. It is one where
        they leave the mass uncertain.
        """
        wrong = any(noticed.contradicts_result for noticed in self.findings)
        wrong = wrong or any(run.is_contradicted for run in self.runs)
        return wrong or self.estimate.why_impossible is not None

    @property
    def disagreement(self) -> str | None:
        """Says that recordings disagree, and the interval of the mass; None where they agree."""
        if self.agreement.agree:
            return None
        value, limits = self.estimate.reported_values[0], self.estimate.reported_intervals[0]
        mass = (
            "not known"
            if value is None or limits is None
            else f"{number(value, limits)} kg, from {limits.low:.4g} to {limits.high:.4g} kg"
        )
        return f"the recordings disagree, which formats without intervals hide: the mass is {mass}"

    @property
    def inputs(self) -> Mapping[str, Path]:
        """Files and folders that were read, by the words that name them."""
        return {
            f"{words} of {name}" if words == "the log" else words: path
            for name, run in zip(self.names, self.runs, strict=True)
            for words, path in run.inputs.items()
        }
