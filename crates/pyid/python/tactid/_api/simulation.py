"""Simulation of experiments, which replaces no input."""

import os
from collections.abc import Callable
from pathlib import Path

from tactid import _native
from tactid._base.output_files import check_ending, check_outputs
from tactid._native import Experiment
from tactid._results.records import RunReport


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
        ArgumentError: The folder of ``out`` does not exist, its name does not end in ``.mcap``, or
            it is one of the experiment's files.
        ExperimentError: The experiment or its robot is impossible.
        SimulationError: The payload slipped, a check exceeded its bound, or the motion of active
            excitation cannot be planned. The log up to there has the name of ``out`` with
            ``.failed.mcap`` instead of ``.mcap``.
        LogError: The log cannot be written.
    """
    check_outputs({"`out`": Path(out)}, files_of(experiment))
    check_ending("`out`", Path(out), ".mcap")
    return RunReport(**_native.simulate(experiment, out, progress=progress))


FILES = {
    "the experiment's URDF": ("robot", "urdf"),
    "the experiment's motion": ("excitation", "file"),
}
"""Table and field of each file that an experiment may name, by what it is."""


def files_of(experiment: Experiment) -> dict[str, Path]:
    """Returns the files that an experiment names, by what they are."""
    fields = experiment.to_dict()
    named = {what: fields[table].get(name) for what, (table, name) in FILES.items()}
    return {what: Path(name) for what, name in named.items() if name is not None}
