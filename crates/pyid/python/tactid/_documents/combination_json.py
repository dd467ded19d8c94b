"""Several recordings together as JSON: the layout of ``tactid identify --json`` for several logs.

``tactid.combination_schema()`` describes every key.
"""

from pathlib import Path
from typing import Any

from tactid._base.files import write_atomically
from tactid._base.naming import Style
from tactid._documents import findings_json, result_json
from tactid._results.combination import CombinationData
from tactid._show.combination_text import combined_remarks
from tactid._show.outlook import WITHIN

SCHEMA = "tactid.combination/3"
"""Name and version of the layout: a change that breaks a reader increments the version."""

VIEWS: dict[str, dict[str, Any]] = {
    "is_contradicted": result_json.VIEWS["is_contradicted"],
    "remarks": result_json.VIEWS["remarks"],
    "findings": {
        "type": "array",
        "description": "What was noticed about the recordings together, for a program to match.",
        "items": {"$ref": "#/$defs/Finding"},
    },
    "names": {
        "type": "array",
        "description": "Name of each recording.",
        "items": {"type": "string"},
    },
    "runs": {
        "type": "array",
        "description": "The result of each recording alone: a document of tactid.result_schema().",
        "items": {"$ref": "#/$defs/result"},
    },
}
"""What the document has besides the fields of the combination, as JSON schemas."""


def write(
    result: CombinationData, path: Path, within: float = WITHIN, style: Style = "keyword"
) -> None:
    """Writes the combined result; each of its recordings has its time series."""
    write_atomically(path, result_json.to_json(record(result, within, style, series=True)))


def record(
    result: CombinationData,
    within: float = WITHIN,
    style: Style = "keyword",
    *,
    series: bool = False,
) -> dict[str, Any]:
    """Returns the combined result as JSON has it.

    Args:
        result: The combination.
        within: Target for the remaining time of each recording.
        style: Who reads the sentences: it decides how they spell options.
        series: Whether each recording has its time series, too.
    """
    return {
        "schema": SCHEMA,
        "units": result_json.UNITS,
        **result_json.plain(result),
        **result_json.of_payload(result),
        "findings": findings_json.findings(result.findings, style),
        "is_contradicted": result.is_contradicted,
        "remarks": combined_remarks(result, style),
        "names": list(result.names),
        "runs": [result_json.record(run, within, style, series=series) for run in result.runs],
    }
