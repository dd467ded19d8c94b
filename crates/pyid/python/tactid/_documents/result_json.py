"""A result as JSON: the layout of ``result.json`` and of ``tactid identify --json``.

The keys are the fields of the result, and what a reader wants to know besides: :data:`VIEWS`.
``tactid.result_schema()`` describes every key.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactid._base.files import write_atomically
from tactid._base.naming import Style
from tactid._base.values import Array, Interval, finite, nested, values_of
from tactid._documents import findings_json
from tactid._native import MassProperties
from tactid._results.identification import IdentificationData, Recorded
from tactid._results.payload import PayloadEstimate
from tactid._results.provenance import file_key
from tactid._results.records import PrincipalMoments, Record, of_ten, schema_of
from tactid._show import reported
from tactid._show.outlook import WITHIN
from tactid._show.remarks import measures_moments, motion_advice, remarks
from tactid._show.reported import Result

SCHEMA = "tactid.result/3"
"""Name and version of the layout: a change that breaks a reader increments the version."""

PAPER_SCHEMA = "tactid.paper/1"
"""Name and version of the layout of a result of the paper's filter."""

UNITS = {"mass": "kg", "com": "m", "inertia": "kg m²", "principal_moments": "kg m²", "time": "s"}
"""Units of the values; any other number has its unit in its key, or in the schema's description."""

MOST_POINTS = 2000
"""Largest number of points of a time series in JSON."""

_TEXTS = {"type": "array", "items": {"type": "string"}}

VIEWS: dict[str, dict[str, Any]] = {
    "is_contradicted": {
        "type": "boolean",
        "description": "Whether the data show the result to be wrong: no body can have the values,"
        " or a finding says so. The command then ends with exit code 1.",
    },
    "not_identifiable": _TEXTS
    | {"description": "Names of the values that are uncertain or unobservable: see observability."},
    "motion_advice": _TEXTS
    | {
        "description": "Which motion would determine the values that are not identifiable, in"
        " sentences."
    },
    "remaining_s": {
        "description": "How much longer the motion must go on, s.",
        "properties": {
            "within": {
                "type": "number",
                "description": "Target for half of each 95 % interval, as a fraction of the largest"
                " value of its kind, without a unit.",
            },
            "all": {
                "type": "number",
                "description": "Time until every value is known within the target, s; null where it"
                " never is, or where it is not known.",
            },
            "each": {
                "$ref": "#/$defs/TenValues_double",
                "description": "Time until each value is known within the target, s.",
            },
        },
    },
    "remarks": _TEXTS
    | {
        "description": "What a reader must know to trust the result, in sentences; what shows it to"
        " be wrong comes first."
    },
    "files": {
        "type": "object",
        "description": "Names of the files and folders that were read, by what they are.",
        "additionalProperties": {"type": "string"},
    },
    "sha256": {
        "type": "object",
        "description": "SHA-256 of each file that was read, by what it is and by its name.",
        "additionalProperties": {"type": "object", "additionalProperties": {"type": "string"}},
    },
    "options": {
        "type": "object",
        "description": "The options that were given, by their names.",
    },
    "provenance": {
        "type": "object",
        "description": "Where the result comes from, in words: files, sensors, what was subtracted,"
        " options.",
        "additionalProperties": {"type": "string"},
    },
}
"""What the document has besides the fields of the result, as JSON schemas."""

PAPER_VIEWS = {name: view for name, view in VIEWS.items() if name != "remaining_s"}
"""What the document of a result of the paper's filter has besides its fields."""


def write(
    result: Recorded,
    path: Path,
    within: float = WITHIN,
    style: Style = "keyword",
    checks: Mapping[str, Any] | None = None,
) -> None:
    """Writes a result with its time series; ``checks`` are those of the run of a simulated log."""
    write_atomically(path, to_json(record(result, within, style, checks, series=True)))


