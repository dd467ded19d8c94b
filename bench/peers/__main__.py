"""Runs all comparisons on one core and prints each row as it is done; `make bench-peers`.

The libraries are built on all cores before each comparison. The table of a whole run is kept for
each processor in ``docs/theory/notes/peers/``, with every round in ``target/bench/peers.json``.

With words as arguments, only the tasks that contain one of them are measured. With ``--quick``, a
round of each task and no builds for the machine's own processor give a first table in two minutes.
Neither writes a file.
"""

import os
import platform
import re
import subprocess
import sys
import time
from dataclasses import replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from peers import dynamics, estimators, logs, online, python_calls, simulation
from peers.cores import use_one_core
from peers.harness import ROUNDS, Comparison, Row, keep, run, show
from peers.native import BENCH, BUILD, CXX_FLAGS, OWN_PROCESSOR, compiler

NOTES = BENCH.parent / "docs" / "theory" / "notes" / "peers"

MODULES = (dynamics, estimators, online, python_calls, logs, simulation)
PACKAGES = ("tactid", "pin", "cmeel-eigen", "padasip", "mujoco", "rosbags", "numpy")


def main() -> None:
    """Measures on one core, and reports."""
    words = sys.argv[1:]
    is_quick = "--quick" in words
    chosen = [word for word in words if word != "--quick"]
    use_one_core()
    BUILD.mkdir(parents=True, exist_ok=True)
    tasks = [each for module in MODULES for each in module.comparisons()]
    if chosen:
        tasks = [each for each in tasks if any(word in each.task for word in chosen)]
    if not tasks:
        sys.exit(f"no task contains {' or '.join(chosen)}: make bench-peers runs all")
    if is_quick:
        tasks = [quick(each) for each in tasks]
    rows = measured(tasks, 1 if is_quick else ROUNDS)
    known = facts()
    for key, value in known.items():
        print(f"{key}: {value}")
    if not words:
        keep(rows, known, NOTES / f"{file_name(processor())}.md", BUILD / "peers.json")


def measured(tasks: list[Comparison], rounds: int) -> list[Row]:
    """Runs the comparisons, and prints each with the time that is left."""
    rows: list[Row] = []
    start_s = time.monotonic()
    for task in tasks:
        rows.append(run(task, rounds))
        show(rows[-1])
        left_s = (time.monotonic() - start_s) / len(rows) * (len(tasks) - len(rows))
        left = f"{len(rows)} of {len(tasks)} tasks, about {left_s / 60:.0f} min left"
        print(left, file=sys.stderr, flush=True)
    return rows


def quick(comparison: Comparison) -> Comparison:
    """The comparison without builds for the machine's own processor."""
    kept = {k: v for k, v in comparison.contenders.items() if OWN_PROCESSOR not in k}
    return replace(comparison, contenders=kept)


def file_name(words: str) -> str:
    """Words as the name of a file: lower case, with hyphens."""
    return "-".join(re.findall(r"[a-z0-9.]+", words.lower()))


def facts() -> dict[str, str]:
    """The machine, the versions and the flags."""
    return {
        "machine": f"{processor()}, {os.cpu_count()} cores, {platform.platform()}",
        "load": f"{os.getloadavg()[0]:.1f} at the end, processes of others included",
        "compilers": f"{first_line('rustc', '--version')}; {first_line(compiler(), '--version')}",
        "flags": f"Rust: {rust_flags()}; C++: {' '.join(CXX_FLAGS)}, {OWN_PROCESSOR} where said",
        "packages": ", ".join(f"{name} {installed(name)}" for name in PACKAGES),
    }


def rust_flags() -> str:
    """How tactid is compiled: the profile of `Cargo.toml` and what the environment adds."""
    given = os.environ.get("RUSTFLAGS")
    return f"release, one codegen unit, baseline {platform.machine()}" + (
        f", {given}" if given else ""
    )


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
