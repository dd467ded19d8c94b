"""Runs all comparisons on one core and writes one table; `make bench-peers`.

The libraries are built on all cores before each comparison.

With words as arguments, only the tasks that contain one of them are measured, and no file is
written.
"""

import os
import platform
import subprocess
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from peers import dynamics, estimators, logs, online, python_calls, simulation
from peers.cores import use_one_core
from peers.harness import report, run
from peers.native import BUILD, CXX_FLAGS, compiler

MODULES = (dynamics, estimators, online, python_calls, logs, simulation)
PACKAGES = ("tactid", "pin", "cmeel-eigen", "padasip", "mujoco", "rosbags", "numpy")


def main() -> None:
    """Measures on one core, and reports."""
    chosen = sys.argv[1:]
    use_one_core()
    tasks = [each for module in MODULES for each in module.comparisons()]
    if chosen:
        tasks = [each for each in tasks if any(word in each.task for word in chosen)]
    if not tasks:
        sys.exit(f"no task contains {' or '.join(chosen)}; make bench-peers without words runs all")
    report([run(each) for each in tasks], facts(), None if chosen else BUILD)


def facts() -> dict[str, str]:
    """The machine, the versions and the flags."""
    return {
        "machine": f"{processor()}, {os.cpu_count()} cores, {platform.platform()}",
        "load": f"{os.getloadavg()[0]:.1f} at the end, processes of others included",
        "compilers": f"{first_line('rustc', '--version')}; {first_line(compiler(), '--version')}",
        "flags": f"Rust: {rust_flags()}; C++: {' '.join(CXX_FLAGS)}, and -march=native where said",
        "packages": ", ".join(f"{name} {installed(name)}" for name in PACKAGES),
    }


def rust_flags() -> str:
    """How tactid is compiled: the profile of `bench/Cargo.toml` and what the environment adds."""
    given = os.environ.get("RUSTFLAGS")
    return f"release, thin LTO, baseline {platform.machine()}" + (f", {given}" if given else "")


def processor() -> str:
    """Name of the processor."""
    lines = Path("/proc/cpuinfo").read_text().splitlines() if Path("/proc/cpuinfo").exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor()


def first_line(*command: str) -> str:
    """The first line of what a command prints."""
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
