"""The row of a recording: its columns follow from the schema of a result.

A column has the name of a key of the JSON document of a result, with dots between the names of
nested keys, such as ``estimate.values.com.x``, and the type of its schema.
"""

import json
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from datetime import datetime, timezone
from typing import Any, Literal

from tactid._api.result import Identification
from tactid._base.errors import InternalError, TactidError
from tactid._base.values import PATHS
from tactid._documents import findings_json, result_json
from tactid._fleet.recordings import Recording
from tactid._native import __version__
from tactid._options.options import Options
from tactid._results.records import SCHEMAS, of_ten, without_null

Outcome = Literal[
    "identified", "contradicted", "undetermined", "refused", "unreachable", "internal error"
]
"""What has become of a recording: a payload; one that the data contradict; a motion that determines
no value; an option, a file or a recording that is wrong; a store, a file or a worker that failed,
which the next run tries again; a fault of tactid."""

WITH_RESULT: tuple[Outcome, ...] = ("identified", "contradicted", "undetermined")
"""Outcomes of recordings that have a result; of others the error says why there is none."""

Row = dict[str, Any]
"""The values of a row by the names of their columns; those that are missing are null."""


Key = tuple[str | int, ...]
"""What makes two rows those of one recording, or of one simulation by one method."""

KEY = ("address", "episode", "seed", "method")
"""Columns of a key; the method is part of that of a simulation alone."""


def key_of(row: Mapping[str, Any]) -> Key:
    """Returns the key of a row."""
    of_simulation = () if row.get("seed") is None else (row["seed"], row["method"])
    return row["address"], -1 if row["episode"] is None else row["episode"], *of_simulation


def place_of(row: Mapping[str, Any]) -> tuple[Any, ...]:
    """Returns the place of a row in a table: that of its recording, and of its segment there.

    Numbers in addresses count as such.
    """
    address, *others = key_of(row)
    parts = re.split(r"(\d+)", str(address))
    parts[1::2] = map(int, parts[1::2])
    return parts, address, others, row.get("begin_s") or 0.0


def rows_of(rows: Iterable[Row], tasks: Iterable["Task"]) -> list[Row]:
    """Returns the rows of some tasks in order, with all columns."""
    keys = {task.key for task in tasks}
    missing = dict.fromkeys((*HEAD, *COLUMNS))
    return sorted((missing | row for row in rows if key_of(row) in keys), key=place_of)


@dataclass(frozen=True)
class Task:
    """A recording with what is asked for."""

    recording: Recording
    options: Options
    """Options with the robot's URDF as text."""
    options_sha256: str
    """Hash of the options and of the files that they name."""
    robot: str = ""
    """Name of the robot."""
    split: bool = False
    """Whether the recording is cut where the payload changes."""

    @property
    def key(self) -> Key:
        """The key of its rows."""
        return key_of(self.head())

    @property
    def state(self) -> tuple[Any, ...]:
        """What decides whether a stored row is that of this task: see :data:`STATE`."""
        return tuple(self.head()[name] for name in STATE)

    def head(self) -> Row:
        """Returns the columns that are known before anything is read."""
        return {
            "address": self.recording.address,
            "episode": self.recording.episode,
            "seed": self.recording.seed,
            "method": self.options.method,
            "robot": self.robot,
            "size": self.recording.size,
            "tag": self.recording.tag,
            "options_sha256": self.options_sha256,
            "version": __version__,
            "configured": self.configured,
            "begin_s": self.options.begin_s,
            "end_s": self.options.end_s,
        }

    @property
    def configured(self) -> list[float] | None:
        """Mass and centre of mass of the payload that the controller was configured with."""
        given = self.options.configured_payload
        return None if given is None else [float(each) for each in given]


STATE = ("robot", "size", "tag", "options_sha256", "version")
"""Columns by which a recording is known to be new or changed."""

HEAD = {
    "address": "string",
    "episode": "integer",
    "seed": "integer",
    "robot": "string",
    "size": "integer",
    "tag": "string",
    "options_sha256": "string",
    "version": "string",
    "configured": ["number"],
    "begin_s": "number",
    "end_s": "number",
    "finished": "time",
    "seconds": "number",
    "requests": "integer",
    "bytes_read": "integer",
    "outcome": "string",
    "error": "string",
}
"""Types of the columns that stand before those of the result, which a row always has."""

OWN_TYPES: dict[str, Any] = {
    "findings": {"kind": "string", "severity": "string", "text": "string"},
    "faults": {"topic": "string", "kind": "string", "count": "integer", "text": "string"},
}
"""Columns whose entries are of many kinds, and what each of them has."""


