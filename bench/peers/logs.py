"""A log of 60 s by the command line, beside a script with NumPy, Pinocchio and rosbags."""

import json
import resource
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np

import tactid
from peers.harness import Array, Comparison, Contender, peer
from peers.native import BUILD

EXPERIMENT = tactid.Experiment.paper().replace(duration=60.0)
SCRIPT = Path(__file__).with_name("log_script.py")


def comparisons() -> list[Comparison]:
    """The paper's experiment, simulated and then identified by a process of each."""
    # The script differs by what it does not know, such as outliers at contact.
    contenders = {"tactid identify": by_tactid, "script": by_script}
    return [Comparison("log of 60 s", "s", contenders, scale=1.0, bar=12.0, tolerance=2e-3)]


def by_tactid() -> Contender:
    """The command line of tactid."""
    command = Command([str(Path(sys.executable).with_name("tactid")), "identify", log(), "--json"])
    estimate = json.loads(command.printed())["estimate"]
    return Contender(command, in_sizes(parameters(estimate["values"])))


def by_script() -> Contender:
    """The script beside this module."""
    peer("pinocchio", "pin")
    peer("rosbags", "rosbags")
    command = Command([sys.executable, str(SCRIPT), log()])
    return Contender(command, in_sizes(np.array(command.printed().split(), dtype=float)))


@cache
def log() -> str:
    """The path of a log that is simulated once."""
    path = BUILD / "minute.mcap"
    path.parent.mkdir(parents=True, exist_ok=True)
    tactid.simulate(EXPERIMENT, path)
    return str(path)


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


def in_sizes(estimate: Array) -> Array:
    """Ten parameters as multiples of the payload's largest of their kind: mass, moment, inertia."""
    kinds = np.split(np.abs(EXPERIMENT.payload.parameters), [1, 4])
    return estimate / np.repeat([kind.max() for kind in kinds], [1, 3, 6])


def parameters(values: dict) -> Array:
    """The ten parameters of the values of an estimate in JSON."""
    com = list(values["com"].values())
    xx, xy, xz, yy, yz, zz = values["inertia"].values()
    inertia = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
    return tactid.MassProperties(mass=values["mass"], com=com, inertia=inertia).parameters
