"""Studies: many simulations of one experiment, and the errors of methods on them."""

import hashlib
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, cast, get_args

import numpy as np

from tactid._api.simulation import FILES, files_of
from tactid._base.errors import ArgumentError
from tactid._base.field_docs import with_fields
from tactid._base.values import PATHS, values_of
from tactid._fleet.recordings import Recording, content_of
from tactid._fleet.rows import Row, Task
from tactid._fleet.run import completed, tasks_of
from tactid._native import VALUE_NAMES, Experiment
from tactid._options.declaration import with_options
from tactid._options.options import OPTIONS, Method, Options, collect


@with_fields
@dataclass(frozen=True)
class StudyErrors:
    """How far the estimates of one value by one method are from the truth."""

    method: str
    """The method, by its name in the rows."""
    value: str
    """Name of the value, one of ``VALUE_NAMES``."""
    runs: int
    """Number of simulations that determine it."""
    rms: float
    """Root mean square of the errors, in the unit of the value: kg, m or kg m²."""
    bias: float
    """Mean of the errors, in the unit of the value; the error of a larger estimate is positive."""
    coverage: float
    """Fraction of the 95 % intervals that contain the truth."""


COMPARED = ("identified", "contradicted")
"""Outcomes whose estimates are compared with the truth."""

NOT_OF_A_STUDY = {
    "method": "`methods` are those of the study",
    "columns": "its simulations are logs",
    "episode": "its simulations are logs",
    "known_tool": "the truth is the whole payload of the experiment",
    "known_tool_std_dev": "the truth is the whole payload of the experiment",
}
"""Options of a log that a study does not have, and why."""


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
    recordings are the simulations, by their ``seed`` and ``method``. The tip is the tool of the
    experiment; a ``urdf`` is the model by which its simulations are identified.

        rows = tactid.study("experiment.toml", seeds=200, methods=["tactile", "combined"])
        errors = tactid.study_errors(rows, "experiment.toml")

    Args:
        experiment: The experiment, or the path of its TOML file. In rows, ``address`` is that path,
            or another name for each other experiment.
        seeds: Number of simulations: their seeds are 0, 1, and so on.
        methods: The methods by which the payload of each simulation is identified.
        out: Where the rows are stored: a folder of Parquet files, to which a later call adds what
            is missing; or a ``.csv`` file, which is written anew.
        client: The ``distributed.Client`` of a cluster, or the address of its scheduler. Default:
            a process for each core of this computer.
        options: Options to start from; keywords replace them.
        progress: Called after each simulation with the number of identifications that are done,
            and of all.
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
    return completed(tasks_of_study(experiment, seeds, methods, collected), out, client, progress)


def tasks_of_study(
    given: Experiment | str | os.PathLike[str],
    seeds: int,
    methods: Sequence[Method],
    options: Options,
) -> list[Task]:
    """Returns the simulations as recordings that are still to be made, by each method.

    Raises:
        ArgumentError: There is no seed or no method, a method is given twice or is none, or an
            option does not apply.
    """
    experiment = _read(given)
    _check(experiment, seeds, methods, options)
    # The seeds are those of the study; what files say counts, and not only their names.
    said = experiment.replace(seed=0).to_toml()
    contents = [content_of(path) for path in files_of(experiment).values()]
    tag = hashlib.sha256("\n".join([said, *contents]).encode()).hexdigest()[:32]
    name = f"experiment {tag[:8]}"
    address = name if isinstance(given, Experiment) else os.path.abspath(given)
    recordings = [Recording(address, 0, tag, experiment=said, seed=seed) for seed in range(seeds)]
    options = options.replace(tip=experiment.tip)
    each = [tasks_of(recordings, options.replace(method=method)) for method in methods]
    return [task for of_seed in zip(*each, strict=True) for task in of_seed]


def _read(given: Experiment | str | os.PathLike[str]) -> Experiment:
    """Returns an experiment with absolute paths, because a worker may be in another folder."""
    experiment = given if isinstance(given, Experiment) else Experiment.from_file(given)
    fields = experiment.to_dict()
    paths = {
        table: {name: os.path.abspath(fields[table][name])}
        for table, name in FILES.values()
        if name in fields[table]
    }
    return experiment.replace(**cast(Any, paths))


def _check(experiment: Experiment, seeds: int, methods: Sequence[Method], options: Options) -> None:
    """Checks what is asked of a study.

    Raises:
        ArgumentError: It is refused.
    """
    if seeds < 1:
        raise ArgumentError(f"`seeds` is {seeds}: expected at least 1", option="seeds")
    known = get_args(Method)
    is_list = not isinstance(methods, str) and methods
    if not is_list or len(set(methods)) < len(methods) or not set(methods) <= set(known):
        said = methods if isinstance(methods, str) else ", ".join(map(str, methods))
        raise ArgumentError(
            f"`methods` is {said}: expected a list of some of {', '.join(known)}, once each",
            option="methods",
        )
    for name, reason in NOT_OF_A_STUDY.items():
        if name in options.given:
            raise ArgumentError(f"`{name}` does not apply to a study: {reason}", option=name)
    if options.tip not in (None, experiment.tip):
        raise ArgumentError(
            f"`tip` is {options.tip}, but the true values are those in {experiment.tip}, the tool"
            " of the experiment",
            option="tip",
        )


def study_errors(
    rows: Sequence[Row], experiment: Experiment | str | os.PathLike[str]
) -> list[StudyErrors]:
    """Returns how far the estimates of a study are from the truth.

    Args:
        rows: The rows of :func:`tactid.study`, or those of its table.
        experiment: The experiment, or the path of its TOML file, whose payload is the truth.

    Returns:
        The errors of each value by each method, in the order of the rows.
    """
    experiment = _read(experiment)
    found = []
    truth = list(zip(VALUE_NAMES, map(".".join, PATHS), values_of(experiment.payload), strict=True))
    for method in dict.fromkeys(row["method"] for row in rows if row["outcome"] in COMPARED):
        own = [row for row in rows if row["method"] == method and row["outcome"] in COMPARED]
        for name, path, true in truth:
            columns = (f"estimate.values.{path}", f"estimate.intervals.{path}")
            pairs = [tuple(row[column] for column in columns) for row in own]
            known = [(value, *limits) for value, limits in pairs if value is not None and limits]
            if not known:
                continue
            values, low, high = np.array(known, dtype=float).T
            errors, inside = values - true, (low <= true) & (true <= high)
            rms, bias = float(np.sqrt(np.mean(errors**2))), float(errors.mean())
            found.append(StudyErrors(method, name, len(known), rms, bias, float(inside.mean())))
    return found
