"""Results as plain data: a class for each structure that the crates serialise.

Fields, their order, types and documentation are those of the structure in Rust, by its JSON schema.
A class is made when it is first used. A class of the package that adds methods is a subclass of the
same name. The stub ``records.pyi``, which ``docs/tools/record_stub.py`` writes, has the fields for
type checkers and editors.
"""

import functools
import json
import re
from collections.abc import Mapping
from dataclasses import Field, field, fields, make_dataclass
from typing import Any

import numpy as np

from tactid import _native
from tactid._base.equality import ComparedByValue
from tactid._base.field_docs import with_fields


class Classes(dict[str, type["Record"]]):
    """Classes by the names of their structures, made when they are asked for."""

    def __missing__(self, name: str) -> type["Record"]:
        return made(name)


CLASSES = Classes()
"""The class of each structure: the one with methods where there is one."""

LINK = re.compile(r"\[([^\]]+)\]\([^)]*::[^)]*\)|\[(`[^`\]]+`)\]")
"""A link to an item of the crates in a doc comment."""


class Record(ComparedByValue):
    """Plain data: a structure of the crates by the names of its fields."""

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        # A subclass of a user is not what an identification returns.
        if cls.__module__.startswith("tactid."):
            CLASSES[cls.__name__] = cls

    def __post_init__(self) -> None:
        """Makes arrays of lists, and gives an array without entries its number of dimensions."""
        for each in fields(self):  # type: ignore[arg-type]
            object.__setattr__(self, each.name, _converted(each, getattr(self, each.name)))


def _converted(of: "Field[Any]", value: Any) -> Any:
    dimensions, dtype = of.metadata.get("dimensions", 0), of.metadata.get("dtype")
    if not dimensions or value is None or isinstance(value, np.ndarray):
        return value
    array = np.asarray(value, dtype=dtype)
    return array if array.size else np.empty((0,) * dimensions, dtype=dtype)


def schema_of(record: type[Record] | Record) -> dict[str, Any]:
    """Returns the JSON schema of the structure of a record."""
    classes = (record if isinstance(record, type) else type(record)).__mro__
    return next(SCHEMAS[each.__name__] for each in classes if each.__module__ == __name__)


def without_null(schema: Mapping[str, Any]) -> Mapping[str, Any]:
    """Returns what a value is where it is not null."""
    for part in schema.get("anyOf", ()):
        if part != {"type": "null"}:
            found: Mapping[str, Any] = part
            return found
    if isinstance(schema.get("type"), list):
        return {**schema, "type": next(kind for kind in schema["type"] if kind != "null")}
    return schema


def is_nullable(schema: Mapping[str, Any]) -> bool:
    """Returns whether a value may be null."""
    return {"type": "null"} in schema.get("anyOf", ()) or "null" in schema.get("type", ())


def of_ten(schema: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """Returns what there is of each of the ten values; None of anything else."""
    name = without_null(schema).get("$ref", "").removeprefix("#/$defs/")
    if not name.startswith("TenValues_"):
        return None
    entry: Mapping[str, Any] = SCHEMAS[name]["properties"]["mass"]
    return entry


def array_of(schema: Mapping[str, Any]) -> tuple[int, str]:
    """Returns the number of dimensions of an array and the type of its entries; 0 without any."""
    entry = of_ten(schema) or without_null(schema).get("items")
    if entry is None or "x-class" in schema:
        return 0, ""
    if entry.get("type") in {"number", "boolean"}:
        return 1, entry["type"]
    dimensions, kind = array_of(entry)
    return dimensions + 1 if dimensions else 0, kind


def sentences(text: str) -> str:
    """Returns a doc comment without links, a line for each paragraph."""
    text = LINK.sub(lambda found: found[1] or found[2], text).replace("::", ".")
    return "\n\n".join(" ".join(part.split()) for part in text.split("\n\n"))


def _read(node: Any) -> Any:
    """Returns a schema with its fields in order, and without links in its descriptions."""
    if isinstance(node, list):
        return [_read(each) for each in node]
    if not isinstance(node, dict):
        return node
    texts = {"description": sentences} if isinstance(node.get("description"), str) else {}
    found = {key: texts.get(key, _read)(value) for key, value in node.items()}
    if "properties" in found:
        # The crates list the fields in their order as required, and sort the properties.
        found["properties"] = {key: found["properties"][key] for key in found["required"]}
    return found


SCHEMAS: dict[str, dict[str, Any]] = _read(json.loads(_native.record_schemas()))
"""The JSON schema of each structure by its name."""


def _field(schema: dict[str, Any]) -> Any:
    dimensions, kind = array_of(schema)
    metadata = {
        "schema": schema,
        "dimensions": dimensions,
        "dtype": bool if kind == "boolean" else float,
    }
    if "default" in schema:
        default = schema["default"]
        if default == []:
            return field(default_factory=list, metadata=metadata)
        return field(
            default=float(default) if isinstance(default, str) else default, metadata=metadata
        )
    if is_nullable(schema):
        return field(default=None, metadata=metadata)
    return field(metadata=metadata)


def in_order(schema: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Returns the fields that a structure adds to those of its base, those with defaults last."""
    inherited = SCHEMAS[schema["x-base"]]["properties"] if "x-base" in schema else {}
    properties: dict[str, dict[str, Any]] = {
        name: part for name, part in schema["properties"].items() if name not in inherited
    }
    has_default = {name: "default" in p or is_nullable(p) for name, p in properties.items()}
    return {name: properties[name] for name in sorted(properties, key=has_default.__getitem__)}


@functools.cache
def made(name: str) -> type[Record]:
    """Returns the class of the fields of a structure, without methods.

    Raises:
        KeyError: There is no such structure.
    """
    schema = SCHEMAS[name]
    members = [(key, Any, _field(part)) for key, part in in_order(schema).items()]
    namespace = {"__doc__": schema.get("description"), "__module__": __name__}
    base = made(schema["x-base"]) if "x-base" in schema else Record
    plain = make_dataclass(name, members, bases=(base,), namespace=namespace, frozen=True, eq=False)
    return with_fields(plain)


def __getattr__(name: str) -> type[Record]:
    if SCHEMAS.get(name, {}).get("properties"):
        return made(name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
