"""The command ``tactid fleet``: a row of a table for each of many recordings."""

import csv
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from tactid._base.errors import ArgumentError
from tactid._base.naming import counted
from tactid._base.output_files import check_report
from tactid._cli import option_flags, option_text
from tactid._cli.command import interruptible
from tactid._cli.console import check_files, notes, print_written, progress
from tactid._fleet import run as fleet
from tactid._fleet.analysis import READ
from tactid._fleet.recordings import Recording, find
from tactid._fleet.rows import WITH_RESULT, Row, Task, key_of
from tactid._fleet.table import Rows, read_rows, rows_at
from tactid._options.options import OPTIONS, options_for

MOST_ERRORS = 3
"""Errors that are printed: the most frequent ones."""

MOST_NAMED = 3
"""Files that a line names: the first ones."""


def identify_fleet(
    urls: Annotated[
        list[str],
        typer.Argument(
            help="Logs, folders of them, patterns, data sets of LeRobot, addresses (s3://, gs://,"
            " az://, https://), and .txt files with a path or an address a line.",
            metavar="URL...",
        ),
    ],
    out: Annotated[
        Path,
        typer.Option(
            help="The table: a folder of Parquet files, to which a later run adds what is new or"
            " has changed, or a .csv file."
        ),
    ] = Path("payloads.parquet"),
    table: Annotated[
        Path | None,
        typer.Option(
            help="A CSV file with a line for each robot: a pattern of addresses, the name of the"
            " robot, and options in columns of their names."
        ),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(help="Address of a Dask scheduler. Default: a process for each core."),
    ] = None,
    split: Annotated[
        bool,
        typer.Option(
            "--split",
            help="Cut each recording where the payload changes: a row for each segment, with the"
            " times at which its payload is held.",
        ),
    ] = False,
    **options: Any,
) -> None:
    """Identifies the payload of each of many recordings, into one table.

    A recording that cannot be identified has a row, too: its outcome and its error. Ctrl-C leaves
    the rows that are done, and the next run goes on.
    """
    if out.suffix.lower() == ".csv":
        inputs = {name: options[name] for name in ("urdf", "unloaded", "calibration")}
        inputs |= {"known_tool": option_text.tool_file(options["known_tool"])}
        named = {OPTIONS[name].flag: path for name, path in inputs.items()}
        check_files({"--out": out}, {"--table": table, **named})
    fleet.check_scheduler(scheduler, "--scheduler")
    robots = [] if table is None else read_robots(table)
    left_out: list[str] = []
    with interruptible("no row was computed"), notes.status("listing"):
        recordings = find(urls, left_out=left_out)
        given = option_flags.read(options, "log")
        tasks = fleet.tasks_of(recordings, given, robots, split=split)
        rows = rows_at(out, recordings)
    _print_unused(left_out, recordings, robots)
    _print_lost(out, tasks)
    raise typer.Exit(run_tasks(tasks, rows, out, scheduler))


def run_tasks(
    tasks: Sequence[Task], table: Rows, out: Path, scheduler: str | None, noun: str = "recording"
) -> int:
    """Runs tasks into the table at a path, and prints what has become of them.

    Returns:
        The exit code: 1 where none of this run has a result.
    """
    rows = Counted(table)
    with (
        interruptible(lambda: rows.so_far(out)),
        progress("identifying", len(tasks)) as done,
    ):
        before = fleet.run(tasks, rows, scheduler, lambda count, _: done(count), _print)
    parts = [f"{number} {outcome}" for outcome, number in rows.outcomes.most_common()]
    if any(task.split for task in tasks) and parts:
        parts[0] = f"{counted(rows.outcomes.total(), 'segment')}, {parts[0]}"
    if before:
        parts.append(f"{before} with a row of an earlier run")
    rows.print_end(f"{counted(len(tasks), noun)}: {', '.join(parts)}.")
    _print(f"Wrote {out}{f': tactid fleet-report {out} shows more' * bool(rows.errors)}.")
    return int(bool(rows.outcomes) and rows.outcomes.keys().isdisjoint(WITH_RESULT))


def _print(text: str) -> None:
    notes.print(text, markup=False)


def _print_unused(
    left_out: Sequence[str], recordings: Sequence[Recording], robots: Sequence[dict[str, Any]]
) -> None:
    """Says what folders have that is not read, and what the table of robots does not match."""
    if left_out:
        _print(
            f"Left out {counted(len(left_out), 'file')} that may be recordings: {_some(left_out)}."
        )
    for pattern, is_hidden in fleet.without_recording(recordings, robots).items():
        matched = "only what earlier lines match" if is_hidden else "no recording"
        _print(f"{pattern} of --table matches {matched}.")
    without = fleet.without_robot(recordings, robots) if robots else []
    if without:
        count = counted(len(without), "recording")
        _print(f"No line of --table matches {count}: {_some(without)}.")


def _some(names: Sequence[str]) -> str:
    others = f" and {counted(len(names) - MOST_NAMED, 'other')}" * (len(names) > MOST_NAMED)
    return ", ".join(names[:MOST_NAMED]) + others


