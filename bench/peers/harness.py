"""What all comparisons have in common: agreement first, then interleaved rounds, then one table.

A module that `__main__` lists has a function `comparisons`, which returns its `Comparison`s. Each
says what is computed, by whom, and how the results compare; nothing else differs between a kernel
of nanoseconds and a command of seconds. Nothing is prepared before a comparison is run.
"""

import importlib
import json
import statistics
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from types import ModuleType

import numpy as np

Array = np.ndarray

ROUNDS = 9
"""Interleaved rounds; one more before them warms caches and is not counted."""

TOLERANCE = 1e-10
"""Largest difference between results, as a fraction of the largest entry of its column."""

SMALL_COLUMN = 1e-3
"""A column whose entries are smaller than this fraction of the largest of all is compared as if
they were of this size: it may consist of rounding."""

COLUMNS = ("task", "contender", "minimum", "median", "ratio (of medians)", "bar", "difference")
"""Columns of the table. The bar has a mark where it is missed. The difference is that of the result
from tactid's, relative to the largest entry of its column; it is empty where only times are
compared."""


class MissingPeerError(Exception):
    """A peer cannot be measured here; the message says why, such as what is not installed."""


def peer(module: str, package: str) -> ModuleType:
    """The module of a peer.

    Raises:
        MissingPeerError: It cannot be imported.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise MissingPeerError(f"pip install {package}") from error


@dataclass
class Contender:
    """One library at one task, ready to be timed."""

    measure: Callable[[], float]
    """Does the task once or often, and returns the seconds of one unit."""
    result: Array | None = None
    """Compared with those of the others: an array with a column for each quantity, or one for
    quantities of one kind. Without it, only times are compared."""
    note: str = ""
    """What else a reader must know, such as the accuracy of the result."""


@dataclass
class Comparison:
    """A task, tactid's way of doing it first, and its peers."""

    task: str
    unit: str
    contenders: dict[str, Callable[[], Contender]]
    """What prepares each contender, or raises `MissingPeerError`."""
    scale: float = 1e9
    bar: float | None = None
    """Ratio that is aimed for, of each peer's time to that of tactid."""
    tolerance: float = TOLERANCE
    """Largest difference between results, as a fraction of the largest entry of its column."""
    note: str = ""
    """What the contenders' notes are: the first part of the note below the table."""


@dataclass
class Timing:
    """The rounds of one contender."""

    name: str
    minimum: float | None = None
    median: float | None = None
    difference: float | None = None
    """Difference of its result from tactid's, as a fraction of the largest entry of its column."""
    ratio: float | None = None
    """Minimum of this peer as a multiple of tactid's in the same run: above 1, tactid is faster."""
    median_ratio: float | None = None
    missing: str = ""
    rounds: list[float] = field(default_factory=list)


@dataclass
class Row:
    """A finished comparison."""

    task: str
    unit: str
    bar: float | None
    timings: list[Timing]
    note: str = ""


def run(comparison: Comparison, count: int = ROUNDS) -> Row:
    """Checks that the results agree, then measures all contenders in turn, round after round."""
    present: dict[str, Contender] = {}
    missing: dict[str, str] = {}
    for name, prepare in comparison.contenders.items():
        try:
            present[name] = prepare()
        except MissingPeerError as error:
            missing[name] = str(error)
    reference = next(iter(comparison.contenders))
    if reference in missing:  # Without its own result, there is nothing to compare with.
        timings = [Timing(name, missing=missing[reference]) for name in comparison.contenders]
        return Row(comparison.task, comparison.unit, comparison.bar, timings, comparison.note)
    differences = check_agreement(comparison, present, reference)
    rounds = interleaved_rounds(comparison, present, count)
    ours = rounds[reference]
    timings = []
    for name in comparison.contenders:
        if name in missing:
            timings.append(Timing(name, missing=missing[name]))
            continue
        times = rounds[name]
        timing = Timing(name, min(times), statistics.median(times), rounds=times)
        if name != reference:
            timing.difference = differences.get(name)
            timing.ratio = timing.minimum / min(ours)
            timing.median_ratio = timing.median / statistics.median(ours)
        timings.append(timing)
    notes = "; ".join(f"{name}: {each.note}" for name, each in present.items() if each.note)
    note = f"{comparison.note}: {notes}" if notes else comparison.note
    return Row(comparison.task, comparison.unit, comparison.bar, timings, note)


