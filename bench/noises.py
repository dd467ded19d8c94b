"""Intervals where noise is coloured or quantised, and `combined` beside each of its parts.

Run by `make bench-noises`. All six joints move at once for a second; the noise is drawn anew for
each run. First, noise of 1 % of the peak on every channel: how many 95 % intervals hold the truth.
Then white noise on motion, wrenches and efforts apart: the error of `combined` relative to the one
of its best part.
"""

from collections import Counter
from functools import partial
from multiprocessing import Pool
from pathlib import Path

import numpy as np
from recorded import METHODS, Array, Noise, Recorded, scales, white
from rich.console import Console
from rich.progress import track
from rich.table import Table

import tactid
from tactid._base.values import values_of

RUNS = 400
MIX_RUNS = 50
SECONDS = 1.0


def coloured(
    correlation: float, values: Array, std_devs: Array, random: np.random.Generator
) -> Array:
    """Noise of the first order, AR(1), with this correlation of neighbouring samples."""
    noise = random.standard_normal(values.shape)
    for k in range(1, len(noise)):
        noise[k] = correlation * noise[k - 1] + np.sqrt(1 - correlation**2) * noise[k]
    return std_devs * noise


def quantised(values: Array, std_devs: Array, random: np.random.Generator) -> Array:
    """Rounding to steps of this standard deviation, and as much as 0.3 of it of white noise."""
    step = np.sqrt(12) * np.where(std_devs > 0, std_devs, 1.0)
    noisy = values + 0.3 * white(values, std_devs, random)
    phase = random.uniform(size=std_devs.shape)
    rounded = (np.round(noisy / step + phase) - phase) * step
    return np.where(std_devs > 0, rounded - values, 0.0)


KINDS: dict[str, Noise] = {
    "white": white,
    "AR(1) 0.5": partial(coloured, 0.5),
    "AR(1) 0.9": partial(coloured, 0.9),
    "quantised": quantised,
}
EVERYWHERE = {"wrench": 0.01, "motion": 0.01, "effort": 0.01}
MIXES = {
    "every channel": EVERYWHERE,
    "wrenches exact": {**EVERYWHERE, "wrench": 0.0},
    "wrenches 20 %": {**EVERYWHERE, "wrench": 0.2},
    "motion alone": {"wrench": 0.0, "motion": 0.01},
    "wrenches alone": {"wrench": 0.01},
    "efforts alone": {"wrench": 0.0, "effort": 0.01},
}


def main() -> None:
    """Prints both tables."""
    text = Path(__file__).with_name("all_joints.toml").read_text()
    experiment = tactid.Experiment.from_toml(text).replace(duration=1.1 * SECONDS)
    console = Console(width=130)
    with Pool(initializer=start, initargs=(Recorded.of(experiment), experiment)) as pool:
        title = f"{RUNS} runs of {SECONDS:g} s: how many 95 % intervals hold the truth, %"
        table = Table("noise", "method", "mean", "least", "largest", "motion", title=title)
        for kind in KINDS:
            cases = [(method, kind, EVERYWHERE) for method in METHODS]
            for (method, *_), runs in zip(cases, all_runs(pool, cases, RUNS, kind), strict=True):
                _, inside, motions = (np.array(part) for part in zip(*runs, strict=True))
                each = 100 * inside.mean(axis=0)
                numbers = (each.mean(), each.min(), each.max())
                table.add_row(kind, method, *(f"{x:.1f}" for x in numbers), counted(motions))
        console.print(table)
        title = (
            f"white noise, {MIX_RUNS} runs of {SECONDS:g} s: error of combined over its best part's"
        )
        table = Table("noise", *tactid.VALUE_NAMES, "worst, %", title=title)
        for name, levels in MIXES.items():
            cases = [(method, "white", levels) for method in METHODS]
            errors = [[run[0] for run in runs] for runs in all_runs(pool, cases, MIX_RUNS, name)]
            rms = np.sqrt(np.mean(np.square(errors), axis=1))
            ratio = rms[-1] / rms[:-1].min(axis=0)
            table.add_row(name, *(f"{x:.2f}" for x in ratio), f"{rms[-1].max():.2g}")
        console.print(table)


def all_runs(pool: Pool, cases: list[tuple], count: int, what: str) -> list[list[tuple]]:
    """Returns the runs of each case."""
    numbered = [(seed, *case) for case in cases for seed in range(count)]
    runs = pool.imap(run, numbered, chunksize=10)
    done = list(track(runs, what, len(numbered), console=Console(stderr=True)))
    return [done[k : k + count] for k in range(0, len(done), count)]


def start(recorded: Recorded, experiment: tactid.Experiment) -> None:
    """What each process keeps: robots do not travel between them."""
    robot = tactid.Manipulator.from_urdf(experiment.urdf, "floating")
    run.kept = (recorded, robot, experiment.payload)


def run(case: tuple[int, str, str, dict[str, float]]) -> tuple[Array, Array, str]:
    """Errors of the ten values in %, which of them lie inside, and how the motion was estimated."""
    seed, method, kind, levels = case
    recorded, robot, payload = run.kept
    noisy = recorded.with_noise(np.random.default_rng(seed), **levels, draw=KINDS[kind])
    found = noisy.identify(robot, method, SECONDS)
    truth = values_of(payload)
    low, high = found.estimate.intervals.T
    error = 100 * (found.estimate.values - truth) / scales(payload)
    return error, (low <= truth) & (truth <= high), found.fit.motion


def counted(motions: Array) -> str:
    """How often the motion was estimated in which way."""
    return ", ".join(f"{count} {name}" for name, count in Counter(motions.tolist()).most_common())


if __name__ == "__main__":
    main()
