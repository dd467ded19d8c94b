"""Runs the fuzz targets: builds them guided by coverage, and prints what each has executed.

The compiler is the stable one: libFuzzer needs only LLVM's coverage pass, which ``rustc`` has.
Inputs are mutated from ``corpus/TARGET``; those of findings that have been mended stand in
``regressions/TARGET`` and are run first. What a run finds is kept in ``found/TARGET``.
"""

import argparse
import os
import re
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).parent

COVERAGE = [
    "-Cpasses=sancov-module",
    "-Cllvm-args=-sanitizer-coverage-level=4",
    "-Cllvm-args=-sanitizer-coverage-inline-8bit-counters",
    "-Cllvm-args=-sanitizer-coverage-pc-table",
    "-Cllvm-args=-sanitizer-coverage-trace-compares",
]
"""Flags of the compiler. They must not apply to build scripts, hence ``--target``."""

RSS_MB = 1024
"""Memory of a process that is a finding, MB: the targets limit that of one input to 512 MB."""

TIMEOUT_S = 10
"""Time for one input that is a finding, s, by the clock. On an idle core the bar is 5 s."""

IN_MEMORY = Path("/dev/shm")
"""Where targets write the files that they read: a disk would take most of their time."""

MAX_BYTES = 65536
"""Largest input that is made by mutation. A kept one may be larger."""


def main() -> int:
    """Runs the targets that the command line names, or all of them."""
    layout = argparse.RawTextHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=layout)
    parser.add_argument("targets", nargs="*", metavar="TARGET", help="default: all")
    of_seconds = "for each target; 0 runs the kept inputs alone"
    parser.add_argument("--seconds", type=int, default=60, help=of_seconds)
    of_limit = f"for one input, by the clock; more on a loaded machine (default: {TIMEOUT_S})"
    parser.add_argument("--limit", type=int, default=TIMEOUT_S, metavar="SECONDS", help=of_limit)
    of_seed = "of the mutations; 0: another each time"
    parser.add_argument("--seed", type=int, default=0, help=of_seed)
    arguments = parser.parse_args()
    all_targets = sorted(path.stem for path in (HERE / "targets").glob("*.rs"))
    unknown = set(arguments.targets) - set(all_targets)
    if unknown:
        parser.error(f"no target {', '.join(sorted(unknown))}; there are {', '.join(all_targets)}")
    programs = build()
    failed = []
    total = 0
    for target in arguments.targets or all_targets:
        count, summary, passed = run(programs / target, target, arguments)
        total += count
        print(f"{target:<12} {summary}", flush=True)
        if not passed:
            failed.append(target)
    print(f"{'total':<12} {total} executions")
    for target in failed:
        print(f"{target} failed: see {HERE / 'found' / target}", file=sys.stderr)
    return 1 if failed else 0


def build() -> Path:
    """Builds all targets and returns the folder of the programs."""
    target = subprocess.check_output(["rustc", "--print", "host-tuple"], text=True).strip()
    environment = {**os.environ, "RUSTFLAGS": " ".join(COVERAGE), "CARGO_INCREMENTAL": "0"}
    command = ["cargo", "build", "--release", "--locked", "--target", target]
    subprocess.run(command, check=True, cwd=HERE, env=environment)
    return HERE / "target" / target / "release"


def run(program: Path, target: str, arguments: argparse.Namespace) -> tuple[int, str, bool]:
    """Runs a target. Returns its executions, a summary, and whether it ran and found nothing."""
    corpus = HERE / "target" / "corpus" / target
    found = HERE / "found" / target
    for folder in (corpus, found):
        folder.mkdir(parents=True, exist_ok=True)
    kept = [HERE / name / target for name in ("corpus", "regressions")]
    kept = [folder for folder in kept if folder.exists()]
    sizes = [file.stat().st_size for folder in kept for file in folder.iterdir()]
    if not sizes:
        return 0, f"no input in {HERE / 'corpus' / target}", False
    options = [
        f"-artifact_prefix={found}/",
        f"-rss_limit_mb={RSS_MB}",
        f"-timeout={arguments.limit}",
        f"-seed={arguments.seed}",
        "-print_final_stats=1",
        f"-max_len={max(MAX_BYTES, *sizes)}",
        *([f"-max_total_time={arguments.seconds}"] if arguments.seconds else ["-runs=0"]),
    ]
    folders = [str(folder) for folder in kept]
    if arguments.seconds:
        folders.insert(0, str(corpus))  # what earlier runs have found, and where new inputs go
    command = [str(program), *options, *folders]
    environment = os.environ | ({"TMPDIR": str(IN_MEMORY)} if IN_MEMORY.is_dir() else {})
    done = subprocess.run(
        command, capture_output=True, text=True, errors="replace", env=environment
    )
    (found / "log.txt").write_text(done.stderr)
    count, summary = statistics(done.stderr)
    return count, summary, done.returncode == 0 and count >= len(sizes)


def statistics(log: str) -> tuple[int, str]:
    """Returns the executions of a run and a summary of what libFuzzer has printed."""
    executed = re.findall(r"^stat::number_of_executed_units:\s*(\d+)", log, re.MULTILINE)
    rate = re.findall(r"^stat::average_exec_per_sec:\s*(\d+)", log, re.MULTILINE)
    coverage = re.findall(r"\bcov: (\d+)", log)
    count = int(executed[-1]) if executed else 0
    covered = coverage[-1] if coverage else "?"
    return count, f"{count} executions, {rate[-1] if rate else '?'} per second, {covered} edges"


if __name__ == "__main__":
    sys.exit(main())
