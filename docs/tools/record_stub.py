"""The stub of the module ``tactid._results.records``, which makes its classes when they are used.

``python docs/tools/record_stub.py`` writes it.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from tactid._results import records
from tactid._results.records import SCHEMAS, array_of, in_order, is_nullable, of_ten, without_null

PATH = Path(records.__file__).with_suffix(".pyi")
"""The file of the stub."""

LONGEST_LINE = 100
"""Columns of a line, beyond which the formatter breaks it."""

PLAIN = {"number": "float", "integer": "int", "boolean": "bool", "string": "str"}
"""Types of plain values by their names in a schema."""

HEAD = """\
# Written by docs/tools/record_stub.py: do not edit.
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tactid._base.equality import ComparedByValue
from tactid._base.findings import DataFault, Finding
from tactid._native import MassProperties

CLASSES: dict[str, type[Record]]
SCHEMAS: dict[str, dict[str, Any]]

def sentences(text: str) -> str: ...
def schema_of(record: type[Record] | Record) -> dict[str, Any]: ...
def without_null(schema: Mapping[str, Any]) -> Mapping[str, Any]: ...
def is_nullable(schema: Mapping[str, Any]) -> bool: ...
def of_ten(schema: Mapping[str, Any]) -> Mapping[str, Any] | None: ...
def array_of(schema: Mapping[str, Any]) -> tuple[int, str]: ...
def in_order(schema: Mapping[str, Any]) -> dict[str, dict[str, Any]]: ...

class Record(ComparedByValue):
    def __post_init__(self) -> None: ...
"""
"""What the stub begins with."""


def stub() -> str:
    """Returns the text of the stub."""
    return "\n".join([HEAD, *_aliases(), "", *_classes()])


def _aliases() -> Iterator[str]:
    for name, schema in SCHEMAS.items():
        names = [part.get("const") for part in schema.get("oneOf", ())] or schema.get("enum")
        if names:
            listed = ", ".join(map(_quoted, names))
            alias = f"{name}: TypeAlias = Literal[{listed}]"
            lines = [f"    {listed}"]
            if len(lines[0]) > LONGEST_LINE:
                lines = [f"    {_quoted(each)}," for each in names]
            broken = "\n".join(["", *lines, ""])
            yield alias.replace(listed, broken) if len(alias) > LONGEST_LINE else alias


def _classes() -> Iterator[str]:
    for name, schema in SCHEMAS.items():
        if schema.get("properties") and not name.startswith("TenValues_"):
            base = schema.get("x-base", "Record")
            yield f"@dataclass(frozen=True, eq=False)\nclass {name}({base}):"
            for key, part in in_order(schema).items():
                default = " = ..." if "default" in part or is_nullable(part) else ""
                yield f"    {key}: {annotation(part)}{default}"
            yield ""


def annotation(schema: Mapping[str, Any]) -> str:
    """Returns the annotation of a field."""
    optional = " | None" if is_nullable(schema) else ""
    return _not_null(schema) + optional


def _not_null(schema: Mapping[str, Any]) -> str:
    if "x-class" in schema:
        return str(schema["x-class"])
    dimensions, kind = array_of(schema)
    if dimensions:
        return "NDArray[np.bool_]" if kind == "boolean" else "NDArray[np.float64]"
    entry, value = of_ten(schema), without_null(schema)
    if entry is not None or value.get("type") == "array":
        return f"Sequence[{annotation(entry or value['items'])}]"
    if "$ref" in value:
        return str(value["$ref"].removeprefix("#/$defs/"))
    if "const" in value:
        return f"Literal[{_quoted(value['const'])}]"
    return PLAIN[value["type"]]


def _quoted(name: object) -> str:
    return f'"{name}"'


if __name__ == "__main__":
    PATH.write_text(stub(), encoding="utf-8")
