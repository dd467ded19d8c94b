"""Eight logs, identified together by one command: seconds on one core, and on all.

It also prints the parallel efficiency.

Run by `make bench-many`. The logs are simulated first, which takes a minute.
"""

import tempfile
from pathlib import Path

from hour import core_sets, counted, identify

import tactid

LOGS = 8
SECONDS = 120.0
ROUNDS = 3


def main() -> None:
    """Prints the best time of some interleaved rounds for each number of cores."""
    with tempfile.TemporaryDirectory() as folder:
        logs = [simulated(Path(folder), seed) for seed in range(LOGS)]
        print(
            f"{LOGS} logs of {SECONDS:g} s, {sum(log.stat().st_size for log in logs) / 1e6:.0f} MB"
        )
        sets = core_sets()
        times = [[identify(logs, cores)[0] for cores in sets] for _ in range(ROUNDS)]
    best = [min(of_set) for of_set in zip(*times, strict=True)]
    for cores, seconds in zip(sets, best, strict=True):
        # Where no cores can be chosen, nothing was measured on one.
        ideal = f", {best[0] / len(cores) / seconds:.2f} of ideal" if cores else ""
        print(f"{seconds:.2f} s on {counted(cores)}{ideal}")


def simulated(folder: Path, seed: int) -> Path:
    """A log of the paper's experiment, with a seed of its own."""
    log = folder / f"{seed}.mcap"
    experiment = tactid.Experiment.paper().replace(duration=SECONDS, seed=seed)
    tactid.simulate(experiment, log)
    return log


if __name__ == "__main__":
    main()
