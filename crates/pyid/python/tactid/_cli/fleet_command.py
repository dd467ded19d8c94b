"""The command ``tactid fleet``: a row of a table for each of many recordings."""

import csv
from collections import Counter
from pathlib import Path
from typing import Annotated, Any

import typer

from tactid._base.errors import ArgumentError
from tactid._base.naming import counted
from tactid._base.output_files import check_report
from tactid._cli import option_flags, option_text
from tactid._cli.console import check_files, interruptible, notes, print_written, progress
from tactid._fleet import run as fleet
from tactid._fleet.analysis import READ
from tactid._fleet.recordings import find
from tactid._fleet.rows import WITH_RESULT, Row
from tactid._fleet.table import read_rows, rows_at
from tactid._options.options import OPTIONS, options_for


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
    robots = [] if table is None else read_robots(table)
    with interruptible("no row was computed"), notes.status("listing"):
        given = option_flags.read(options, "log")
        recordings = find(urls)
        tasks = fleet.tasks_of(recordings, given, robots, split=split)
        rows = Counted(rows_at(out, recordings))
    for pattern in fleet.without_recording(recordings, robots):
        notes.print(f"{pattern} of --table matches no recording.", markup=False)
    with (
        interruptible(f"{out} has the rows that are done"),
        progress("identifying", len(tasks)) as done,
    ):
        before = fleet.run(tasks, rows, scheduler, lambda count, _: done(count))
    notes.print(_summary(len(tasks), rows.outcomes, before, split=split), markup=False)
    notes.print(f"Wrote {out}.", markup=False)
    if rows.outcomes and rows.outcomes.keys().isdisjoint(WITH_RESULT):
        raise typer.Exit(1)


def _summary(count: int, outcomes: Counter[str], before: int, *, split: bool) -> str:
    """Says what has become of recordings, of which some had their rows before."""
    parts = [f"{number} {outcome}" for outcome, number in outcomes.most_common()]
    if split and parts:
        parts[0] = f"{counted(outcomes.total(), 'segment')}, {parts[0]}"
    if before:
        parts.append(f"{before} with a row of an earlier run")
    return f"{counted(count, 'recording')}: {', '.join(parts)}."


class Counted:
    """A table that counts the outcomes of the rows that are added to it."""

    def __init__(self, table: Any) -> None:
        self._table = table
        self.outcomes: Counter[str] = Counter()
        self.stored, self.close = table.stored, table.close

    def add(self, rows: list[Row]) -> None:
        """Adds the rows of a recording."""
        self.outcomes.update(row["outcome"] for row in rows)
        self._table.add(rows)


def read_robots(path: Path) -> list[dict[str, Any]]:
    """Returns what a table says of each robot: a pattern, a name and options.

    Raises:
        ArgumentError: The file cannot be read, or a column is no option.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            lines = list(csv.DictReader(file))
    except (OSError, UnicodeError, csv.Error) as error:
        raise ArgumentError(f"cannot read --table {path}: {error}") from None
    allowed = {option.name: option for option in options_for("log")}
    found = []
    for number, line in enumerate(lines, start=2):
        entry: dict[str, Any] = {}
        for column, text in line.items():
            name = str(column).strip().removeprefix("--").replace("-", "_")
            if name not in (*fleet.ROBOT_KEYS, *allowed):
                raise ArgumentError(
                    f"--table {path} has the column {column}: expected pattern, robot, or an option"
                    " of tactid identify"
                )
            if not (text or "").strip():
                continue
            try:
                option = allowed.get(name)
                entry[name] = text if option is None else option_flags.from_text(option, text)
            except ValueError as error:
                raise ArgumentError(f"--table {path}, line {number}: {error}") from None
        if "pattern" not in entry:
            raise ArgumentError(
                f"--table {path}, line {number} has no pattern: which addresses are the robot's"
            )
        found.append(entry)
    return found


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
