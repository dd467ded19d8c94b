"""The command ``tactid paper``: the paper's experiment, from the simulation to Table 2."""

from pathlib import Path
from typing import Annotated

import typer

from tactid._base.errors import ArgumentError
from tactid._base.files import new_folder
from tactid._base.output_files import FigureFormat
from tactid._cli.command import interruptible
from tactid._cli.console import (
    check_files,
    notes,
    print_whole,
    print_written,
    progress,
    reporting_partial_log,
)
from tactid._native import Experiment, info as log_info
from tactid._options.options import Estimator
from tactid._results import table


def run_paper(
    out: Annotated[Path, typer.Option(help="Folder for the log and the results.")] = Path(
        "tactid-paper"
    ),
    estimator: Annotated[
        Estimator, typer.Option(help="The paper's filter, or least squares.")
    ] = "nlms",
    frequency: Annotated[
        float | None, typer.Option(help="Frequency of the excitation, Hz: 0.2 in the paper's text.")
    ] = None,
    posture: Annotated[
        str | None,
        typer.Option(
            help="identifiable, table1, or six joint angles in rad: 0,-1.2,1.6,-0.4,1.57,0.",
            metavar="A,A,A,A,A,A",
        ),
    ] = None,
    seed: Annotated[
        int | None, typer.Option(min=0, max=2**63 - 1, help="Seed of the noise on the command.")
    ] = None,
    duration: Annotated[
        float | None, typer.Option(help="Simulated time, s: 300 in the paper.")
    ] = None,
    figures: Annotated[FigureFormat, typer.Option(help="Format of the figures.")] = "png",
) -> None:
    """Runs the paper's experiment: simulates, logs, identifies, and shows Table 2."""
    from tactid._cli import paper_run  # imports matplotlib, which takes a while to load

    experiment = Experiment.paper().replace(
        frequency=frequency,
        posture=None if posture is None else _read_posture(posture),
        seed=seed,
        duration=duration,
    )
    files = paper_run.Files(out, figures)
    with new_folder(out, "--out"), reporting_partial_log(files.log), progress("simulating") as done:
        replaced = check_files({f"{file.name} in --out": file for file in files.written}, {})
        report = paper_run.simulate_into(files, experiment, done)
    with interruptible(lambda: f"what was written is complete: {files.listed()}"):
        with progress("identifying") as done:
            results = paper_run.identify_all(files.log, experiment.tip, estimator, done)
        outcome = paper_run.Outcome(experiment, report, results, log_info(files.log))
        with notes.status("drawing"):
            outcome.write(files)
    print_whole(table.rich_table(outcome.columns[:1], outcome.truth))
    for remark in outcome.remarks:
        notes.print(remark, markup=False)
    wrote = f"Wrote {files.log}, {files.result}, {files.report} and the figures beside them."
    print_written(wrote, replaced)
    if results[0].is_contradicted:
        raise typer.Exit(1)


def _read_posture(text: str) -> str | list[float]:
    if text.replace("_", "").isalnum() and not text[0].isdigit():
        return text
    try:
        return [float(angle) for angle in text.replace(",", " ").split()]
    except ValueError:
        raise ArgumentError(
            f"--posture is {text!r}: expected identifiable, table1, or joint angles in rad"
        ) from None
