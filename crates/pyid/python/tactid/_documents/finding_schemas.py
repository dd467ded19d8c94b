"""The JSON schemas of findings, from the documentation of their fields in Rust."""

import json
from collections.abc import Iterator
from typing import Any, get_args

from tactid import _native
from tactid._base.findings import Severity
from tactid._results.records import sentences

Schema = dict[str, Any]

KIND, TEXT = "Name of what was noticed.", "The finding in sentences."
GRAVE = "How grave it is: the result is wrong, no precision is promised, or neither."
CHOICE = "Which of several cases it is."


def definitions() -> Schema:
    """Returns the schemas of findings and faults in documents, by their names."""
    return {
        "Finding": finding_schema(),
        "CalibrationFinding": calibration_finding_schema(),
        "DataFault": fault_schema(),
    }


def finding_schema() -> Schema:
    """Returns the schema of a finding about a recording, or about several."""
    return _schema("A finding: its kind, its sentences, and the numbers and names of the kind.", 0)


def calibration_finding_schema() -> Schema:
    """Returns the schema of what the recordings of a calibration contradict or do not determine."""
    return _schema(
        "A finding of the calibration: its kind, its sentences, and the numbers and names of the"
        " kind.",
        1,
        2,
    )


def kinds_of(schema: Schema) -> list[str]:
    """Returns the kinds of findings that a schema describes."""
    kinds = [each["properties"]["kind"]["const"] for each in schema["oneOf"]]
    return list(dict.fromkeys(kinds))


def fault_schema() -> Schema:
    """Returns the schema of a fault, with every kind of fault."""
    joint = "Name of the joint, where the fault is that of one joint; else null."
    text = "What was wrong, how often, and what was done about it, in a sentence."
    found = list(variants(json.loads(_native.finding_schemas()[3])))
    parts = {key: _plain(part) for key, part in found[0]["properties"].items()}
    kinds = [each["properties"]["kind"]["const"] for each in found]
    properties = {
        "topic": parts["topic"],
        "kind": {"enum": kinds, "description": "Kind of the fault."},
        "joint": {"type": ["string", "null"], "description": joint},
        "text": {"type": "string", "description": text},
        "count": parts["count"],
        "first_s": parts["first_s"],
    }
    return {
        "type": "object",
        "properties": properties,
        "required": list(properties),
        "additionalProperties": False,
    }


def fault_kinds() -> list[str]:
    """Returns every kind of fault."""
    found: list[str] = fault_schema()["properties"]["kind"]["enum"]
    return found


def _schema(description: str, *indices: int) -> Schema:
    found = [json.loads(_native.finding_schemas()[index]) for index in indices]
    return {
        "description": description,
        "type": "object",
        "required": ["kind", "severity", "text"],
        "oneOf": [_finding(each) for schema in found for each in variants(schema)],
    }


def _finding(variant: Schema) -> Schema:
    """Returns the schema of one kind of finding as a document has it."""
    properties = {**variant["properties"]}
    # A contradiction of a calibration is a finding by its assumption.
    tag = "kind" if "kind" in properties else "assumption"
    kind = properties.pop(tag)["const"]
    data = {key: {"description": CHOICE} | _plain(part) for key, part in properties.items()}
    head = {
        "kind": {"const": kind, "description": KIND},
        "severity": {"enum": list(get_args(Severity)), "description": GRAVE},
        "text": {"type": "string", "description": TEXT},
    }
    required = [name for name in variant["required"] if name in data]
    return {
        "description": variant["description"],
        "properties": head | data,
        "required": [*head, *required],
        "additionalProperties": False,
    }


def variants(part: Schema) -> Iterator[Schema]:
    """Yields each alternative of a schema, with the properties that all of them have."""
    properties, required = part.get("properties", {}), part.get("required", [])
    own = {
        # The crates list the fields in their order as required, and sort the properties.
        "properties": {key: properties[key] for key in (*required, *properties)},
        "required": required,
        "description": sentences(part.get("description", "")),
    }
    # What several findings have in common says nothing about one of them.
    head = [own["description"]] if "kind" in properties else []
    alternatives = part.get("oneOf", part.get("anyOf"))
    if alternatives is None:
        yield own
        return
    for alternative in alternatives:
        for below in variants(alternative):
            yield {
                "properties": own["properties"] | below["properties"],
                "required": [*own["required"], *below["required"]],
                "description": " ".join(filter(None, [*head, below["description"]])),
            }


def _plain(part: Schema) -> Schema:
    """Returns the schema of a field: choices as ``enum``, and null for what JSON does not have."""
    part = {key: value for key, value in part.items() if key not in ("format", "default")}
    if "description" in part:
        part["description"] = sentences(part["description"])
    if "const" in part:
        return {"const": part["const"]}
    choices = list(_choices(part))
    if choices:
        part = {key: value for key, value in part.items() if key not in ("oneOf", "anyOf", "type")}
        return part | {"enum": choices}
    if part.get("type") == "number":
        part["type"] = ["number", "null"]
    if "items" in part:
        part["items"] = _plain(part["items"])
    if "properties" in part:  # an object is optional, as the advice of poses at rest
        part["type"] = ["object", "null"]
        part["properties"] = {key: _plain(each) for key, each in part["properties"].items()}
    return part


def _choices(part: Schema) -> Iterator[str | None]:
    """Yields the names among which a field chooses."""
    yield from part.get("enum", [])
    if "const" in part:
        yield part["const"]
    if part.get("type") == "null":
        yield None
    for below in [*part.get("oneOf", []), *part.get("anyOf", [])]:
        yield from _choices(below)
