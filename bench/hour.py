"""An hour at 1 kHz (joints, base, two wrenches): seconds and peak memory of `tactid identify`.

Run by `make bench-hour`, or with a log as the argument. Without one, an hour of the paper's
experiment is simulated first, which takes some minutes and 2 GB of disk.
"""

import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import tactid

HOUR_S = 3600.0


def main() -> None:
    """Prints the log's size, and the time and memory that identification takes."""
    if len(sys.argv) > 1:
        measure(Path(sys.argv[1]))
        return
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "hour.mcap"
        tactid.simulate(tactid.Experiment.paper().replace(duration=HOUR_S), log)
        measure(log)


def measure(log: Path) -> None:
    """Runs the command as a user does, in a process of its own."""
    print(f"{log.stat().st_size / 1e9:.2f} GB")
    command = Path(sys.executable).with_name("tactid")
    start = time.perf_counter()
    subprocess.run([command, "identify", log], check=True, stdout=subprocess.DEVNULL)
    elapsed_s = time.perf_counter() - start
    # The children's largest resident set, in KiB on Linux.
    peak_mb = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * 1024 / 1e6
    print(f"tactid identify: {elapsed_s:.1f} s, {peak_mb:.0f} MB")


if __name__ == "__main__":
    main()
