"""Instructions of the main kernels, counted by callgrind, against those in `instructions.json`.

Run by `make instructions`. A count does not depend on the machine's speed or load, so it may fail a
build: a kernel whose count differs from the stored one by more than `TOLERANCE`, up or down, is an
error, and `--write` stores the new count where the change is meant. The C library copies and clears
memory with the instructions that suit the processor; instructions in libraries are printed, but not
compared. Where nothing can be counted, that is an error, too.
"""

import json
import platform
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
STORED = Path(__file__).with_name("instructions.json")
PROGRAMS = {
    "kernels": "tactid-dynamics",
    "updates": "tactid-batch",
    "c_updates": "tactid-capi",
}
"""Examples that repeat a kernel, and their packages."""

TOLERANCE = 0.03
"""Largest change of a count, as a fraction. The compiled code is the same on all processors, and
valgrind lets it use AVX2 at most. Runs of one build differ by up to 1.3 %, in steps of 132
instructions a sample: the stored count is the middle one. A C library that rounds a sine otherwise
can change a branch or add a step to an iteration, and another version of the compiler changes some
counts by a percent or two; where it changes one by more, the counts are stored anew."""

REPETITIONS = (200, 1200)
"""The difference of two runs is that of the calls alone."""

REPETITIONS_OF = {"batch_fit": (1, 5)}
"""Repetitions of kernels that need millions of instructions."""

PROCESSOR = "x86_64"
"""The processor whose instructions are stored."""


def main() -> int:
    """Counts, compares and reports."""
    if shutil.which("valgrind") is None:
        sys.exit("nothing can be counted: valgrind is missing (Debian: apt install valgrind)")
    if platform.machine() != PROCESSOR:
        sys.exit(f"the stored counts are those of {PROCESSOR}; this is {platform.machine()}")
    counts = {}
    for example, package in PROGRAMS.items():
        program = built(example, package)
        names = subprocess.run([program], capture_output=True, text=True, check=True).stdout
        counts |= {name: instructions(program, name) for name in names.split()}
    if "--write" in sys.argv[1:]:
        own = {name: count for name, (count, _) in counts.items()}
        STORED.write_text(json.dumps(own, indent=2) + "\n")
        return 0
    stored, code = json.loads(STORED.read_text()), 0
    for name, (count, in_libraries) in counts.items():
        change = count / stored[name] - 1 if name in stored else float("inf")
        verdict = ""
        if abs(change) > TOLERANCE:
            verdict, code = "not as stored: store what is meant with --write", 1
        print(f"{name:22} {count:9} {change:+8.1%}  and {in_libraries:7} in libraries  {verdict}")
    for name in stored.keys() - counts.keys():
        print(f"{name:22} is stored, but no kernel")
        code = 1
    return code


def built(example: str, package: str) -> Path:
    """Builds an example and returns the path of its program."""
    command = ["cargo", "build", "--release", "--locked", "--quiet", "-p", package]
    subprocess.run([*command, "--example", example], cwd=ROOT, check=True)
    return ROOT / "target" / "release" / "examples" / example


def instructions(program: Path, name: str) -> tuple[int, int]:
    """Instructions of one call of a kernel, in the program and in the libraries that it calls."""
    few, many = REPETITIONS_OF.get(name, REPETITIONS)
    before, after = run(program, name, few), run(program, name, many)
    own, in_libraries = (round((b - a) / (many - few)) for a, b in zip(before, after, strict=True))
    return own, in_libraries


def run(program: Path, name: str, repetitions: int) -> tuple[int, int]:
    """Instructions of a whole run, in the program and in libraries."""
    with tempfile.NamedTemporaryFile("r", suffix=".callgrind") as profile:
        command = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={profile.name}"]
        command += ["--compress-strings=no", "--compress-pos=no"]
        command += [str(program), name, str(repetitions)]
        subprocess.run(command, capture_output=True, text=True, check=True)
        return total(profile.read(), program)


def total(profile: str, program: Path) -> tuple[int, int]:
    """Sums of a profile of callgrind, in the program and in libraries.

    `ob=` names the object file of what follows. Each line of costs has the line in the source and
    the instructions. The line after `calls=` has those of a function that is called, whose own
    lines stand elsewhere.
    """
    own = in_libraries = 0
    is_own = is_call = False
    for line in profile.splitlines():
        if line.startswith("ob="):
            is_own = line == f"ob={program}"
        elif line.startswith("calls="):
            is_call = True
        elif line[:1].isdigit():
            cost = 0 if is_call else int(line.split()[1])
            own, in_libraries = (own + cost, in_libraries) if is_own else (own, in_libraries + cost)
            is_call = False
    if own == 0:
        sys.exit(f"the profile of callgrind has no costs of {program}")
    return own, in_libraries


if __name__ == "__main__":
    sys.exit(main())
