"""The estimators against noise, over time, and against the Cramér-Rao bound.

Run by `make bench-study`. One motion of all six joints is simulated without noise and the noise
drawn anew for each run: a table for each level and method, the bound beside it, and the picture
study.png. The recursive filters LMS, NLMS and RLS are compared on the same rows of that motion.
Then the same with the paper's experiment, which moves one joint at a time, and with its filter.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from recorded import FINGERS, METHODS, Array, Recorded, scales
from rich.console import Console
from rich.progress import track
from rich.table import Table

import tactid
from tactid._base.values import values_of

RUNS = 20
BOUND_RUNS = 100
LEVELS = [0.0, 0.001, 0.01, 0.05]
SECONDS = [1.0, 2.0, 5.0, 10.0]
PAPER_RUNS = 5
ESTIMATORS = {
    **{method: (method, "least-squares") for method in METHODS},
    "NLMS, tactile": ("tactile", "nlms"),
}
STEP = 1e-3


def main() -> None:
    """Prints the tables and draws the picture."""
    together = Trial.of(tactid.Experiment.from_file(Path(__file__).with_name("all_joints.toml")))
    console = Console(width=110)
    everywhere = {
        (level, method): together.errors(method, level)
        for level in LEVELS
        for method in track(METHODS, f"noise {100 * level:g} %", console=Console(stderr=True))
    }
    console.print(table("noise on every channel: rms error in %, the worst of ten", everywhere))
    title = "1 % on every channel, combined: rms error in %"
    console.print(each(title, rms_of(everywhere[0.01, "combined"])))
    console.print(bias_table(everywhere))
    bound = np.array([limit(together, 0.01, s) for s in SECONDS])
    title = "1 % on the wrenches alone, tactile: Cramér-Rao bound in %"
    console.print(each(title, bound))
    for what, options in (
        ("noise learnt from the residuals", {}),
        ("noise given", {"wrench_noise": together.recorded.wrench_std_dev(0.01)}),
    ):
        progress = track(range(BOUND_RUNS), what, console=Console(stderr=True))
        wrench = together.errors("tactile", 0.01, motion=False, seeds=progress, **options)
        title = f"rms error of {BOUND_RUNS} draws over the bound, {what}"
        console.print(each(title, rms_of(wrench) / bound, ".2f"))
    console.print(filter_table(together))
    draw(everywhere, Path("study.png"))
    console.print(one_at_a_time(Trial.of(tactid.Experiment.paper())))


@dataclass(frozen=True)
class Trial:
    """A recorded motion with its robot and the payload that is to be found."""

    recorded: Recorded
    robot: tactid.Manipulator
    payload: tactid.MassProperties

    @classmethod
    def of(cls, experiment: tactid.Experiment) -> "Trial":
        """Simulates an experiment without noise."""
        robot = tactid.Manipulator.from_urdf(experiment.urdf, "floating")
        return cls(Recorded.of(experiment), robot, experiment.payload)

    def errors(
        self,
        method: str,
        level: float,
        *,
        motion: bool = True,
        estimator: str = "least-squares",
        seconds: Sequence[float] = SECONDS,
        seeds: Iterable[int] = range(RUNS),
        **options: object,
    ) -> Array:
        """Returns errors in %, (seeds, seconds, 10). Methods and estimators see the same noise."""
        found = []
        for seed in seeds if level > 0 else [0]:
            other, random = level * motion, np.random.default_rng(seed)
            noisy = self.recorded.with_noise(random, wrench=level, motion=other, effort=other)
            results = [noisy.identify(self.robot, method, s, estimator, **options) for s in seconds]
            found.append([result.estimate.values for result in results])
        return 100 * (np.array(found) - values_of(self.payload)) / scales(self.payload)


def rms_of(errors: Array) -> Array:
    """Returns the rms errors over the runs, (seconds, 10)."""
    return np.sqrt(np.mean(errors**2, axis=0))


def limit(trial: Trial, level: float, seconds: float) -> Array:
    """Least possible standard deviations in % with noise on the wrenches alone, without bias.

    (Σ YᵀΩ⁻¹Y)⁻¹, brought to the ten values by their derivatives.
    """
    recorded, robot, payload = trial.recorded, trial.robot, trial.payload
    rows = slice(0, int(seconds / STEP) + 1)
    regressor = recorded.regressor(robot)[rows]
    noise = wrench_noise(recorded, robot, level)
    white = np.linalg.solve(np.linalg.cholesky(noise), regressor)
    covariance = np.linalg.inv(np.einsum("nki,nkj->ij", white, white))
    parameters = payload.parameters
    slopes = np.empty((10, 10))
    for k in range(10):
        step = 1e-6 * max(abs(parameters[k]), 1.0)
        moved = [parameters + sign * step * np.eye(10)[k] for sign in (1, -1)]
        plus, minus = (np.array(values_of(tactid.MassProperties.from_parameters(p))) for p in moved)
        slopes[:, k] = (plus - minus) / (2 * step)
    std_devs = np.sqrt(np.diag(slopes @ covariance @ slopes.T))
    return 100 * std_devs / scales(payload)


def wrench_noise(recorded: Recorded, robot: tactid.Manipulator, level: float) -> Array:
    """Covariance of the fingers' summed wrench in the tool's frame, about its origin."""
    noise = np.zeros((6, 6))
    fingers = tool_from_fingers(recorded, robot)
    for move, std_devs in zip(fingers, recorded.wrench_std_dev(level), strict=True):
        noise += move @ np.diag(std_devs**2) @ move.T
    return noise


def tool_from_fingers(recorded: Recorded, robot: tactid.Manipulator) -> Array:
    """Matrices (2, 6, 6) that move each finger's wrench to the tool's frame and origin."""
    posture = recorded.q[:1]
    tool_from_world = np.linalg.inv(robot.kinematics("tool0", posture).pose[0])
    moves = []
    for link in FINGERS:
        tool_from_finger = tool_from_world @ robot.kinematics(link, posture).pose[0]
        turn, (x, y, z) = tool_from_finger[:3, :3], tool_from_finger[:3, 3]
        arm = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        moves.append(np.block([[turn, np.zeros((3, 3))], [arm @ turn, turn]]))
    return np.array(moves)


def filter_table(trial: Trial) -> Table:
    """The worst of ten for LMS, NLMS and RLS, each updated once with every row ``Y pi = [f; n]``.

    The motion is exact, and the noise is on the wrenches alone. LMS takes half of the largest step
    size at which no row makes it diverge.
    """
    recorded, robot, payload = trial.recorded, trial.robot, trial.payload
    rows = recorded.regressor(robot).reshape(-1, 10)
    fingers = tool_from_fingers(recorded, robot)
    step = 1.0 / np.square(rows).sum(axis=1).max()
    filters: dict[str, Callable[[], tactid.Estimator]] = {
        "LMS": lambda: tactid.Lms(10, step),
        "NLMS": lambda: tactid.Nlms(10),
        "RLS": lambda: tactid.Rls(10),
    }

    def errors(make: Callable[[], tactid.Estimator], level: float) -> Array:
        found = []
        for seed in range(RUNS) if level > 0 else [0]:
            noisy = recorded.with_noise(np.random.default_rng(seed), wrench=level)
            recursive = make()
            recursive.update(rows, np.einsum("fij,nfj->ni", fingers, noisy.wrench).ravel())
            found.append(values_of(tactid.MassProperties.from_parameters(recursive.parameters)))
        return 100 * (np.array(found) - values_of(payload)) / scales(payload)

    title = f"recursive filters on the same rows, {SECONDS[-1]:g} s: worst rms error in %"
    levels = (f"{100 * level:g} %" for level in LEVELS)
    result = Table("noise on the wrenches", *levels, title=title)
    for name, make in filters.items():
        worst = [rms_of(errors(make, level)).max() for level in LEVELS]
        result.add_row(name, *(f"{value:.3g}" for value in worst))
    return result


def table(title: str, found: dict[tuple[float, str], Array]) -> Table:
    """The worst of ten for each level, method and time."""
    result = Table("noise", "method", *(f"{s:g} s" for s in SECONDS), title=title)
    for (level, method), errors in found.items():
        worst = rms_of(errors).max(axis=1)
        result.add_row(f"{100 * level:g} %", method, *(f"{value:.3g}" for value in worst))
    return result


def each(title: str, numbers: Array, form: str = ".2g") -> Table:
    """Returns a table of the numbers of all ten values, a row for each time."""
    result = Table("after", *tactid.VALUE_NAMES, title=title)
    for seconds, row in zip(SECONDS, numbers, strict=True):
        result.add_row(f"{seconds:g} s", *(f"{value:{form}}" for value in row))
    return result


def bias_table(found: dict[tuple[float, str], Array]) -> Table:
    """The mean error against the standard deviation of one run, at the largest noise."""
    noise = f"{100 * LEVELS[-1]:g} % on every channel, {SECONDS[-1]:g} s"
    title = f"{noise}: bias over standard deviation"
    result = Table("method", *tactid.VALUE_NAMES, title=title)
    for method in METHODS:
        errors = found[LEVELS[-1], method][:, -1]
        ratio = errors.mean(axis=0) / errors.std(axis=0, ddof=1)
        result.add_row(method, *(f"{value:.2f}" for value in ratio))
    return result


def one_at_a_time(trial: Trial) -> Table:
    """The worst of ten for each estimator and level, from the whole run."""
    seconds = float(trial.recorded.time[-1] - trial.recorded.time[0])
    what = f"one joint at a time, {seconds:.0f} s, {PAPER_RUNS} draws"
    title = f"{what}: worst rms error in %"
    levels = (f"{100 * level:g} %" for level in LEVELS)
    result = Table("noise on every channel", *levels, title=title)
    for name, (method, estimator) in track(
        ESTIMATORS.items(), "paper", console=Console(stderr=True)
    ):
        options = {"estimator": estimator, "seconds": [seconds], "seeds": range(PAPER_RUNS)}
        worst = [rms_of(trial.errors(method, level, **options)).max() for level in LEVELS]
        result.add_row(name, *(f"{value:.3g}" for value in worst))
    return result


def draw(found: dict[tuple[float, str], Array], path: Path) -> None:
    """The worst of ten over time, a panel for each level with noise."""
    levels = [level for level in LEVELS if level > 0]
    figure, panels = plt.subplots(
        1, len(levels), figsize=(10, 3.6), sharey=True, layout="constrained"
    )
    for level, panel in zip(levels, panels, strict=True):
        for method in METHODS:
            panel.loglog(SECONDS, rms_of(found[level, method]).max(axis=1), "o-", label=method)
        panel.set_title(f"{100 * level:g} % noise on every channel")
        panel.set_xlabel("time, s")
        panel.grid(visible=True, which="both", alpha=0.3)
    panels[0].set_ylabel("rms error, worst of ten, %")
    panels[0].legend()
    figure.savefig(path, dpi=150)
    print(f"The picture is in {path}.")


if __name__ == "__main__":
    main()
