"""Active identification on the spacecraft, 10 s from its log, with and without a bound on the base.

Run by `make bench-active`, or with a number of seeds as the argument. The payload of 100 kg is
unknown at the start. Every channel has white noise of 1 % of its peak; the motion follows from the
noise, so both are found by turns. An error is relative to the nominal value, or for a small one to
the largest of its kind.
"""

import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from logs import noise
from recorded import Array, Recorded, scales
from rich.console import Console
from rich.progress import track
from rich.table import Table

import tactid
from tactid._base.values import values_of

SEEDS = 20
DURATION_S = 10.0
BOUNDS_DEG = [0.1, None]
METHODS = {
    "fingers": {"method": "tactile"},
    "combined": {"method": "combined"},
    "combined, IMU": {"method": "combined", "imu_topic": "/base/imu"},
}
PASSES = 2
"""Motions from which the noise is found before the one that counts."""


@dataclass
class Runs:
    """Results of the runs with one bound."""

    values: dict[str, list[Array]] = field(default_factory=lambda: {name: [] for name in METHODS})
    attitude_deg: list[float] = field(default_factory=list)
    torque: list[float] = field(default_factory=list)


def main() -> None:
    """Prints the errors of the ten values, and what the motions used of their limits."""
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else SEEDS
    truth = tactid.Experiment.paper().payload
    title = f"{DURATION_S:g} s of active identification, 1 % noise, {seeds} seeds: rms error in %"
    errors = Table("base", "from", "worst", *tactid.VALUE_NAMES, title=title)
    limits = Table("base", "attitude, degrees", "torque over its limit", title="largest of all")
    for bound in BOUNDS_DEG:
        name = "free" if bound is None else f"{bound:g} degrees"
        runs = measure(bound, seeds, name)
        for method, values in runs.values.items():
            percent = 100 * (np.array(values) - values_of(truth)) / scales(truth)
            rms = np.sqrt(np.mean(percent**2, axis=0))
            errors.add_row(name, method, *(f"{value:.2g}" for value in (rms.max(), *rms)))
        limits.add_row(name, f"{max(runs.attitude_deg):.3f}", f"{max(runs.torque):.3f}")
    console = Console(width=120)
    console.print(errors)
    console.print(limits)


def measure(bound_deg: float | None, seeds: int, name: str) -> Runs:
    """Simulates and identifies each seed."""
    runs = Runs()
    text = experiment_text(bound_deg)
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "run.mcap"
        noisy = tactid.Experiment.from_toml(text)
        for _ in range(PASSES):
            tactid.simulate(noisy, log)
            noisy = tactid.Experiment.from_toml(text + noise(log))
        for seed in track(range(seeds), name, console=Console(stderr=True)):
            tactid.simulate(noisy.replace(seed=seed), log)
            for method, options in METHODS.items():
                runs.values[method].append(tactid.identify(log, **options).estimate.values)
            recorded = Recorded.read(log)
            runs.attitude_deg.append(attitude_deg(recorded.orientation))
            runs.torque.append(float(np.max(np.abs(recorded.effort[:, :6]) / torque_limits())))
    return runs


def experiment_text(bound_deg: float | None) -> str:
    """The experiment, whose target is too narrow to be reached: it lasts its whole duration."""
    bound = "" if bound_deg is None else f"base_attitude_deg = {bound_deg}\n"
    return (
        f'duration_s = {DURATION_S}\n[excitation]\nkind = "active"\n'
        f"[excitation.active]\nwithin = 1e-6\n{bound}"
    )


def attitude_deg(orientation: Array) -> float:
    """The largest angle from the first orientation, degrees."""
    cosine = np.abs(orientation @ orientation[0]).clip(max=1.0)
    return float(np.degrees(2 * np.arccos(cosine)).max())


def torque_limits() -> Array:
    """Returns the torque limits of the arm's joints, N m."""
    joints = ElementTree.fromstring(tactid.Experiment.paper().urdf).iter("joint")
    limits = {joint.get("name"): joint.find("limit") for joint in joints}
    found = [limits[f"joint_{k}"] for k in range(1, 7)]
    return np.array([float(limit.get("effort")) for limit in found])


if __name__ == "__main__":
    main()
