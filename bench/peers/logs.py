"""A log of 60 s by the command line, beside a script with NumPy, Pinocchio and rosbags."""

import json
import resource
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import tactid
from peers.harness import Array, Comparison, Contender
from peers.native import BUILD

SECONDS = 60.0
SCRIPT = Path(__file__).with_name("log_script.py")


def comparisons() -> Iterator[Comparison]:
    """The paper's experiment, simulated and then identified by a process of each."""
    log = BUILD / "minute.mcap"
    log.parent.mkdir(parents=True, exist_ok=True)
    tactid.simulate(tactid.Experiment.paper().replace(duration=SECONDS), log)
    tool = Path(sys.executable).with_name("tactid")
    ours = Command([str(tool), "identify", str(log), "--json"])
    theirs = Command([sys.executable, str(SCRIPT), str(log)])
    estimate = parameters(json.loads(ours.printed())["estimate"])
    size = sizes(estimate)
    contenders = [
        Contender("tactid identify", ours, estimate / size),
        Contender("script", theirs, np.array(theirs.printed().split(), dtype=float) / size),
    ]
    # The script differs by what it does not know, such as outliers at contact.
    yield Comparison("log of 60 s", "s", contenders, scale=1.0, bar=6.0, tolerance=2e-3)


class Command:
    """A process; its time is that of the processor: other processes on the core do not count."""

    def __init__(self, command: list[str]) -> None:
        self.command = command

    def __call__(self) -> float:
        """Seconds of a run, all threads together."""
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        self.printed()
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

    def printed(self) -> str:
        """What a run prints."""
        command = subprocess.run(self.command, capture_output=True, text=True, check=True)
        return command.stdout


def sizes(parameters: Array) -> Array:
    """For each parameter the largest value of its kind: mass, first moment or inertia."""
    mass, first_moments, inertia = np.abs(parameters[0]), parameters[1:4], parameters[4:]
    return np.repeat([mass, np.abs(first_moments).max(), np.abs(inertia).max()], [1, 3, 6])


def parameters(estimate: dict) -> Array:
    """The ten parameters of an estimate of the JSON."""
    com = list(estimate["com"].values())
    xx, xy, xz, yy, yz, zz = estimate["inertia"].values()
    inertia = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
    return tactid.MassProperties(mass=estimate["mass"], com=com, inertia=inertia).parameters