def of_result(result: Identification) -> Row:
    """Returns the columns of a result."""
    found = {**result_json.plain(result), **result_json.of_payload(result)}
    found["findings"] = findings_json.findings(result.findings, "command-line")
    found["faults"] = findings_json.faults(result.faults)
    row: Row = {"outcome": outcome_of(result)}
    for name, schema in COLUMNS.items():
        row[name] = _fitted(_at(found, name), schema)
    return row


def outcome_of(result: Identification) -> Outcome:
    """Returns what the exit code of ``tactid identify`` means for a result."""
    if result.is_contradicted:
        return "contradicted"
    return "identified" if any(result.estimate.identifiable) else "undetermined"


PASSING = re.compile(r"\(os error \d+\)|there is no (such file|file or folder|object)")
"""What an error says where the system, not the content of a file, is the reason."""


def of_error(error: BaseException) -> Row:
    """Returns the columns of a recording that has no result."""
    if isinstance(error, TactidError) and not isinstance(error, InternalError):
        text = _line(error.worded("command-line"))
        return {"outcome": "unreachable" if PASSING.search(text) else "refused", "error": text}
    if isinstance(error, OSError):
        return {"outcome": "unreachable", "error": _line(str(error))}
    name = type(error).__name__
    return {"outcome": "internal error", "error": _line(f"{name}: {error}")}


def failed(task: Task, error: BaseException) -> Row:
    """Returns the row of a recording that no worker has finished."""
    return task.head() | {"finished": datetime.now(timezone.utc)} | of_error(error)


def _line(text: str) -> str:
    return " ".join(text.split())


def _columns(name: str, schema: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yields the columns of a key with their types, in words or as lists of them."""
    if name in OWN_TYPES:
        yield name, [OWN_TYPES[name]]
        return
    entry, node = of_ten(schema), without_null(schema)
    if entry is not None:
        for path in PATHS:
            yield ".".join((name, *path)), _type(entry)
        return
    node = _resolved(node)
    if "properties" in node:
        for key, part in node["properties"].items():
            if part.get("kept", "always") == "always":
                yield from _columns(f"{name}.{key}" if name else key, part)
        return
    yield name, _type(node)


def _resolved(node: Mapping[str, Any]) -> Mapping[str, Any]:
    reference = str(node.get("$ref", "")).removeprefix("#/$defs/")
    return SCHEMAS.get(reference, node)


def _type(schema: Mapping[str, Any]) -> Any:
    """Returns the type of a value: a word, a list with that of its entries, or one by name."""
    if of_ten(schema) is not None:
        return "text"
    node = _resolved(without_null(schema))
    if "items" in node:
        return [_type(node["items"])]
    if "properties" in node:
        return {key: _type(part) for key, part in node["properties"].items()}
    kind = node.get("type")
    if kind in ("number", "integer", "boolean"):
        return kind
    return "string" if kind == "string" or "enum" in node or "oneOf" in node else "text"


def _at(data: Any, name: str) -> Any:
    for key in name.split("."):
        if not isinstance(data, Mapping):
            return None
        data = data.get(key)
    return data


def _fitted(value: Any, schema: Any) -> Any:
    """Returns a value of JSON as the type of its column has it."""
    if value is None:
        return None
    if isinstance(schema, list):
        return [_fitted(each, schema[0]) for each in value]
    if isinstance(schema, Mapping):
        return {key: _fitted(value.get(key), part) for key, part in schema.items()}
    return json.dumps(value) if schema == "text" else value


COLUMNS: dict[str, Any] = dict(_columns("", SCHEMAS["Identification"]))
"""Types of the columns of a result, by their names."""


def arrow_schema(arrow: Any) -> Any:
    """Returns the schema of a table of rows; ``arrow`` is the module ``pyarrow``."""
    words = {
        "string": arrow.string(),
        "text": arrow.string(),
        "number": arrow.float64(),
        "integer": arrow.int64(),
        "boolean": arrow.bool_(),
        "time": arrow.timestamp("ms", "UTC"),
    }

    def typed(kind: Any) -> Any:
        if isinstance(kind, list):
            return arrow.list_(typed(kind[0]))
        if isinstance(kind, Mapping):
            return arrow.struct([(key, typed(part)) for key, part in kind.items()])
        return words[kind]

    columns = [(name, typed(kind)) for name, kind in (HEAD | COLUMNS).items()]
    return arrow.schema(columns, metadata={"tactid": __version__})
