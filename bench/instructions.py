"""Instructions of the main kernels, counted by callgrind, against those in `instructions.json`.

Run by `make instructions`. A count does not depend on the machine's speed or load, and little on
the compiler and the C library (within `TOLERANCE`), so it may fail a build: a kernel that needs
more than `TOLERANCE` above its count is an error. One that needs that much less asks for the new
count, which `--write` stores. Without valgrind nothing can be counted, which is an error, too.
"""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
STORED = Path(__file__).with_name("instructions.json")
PROGRAMS = {"kernels": "tactid-dynamics", "updates": "tactid-identify"}
"""Examples that repeat a kernel, and their packages."""

TOLERANCE = 0.05
"""Compilers and C libraries of other versions differ by a few percent."""

REPETITIONS = (200, 1200)
"""The difference of two runs is that of the calls alone."""


def main() -> int:
    """Counts, compares and reports."""
    if shutil.which("valgrind") is None:
        print("valgrind is missing (Debian: apt install valgrind)", file=sys.stderr)
        return 2
    counts = {}
    for example, package in PROGRAMS.items():
        program = built(example, package)
        names = subprocess.run([program], capture_output=True, text=True, check=True).stdout
        counts |= {name: instructions(program, name) for name in names.split()}
    if "--write" in sys.argv[1:]:
        STORED.write_text(json.dumps(counts, indent=2) + "\n")
        return 0
    stored, code = json.loads(STORED.read_text()), 0
    for name, count in counts.items():
        change = count / stored[name] - 1 if name in stored else float("inf")
        verdict = ""
        if change > TOLERANCE:
            verdict, code = "more than stored", 1
        elif change < -TOLERANCE:
            verdict = "less than stored: run bench/instructions.py --write"
        print(f"{name:24} {count:8} instructions {change:+8.1%}  {verdict}")
    for name in stored.keys() - counts.keys():
        print(f"{name:24} is stored, but no kernel")
        code = 1
    return code


def built(example: str, package: str) -> Path:
    """Builds an example and returns the path of its program."""
    command = ["cargo", "build", "--release", "--locked", "--quiet", "-p", package]
    subprocess.run([*command, "--example", example], cwd=ROOT, check=True)
    return ROOT / "target" / "release" / "examples" / example


def instructions(program: Path, name: str) -> int:
    """Instructions of one call of a kernel."""
    few, many = (total(program, name, repetitions) for repetitions in REPETITIONS)
    return round((many - few) / (REPETITIONS[1] - REPETITIONS[0]))


def total(program: Path, name: str, repetitions: int) -> int:
    """Instructions of a whole run."""
    command = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null"]
    command += [str(program), name, str(repetitions)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    found = re.search(r"Collected : (\d+)", done.stderr)
    assert found is not None, done.stderr
    return int(found[1])


if __name__ == "__main__":
    sys.exit(main())
