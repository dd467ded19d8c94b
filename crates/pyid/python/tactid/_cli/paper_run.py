"""The paper's experiment from log to report."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, get_args

from tactid._api.offline import identify
from tactid._api.result import PaperIdentification
from tactid._api.simulation import simulate
from tactid._base.errors import LogError
from tactid._base.files import write_atomically
from tactid._base.output_files import FigureFormat
from tactid._base.values import nested
from tactid._documents import result_json
from tactid._native import Experiment, LogInfo
from tactid._options.options import Estimator, Method
from tactid._results import table
from tactid._results.identification import Recorded
from tactid._results.records import RunReport
from tactid._results.truth import Truth, momentum_drift, read_truth
from tactid._show import paper_plots, paper_report
from tactid._show.drawing import Figures
from tactid._show.remarks import remarks

TITLES: dict[tuple[Method, Estimator], str] = {
    ("tactile", "nlms"): "NLMS",
    ("tactile", "least-squares"): "least squares",
    ("joint-sensing", "least-squares"): "joint sensing, least squares",
}


@dataclass(frozen=True)
class Files:
    """The files that a run writes into its folder."""

    folder: Path
    form: FigureFormat = "png"
    """Format of the figures."""

    @property
    def log(self) -> Path:
        """Path of the log: the measurements, and the truth as metadata."""
        return self.folder / "run.mcap"

    @property
    def result(self) -> Path:
        """Path of the results as JSON: estimate, truth, errors and diagnostics."""
        return self.folder / "result.json"

    @property
    def report(self) -> Path:
        """Path of the report: the results as an HTML page with figures."""
        return self.folder / "report.html"

    @property
    def written(self) -> list[Path]:
        """Paths of all files, of which the log is the first."""
        return [self.log, self.result, self.report, *self.figures(self.form)]

    def listed(self) -> str:
        """Lists the files that are there, each of which was written as a whole."""
        return ", ".join(str(file) for file in self.written if file.exists())

    def figures(self, form: FigureFormat) -> list[Path]:
        """Paths of the figures in a format."""
        return [self.figure(name, form) for name in paper_plots.FIGURES.values()]

    def figure(self, name: str, form: FigureFormat) -> Path:
        """Path of a figure in a format."""
        return self.folder / f"{name}.{form}"

    def remove_results(self) -> None:
        """Removes the result, the report and the figures of an earlier run, in any format."""
        earlier = [path for form in get_args(FigureFormat) for path in self.figures(form)]
        for file in (self.result, self.report, *earlier):
            file.unlink(missing_ok=True)


def simulate_into(
    files: Files, experiment: Experiment, progress: Callable[[float], None]
) -> RunReport:
    """Simulates the experiment and writes its log.

    Once the log has been replaced, the results of an earlier run do not belong to it and are
    removed, even if the simulation then stops. An experiment that is refused leaves every file.
    """
    before = _version(files.log)
    try:
        return simulate(experiment, files.log, progress=progress)
    finally:
        if _version(files.log) != before:
            files.remove_results()


def _version(file: Path) -> tuple[int, int, int] | None:
    """Returns values that differ once a file has been written again; None without a file."""
    try:
        status = file.stat()
    except FileNotFoundError:
        return None
    return status.st_ino, status.st_mtime_ns, status.st_size


def identify_all(
    log: Path, tip: str, estimator: Estimator, progress: Callable[[float], None]
) -> list[Recorded]:
    """Identifies from one log by each method and estimator; the chosen estimator comes first."""
    runs = sorted(TITLES, key=lambda run: run != ("tactile", estimator))

    def identify_by(index: int) -> Recorded:
        method, chosen = runs[index]
        return identify(
            log,
            tip=tip,
            method=method,
            estimator=chosen,
            progress=lambda done: progress((index + done) / len(runs)),
        )

    return [identify_by(index) for index in range(len(runs))]


@dataclass
class Outcome:
    """The results of one run."""

    experiment: Experiment
    run: RunReport
    results: list[Recorded]
    info: LogInfo
    truth: Truth = field(init=False)
    columns: list[table.Column] = field(init=False)

    def __post_init__(self) -> None:
        truth = read_truth(self.info)
        if truth is None:
            raise LogError("the log does not say what the payload really is")
        self.truth = truth
        self.columns = [self._column(result) for result in self.results]

    def _column(self, result: Recorded) -> table.Column:
        values = result.estimate.reported_values
        title = TITLES[result.method, result.estimator]
        return table.Column(title, values, self.truth.errors_percent(values))

    @property
    def remarks(self) -> list[str]:
        """Sentences that a reader must know to trust the numbers."""
        return remarks(self.results[0], "command-line")

    def record(self) -> dict[str, Any]:
        """Returns the content of ``result.json``."""
        first, column = self.results[0], self.columns[0]
        others = {column.title: nested(column.values) for column in self.columns[1:]}
        record = result_json.record(first, style="command-line", checks=result_json.plain(self.run))
        return record | {
            "truth": nested(self.truth.actual),
            "error_percent": nested(column.errors or []),
            "other_estimates": others,
        }

    def write(self, files: Files) -> None:
        """Writes result, figures and report."""
        write_atomically(files.result, result_json.to_json(self.record()))
        history = paper_plots.History.of(self.results[0], driving_phases(self.experiment))
        figures = Figures(files.form)
        shown = "".join(
            figures.html(name, drawn, paper_report.CAPTIONS[name])
            for name, drawn in paper_plots.figures(history, self.truth).items()
        )
        for name, content in figures.files.items():
            write_atomically(files.figure(name, files.form), content)
        experiment = self.experiment.to_toml()
        page = paper_report.Report(
            self.truth, self.columns, self._facts(), self.remarks, experiment, shown
        )
        write_atomically(files.report, paper_report.render(page))

    def _facts(self) -> dict[str, str]:
        run, result = self.run, self.results[0]
        facts = {
            "end-effector frame": self.experiment.tip,
            "simulated time": f"{run.simulated_time_s:g} s in {run.steps} steps",
            "wall time": f"{run.wall_time_s:.1f} s, {run.steps_per_second:.0f} steps a second",
            "momentum drift": momentum_drift(run),
            "grasp drift": f"{run.grasp_drift_m * 1e6:.2f} µm,"
            f" {run.grasp_drift_rad * 1e6:.2f} µrad",
            "contact readout": f"force {run.newton_residual:.1e}, moment {run.euler_residual:.1e}"
            " off the payload's Newton-Euler equations",
            "grip force": f"{run.grip_force_n:.0f} N a finger",
        }
        if isinstance(result, PaperIdentification):
            excitation = result.singular_values
            facts["singular values, mass"] = _numbers(excitation.mass) + " m/s²"
            facts["singular values, inertia"] = _numbers(excitation.inertia) + " rad/s²"
        return facts


def _numbers(values: Any) -> str:
    return ", ".join(f"{value:.3g}" for value in values)


def driving_phases(experiment: Experiment) -> list[paper_plots.Phase]:
    """Returns which joint is driven when."""
    excitation = experiment.to_dict()["excitation"]
    names = [joint["name"].replace("_", " ") for joint in excitation["joints"]]
    if excitation["mode"] != "sequence" or not names:
        return []
    phase = experiment.duration / len(names)
    return [paper_plots.Phase(i * phase, (i + 1) * phase, name) for i, name in enumerate(names)]