def interleaved_rounds(
    comparison: Comparison, contenders: dict[str, Contender], count: int
) -> dict[str, list[float]]:
    """Times of each contender in the unit of the task; the first round is not counted."""
    rounds: dict[str, list[float]] = {name: [] for name in contenders}
    for number in range(count + 1):
        for name, each in contenders.items():
            seconds = each.measure()
            if number > 0:
                rounds[name].append(seconds * comparison.scale)
    return rounds


def check_agreement(
    comparison: Comparison, contenders: dict[str, Contender], reference: str
) -> dict[str, float]:
    """Differences of the results from tactid's; raises where one is too large."""
    results = {name: each.result for name, each in contenders.items() if each.result is not None}
    differences = {}
    for name, result in results.items():
        if name == reference:
            continue
        differences[name] = difference(result, results[reference])
        if not differences[name] <= comparison.tolerance:
            raise SystemExit(
                f"{comparison.task}: {name} and {reference} differ by {differences[name]:.1e}"
            )
    return differences


def difference(theirs: Array, ours: Array) -> float:
    """Largest difference of two results, as a fraction of the largest entry of its column."""
    if theirs.shape != ours.shape:
        raise SystemExit(f"results have the shapes {theirs.shape} and {ours.shape}")
    theirs, ours = (each.reshape(len(each), -1) for each in (theirs, ours))
    largest = np.abs(ours).max(axis=0)
    sizes = np.maximum(largest, SMALL_COLUMN * largest.max())
    return float((np.abs(theirs - ours).max(axis=0) / sizes).max())


def show(row: Row) -> None:
    """Prints a finished comparison: its task, and a line for each contender."""
    print(f"{row.task}{f' ({row.note})' if row.note else ''}")
    for timing in row.timings:
        minimum, median, ratio, bar, difference = figures(row, timing)
        cells = f"{minimum:>14} {median:>14} {ratio:>13} {bar:>12} {difference:>8}"
        print(f"    {timing.name:<42} {cells.rstrip()}", flush=True)


def keep(rows: list[Row], facts: dict[str, str], table: Path, rounds: Path) -> None:
    """Writes the table as Markdown and, with every round, as JSON."""
    lines = ["# Beside peers", "", *(f"- {key}: {value}" for key, value in facts.items()), ""]
    lines += ["| " + " | ".join(COLUMNS) + " |", "|" + "---|" * len(COLUMNS)]
    for row in rows:
        for k, timing in enumerate(row.timings):
            cells = [row.task if k == 0 else "", timing.name, *figures(row, timing)]
            lines.append("| " + " | ".join(cells) + " |")
    notes = [f"- {row.task}: {row.note}" for row in rows if row.note]
    lines += ["", *notes] if notes else []
    for path in (table, rounds):
        path.parent.mkdir(parents=True, exist_ok=True)
    table.write_text("\n".join(lines) + "\n")
    content = {"facts": facts, "comparisons": [asdict(row) for row in rows]}
    rounds.write_text(json.dumps(content, indent=1) + "\n")
    print(f"written to {table} and {rounds}")


def figures(row: Row, timing: Timing) -> list[str]:
    """Minimum, median, ratio, bar and difference of a contender as text."""
    if timing.minimum is None:
        return [f"missing: {timing.missing}", "", "", "", ""]
    ratio = "1" if timing.ratio is None else f"{timing.ratio:.2f} ({timing.median_ratio:.2f})"
    bar = "" if row.bar is None or timing.ratio is None else f"{row.bar:.3g}"
    if bar and timing.ratio < row.bar:
        bar += " missed"
    difference = "" if timing.difference is None else f"{timing.difference:.0e}"
    times = [f"{time:.4g} {row.unit}" for time in (timing.minimum, timing.median)]
    return [*times, ratio, bar, difference]
