"""Simulation of experiments, which replaces no input."""

import os
import tomllib
from collections.abc import Callable
from pathlib import Path

from tactid import _native
from tactid._native import Experiment
from tactid.console import notes
from tactid.naming import abridged
from tactid.output_files import check_outputs
from tactid.records import RunReport
from tactid.run_report import active_text, base_text


def simulate(
    experiment: Experiment,
    out: str | os.PathLike[str],
    *,
    progress: Callable[[float], object] | None = None,
) -> RunReport:
    """Simulates an experiment and writes its log.

    The log is a rosbag2 MCAP file as a real robot would record it. Equal experiments give the same
    log, byte for byte. With active excitation the run ends when the payload is identified and the
    arm rests.

    Args:
        experiment: Experiment to simulate.
        out: The ``.mcap`` file to write, which replaces an existing one.
        progress: Called with the fraction done, about twenty times a second. An exception that it
            raises stops the run, as Ctrl-C does; the log is then complete up to there.

    Returns:
        How the run went.

    Raises:
        ArgumentError: The folder of ``out`` does not exist, or ``out`` is one of
            the experiment's files.
        ExperimentError: The experiment or its robot is impossible.
        SimulationError: The payload slipped, a check exceeded its bound, or the motion of active
            excitation cannot be planned. The log up to there has the name of ``out`` with
            ``.failed.mcap`` instead of ``.mcap``.
        LogError: The log cannot be written.
    """
    check_outputs({"`out`": Path(out)}, files_of(experiment))
    return RunReport(**_native.simulate(experiment, out, progress=progress))


def print_outcome(report: RunReport, experiment: Experiment) -> bool:
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
    active = tomllib.loads(experiment.to_toml())["excitation"].get("active", {})
    base = base_text(report, active)
    if base is not None:
        notes.print(base.sentence, markup=False)
        is_contradicted |= base.is_exceeded
    return is_contradicted


def files_of(experiment: Experiment) -> dict[str, Path]:
    """Returns the files that an experiment names, by what they are."""
    fields = tomllib.loads(experiment.to_toml())
    named = {
        "the experiment's URDF": fields["robot"].get("urdf"),
        "the experiment's motion": fields["excitation"].get("file"),
    }
    return {what: Path(name) for what, name in named.items() if name is not None}
