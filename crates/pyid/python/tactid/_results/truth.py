"""What only a simulation knows: the true payload, and the checks of the run."""

import json
from dataclasses import dataclass
from typing import Any

from tactid._base.bodies import principal_moments
from tactid._base.values import KINDS, Values, flat
from tactid._native import LogInfo
from tactid._results.records import RunReport, schema_of


@dataclass(frozen=True)
class Truth:
    """The true payload of a simulated log."""

    frame: str
    """Name of the frame in which the values are: the tip of the experiment's robot."""

    actual: list[float]
    """The ten values as the payload sits in the grasp."""
    nominal: list[float]
    """The ten values as the experiment asks for them."""

    @property
    def scales(self) -> list[float]:
        """What an error is a fraction of: the nominal value, or the largest of its kind for 0."""
        scales: list[float] = []
        for kind in KINDS:
            largest = max(abs(value) for value in self.nominal[kind])
            scales += [abs(value) or largest for value in self.nominal[kind]]
        return scales

    def errors_percent(self, values: Values) -> list[float | None]:
        """Error of each value in percent of its scale; None where there is no value."""
        return [
            None if value is None or scale == 0 else 100 * (value - actual) / scale
            for value, actual, scale in zip(values, self.actual, self.scales, strict=True)
        ]

    @property
    def nominal_moments(self) -> list[float]:
        """The nominal principal moments of inertia, ascending, kg m²."""
        return principal_moments(self.nominal)

    def moment_errors_percent(self, moments: Values) -> list[float | None]:
        """Error of each principal moment in percent of its nominal value.

        None stands where there is no moment.
        """
        actual, nominal = principal_moments(self.actual), self.nominal_moments
        return [
            None if moment is None or scale == 0 else 100 * (moment - true) / scale
            for moment, true, scale in zip(moments, actual, nominal, strict=True)
        ]


def read_truth(info: LogInfo | None) -> Truth | None:
    """Returns the truth that a simulated log carries; None for any other log."""
    record = _record(info, "tactid.truth")
    if record is None:
        return None
    try:
        return Truth(
            frame=str(record["frame"]),
            actual=flat(record),
            nominal=flat(record.get("nominal", record)),
        )
    except (KeyError, TypeError, ValueError):
        return None


def read_checks(info: LogInfo | None) -> dict[str, Any]:
    """Returns how the run behind a simulated log went; empty for any other log."""
    record = _record(info, "tactid.report")
    if record is None:
        return {}
    return {name: record.get(name) for name in schema_of(RunReport)["properties"] if name in record}


def momentum_drift(report: RunReport) -> str:
    """Says how well a run conserved momentum, which a fixed base exchanges with the ground."""
    linear, angular = report.linear_momentum_drift, report.angular_momentum_drift
    if linear is None or angular is None:
        return "not checked on a fixed base"
    return f"linear {linear:.1e}, angular {angular:.1e} of the largest of a single body"


def _record(info: LogInfo | None, name: str) -> dict[str, Any] | None:
    if info is None:  # a recording in another form
        return None
    try:
        record = json.loads(info.metadata[name]["json"])
    except (KeyError, ValueError):
        return None
    return record if isinstance(record, dict) else None
