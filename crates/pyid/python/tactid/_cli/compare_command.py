"""The command ``tactid compare``: every method and estimator on one recording, in one table."""

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table

from tactid._api.comparison import CHOSEN, Attempt, compare
from tactid._base.files import write_atomically
from tactid._base.output_files import check_ending
from tactid._base.text_table import empty_table
from tactid._base.values import nested
from tactid._cli import option_flags, option_text
from tactid._cli.command import interruptible
from tactid._cli.console import (
    check_files,
    notes,
    print_whole,
    print_written,
    progress,
)
from tactid._cli.identify_command import truth_in_frame
from tactid._documents import result_json
from tactid._native import VALUE_NAMES
from tactid._options.options import options_for
from tactid._results.table import percent
from tactid._results.truth import Truth
from tactid._show import reported


def compare_recording(
    log: Annotated[Path, typer.Argument(help="A rosbag2 folder, or an .mcap or .db3 file.")],
    result_file: Annotated[
        Path | None,
        typer.Option("--result", help="A JSON file to write, with every result and reason."),
    ] = None,
    **options: Any,
) -> None:
    """Identifies the payload by every method and estimator that a recording permits."""
    replaced = check_files(
        {"--result": result_file},
        {
            "the log": log,
            "--urdf": options["urdf"],
            "--unloaded": options["unloaded"],
            "--calibration": options["calibration"],
            "--known-tool": option_text.tool_file(options["known_tool"]),
            "--shape": options["shape"],
        },
    )
    check_ending("--result", result_file, ".json")
    with interruptible("no result"), progress("comparing") as done:
        attempts = compare(log, options=option_flags.read(options, "log"), progress=done)
    frame = next(each.result.estimate.frame for each in attempts if each.result is not None)
    truth = truth_in_frame(log, frame)
    print_whole(comparison_table(attempts, truth))
    for attempt in attempts:
        reason = attempt.reason("command-line")
        if reason is not None:
            notes.print(f"{attempt.title}: not possible: {reason}", markup=False)
    if result_file is not None:
        record = comparison_record(attempts, truth)
        write_atomically(result_file, result_json.to_json(record))
        print_written(f"Wrote {result_file}.", replaced)


SCHEMA = "tactid.comparison/2"
"""Name and version of the JSON of a comparison: its results are documents of ``result_schema``."""


def comparison_table(attempts: list[Attempt], truth: Truth | None) -> Table:
    """Returns the table of a comparison: a block for each value, and a row for each result."""
    columns = [
        (attempt.title, reported.column(attempt.result, truth))
        for attempt in attempts
        if attempt.result is not None
    ]
    table = empty_table()
    for heading in ("parameter", "unit", "method"):
        table.add_column(heading, style="dim" if heading == "unit" else "")
    for heading in ("value", "± 95 %"):
        table.add_column(heading, justify="right")
    if truth is not None:
        table.add_column("error %", justify="right")
    titles = [title for title, _ in columns]
    for rows in zip(*(column.rows for _, column in columns), strict=True):
        for place, (title, row) in enumerate(zip(titles, rows, strict=True)):
            name = (row.name, row.unit) if place == 0 else ("", "")
            cells = [*name, title, row.number, row.around]
            if truth is not None:
                cells.append(percent(row.error))
            table.add_row(*cells, end_section=place == len(titles) - 1)
    return table


def comparison_record(attempts: list[Attempt], truth: Truth | None) -> dict[str, Any]:
    """Returns a comparison as JSON has it: results as ``tactid identify --json`` has them."""
    results, impossible = [], []
    for attempt in attempts:
        if attempt.result is None:
            names = {"method": attempt.method, "estimator": attempt.estimator}
            impossible.append(names | {"reason": attempt.reason("command-line")})
            continue
        record = result_json.record(attempt.result, style="command-line")
        if truth is not None:
            errors = reported.column(attempt.result, truth).errors or []
            record["error_percent"] = nested(list(errors)[: len(VALUE_NAMES)])
        results.append(record)
    return {
        "schema": SCHEMA,
        "truth": None if truth is None else nested(truth.actual),
        "results": results,
        "not_possible": impossible,
    }


option_flags.show(
    compare_recording,
    option_flags.parameters(each for each in options_for("log") if each.name not in CHOSEN),
    last=("result_file",),
)
