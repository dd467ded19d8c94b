"""What all comparisons have in common: agreement first, then interleaved rounds, then one table.

A comparison is a function that yields `Comparison`s, in a module of its own that `__main__` lists.
It says what is computed, by whom, and how the results compare; nothing else differs between a
kernel of nanoseconds and a command of seconds.
"""

import json
import statistics
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

Array = np.ndarray

ROUNDS = 9
"""Interleaved rounds; one more before them warms caches and is not counted."""

TOLERANCE = 1e-10
"""Largest difference between results, as a fraction of the largest entry."""


COLUMNS = ("task", "contender", "minimum", "median", "ratio (of medians)", "bar", "difference")
"""Columns of the table. The difference is that of the result from tactid's, relative to the largest
entry; it is empty where only times are compared."""


@dataclass
class Contender:
    """One library at one task.

    `measure` does the task once or often and returns the seconds of one unit. `result` is compared
    with that of the others; without it, only the time is. A contender that is not here has
    `missing` instead.
    """

    name: str
    measure: Callable[[], float] | None = None
    result: Array | None = None
    missing: str = ""


@dataclass
class Comparison:
    """A task, tactid's way of doing it first, and its peers."""

    task: str
    unit: str
    contenders: list[Contender]
    scale: float = 1e9
    bar: float | None = None
    """Ratio that is aimed for, of the fastest peer's time to that of tactid."""
    tolerance: float = TOLERANCE
    """Largest difference between results, as a fraction of the largest entry."""
    note: str = ""
    """What else a reader must know, such as the accuracy of the results."""


@dataclass
class Timing:
    """The rounds of one contender."""

    name: str
    minimum: float | None = None
    median: float | None = None
    difference: float | None = None
    """Difference of its result from tactid's, as a fraction of the largest entry."""
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


def run(comparison: Comparison) -> Row:
    """Checks that the results agree, then measures all contenders in turn, round after round."""
    reference = comparison.contenders[0]
    if reference.measure is None:
        raise SystemExit(f"{comparison.task}: tactid itself is missing: {reference.missing}")
    present = [each for each in comparison.contenders if each.measure is not None]
    differences = check_agreement(comparison, present)
    rounds: dict[str, list[float]] = {each.name: [] for each in present}
    for number in range(ROUNDS + 1):
        for each in present:
            assert each.measure is not None
            seconds = each.measure()
            if number > 0:
                rounds[each.name].append(seconds * comparison.scale)
    ours = rounds[reference.name]
    timings = []
    for each in comparison.contenders:
        if each.name not in rounds:
            timings.append(Timing(each.name, missing=each.missing))
            continue
        times = rounds[each.name]
        timing = Timing(each.name, min(times), statistics.median(times), rounds=times)
        if each is not reference:
            timing.difference = differences.get(each.name)
            timing.ratio = timing.minimum / min(ours)
            timing.median_ratio = timing.median / statistics.median(ours)
        timings.append(timing)
    return Row(comparison.task, comparison.unit, comparison.bar, timings, comparison.note)


def check_agreement(comparison: Comparison, contenders: list[Contender]) -> dict[str, float]:
    """Differences of the results from the first one; raises where one is too large."""
    ours, *others = [each for each in contenders if each.result is not None] or [None]
    differences = {}
    for other in others:
        scale = np.abs(ours.result).max()
        difference = float(np.abs(other.result - ours.result).max() / scale)
        if not difference <= comparison.tolerance:
            raise SystemExit(
                f"{comparison.task}: {other.name} and {ours.name} differ by {difference:.1e}"
            )
        differences[other.name] = difference
    return differences


def report(rows: list[Row], facts: dict[str, str], folder: Path | None) -> None:
    """Shows the table, and writes it to a folder as Markdown and, with every round, as JSON."""
    console = Console()
    lines = [f"- {key}: {value}" for key, value in facts.items()]
    lines += [
        "",
        "| " + " | ".join(COLUMNS) + " |",
        "|" + "---|" * len(COLUMNS),
    ]
    table = Table(*COLUMNS)
    for row in rows:
        for k, timing in enumerate(row.timings):
            cells = [row.task if k == 0 else "", timing.name, *figures(row, timing)]
            table.add_row(*cells)
            lines.append("| " + " | ".join(cells) + " |")
        table.add_section()
    notes = [f"- {row.task}: {row.note}" for row in rows if row.note]
    lines += ["", *notes] if notes else []
    for key, value in facts.items():
        console.print(f"[dim]{key}:[/dim] {value}", highlight=False)
    console.print(table)
    for note in notes:
        console.print(note, highlight=False)
    if folder is None:
        return
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "peers.md").write_text("\n".join(lines) + "\n")
    content = {"facts": facts, "comparisons": [asdict(row) for row in rows]}
    (folder / "peers.json").write_text(json.dumps(content, indent=1) + "\n")
    console.print(f"written to {folder}/peers.md and peers.json")


def figures(row: Row, timing: Timing) -> list[str]:
    """Minimum, median, ratio, bar and difference of a contender as text."""
    if timing.minimum is None:
        return [f"missing: {timing.missing}", "", "", "", ""]
    ratio = "1" if timing.ratio is None else f"{timing.ratio:.2f} ({timing.median_ratio:.2f})"
    bar = "" if row.bar is None or timing.ratio is None else f"{row.bar:g}"
    difference = "" if timing.difference is None else f"{timing.difference:.0e}"
    times = [f"{time:.4g} {row.unit}" for time in (timing.minimum, timing.median)]
    return [*times, ratio, bar, difference]