def _print_lost(out: Path, tasks: Sequence[Task]) -> None:
    """Says that a file has rows of recordings that are not those of a run."""
    if out.suffix.lower() != ".csv" or not out.is_file():
        return
    keys = {task.key for task in tasks}
    lost = [row for row in read_rows(out) if key_of(row) not in keys]
    if lost:
        _print(
            f"{out} has {counted(len(lost), 'row')} of other recordings, which this run leaves"
            " out: a folder of Parquet files keeps them."
        )


class Counted:
    """A table that counts the outcomes and the errors of the rows that are added to it."""

    def __init__(self, table: Rows) -> None:
        self._table = table
        self.outcomes: Counter[str] = Counter()
        self.errors: Counter[str] = Counter()
        self._examples: dict[str, str] = {}
        self.stored, self.close = table.stored, table.close

    def add(self, rows: list[Row]) -> None:
        """Adds the rows of a recording."""
        self.outcomes.update(row["outcome"] for row in rows)
        for row in rows:
            if row.get("error"):
                error = row["error"]
                if row.get("seed") is not None:
                    error = f"{row['method']}: {error}"
                reason = error.replace(row["address"], "")
                self.errors[reason] += 1
                self._examples.setdefault(reason, error)
        self._table.add(rows)

    def so_far(self, out: Path) -> str:
        """Returns how many rows a run has added to a table that it leaves."""
        count = self.outcomes.total()
        return f"{out} has {counted(count, 'row')} of this run" if count else "no row was computed"

    def print_end(self, summary: str) -> None:
        """Prints a summary and the most frequent errors; the address makes no other error."""
        _print(summary)
        for reason, count in self.errors.most_common(MOST_ERRORS):
            _print(f"{count} {'time' if count == 1 else 'times'}: {self._examples[reason]}")
        others = len(self.errors) - MOST_ERRORS
        if others > 0:
            verb = "is" if others == 1 else "are"
            _print(f"There {verb} {counted(others, 'other error')}.")


def read_robots(path: Path) -> list[dict[str, Any]]:
    """Returns what a table says of each robot: a pattern, a name and options.

    Raises:
        ArgumentError: The file cannot be read, or a column is no option.
    """
    heads, lines = _lines(path)
    names = [str(head).strip().removeprefix("--").replace("-", "_") for head in heads]
    for place, head in enumerate(heads):
        if names[place] in names[:place]:
            raise ArgumentError(f"--table {path} has the column {head} twice: expected it once")
    allowed = {option.name: option for option in options_for("log")}
    found: list[dict[str, Any]] = []
    for number, line in lines:
        entry = Robot(place=f"--table {path}, line {number}")
        for column, name, text in zip(heads, names, line, strict=True):
            if name not in (*fleet.ROBOT_KEYS, *allowed):
                raise ArgumentError(
                    f"--table {path} has the column {column}: expected pattern, robot, or an option"
                    " of tactid identify"
                )
            if not text.strip():
                continue
            try:
                option = allowed.get(name)
                entry[name] = text if option is None else option_flags.from_text(option, text)
            except ValueError as error:
                raise ArgumentError(f"{entry.place}: {error}") from None
        if "pattern" not in entry:
            raise ArgumentError(f"{entry.place} has no pattern: which addresses are the robot's")
        found.append(entry)
    return found


def _lines(path: Path) -> tuple[list[str], list[tuple[int, list[str]]]]:
    """Returns the heads of a table of robots, and the cells of its lines with their numbers.

    Raises:
        ArgumentError: It cannot be read, has no line, or a line has another number of cells.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            reader = csv.reader(file)
            lines = [(reader.line_num, line) for line in reader if any(map(str.strip, line))]
    except OSError as error:
        raise ArgumentError(f"cannot read --table {path}: {error.strerror}") from None
    except (UnicodeError, csv.Error):
        raise ArgumentError(f"--table {path} is no CSV file in UTF-8") from None
    if len(lines) < 2:
        raise ArgumentError(
            f"--table {path} has no line of a robot: expected a line with the names of the columns"
            " (pattern, robot, and options), and one for each robot"
        )
    heads = lines[0][1]
    if len(heads) == 1 and ";" in heads[0]:
        raise ArgumentError(f"--table {path} separates cells by semicolons: expected commas")
    for number, line in lines:
        if len(line) != len(heads):
            raise ArgumentError(
                f"--table {path}, line {number} has {len(line)} cells, but the table has"
                f" {counted(len(heads), 'column')}"
            )
    return heads, lines[1:]


class Robot(dict[str, Any]):
    """What a line of a table says of a robot: an entry of ``robots``."""

    def __init__(self, place: str) -> None:
        super().__init__()
        self.place = place


option_flags.show(
    identify_fleet,
    option_flags.parameters(options_for("log")),
    last=("out", "table", "split", "scheduler"),
)


def report_fleet(
    table: Annotated[Path, typer.Argument(help="The table that tactid fleet has written.")],
    out: Annotated[Path, typer.Option(help="The HTML file to write.")] = Path("fleet.html"),
) -> None:
    """Writes a report of the table of a fleet: payloads, changes, drift and what to look at."""
    check_report("--out", out, None, has_figures=False)
    replaced = check_files({"--out": out}, {"the table": table})
    with interruptible("no report was written"), notes.status("drawing"):
        from tactid._fleet import report  # imports matplotlib, which takes a while to load

        report.write_report(read_rows(table, READ), out)
    print_written(f"Wrote {out}.", replaced)
