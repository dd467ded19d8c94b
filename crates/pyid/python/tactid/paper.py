"""The paper's experiment from log to report."""

import tomllib
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import tactid
from tactid import plots, report, result, table
from tactid.result import Filter, Way

TITLES: dict[tuple[Way, Filter], str] = {
    ("tactile", "nlms"): "NLMS",
    ("tactile", "rls"): "least squares",
    ("joint-sensing", "rls"): "joint sensing, least squares",
}


@dataclass(frozen=True)
class Files:
    """What a run leaves in its folder."""

    folder: Path

    @property
    def log(self) -> Path:
        """What was measured, and the truth as metadata."""
        return self.folder / "run.mcap"

    @property
    def result(self) -> Path:
        """Estimate, truth, errors and diagnostics."""
        return self.folder / "result.json"

    @property
    def report(self) -> Path:
        """The same for people, with figures."""
        return self.folder / "report.html"

    def remove_results(self) -> None:
        """So that results of another run never stand beside a new log."""
        for file in (self.result, self.report, *self.folder.glob("figure_??.png")):
            file.unlink(missing_ok=True)


def identify_all(
    log: Path, tool: str, estimator: Filter, progress: Callable[[float], None]
) -> list[tactid.Identification]:
    """Identifies from one log in each way; the one asked for comes first."""
    ways = sorted(TITLES, key=lambda way: way != ("tactile", estimator))

    def identify(index: int) -> tactid.Identification:
        way, chosen = ways[index]
        return tactid.identify(
            log,
            tool=tool,
            way=way,
            estimator=chosen,
            progress=lambda done: progress((index + done) / len(ways)),
        )

    return [identify(index) for index in range(len(ways))]


@dataclass
class Outcome:
    """Everything that came of one run."""

    experiment: tactid.Experiment
    run: tactid.RunReport
    found: list[tactid.Identification]
    info: tactid.LogInfo
    truth: result.Truth = field(init=False)
    columns: list[table.Column] = field(init=False)

    def __post_init__(self) -> None:
        truth = result.read_truth(self.info)
        if truth is None:
            raise tactid.LogError("the log does not say what the payload really is")
        self.truth = truth
        self.columns = [self._column(found) for found in self.found]

    def _column(self, found: tactid.Identification) -> table.Column:
        values = result.estimate_values(found)
        title = TITLES[found.way, found.estimator]
        return table.Column(title, values, self.truth.errors_percent(values))

    @property
    def remarks(self) -> list[str]:
        """What a reader must know to trust the numbers."""
        return result.remarks_on(self.found[0])

    def record(self) -> dict[str, Any]:
        """What ``result.json`` holds."""
        first, column = self.found[0], self.columns[0]
        run = {
            "wall_time_s": self.run.wall_time,
            "steps": self.run.steps,
            "steps_per_second": self.run.steps_per_second,
            "grip_force_n": self.run.grip_force,
        }
        others = {column.title: result.nested(column.values) for column in self.columns[1:]}
        return {
            "estimate": result.nested(column.values),
            "truth": result.nested(self.truth.actual),
            "error_percent": result.nested(column.errors or []),
            "estimator": first.estimator,
            "diagnostics": result.diagnostics(first) | result.read_checks(self.info) | run,
            "other_estimates": others,
        }

    def write(self, files: Files) -> None:
        """Writes result, figures and report."""
        result.write_atomically(files.result, result.to_json(self.record()))
        history = plots.History.of(self.found[0], driving_phases(self.experiment))
        figures = plots.figures(history, self.truth)
        for name, png in figures.items():
            result.write_atomically(files.folder / name, png)
        experiment = self.experiment.to_toml()
        page = report.Report(
            self.truth, self.columns, self._facts(), self.remarks, experiment, figures
        )
        result.write_atomically(files.report, report.render(page))

    def _facts(self) -> dict[str, str]:
        run, estimate = self.run, self.found[0].estimate
        return {
            "end-effector frame": self.experiment.tool,
            "simulated time": f"{run.simulated_time:g} s in {run.steps} steps",
            "wall time": f"{run.wall_time:.1f} s, {run.steps_per_second:.0f} steps a second",
            "momentum drift": f"linear {run.linear_momentum_drift:.1e}, angular"
            f" {run.angular_momentum_drift:.1e} of the largest of a single body",
            "grasp drift": f"{run.grasp_drift * 1e6:.2f} µm, {run.grasp_rotation * 1e6:.2f} µrad",
            "contact readout": f"force {run.newton_residual:.1e}, moment {run.euler_residual:.1e}"
            " off the payload's Newton-Euler equations",
            "grip force": f"{run.grip_force:.0f} N a finger",
            "singular values, mass": _numbers(estimate.mass_singular_values) + " m/s²",
            "singular values, inertia": _numbers(estimate.inertia_singular_values) + " rad/s²",
        }


def _numbers(values: Any) -> str:
    return ", ".join(f"{value:.3g}" for value in values)


def driving_phases(experiment: tactid.Experiment) -> list[plots.Phase]:
    """When which joint is driven."""
    excitation = tomllib.loads(experiment.to_toml())["excitation"]
    names = [joint["name"].replace("_", " ") for joint in excitation["joints"]]
    if excitation["mode"] != "sequence" or not names:
        return []
    part = experiment.duration / len(names)
    return [plots.Phase(i * part, (i + 1) * part, name) for i, name in enumerate(names)]
