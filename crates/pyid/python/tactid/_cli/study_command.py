"""The command ``tactid study``: many simulations of one experiment, and the errors of methods."""

from pathlib import Path
from typing import Annotated, Any, cast, get_args

import typer

from tactid._base.errors import ArgumentError
from tactid._base.text_table import empty_table
from tactid._base.values import UNITS
from tactid._cli import option_flags
from tactid._cli.console import interruptible, notes, print_whole, progress
from tactid._fleet import run as fleet
from tactid._fleet import study
from tactid._fleet.rows import rows_of
from tactid._fleet.table import rows_at
from tactid._native import VALUE_NAMES
from tactid._options.options import Method, options_for


def run_study(
    experiment: Annotated[Path, typer.Argument(help="A TOML file.")],
    seeds: Annotated[int, typer.Option(help="Number of simulations: seeds 0, 1, and so on.")] = 100,
    methods: Annotated[
        str, typer.Option(help="Methods by which each simulation is identified, with commas.")
    ] = "tactile",
    out: Annotated[
        Path,
        typer.Option(
            help="The table: a folder of Parquet files, to which a later run adds what is missing,"
            " or a .csv file."
        ),
    ] = Path("study.parquet"),
    scheduler: Annotated[
        str | None,
        typer.Option(help="Address of a Dask scheduler. Default: a process for each core."),
    ] = None,
    **options: Any,
) -> None:
    """Simulates an experiment with many seeds, and prints the errors of each method.

    The columns of the printed table are the root mean square of the errors, their mean, and the
    fraction of the 95 % intervals that contain the truth.
    """
    with interruptible("no simulation was run"):
        given = option_flags.read({"method": None, **options}, "log")
        name, described = study.read_experiment(experiment)
        tasks = study.tasks_of_study(name, described, seeds, read_methods(methods), given)
        rows = rows_at(out)
    with (
        interruptible(f"{out} has the simulations that are done"),
        progress("simulating", len(tasks)) as done,
    ):
        fleet.run(tasks, rows, scheduler, lambda count, _: done(count))
    found = rows_of(rows.all(), (task.recording for task in tasks))
    table = empty_table()
    for heading in ("method", "value", "unit", "runs", "rms error", "bias", "inside 95 %"):
        table.add_column(heading, justify="left" if heading in ("method", "value") else "right")
    units = dict(zip(VALUE_NAMES, UNITS, strict=True))
    for each in study.errors_of(found, described):
        numbers = (f"{each.runs}", f"{each.rms:.3g}", f"{each.bias:.2g}", f"{each.coverage:.1%}")
        table.add_row(each.method, each.value, units[each.value], *numbers)
    print_whole(table)
    for row in found:
        if row["error"]:
            notes.print(f"seed {row['episode']}: {row['error']}", markup=False)
    notes.print(f"Wrote {out}.", markup=False)


def read_methods(text: str) -> list[Method]:
    """Returns the methods that a text names.

    Raises:
        ArgumentError: One of them is no method, or is named twice.
    """
    names = [name.strip() for name in text.split(",")]
    known = get_args(Method)
    if len(set(names)) < len(names) or not set(names) <= set(known):
        raise ArgumentError(f"--methods is {text}: expected some of {', '.join(known)}, once each")
    return cast(list[Method], names)


option_flags.show(
    run_study,
    option_flags.parameters([each for each in options_for("log") if each.name != "method"]),
    last=("seeds", "methods", "out", "scheduler"),
)
