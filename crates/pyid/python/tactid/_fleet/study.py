"""Studies: many simulations of one experiment, and the errors of methods on them."""

import hashlib
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tactid._base.errors import ArgumentError
from tactid._base.values import PATHS, Z95, values_of
from tactid._fleet.recordings import Recording
from tactid._fleet.rows import Row, Task, rows_of
from tactid._fleet.run import run, tasks_of
from tactid._fleet.table import rows_at
from tactid._native import VALUE_NAMES, Experiment
from tactid._options.declaration import with_options
from tactid._options.options import OPTIONS, Method, Options, collect


@dataclass(frozen=True)
class Errors:
    """How far the estimates of one value by one method are from the truth."""

    method: str
    value: str
    """Name of the value, one of ``VALUE_NAMES``."""
    runs: int
    """Number of simulations that determine it."""
    rms: float
    """Root mean square of the errors."""
    bias: float
    """Mean error."""
    coverage: float
    """Fraction of the 95 % intervals that contain the truth."""


@with_options(OPTIONS, "log")
def study(
    experiment: Experiment | str | os.PathLike[str],
    /,
    *,
    seeds: int = 100,
    methods: Sequence[Method] = ("tactile",),
    out: str | os.PathLike[str] | None = None,
    client: Any = None,
    options: Options | None = None,
    progress: Callable[[int, int], object] | None = None,
    **keywords: Any,
) -> list[dict[str, Any]]:
    """Simulates an experiment with many seeds, and identifies the payload of each simulation.

    Dask does the work, as that of :func:`tactid.fleet`. The rows are those of a fleet whose
    recordings are the simulations: ``episode`` is the seed, and ``method`` the method.

        rows = tactid.study("experiment.toml", seeds=200, methods=["tactile", "combined"])

    Args:
        experiment: The experiment, or the path of its TOML file.
        seeds: Number of simulations: their seeds are 0, 1, and so on.
        methods: The methods by which the payload of each simulation is identified.
        out: Where the rows are stored: a folder of Parquet files, to which a later call adds what
            is missing; or a ``.csv`` file, which is written anew.
        client: The ``distributed.Client`` of a cluster, or the address of its scheduler. Default:
            a process for each core of this computer.
        options: Options to start from; keywords replace them.
        progress: Called after each simulation with the number of those that are done, and of all.
        **keywords: The fields of :class:`tactid.Options`, as follows. The topics are those of a
            log.

            <options>

    Returns:
        A dictionary for each simulation and method, in the order of the seeds.

    Raises:
        ArgumentError: An option does not apply, or a package is missing.
        OSError: The file cannot be read, or the scheduler cannot be reached.
    """
    own = ("seeds", "methods", "out", "client", "options", "progress")
    collected = collect(options, keywords, "log", own)
    name, described = read_experiment(experiment)
    table = rows_at(None if out is None else Path(out))
    tasks = tasks_of_study(name, described, seeds, methods, collected)
    run(tasks, table, client, progress)
    return rows_of(table.all(), (task.recording for task in tasks))


def read_experiment(given: Experiment | str | os.PathLike[str]) -> tuple[str, Experiment]:
    """Returns the name of an experiment in rows, and the experiment."""
    if isinstance(given, Experiment):
        return "experiment", given
    return os.fspath(given), Experiment.from_file(given)


def tasks_of_study(
    name: str, experiment: Experiment, seeds: int, methods: Sequence[Method], options: Options
) -> list[Task]:
    """Returns the simulations as recordings that are still to be made.

    Raises:
        ArgumentError: There is no seed or no method, or the method is given twice.
    """
    if seeds < 1 or not methods:
        raise ArgumentError("a study has at least one seed and one method")
    if options.method is not None:
        raise ArgumentError(
            "`method` is given besides the methods of the study, which replace it", option="method"
        )
    text = experiment.to_toml()
    tag = hashlib.sha256(text.encode()).hexdigest()[:32]
    recordings = (Recording(name, 0, tag, seed, experiment=text) for seed in range(seeds))
    return tasks_of(recordings, options, methods=tuple(methods))


COMPARED = ("identified", "contradicted")
"""Outcomes whose estimates are compared with the truth."""


def errors_of(rows: Sequence[Row], experiment: Experiment) -> list[Errors]:
    """Returns the errors of each value by each method, in the order of the rows."""
    found = []
    truth = list(zip(VALUE_NAMES, map(".".join, PATHS), values_of(experiment.payload), strict=True))
    for method in dict.fromkeys(row["method"] for row in rows if row["outcome"] in COMPARED):
        own = [row for row in rows if row["method"] == method and row["outcome"] in COMPARED]
        for name, path, true in truth:
            columns = (f"estimate.values.{path}", f"estimate.std_devs.{path}")
            pairs = [tuple(row[column] for column in columns) for row in own]
            known = np.array([pair for pair in pairs if None not in pair], dtype=float)
            if not len(known):
                continue
            errors, half_widths = known[:, 0] - true, Z95 * known[:, 1]
            rms = float(np.sqrt(np.mean(errors**2)))
            inside = float(np.mean(np.abs(errors) <= half_widths))
            found.append(Errors(method, name, len(known), rms, float(errors.mean()), inside))
    return found
