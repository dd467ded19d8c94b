"""Ends commands that write by signals at random moments, and checks what they leave.

``python tests/python/kills.py 1000`` ends a thousand runs. Whatever the moment: the exit code is
that of the signal, inputs are unchanged, and a file under its final name is whole. Only the log of
a simulation grows under its name; two readers read it up to where it ends. A run that has ended by
itself before the signal has written all that it should.
"""

import argparse
import csv
import hashlib
import json
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Container, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml
from mcap.exceptions import EndOfFile
from mcap.reader import NonSeekingReader

import recorded_arm
import tactid
from recordings import driven, write_bag

CODES = {signal.SIGKILL: -signal.SIGKILL, signal.SIGTERM: 143, signal.SIGINT: 130}
"""Exit code of a run that a signal has ended; a shell shows a negative one as 128 more."""

STARTED_S = 3.0
"""Time after which a command has its handlers. Before, the signal itself may end the process."""

LOADING = ("Fatal Python error: init_import_site", "Could not import runpy module")
"""What Python prints where a signal ends its own start."""

DURATION_S = {"simulate": 2.5, "paper": 8.0, "identify": 4.0, "calibrate": 3.5, "excite": 4.5}
"""Time within which a signal is sent. Most runs are still busy then."""

ENDED = {command: {0, 1} if command == "paper" else {0} for command in DURATION_S}
"""Exit codes of a run that ends before the signal. The paper's filter gives, after a short run, a
body that cannot exist, which is code 1."""

WRITTEN = {
    "simulate": {"run.mcap"},
    "paper": {"run.mcap", "result.json", "report.html"},
    "identify": {"r.json", "r.html"},
    "calibrate": {"arm.toml", "arm.html"},
    "excite": {
        "motion/trajectory.mcap",
        "motion/trajectory.csv",
        "motion/moveit.yaml",
        "motion/result.json",
    },
}
"""Files that a command has written once it ends by itself; some write others beside them."""

DEADLINE_S = 60.0
"""Time after a signal within which a run must end, s."""

BEGINNING = 1 << 16
"""Size of a log from which on it has messages, bytes: far above that of its descriptions."""

ENDS = {".png": b"IEND\xaeB`\x82", ".html": b"</html>", ".script": b"end\n"}
"""Last bytes of whole files that no parser reads here; white space after them does not count."""


@dataclass
class Inputs:
    """Files that the commands read, in a folder of their own."""

    folder: Path
    digests: dict[Path, str] = field(default_factory=dict)

    @classmethod
    def create(cls, folder: Path) -> "Inputs":
        """Writes an experiment, its log, an arm and a recording of it."""
        text = 'duration_s = 3.0\n[excitation]\nmode = "together"\n'
        (folder / "experiment.toml").write_text(text)
        tactid.simulate(tactid.Experiment.from_toml(text), folder / "input.mcap")
        (folder / "arm.urdf").write_text(recorded_arm.ur5e())
        write_bag(folder / "bag", driven(recorded_arm.FIXED, 15.0, 250.0))
        inputs = cls(folder)
        inputs.digests = inputs.present()
        return inputs

    def present(self) -> dict[Path, str]:
        """The digest of each file now."""
        files = sorted(path for path in self.folder.rglob("*") if path.is_file())
        return {path: hashlib.sha256(path.read_bytes()).hexdigest() for path in files}

    def arguments(self, command: str) -> list[str]:
        """The arguments of a run that writes into its working directory."""
        arm = ["--urdf", f"{self.folder}/arm.urdf", "--tip", "tool0"]
        motion = ["--from", "0,-1.5,1.5,-1.5,-1.5,0", "--duration", "1", "--payload-mass-max", "3"]
        box = ["--payload-box", "-0.1,-0.1,0,0.1,0.1,0.2", "--out", "motion"]
        found = ["--out", "arm.toml", "--report", "arm.html"]
        return {
            "simulate": [f"{self.folder}/experiment.toml", "--out", "run.mcap"],
            "paper": ["--duration", "15", "--out", "."],
            "identify": [f"{self.folder}/input.mcap", "--result", "r.json", "--report", "r.html"],
            "calibrate": [*arm, "--unloaded", f"{self.folder}/bag", *found],
            # The arm stands without its meshes.
            "excite": [*arm, *motion, *box, "--no-collisions"],
        }[command]


