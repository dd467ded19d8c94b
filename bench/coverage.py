"""How often the 95 % intervals hold the truth: 200 runs of one motion with its noise drawn anew.

Run by `make bench-coverage`. The payload of the paper is a plate, on the border of possible bodies,
where half of all estimates are brought back onto it; a second one lies well inside.
"""

from multiprocessing import Pool
from pathlib import Path

import numpy as np
from recorded import Array, Recorded
from rich.console import Console
from rich.progress import track
from rich.table import Table

import tactid
from tactid._base.values import values_of

RUNS = 200
SECONDS = 2.0
LEVEL = 0.01
CASES = [("tactile", False), ("tactile", True), ("combined", True)]
PAYLOADS = {"plate": [10.0, 0.0, 0.0, 20.0, 0.0, 10.0], "body": [12.0, 0.5, -0.3, 16.0, 0.4, 11.0]}


def main() -> None:
    """Prints the coverage of each value."""
    console = Console(width=130)
    table = Table("payload", "method", "noise on", *tactid.VALUE_NAMES, "impossible")
    what = f"{RUNS} runs of {SECONDS:g} s, {100 * LEVEL:g} % noise"
    table.title = f"{what}: how many 95 % intervals hold the truth, %"
    text = Path(__file__).with_name("all_joints.toml").read_text()
    for name, inertia in PAYLOADS.items():
        experiment = tactid.Experiment.from_toml(f"{text}\n[payload]\ninertia_kg_m2 = {inertia}\n")
        arguments = (Recorded.of(experiment), experiment.urdf, values_of(experiment.payload))
        with Pool(initializer=start, initargs=arguments) as pool:
            for method, motion in CASES:
                seeds = ((seed, method, motion) for seed in range(RUNS))
                runs = pool.imap(run, seeds, chunksize=20)
                progress = track(runs, f"{name}, {method}", RUNS, console=Console(stderr=True))
                inside, possible = zip(*progress, strict=True)
                cover = 100 * np.mean(inside, axis=0)
                noise = "every channel" if motion else "wrenches"
                impossible = str(RUNS - sum(possible))
                table.add_row(name, method, noise, *(f"{c:.1f}" for c in cover), impossible)
    console.print(table)


def start(recorded: Recorded, urdf: str, truth: list[float]) -> None:
    """What each process keeps: robots do not travel between them."""
    run.kept = (recorded, tactid.Manipulator.from_urdf(urdf, "floating"), truth)


def run(case: tuple[int, str, bool]) -> tuple[Array, bool]:
    """Which of the ten values lie inside, and whether the body is possible."""
    seed, method, motion = case
    recorded, robot, truth = run.kept
    other = LEVEL * motion
    random = np.random.default_rng(seed)
    noisy = recorded.with_noise(random, wrench=LEVEL, motion=other, effort=other)
    found = noisy.identify(robot, method, SECONDS)
    low, high = found.estimate.intervals.T
    inside = (low <= truth) & (truth <= high)
    return inside, found.estimate.is_physical


if __name__ == "__main__":
    main()
