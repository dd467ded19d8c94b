"""Pick-and-place recordings: where they are cut, and the payloads of their segments.

Run by `make bench-split`, which takes some minutes. The arm of the demo takes up to two bodies one
after the other, and puts each down again. Velocities are differences of the measured positions. A
gripper of 0.9 kg is on its wrist sensor, whose zero is not set. While a body is grasped or put
down, a contact that grows and fades acts on it.
"""

import argparse
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import tactid
from tactid._base.values import PATHS, values_of
from tactid._live.simulated_arm import TIP, SimulatedArm

Array = NDArray[np.float64]

GRIPPER = tactid.MassProperties(0.9, [0.0, 0.002, 0.05], np.diag([0.0012, 0.0014, 0.0008]))
RATE_HZ = 500.0
NOISE = np.array([0.3, 0.3, 0.3, 0.02, 0.02, 0.02])
ENCODERS = 2.8e-5
"""Standard deviation of the positions, rad: that of encoders of 16 bits."""
CONTACT = np.array([12.0, 12.0, 20.0, 1.0, 1.0, 0.5])
"""Standard deviation of the contact at its largest, N and N m."""
ZERO = np.array([5.0, 5.0, 10.0, 0.3, 0.3, 0.3])
"""Standard deviation of what the sensor measures of nothing, N and N m."""
TOLERANCE_S = 0.1


class Held(NamedTuple):
    """A body that is held for a time."""

    begin_s: float
    end_s: float
    body: tactid.MassProperties


class Recording(NamedTuple):
    """A recording with what it holds."""

    path: Path
    held: list[Held]


def main() -> None:
    """Prints the rows."""
    given = argparse.ArgumentParser(description=__doc__)
    given.add_argument("--recordings", type=int, default=50)
    given.add_argument("--show", action="store_true", help="print each recording that is wrong")
    asked = given.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder, arm = Path(name), SimulatedArm()
        recorded = [record(folder, arm, seed) for seed in range(asked.recordings)]
        begun = time.monotonic()
        rows = tactid.fleet(folder / "*.npz", split=True, urdf=arm.urdf, tip=TIP)
        report(recorded, rows, time.monotonic() - begun, show=asked.show)


def record(folder: Path, arm: SimulatedArm, seed: int) -> Recording:
    """Writes a recording with none, one or two bodies, in turn."""
    rng = np.random.default_rng(seed)
    held = phases(rng, seed % 3)
    duration = held[-1].end_s
    times = np.arange(0.0, duration, 1.0 / RATE_HZ)
    q, motion = moved(arm, times, rng)
    wrench = rng.normal(size=(len(times), 6)) * NOISE + rng.normal(size=6) * ZERO
    regressor = tactid.wrench_regressor(*motion)
    for before, each in zip([None, *held[:-1]], held, strict=True):
        inside = (times >= each.begin_s) & (times < each.end_s)
        wrench[inside] += regressor[inside] @ each.body.parameters
        if before is not None:
            # The load goes over from one to the other, while the contact grows and fades.
            inside = (times >= before.end_s) & (times < each.begin_s)
            done = (times[inside] - before.end_s) / (each.begin_s - before.end_s)
            both = np.outer(1 - done, before.body.parameters) + np.outer(done, each.body.parameters)
            wrench[inside] += np.einsum("nij,nj->ni", regressor[inside], both)
            grown = np.sin(np.pi * done)[:, None] ** 0.5
            shaken = 1.0 + 0.3 * rng.normal(size=(len(done), 6))
            wrench[inside] += grown * shaken * CONTACT * rng.choice([-1.0, 1.0], size=6)
    path = folder / f"{seed:03}.npz"
    noisy = q + ENCODERS * rng.normal(size=q.shape)
    qd = np.gradient(noisy, times, axis=0)
    np.savez(path, time=1.0 + times, q=noisy, qd=qd, wrench=wrench)
    return Recording(path, held)


def phases(rng: np.random.Generator, bodies: int) -> list[Held]:
    """Returns what is held: the gripper, and each body with it, between transients."""
    found, now = [], 0.0
    for k in range(2 * bodies + 1):
        duration = rng.uniform(4.0, 9.0) if bodies else 20.0
        body = GRIPPER + payload(rng) if k % 2 else GRIPPER
        found.append(Held(now, now + duration, body))
        now += duration + rng.uniform(0.15, 0.6)
    return found


def payload(rng: np.random.Generator) -> tactid.MassProperties:
    """Draws a body of 0.15 to 3 kg."""
    mass = float(np.exp(rng.uniform(np.log(0.15), np.log(3.0))))
    com = rng.uniform([-0.04, -0.04, 0.08], [0.04, 0.04, 0.2])
    size = rng.uniform(0.04, 0.15, 3)
    square = size**2
    return tactid.MassProperties(mass, com, np.diag(mass / 12 * (square.sum() - square)))


