"""What is expected of a result in JSON: how near to the truth it is, and what it mentions."""

from collections.abc import Callable
from typing import Any

import jsonschema
import numpy as np

import tactid

Record = dict[str, Any]
Identify = Callable[..., Record]

LAYOUT: list[str] = tactid.result_schema()["required"]
"""The keys of every recording's record, in their order: what others read."""

NAMES = ("mass", "com x", "com y", "com z", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz")
KINDS = (slice(0, 1), slice(1, 4), slice(4, 10))


SCHEMAS = {each["title"]: each for each in map(tactid.result_schema, ("least-squares", "nlms"))}
"""The published schemas of results by their names."""


def assert_fits_schema(record: Record) -> None:
    """The record has every key that the published schema asks for, and no other."""
    validator = jsonschema.Draft202012Validator(SCHEMAS[record["schema"]])
    problems = [f"{error.json_path}: {error.message}" for error in validator.iter_errors(record)]
    assert not problems, problems


def values_of(block: Record) -> np.ndarray:
    """The ten numbers of an estimate; NaN for null."""
    com, inertia = block["com"], block["inertia"]
    entries = [com[axis] for axis in "xyz"]
    entries += [inertia[entry] for entry in ("xx", "xy", "xz", "yy", "yz", "zz")]
    return np.array([block["mass"], *entries], dtype=float)


def limits_of(record: Record) -> tuple[np.ndarray, np.ndarray]:
    """The lower and the upper limits of the ten intervals; NaN for null."""
    ten = record["estimate"]["intervals"]
    pairs = [ten["mass"], *ten["com"].values(), *ten["inertia"].values()]
    low, high = np.array(pairs, dtype=float).T
    return low, high


def half_widths_of(record: Record) -> np.ndarray:
    """The distance of the ten values to the farther limit; NaN for null."""
    values, (low, high) = values_of(record["estimate"]["values"]), limits_of(record)
    return np.asarray(np.maximum(values - low, high - values))


def scales(truth: np.ndarray) -> np.ndarray:
    """What an error is relative to: the largest true value of its kind."""
    return np.concatenate(
        [np.full(kind.stop - kind.start, np.abs(truth[kind]).max()) for kind in KINDS]
    )


def errors(record: Record, truth: np.ndarray) -> np.ndarray:
    """Relative errors of all ten."""
    return np.asarray((values_of(record["estimate"]["values"]) - truth) / scales(truth))


def assert_within(record: Record, truth: np.ndarray, tolerance: float) -> None:
    """Each of the ten is known, and its relative error within the tolerance."""
    found = errors(record, truth)
    wrong = {name: e for name, e in zip(NAMES, found, strict=True) if not abs(e) <= tolerance}
    assert not wrong, f"beyond {tolerance}: {wrong}; remarks: {record['remarks']}"


def remarks_with(record: Record, *words: str) -> list[str]:
    """The remarks that have all of these words."""
    return [
        remark
        for remark in record["remarks"]
        if all(word.casefold() in remark.casefold() for word in words)
    ]


def mentions(record: Record, about: str, *words: str, count: int | None = None) -> bool:
    """Whether a fault on a topic is reported, among the data faults or in a remark.

    Any of the words will do; the count must be right where one is asked for.
    """
    for line in record.get("faults", []):
        text = f"{line['topic']} {line['text']}".casefold()
        right = count is None or line["count"] == count
        if right and about in text and any(word.casefold() in text for word in words or ("",)):
            return True
    numbers = [] if count is None else [str(count)]
    return any(remarks_with(record, about, *numbers, word) for word in words or ("",))
