"""The command ``tactid simulate``."""

from pathlib import Path
from typing import Annotated

import typer

from tactid._api.simulation import files_of, simulate
from tactid._base.errors import ArgumentError
from tactid._base.naming import abridged
from tactid._base.output_files import check_ending
from tactid._cli.console import (
    check_files,
    notes,
    print_written,
    progress,
    reporting_partial_log,
)
from tactid._cli.ros import ros_module
from tactid._native import Experiment
from tactid._results.records import RunReport
from tactid._results.truth import momentum_drift
from tactid._show.run_report import active_text, base_text


def run_simulation(
    experiment: Annotated[
        Path | None, typer.Argument(help="A TOML file; the paper's experiment where left out.")
    ] = None,
    out: Annotated[Path, typer.Option(help="The log to write.")] = Path("run.mcap"),
    motion: Annotated[
        Path | None,
        typer.Option(
            help="A folder that tactid excite wrote, or its trajectory.mcap or .csv: the arm"
            " follows it instead of the experiment's excitation."
        ),
    ] = None,
    publish: Annotated[
        bool,
        typer.Option(
            "--publish",
            help="Publishes an arm with a payload on ROS 2 topics until it is stopped, instead of"
            " writing a log.",
        ),
    ] = False,
) -> None:
    """Simulates an experiment and writes its log.

    With --publish, the built-in arm swings payloads of 2.5 and 1.2 kg in turn, a minute each, and
    is pushed by 15 N for 0.8 s of each minute: topics for tactid live without a robot.

    The exit code is 1 where the payload contradicts the bounds of active excitation, or the base
    exceeds its bound.
    """
    if publish:
        if experiment is not None or motion is not None:
            raise ArgumentError(
                "--publish has an arm and a motion of its own: leave out others (the experiment,"
                " --motion)"
            )
        ros_module("publisher").run()
        return
    chosen = Experiment.paper() if experiment is None else Experiment.from_file(experiment)
    if motion is not None:
        chosen = chosen.following(motion)
    replaced = check_files({"--out": out}, {"the experiment": experiment} | files_of(chosen))
    check_ending("--out", out, ".mcap")
    with reporting_partial_log(out), progress("simulating") as done:
        report = simulate(chosen, out, progress=done)
    print_written(
        f"Wrote {out}: {report.simulated_time_s:g} s in {report.wall_time_s:.1f} s,"
        f" grasp drift {report.grasp_drift_m * 1e6:.1f} µm,"
        f" momentum drift {momentum_drift(report)}.",
        replaced,
    )
    if _print_outcome(report, chosen):
        raise typer.Exit(1)


def _print_outcome(report: RunReport, experiment: Experiment) -> bool:
    """Prints what active excitation has reached and how far the base moved.

    Returns:
        Whether the payload contradicts the bounds that were given for it, or the base exceeded its
        bound.
    """
    is_contradicted = False
    if report.active is not None:
        notes.print(active_text(report.active), markup=False)
        is_contradicted = bool(report.active.contradictions)
        if report.active.untested_shapes:
            shapes = abridged(report.active.untested_shapes)
            notes.print(f"Collisions are not tested for all shapes: {shapes}.", markup=False)
    active = experiment.to_dict()["excitation"].get("active", {})
    base = base_text(report, active)
    if base is not None:
        notes.print(base.sentence, markup=False)
        is_contradicted |= base.is_exceeded
    return is_contradicted