def moved(arm: SimulatedArm, times: Array, rng: np.random.Generator) -> tuple[Array, Any]:
    """Returns positions and the tip's motion: moves from pose to pose, and rests."""
    home = np.array([0.0, -1.2, 1.6, -0.4, 1.57, 0.0])
    reach = np.array([0.8, 0.4, 0.4, 0.7, 0.7, 1.2])
    q, qd, qdd = (np.zeros((len(times), 6)) for _ in range(3))
    begin, at = 0.0, home + reach * rng.uniform(-1, 1, 6)
    while begin < times[-1]:
        duration, rest = rng.uniform(0.9, 1.8), rng.uniform(0.0, 0.7)
        to = home + reach * rng.uniform(-1, 1, 6)
        inside = (times >= begin) & (times < begin + duration + rest)
        s = np.clip((times[inside] - begin) / duration, 0.0, 1.0)[:, None]
        # A polynomial of the seventh degree, whose jerk is continuous.
        q[inside] = at + (to - at) * s**4 * (35 - 84 * s + 70 * s**2 - 20 * s**3)
        qd[inside] = (to - at) / duration * 140 * s**3 * (1 - s) ** 3
        qdd[inside] = (to - at) / duration**2 * 420 * s**2 * (1 - s) ** 2 * (1 - 2 * s)
        begin, at = begin + duration + rest, to
    tool = tactid.Manipulator.from_urdf(arm.urdf).kinematics(TIP, q, qd, qdd)
    back = tool.pose[:, :3, :3].transpose(0, 2, 1)
    felt = tool.acceleration + np.array([0.0, 0.0, 9.81])
    in_world = (felt, tool.angular_velocity, tool.angular_acceleration)
    return q, [np.einsum("nij,nj->ni", back, vector) for vector in in_world]


def report(
    recorded: list[Recording], rows: list[dict[str, Any]], seconds: float, *, show: bool
) -> None:
    """Prints how well segments and payloads agree with what was simulated."""
    errors: list[float] = []
    wrong, missed, contradicted = Counter[str](), 0, Counter[str]()
    inside: dict[str, list[bool]] = {}
    for each in recorded:
        found = [row for row in rows if row["address"] == str(each.path)]
        outer = each.held[0].begin_s, each.held[-1].end_s
        if len(found) != len(each.held):
            wrong[f"{len(found)} for {len(each.held)}"] += 1
            missed += 1
            if show:
                print(each.path.name, [(h.begin_s, h.end_s, h.body.mass) for h in each.held])
                print("   ", [(r["begin_s"], r["end_s"], r["error"]) for r in found])
            continue
        for held, row in zip(each.held, found, strict=True):
            for name in ("begin_s", "end_s"):
                if getattr(held, name) not in outer:
                    errors.append(row[name] - getattr(held, name))
            contradicted[row["outcome"]] += 1
            check(held, row, inside, show=show)
    late = np.array(errors)
    total = sum(len(each.held) for each in recorded)
    print(f"{len(recorded)} recordings, {total} segments: other numbers in {missed} {dict(wrong)}")
    near, largest = np.mean(abs(late) <= TOLERANCE_S), abs(late).max()
    print(
        f"{len(late)} times: within {TOLERANCE_S} s {near:.3f}, largest error {largest:.3f} s,"
        f" median {np.median(late):+.3f} s, rms {np.sqrt(np.mean(late**2)):.3f} s"
    )
    for name, each in inside.items():
        print(f"{name}: {np.mean(each):.3f} of {len(each)} within their intervals")
    print(f"outcomes of segments: {dict(contradicted)}; {seconds:.1f} s")


def check(held: Held, row: dict[str, Any], inside: dict[str, list[bool]], *, show: bool) -> None:
    """Notes which values are within their intervals."""
    for name, truth in zip(map(".".join, PATHS), values_of(held.body), strict=True):
        value, std_dev = row[f"estimate.values.{name}"], row[f"estimate.std_devs.{name}"]
        if value is None or std_dev is None:
            continue
        holds = abs(value - truth) <= 1.96 * std_dev
        kind = name.partition(".")[0]
        inside.setdefault(kind, []).append(holds)
        inside.setdefault("all values", []).append(holds)
        if show and not abs(value - truth) <= 3.5 * std_dev:
            print(row["address"][-7:], row["begin_s"], name, value, truth, std_dev, row["outcome"])


if __name__ == "__main__":
    main()