def to_json(record: dict[str, Any]) -> str:
    """Returns JSON that people can read, too; it never contains NaN."""
    return json.dumps(record, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def record(
    result: Recorded,
    within: float = WITHIN,
    style: Style = "keyword",
    checks: Mapping[str, Any] | None = None,
    *,
    series: bool = False,
) -> dict[str, Any]:
    """Returns the result as JSON has it.

    Args:
        result: The identification.
        within: Target for the remaining time, as :meth:`Identification.remaining` takes it.
        style: Who reads the sentences: it decides how they spell options.
        checks: Further diagnostics: those of the run of a simulated log.
        series: Whether the document has the time series, too.
    """
    unknown = result.estimate.not_identifiable
    name, remaining = PAPER_SCHEMA, {}
    if isinstance(result, IdentificationData):
        name, remaining = SCHEMA, {"remaining_s": _remaining(result, within)}
    return {
        "schema": name,
        "units": UNITS,
        **plain(result, series=series),
        **of_payload(result),
        **({"history": history(result)} if series else {}),
        "faults": findings_json.faults(result.faults),
        "findings": findings_json.findings(result.findings, style),
        "is_contradicted": result.is_contradicted,
        "not_identifiable": unknown,
        "motion_advice": motion_advice(unknown, moments=measures_moments(result)),
        **remaining,
        "remarks": remarks(result, style),
        "files": {file_key(words): path.name for words, path in result.inputs.items()},
        "sha256": {file_key(words): dict(each) for words, each in result.hashes.items()},
        "options": dict(result.given),
        "provenance": result.provenance,
        **({"simulation": dict(checks)} if checks else {}),
    }


def _remaining(result: IdentificationData, within: float) -> dict[str, Any]:
    found = result.remaining(within)
    return {"within": within, "all": finite(found.max()), "each": nested(found.tolist())}


def of_payload(result: Result) -> dict[str, Any]:
    """Returns the payload as JSON has it, with null for each value that is not reported."""
    estimate, moments = result.estimate, result.principal_moments
    found = plain(estimate) | {"values": nested(estimate.reported_values)}
    if isinstance(estimate, PayloadEstimate):
        found["intervals"] = nested(_limits(estimate.reported_intervals))
    shown: Any = None if moments is None else reported.moments(result)
    if isinstance(moments, PrincipalMoments):
        intervals = _limits(reported.moment_intervals(result))
        shown = plain(moments) | {"values": shown, "intervals": intervals}
    return {"estimate": found, "principal_moments": shown}


def _limits(intervals: list[Interval | None]) -> list[list[float | None]]:
    """Returns the limits of intervals; None where there is no interval."""
    return [[None, None] if each is None else list(each) for each in intervals]


def history(result: Recorded) -> dict[str, Any]:
    """Returns the estimate over time, with null for what was not known yet."""
    shown = {"times_s": result.history.times_s, **reported.reported_history(result)}
    return plain(result.history, series=True) | {
        name: _numbers(array[thinned(len(array))]) for name, array in shown.items()
    }


def plain(data: Record, *, series: bool = False) -> dict[str, Any]:
    """Returns the fields of a record as JSON has them, without those kept in memory.

    Args:
        data: The record.
        series: Whether to return time series, too: thinned.
    """
    shown = {}
    for name, schema in schema_of(data)["properties"].items():
        kept = schema.get("kept", "always")
        if kept == "always" or (series and kept == "file"):
            value = getattr(data, name)
            if kept == "file" and isinstance(value, np.ndarray):
                value = value[thinned(len(value))]
            shown[name] = _plain(value, of_ten(schema) is not None, series)
    return shown


def _plain(value: Any, is_of_ten: bool = False, series: bool = False) -> Any:
    if isinstance(value, Record):
        return plain(value, series=series)
    if isinstance(value, MassProperties):
        value = values_of(value)
    if isinstance(value, np.ndarray | list | tuple):
        shown = _numbers(value) if isinstance(value, np.ndarray) else [*map(_plain, value)]
        return nested(shown) if is_of_ten else shown
    if isinstance(value, Path):
        return str(value)
    return finite(value) if isinstance(value, float) else value


def _numbers(values: Array) -> list[Any]:
    """Returns the entries of an array as lists, with None for what is not finite."""
    if values.dtype != float or np.isfinite(values).all():
        listed: list[Any] = values.tolist()
        return listed
    return [_numbers(row) if values.ndim > 1 else finite(row) for row in values]


def thinned(count: int, most: int = MOST_POINTS) -> NDArray[np.intp]:
    """Returns which of so many points to show: evenly spaced, with the first and the last."""
    if count <= most:
        return np.arange(count)
    return np.linspace(0, count - 1, most).round().astype(np.intp)
