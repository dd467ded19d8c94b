"""The command ``tactid study``: many simulations of one experiment, and the errors of methods."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, cast

import typer

from tactid._base.text_table import empty_table
from tactid._base.values import UNITS
from tactid._cli import option_flags
from tactid._cli.command import interruptible
from tactid._cli.console import print_whole
from tactid._cli.fleet_command import run_tasks
from tactid._fleet import study
from tactid._fleet.rows import rows_of
from tactid._fleet.run import check_scheduler
from tactid._fleet.table import rows_at
from tactid._native import VALUE_NAMES, Experiment
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
        check_scheduler(scheduler, "--scheduler")
        truth = Experiment.from_file(experiment)
        given = option_flags.read(options, "log")
        named = cast(list[Method], [name.strip() for name in methods.split(",")])
        tasks = study.tasks_of_study(experiment, seeds, named, given)
        rows = rows_at(out, (task.recording for task in tasks))
    code = run_tasks(tasks, rows, out, scheduler, "identification")
    errors = study.study_errors(rows_of(rows.all(), tasks), truth)
    if errors:
        _print_errors(errors)
    raise typer.Exit(code)


def _print_errors(errors: Sequence[study.StudyErrors]) -> None:
    table = empty_table()
    for heading in ("method", "value", "unit", "runs", "rms error", "bias", "inside 95 %"):
        table.add_column(heading, justify="left" if heading in ("method", "value") else "right")
    units = dict(zip(VALUE_NAMES, UNITS, strict=True))
    for each in errors:
        rms, bias = f"{each.rms:#.3g}".rstrip("."), f"{each.bias:#.2g}".rstrip(".")
        numbers = (f"{each.runs}", rms, bias, f"{each.coverage:.1%}")
        table.add_row(each.method, each.value, units[each.value], *numbers)
    print_whole(table)


option_flags.show(
    run_study,
    option_flags.parameters(
        [each for each in options_for("log") if each.name not in study.NOT_OF_A_STUDY]
    ),
    last=("seeds", "methods", "out", "scheduler"),
)
