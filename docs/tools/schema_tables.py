"""The JSON schema of a result as tables of a page."""

from collections.abc import Iterator
from typing import Any

Schema = dict[str, Any]

DEFINITIONS = "#/$defs/"


def tables(schema: Schema) -> str:
    """Returns a table of the keys at the top, and one for each key that contains others."""
    top, definitions = schema["properties"], schema["$defs"]
    sections = [table(top.items())]
    for name, part in [*top.items(), *definitions.items()]:
        below = list(inner("" if name in definitions else f"{name}.", part))
        if below:
            sections.append(f"### `{name}`\n\n{table(below)}")
    return "\n\n".join(sections)


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
        return f"[`{name}`](#{name})"
    if "const" in part:
        return f'"{part["const"]}"'
    if "enum" in part:
        return ", ".join(f'"{value}"' for value in part["enum"])
    names = part.get("type", "object")
    if names == "array" and "$ref" in part.get("items", {}):
        return f"list of {kind(part['items'])}"
    return " or ".join([names] if isinstance(names, str) else names)
