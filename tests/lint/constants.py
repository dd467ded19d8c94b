"""Checks docs/theory/constants.md: constants of `identify` and `batch` have one row and one name.

Run it from anywhere: ``python3 tests/lint/constants.py``. It prints each fault and exits with
status 1 if there is one. ``--count`` prints the number of constants.

A numeric constant is an item ``const NAME: TYPE = VALUE;`` in production code whose type is a
number, a range of numbers, or settings of a change detector, a limit or a trajectory. Arrays
(tables, names) and generic parameters are none. A constant whose value is the name of another one
is an alias: it has a row, but does not count.
"""

import re
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
SOURCES = {crate: ROOT / "crates" / crate / "src" for crate in ("identify", "batch")}
TABLE = ROOT / "docs" / "theory" / "constants.md"
MOST = 150
KINDS = ("definition", "derived", "calibrated", "rounding", "chosen")
CONSTANT = re.compile(
    r"\bconst ([A-Z][A-Z_0-9]*): "
    r"([\w:<>]*\b(?:f64|usize|[ui]\d+|(?:Change|Limit|Trajectory)Settings)\b>?) = ([^;]*);"
)
ALIAS = re.compile(r"(?:\w+::)*[A-Z][A-Z_0-9]*")


class Constant(NamedTuple):
    """A constant as its file states it."""

    name: str
    value: str
    file: str


def main() -> int:
    """Prints the faults and returns the exit code."""
    constants = list(constants_of(SOURCES))
    count = sum(ALIAS.fullmatch(constant.value) is None for constant in constants)
    if sys.argv[1:] == ["--count"]:
        print(count)
        return 0
    faults = list(faults_of(constants, TABLE.read_text(encoding="utf-8")))
    if count > MOST:
        faults.append(f"identify and batch have {count} numeric constants, at most {MOST}")
    print("\n".join(faults), end="\n" if faults else "")
    return 1 if faults else 0


def constants_of(sources: dict[str, Path]) -> Iterator[Constant]:
    """The numeric constants of production code."""
    paths = [(crate, path) for crate, source in sources.items() for path in source.rglob("*.rs")]
    for crate, path in sorted(paths):
        inside = path.relative_to(sources[crate])
        if path.stem == "tests" or "tests" in inside.parts:
            continue
        text = path.read_text(encoding="utf-8").split("#[cfg(test)]\nmod tests {", maxsplit=1)[0]
        text = re.sub(r"//[^\n]*", "", text)
        for name, _, value in CONSTANT.findall(text):
            short = re.sub(r"\s+", " ", re.sub(r"^\w+Settings (?=\{)", "", value))
            yield Constant(name, short, f"{crate}/{inside.as_posix()}")


def faults_of(constants: list[Constant], text: str) -> Iterator[str]:
    """Names that occur twice, and differences between the source and the table."""
    for name, count in Counter(constant.name for constant in constants).items():
        if count > 1:
            yield f"{count} constants have the name {name}"
    rows = {}
    for line in text.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if line.startswith("| `") and len(cells) == len(Constant._fields) + 2:
            name, value, file = (cell.strip("`") for cell in cells[:3])
            rows[Constant(name, value, file)] = cells[3:]
    for constant in constants:
        if constant not in rows:
            yield f"{constant.file}: {constant.name} = {constant.value} has no row in {TABLE.name}"
    for constant, (kind, reason) in rows.items():
        if constant not in constants:
            yield f"{TABLE.name}: {constant.file} has no {constant.name} = {constant.value}"
        if kind not in KINDS or not reason:
            yield f"{TABLE.name}: {constant.name} needs a kind of {', '.join(KINDS)} and a source"


if __name__ == "__main__":
    sys.exit(main())