def end(inputs: Inputs, command: str, sent: signal.Signals, moment_s: float) -> list[str]:
    """Runs a command, sends it a signal, and returns what is wrong afterwards."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        arguments = [sys.executable, "-m", "tactid", command, *inputs.arguments(command)]
        process = subprocess.Popen(
            arguments, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
        )
        time.sleep(moment_s)
        process.send_signal(sent)
        try:
            _, errors = process.communicate(timeout=DEADLINE_S)
        except subprocess.TimeoutExpired:
            process.kill()
            _, errors = process.communicate()
            wrong = [f"no end within {DEADLINE_S:g} s: {errors}"]
        else:
            ended_by = {CODES[sent]} | ({-sent} if moment_s < STARTED_S else set())
            wrong = list(faults_of_code(folder, command, ended_by, process.returncode, errors))
        wrong += faults(folder, sent)
        if inputs.present() != inputs.digests:
            wrong.append("an input has changed")
    return [f"{command} after {moment_s:.3f} s by {sent.name}: {fault}" for fault in wrong]


def faults_of_code(
    folder: Path, command: str, ended_by: Container[int], code: int, errors: str
) -> Iterator[str]:
    """What is wrong with the way in which a run has ended. ``ended_by``: codes of the signal."""
    # Python itself ends with 1 where a signal interrupts its own start: no line of tactid has run.
    is_loading = code == 1 and any(message in errors for message in LOADING)
    missing = {name for name in WRITTEN[command] if not (folder / name).is_file()}
    if code in ENDED[command] and not is_loading:
        if missing:
            yield f"exit code {code} without {sorted(missing)}: {errors}"
    elif code not in ended_by and not is_loading:
        yield f"exit code {code}: {errors}"


def faults(folder: Path, sent: signal.Signals) -> Iterator[str]:
    """What is wrong with the files that a run has left."""
    for path in sorted(folder.rglob("*")):
        # SIGKILL leaves no time to remove a folder, or what is being written under a hidden name.
        if path.is_dir():
            if sent is not signal.SIGKILL and not any(path.iterdir()):
                yield f"the folder {path.name} is left without a file"
            continue
        if path.name.startswith("."):
            if sent is not signal.SIGKILL:
                yield f"{path.name} is left"
            continue
        try:
            check(path)
        except Exception as error:  # whatever a parser raises for a file that is not whole
            yield f"{path.name}: {type(error).__name__}: {error}"


def check(path: Path) -> None:
    """Raises an error where a file under its final name is not whole."""
    if path.suffix == ".mcap":
        counts = {topic.name: topic.count for topic in tactid.info(path).topics}
        other = Counter(read_by_mcap(path))
        if any(counts.get(name, 0) < count for name, count in other.items()):
            raise ValueError(f"{counts} messages, and another reader has {other}")
        if path.stat().st_size > BEGINNING and not other:
            raise ValueError("no message is readable")
        if path.name != "run.mcap" and tactid.info(path).damage:
            raise ValueError("a log that is not recorded is damaged")
        return
    content = path.read_bytes()
    if path.suffix == ".json":
        json.loads(content)
    elif path.suffix == ".toml":
        tactid.Calibration.read(path)
    elif path.suffix == ".csv":
        check_rows(content.decode())
    elif path.suffix == ".yaml":
        check_points(yaml.safe_load(content))
    elif not content.rstrip().endswith(ENDS[path.suffix].rstrip()):
        raise ValueError(f"the last bytes are {content[-20:]!r}")


def check_rows(text: str) -> None:
    """Raises an error where a table is cut: a row is shorter, or a motion does not end at rest."""
    head, *rows = csv.reader(line for line in text.splitlines() if not line.startswith("#"))
    if not text.endswith("\n") or any(len(row) != len(head) for row in rows):
        raise ValueError("a row has not as many columns as the head")
    at_rest = [float(x) for name, x in zip(head, rows[-1], strict=True) if name.startswith("qd_")]
    if not at_rest and "time_s" in head:
        raise ValueError("the motion has no velocities")
    if any(abs(velocity) > 1e-9 for velocity in at_rest):
        raise ValueError(f"the last velocities are {at_rest}")


def check_points(trajectory: dict[str, Any]) -> None:
    """Raises an error where a trajectory of MoveIt is cut: it does not end at rest."""
    last = trajectory["joint_trajectory"]["points"][-1]
    if any(abs(velocity) > 1e-9 for velocity in last["velocities"]):
        raise ValueError(f"the last velocities are {last['velocities']}")


def read_by_mcap(path: Path) -> Iterator[str]:
    """The topic of each message that the library of the format reads."""
    with path.open("rb") as file:
        try:
            for _, channel, _ in NonSeekingReader(file).iter_messages(log_time_order=False):
                yield channel.topic
        except EndOfFile:
            return


def run(count: int, seed: int, folder: Path) -> list[str]:
    """Ends so many runs, and returns what was wrong after them."""
    draw = random.Random(seed)
    inputs = Inputs.create(folder)
    wrong: list[str] = []
    for number in range(count):
        command = list(DURATION_S)[number % len(DURATION_S)]
        moment_s = draw.uniform(0.0, DURATION_S[command])
        wrong += end(inputs, command, draw.choice(list(CODES)), moment_s)
    return wrong


def main() -> int:
    """Runs what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("count", type=int, help="number of runs that are ended")
    parser.add_argument("--seed", type=int, default=16, help="of commands, signals and moments")
    arguments = parser.parse_args()
    # A shell starts what runs in the background with Ctrl-C ignored, and processes inherit that.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    folder = Path(tempfile.mkdtemp())
    try:
        wrong = run(arguments.count, arguments.seed, folder)
    finally:
        shutil.rmtree(folder)
    for line in wrong:
        print(line, file=sys.stderr)
    print(f"{arguments.count} runs ended, {len(wrong)} findings")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
