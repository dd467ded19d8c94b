"""The JSON schema of a result as tables of a page."""

from collections.abc import Iterator
from typing import Any

Schema = dict[str, Any]

DEFINITIONS = "#/$defs/"


def tables(schema: Schema) -> str:
    """Returns a table of the keys at the top, and one for each key that contains others."""
    top, definitions = schema["properties"], schema.get("$defs", {})
    sections = [table(top.items())]
    for name, part in [*top.items(), *definitions.items()]:
        head = f"### `{name}`\n\n{part.get('description', '')}\n\n"
        if name.endswith("Finding"):
            sections.append(head + finding_table(schema, name))
        elif "oneOf" in part:
            meanings = ((each["const"], each) for each in part["oneOf"])
            sections.append(head + table(meanings))
        below = list(inner("" if name in definitions else f"{name}.", part))
        if below:
            sections.append(head + table(below))
    return "\n\n".join(sections)


def combination_tables(schema: Schema) -> str:
    """Returns tables of the keys that only the document of several recordings has."""
    sections = [table(schema["properties"].items())]
    for name in ("Agreement", "RunDistance", "ValueDifference"):
        sections.append(f"#### `{name}`\n\n{table(inner('', schema['$defs'][name]))}")
    return "\n\n".join(sections)


def finding_table(schema: Schema, name: str = "Finding") -> str:
    """Returns a table of the kinds of findings, with the keys of their data."""
    lines = ["| kind | what it means | data |", "|---|---|---|"]
    cases: dict[str, list[Schema]] = {}
    for part in schema["$defs"][name]["oneOf"]:
        cases.setdefault(part["properties"]["kind"]["const"], []).append(part)
    for kind_name, parts in cases.items():
        keys = {key: below for part in parts for key, below in part["properties"].items()}
        data = [
            f"`{key}`: {below['description']}"
            for key, below in keys.items()
            if key not in ("kind", "severity", "text")
        ]
        meaning = " Or: ".join(part["description"] for part in parts)
        lines.append(f"| `{kind_name}` | {meaning} | {'<br>'.join(data) or 'none'} |")
    return "\n".join(lines)


def inner(path: str, part: Schema) -> Iterator[tuple[str, Schema]]:
    """Returns all keys below a key with their paths; ``[]`` stands for each entry of a list."""
    for key, child in part.get("properties", {}).items():
        yield f"{path}{key}", child
        yield from inner(f"{path}{key}.", child)
    if isinstance(part.get("items"), dict):
        yield from inner(f"{path.removesuffix('.')}[].", part["items"])
    if isinstance(part.get("additionalProperties"), dict):
        yield from inner(f"{path}NAME.", part["additionalProperties"])


def table(rows: Any) -> str:
    """Returns a table of keys."""
    lines = ["| key | type | meaning |", "|---|---|---|"]
    for key, part in rows:
        meaning = part.get("description", "").replace("|", "\\|")
        lines.append(f"| `{key}` | {kind(part)} | {meaning} |")
    return "\n".join(lines)


def kind(part: Schema) -> str:
    """Returns the type of a value, or the values that it may have."""
    if "$ref" in part:
        name = part["$ref"].removeprefix(DEFINITIONS)
        return f"[`{name}`](#{name.lower()})"
    if "anyOf" in part:
        return " or ".join(map(kind, part["anyOf"]))
    if "const" in part:
        return f'"{part["const"]}"'
    if "enum" in part:
        return ", ".join("null" if value is None else f'"{value}"' for value in part["enum"])
    names = part.get("type", "object")
    if names == "array" and "$ref" in part.get("items", {}):
        return f"list of {kind(part['items'])}"
    return " or ".join([names] if isinstance(names, str) else names)
