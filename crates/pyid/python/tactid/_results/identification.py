"""What an identification finds: plain data, which a program can construct as well as read.

All arrays are NumPy arrays of SI units. W, C and H are numbers of averaging windows, channels and
points of the history.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tactid import _native
from tactid._base.values import Array, listed_fields
from tactid._results import provenance, records
from tactid._results.formats import Formats
from tactid._results.payload import Payload, PayloadEstimate
from tactid._results.records import History, PaperHistory, PrincipalMoments


@dataclass(frozen=True, eq=False, repr=False)
class Recorded(Formats, records.RecordingReport):
    """What the results of one recording have in common, whatever the estimator."""

    if TYPE_CHECKING:
        estimate: Payload
        history: History | PaperHistory

        @property
        def principal_moments(self) -> PrincipalMoments | Array | None:
            """The principal moments of inertia, kg m²; None where the mass is zero."""

    inputs: Mapping[str, Path] = field(default_factory=dict, kw_only=True)
    """Files and folders that were read, by the words that name them; empty for arrays."""

    hashes: provenance.Hashes = field(default_factory=dict, kw_only=True)
    """SHA-256 of each file that was read, by the words of ``inputs`` and by its name."""

    given: Mapping[str, Any] = field(default_factory=dict, kw_only=True)
    """The options that were given, by their names, as JSON has them."""

    @property
    def provenance(self) -> dict[str, str]:
        """Where the result comes from, in words: files, sensors, what was subtracted, options."""
        return provenance.facts(self)

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


@dataclass(frozen=True, eq=False, repr=False)
class IdentificationData(records.Identification, Recorded):
    """The fields of :class:`tactid.Identification`."""

    if TYPE_CHECKING:
        estimate: PayloadEstimate

    def remaining(self, within: float = 0.01) -> Array:
        """Returns how much longer the motion must go on until every value is known well enough.

        The information is assumed to grow as in the recording's second half. An error of the model
        (a sign, a frame, friction) is a bias, which no time reduces.

        Args:
            within: Target for half of each 95 % interval, as a fraction of the largest value of its
                kind (mass, centre of mass, inertia): 0.01 for 1 %.

        Returns:
            Time for each of ``VALUE_NAMES``, (10,), s: 0 where the target is reached already,
            infinite where the motion does not determine the value, NaN without a forecast.

        Raises:
            ArgumentError: ``within`` is not positive.
        """
        values, std_devs = self.estimate.values.tolist(), self.estimate.std_devs.tolist()
        forecast = None if self.forecast is None else listed_fields(self.forecast)
        return np.array(_native.remaining(forecast, values, std_devs, within))
