"""The JSON schemas of the documents that tactid writes, made from those of the crates' structures.

Every number may be null, which stands for what is not known.
"""

from collections.abc import Mapping
from typing import Any

from tactid._documents import (
    calibration_json,
    combination_json,
    finding_schemas,
    motion_json,
    result_json,
)
from tactid._options.options import Estimator
from tactid._results.records import SCHEMAS

Schema = dict[str, Any]

NOTES = {"default", "format", "kept", "x-base", "x-class"}
"""Keywords of the schemas of structures that are not about documents."""

OF_SIMULATION: Schema = {
    "simulation": {
        **SCHEMAS["RunReport"],
        "description": "Report of the simulation behind a simulated log.",
        "required": [],
    },
    "truth": {
        "$ref": "#/$defs/TenValues_double",
        "description": "True payload of the simulation: kg, m and kg m²; for the command paper.",
    },
    "error_percent": {
        "$ref": "#/$defs/TenValues_double",
        "description": "Error of each value in percent of its nominal value, or of the largest of"
        " its kind where that is zero; for the commands paper and compare.",
    },
    "other_estimates": {
        "type": "object",
        "description": "Estimates of the same payload by other methods, by their names, in the same"
        " frame and units; for the command paper.",
        "additionalProperties": {"$ref": "#/$defs/TenValues_double"},
    },
}
"""Keys that only the documents of simulated logs have."""


def calibration_schema() -> dict[str, Any]:
    """Returns the JSON schema of calibrations, which describes every key with its unit.

    :meth:`Calibration.to_json` returns such a document.

    >>> tactid.calibration_schema()["properties"]["schema"]["const"]
    'tactid.calibration/3'
    """
    return _document(calibration_json.SCHEMA, "Calibration", calibration_json.VIEWS)


def combination_schema() -> dict[str, Any]:
    """Returns the JSON schema of the results of several recordings.

    :meth:`Combination.to_json` returns such a document. Each of its recordings contains a document
    of :func:`result_schema`.

    >>> tactid.combination_schema()["properties"]["schema"]["const"]
    'tactid.combination/3'
    """
    found = _document(combination_json.SCHEMA, "Combination", combination_json.VIEWS)
    single = result_schema()
    definitions = single.pop("$defs")
    del single["$schema"]
    return found | {"$defs": found["$defs"] | definitions | {"result": single}}


def motion_schema() -> dict[str, Any]:
    """Returns the JSON schema of designed motions, which describes every key with its unit.

    :meth:`DesignedMotion.to_json` returns such a document.

    >>> tactid.motion_schema()["properties"]["schema"]["const"]
    'tactid.motion/2'
    """
    return _document(motion_json.SCHEMA, "DesignedMotion", motion_json.VIEWS)


def result_schema(estimator: Estimator = "least-squares") -> dict[str, Any]:
    """Returns the JSON schema of results, which describes every key with its unit and frame.

    Every JSON document of tactid names its version under ``schema``; :meth:`Identification.to_json`
    returns one.

    >>> tactid.result_schema()["properties"]["schema"]["const"]
    'tactid.result/3'

    Args:
        estimator: The estimator of the result: the paper's filter (``"nlms"``) has fewer keys.
    """
    if estimator == "nlms":
        views = result_json.PAPER_VIEWS
        return _document(result_json.PAPER_SCHEMA, "PaperIdentification", views, OF_SIMULATION)
    return _document(result_json.SCHEMA, "Identification", result_json.VIEWS, OF_SIMULATION)


def _document(name: str, record: str, views: Schema, optional: Schema | None = None) -> Schema:
    """Returns the schema of a document: the fields of a record and what is shown besides."""
    structure = SCHEMAS[record]
    head = {
        "schema": {"const": name, "description": "Name and version of this layout."},
        "units": {
            "properties": {key: {"const": unit} for key, unit in result_json.UNITS.items()},
            "description": "Units of the values. Any other number has its unit in its key, or"
            " states it in its description.",
        },
    }
    properties = head | structure["properties"] | views | (optional or {})
    whole = {
        "description": structure["description"],
        "properties": properties,
        "required": [key for key in properties if key not in (optional or {})],
    }
    definitions = _in_documents({**SCHEMAS, **finding_schemas.definitions()})
    shown = _in_documents(whole)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": name,
        **shown,
        "$defs": _reachable(shown, definitions),
    }


def _in_documents(node: Any) -> Any:
    """Returns a schema of structures as that of documents."""
    if isinstance(node, list):
        return [_in_documents(each) for each in node]
    if not isinstance(node, Mapping):
        return node
    found = {key: _in_documents(value) for key, value in node.items() if key not in NOTES}
    if found.get("type") == "number":
        found["type"] = ["number", "null"]
    if isinstance(found.get("properties"), dict) and "oneOf" not in found:
        kept = {key: part.get("kept") for key, part in node["properties"].items()}
        shown = {key: part for key, part in found["properties"].items() if kept[key] != "memory"}
        required = found.get("required", list(shown))
        found |= {
            "type": found.get("type", "object"),
            "properties": shown,
            "required": [key for key in required if key in shown and kept[key] != "file"],
            "additionalProperties": False,
        }
    return found


def _reachable(node: Any, definitions: Schema) -> Schema:
    """Returns the definitions that a schema refers to, directly or not."""
    found: Schema = {}
    pending = [node]
    while pending:
        part = pending.pop()
        if isinstance(part, Mapping):
            name = str(part.get("$ref", "")).removeprefix("#/$defs/")
            if name in definitions and name not in found:
                found[name] = definitions[name]
                pending.append(definitions[name])
            pending.extend(part.values())
        elif isinstance(part, list):
            pending.extend(part)
    return found
