"""How often the 95 % intervals of the effort method hold the truth on a fixed arm under gravity.

Run by `make bench-coverage`. The noise of positions and velocities enters the torques of the arm
itself, which are subtracted from the measured ones, by amounts that depend on the posture. The
motion is analytic and the torques are exact; the noise is drawn anew for each of 400 runs.
"""

from dataclasses import dataclass
from multiprocessing import Pool
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

import tactid
from tactid._base.values import values_of

Array = NDArray[np.float64]

RUNS = 400
SECONDS = 6.0
LEVEL = 0.01
WIDTH = 1.96
RATES = [100.0, 500.0]
MOTIONS = [0, 1, 2]
ARM_JOINTS = 6
POSTURE = np.array([0.2, -1.3, 1.6, -1.2, 1.2, 0.3])
PEAK_SPEED = 1.5
PAYLOAD = tactid.MassProperties.from_values(
    [4.0, 0.05, -0.04, 0.12, 0.05, 0.004, -0.003, 0.06, 0.005, 0.04]
)
SIZES = {
    "std": lambda values: values.std(axis=0),
    "rms": lambda values: np.sqrt(np.mean(values**2, axis=0)),
}


@dataclass(frozen=True)
class Motion:
    """What the sensors of the joints measure: a row an instant."""

    time: Array
    q: Array
    qd: Array
    effort: Array

    @classmethod
    def of(cls, robot: tactid.Manipulator, rate: float, seed: int) -> "Motion":
        """Four sines for each joint of the arm, from 0.1 to 1.5 Hz, without noise."""
        random = np.random.default_rng(seed)
        shape = (ARM_JOINTS, 4)
        angular = 2 * np.pi * random.uniform([0.1, 0.3, 0.6, 1.0], [0.3, 0.6, 1.0, 1.5], shape)
        phase = random.uniform(0, 2 * np.pi, shape)
        time = np.arange(0.0, SECONDS, 1 / rate)
        angle = time[:, None, None] * angular + phase
        scale = PEAK_SPEED / np.abs(np.cos(angle).sum(axis=2)).max(axis=0)
        states = [
            POSTURE + scale * (np.sin(angle) / angular).sum(axis=2),
            scale * np.cos(angle).sum(axis=2),
            -scale * (np.sin(angle) * angular).sum(axis=2),
        ]
        fingers = robot.dof - ARM_JOINTS
        q, qd, qdd = (np.pad(state, [(0, 0), (0, fingers)]) for state in states)
        effort, _ = robot.with_payload("tool0", PAYLOAD).inverse_dynamics(
            q, qd, qdd, gravity=[0.0, 0.0, -9.81]
        )
        return cls(time, q, qd, effort)


def main() -> None:
    """Prints the coverage of each value, and the mean error over its standard deviation."""
    what = f"{RUNS} runs of {SECONDS:g} s, {100 * LEVEL:g} % noise on every channel"
    table = Table("rate", "motion", "noise of", "", *tactid.VALUE_NAMES)
    table.title = f"{what}, effort method: how many 95 % intervals hold the truth, %"
    cases = [(rate, seed, size) for rate in RATES for seed in MOTIONS for size in SIZES]
    for rate, seed, size in cases:
        with Pool(initializer=start, initargs=(rate, seed, size)) as pool:
            errors, std_devs = zip(*pool.imap(run, range(RUNS), chunksize=20), strict=True)
        inside = np.abs(errors) <= WIDTH * np.array(std_devs)
        cover = (f"{100 * value:.1f}" for value in inside.mean(axis=0))
        bias = np.mean(errors, axis=0) / np.std(errors, axis=0)
        table.add_row(f"{rate:g} Hz", str(seed), size, "inside", *cover)
        table.add_row("", "", "", "bias", *(f"{value:.2f}" for value in bias), end_section=True)
    Console(width=130).print(table)


def start(rate: float, seed: int, size: str) -> None:
    """What each process keeps: robots do not travel between them."""
    experiment = tactid.Experiment.from_file(Path(__file__).with_name("all_joints.toml"))
    robot = tactid.Manipulator.from_urdf(experiment.urdf, "fixed")
    run.kept = (robot, Motion.of(robot, rate, seed), SIZES[size])


def run(seed: int) -> tuple[Array, Array]:
    """Errors and standard deviations of the ten values."""
    robot, motion, size = run.kept
    random = np.random.default_rng(seed)

    def noisy(values: Array) -> Array:
        return values + LEVEL * size(values) * random.standard_normal(values.shape)

    estimate = tactid.identify(
        motion.time,
        robot=robot,
        tip="tool0",
        method="effort",
        delay_s=0.0,
        q=noisy(motion.q),
        qd=noisy(motion.qd),
        effort=noisy(motion.effort),
    ).estimate
    return np.array(estimate.values) - values_of(PAYLOAD), np.array(estimate.std_devs)


if __name__ == "__main__":
    main()
