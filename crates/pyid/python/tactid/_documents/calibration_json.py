"""A calibration as JSON, which ``tactid.calibration_schema()`` describes."""

from typing import Any

from tactid._base.naming import Style
from tactid._documents import findings_json
from tactid._documents.result_json import plain, to_json as to_text
from tactid._results.calibration_data import CalibrationData
from tactid._show.calibration_text import lines

SCHEMA = "tactid.calibration/3"
"""Name and version of the JSON layout: a change that breaks a reader increments the version."""


VIEWS: dict[str, dict[str, Any]] = {
    "gain_prior": {
        "type": "number",
        "description": "Standard deviation of the gains before the calibration, a fraction, without"
        " a unit; null where the calibration was read from a file.",
    },
    "recordings": {
        "type": "array",
        "description": "The recordings: unloaded, loaded, held out; none where the calibration was"
        " read from a file.",
        "items": {"$ref": "#/$defs/CalibrationRecording"},
    },
    "remarks": {
        "type": "array",
        "description": "What a reader must know besides the numbers, in sentences.",
        "items": {"type": "string"},
    },
}
"""What the document has besides the fields of the calibration, as JSON schemas."""


def to_json(arm: CalibrationData, style: Style = "keyword") -> str:
    """Returns a calibration as JSON that people can read, too; it never contains NaN."""
    return to_text(record(arm, style))


def record(arm: CalibrationData, style: Style = "keyword") -> dict[str, Any]:
    """Returns a calibration as JSON has it."""
    return {
        "schema": SCHEMA,
        **plain(arm),
        "shortages": findings_json.findings(arm.shortages, style),
        "contradictions": findings_json.findings(arm.contradictions, style),
        "gain_prior": arm.gain_prior,
        "recordings": [
            plain(each)
            | {
                "faults": findings_json.faults(each.faults),
                "findings": findings_json.findings(each.findings, style),
            }
            for each in arm.recordings
        ],
        "remarks": lines(arm, style),
    }
