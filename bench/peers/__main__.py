"""Runs all comparisons on one core and writes one table; `make bench-peers`.

With names as arguments, only the tasks that contain one of them are run.
"""

import os
import platform
import subprocess
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from peers import dynamics, estimators, logs, online, python_calls, simulation
from peers.harness import report, run
from peers.native import BUILD

MODULES = (dynamics, estimators, online, python_calls, logs, simulation)
COMPARISONS = [each.comparisons for each in MODULES]
PACKAGES = ("tactid", "pin", "cmeel-eigen", "padasip", "mujoco", "rosbags", "numpy")


def main() -> None:
    """Pins the process, measures, and reports."""
    chosen = sys.argv[1:]
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    rows = []
    for comparisons in COMPARISONS:
        for comparison in comparisons():
            if not chosen or any(word in comparison.task for word in chosen):
                rows.append(run(comparison))
    report(rows, facts(), BUILD)


def facts() -> dict[str, str]:
    """The machine, the versions and the flags."""
    return {
        "machine": f"{processor()}, {os.cpu_count()} cores, {platform.platform()}",
        "load": f"{os.getloadavg()[0]:.1f} at the end, processes of others included",
        "compilers": f"{first_line('rustc', '--version')}; {first_line('g++', '--version')}",
        "flags": "Rust: release, thin LTO, baseline x86-64; C++: -O3 -DNDEBUG, and -march=native",
        "packages": ", ".join(f"{name} {installed(name)}" for name in PACKAGES),
    }


def processor() -> str:
    """Name of the processor."""
    lines = Path("/proc/cpuinfo").read_text().splitlines() if Path("/proc/cpuinfo").exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor()


def first_line(*command: str) -> str:
    """What a command says first."""
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return f"no {command[0]}"
    return done.stdout.splitlines()[0]


def installed(name: str) -> str:
    """Version of a package."""
    try:
        return version(name)
    except PackageNotFoundError:
        return "missing"


if __name__ == "__main__":
    main()
