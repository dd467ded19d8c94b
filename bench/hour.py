"""An hour at 1 kHz (joints, base, two wrenches): seconds and peak memory of `tactid identify`.

Run by `make bench-hour`, or with a log as the argument; on one core and, where there are more, on
all of them. Without a log, an hour of the paper's experiment is simulated first, which takes some
minutes and 2 GB of disk. With `--sqlite`, the same messages are also measured in an SQLite bag,
which `rosbags-convert` writes in some minutes.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import tactid

HOUR_S = 3600.0


def main() -> None:
    """Prints the log's size, and the time and memory that identification takes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("log", nargs="?", type=Path, help="a log to measure")
    parser.add_argument("--sqlite", action="store_true", help="also measure it as an SQLite bag")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        log = given.log or Path(folder) / "hour.mcap"
        if given.log is None:
            tactid.simulate(tactid.Experiment.paper().replace(duration=HOUR_S), log)
        measure(log)
        if given.sqlite:
            bag = Path(folder) / "hour"
            convert = Path(sys.executable).with_name("rosbags-convert")
            subprocess.run([convert, "--src", log, "--dst", bag], check=True)
            measure(bag / "hour.db3")


def measure(log: Path) -> None:
    """Prints the time and the memory that a log takes on one core, and on all."""
    print(f"{log.name}: {log.stat().st_size / 1e9:.2f} GB")
    for cores in core_sets():
        elapsed_s, peak_mb = identify([log], cores)
        print(f"tactid identify: {elapsed_s:.1f} s on {counted(cores)}, {peak_mb:.0f} MB")


def identify(logs: list[Path], cores: set[int]) -> tuple[float, float]:
    """Runs the command as a user does, in a process of its own; returns seconds and megabytes."""
    command = Path(sys.executable).with_name("tactid")
    if cores:  # The process inherits them.
        os.sched_setaffinity(0, cores)
    start = time.perf_counter()
    arguments = [command, "identify", *logs]
    with tempfile.TemporaryFile() as errors:
        process = subprocess.Popen(arguments, stdout=subprocess.DEVNULL, stderr=errors)
        _, status, usage = os.wait4(process.pid, 0)
        elapsed_s = time.perf_counter() - start
        if status != 0:
            errors.seek(0)
            sys.exit(errors.read().decode())
    # The largest resident set is in KiB on Linux.
    return elapsed_s, usage.ru_maxrss * 1024 / 1e6


def counted(cores: set[int]) -> str:
    """Number of cores as text."""
    return f"{len(cores)} core{'s' if len(cores) > 1 else ''}" if cores else "all cores"


def core_sets() -> list[set[int]]:
    """Cores of each run: one, then all that are usable; an empty set where none can be chosen."""
    if not hasattr(os, "sched_getaffinity"):
        return [set()]
    usable = os.sched_getaffinity(0)
    return [{max(usable)}] + ([usable] if len(usable) > 1 else [])


if __name__ == "__main__":
    main()
