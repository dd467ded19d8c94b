"""A payload of 100 kg that becomes one of 60 kg in mid-motion, as the fingers feel it online.

Run by `make bench-swap`. The motion is that of a simulated run; what the second payload adds to it
is computed, so that the noise can be drawn anew for each run.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
from recorded import FINGERS, Array, Recorded, scales
from rich.console import Console
from rich.progress import track
from rich.table import Table

import tactid
from tactid._base.values import values_of

RUNS = 20
LEVELS = [0.0, 0.001, 0.01]
SWAP = 5.0
AFTER = 2.0
LIGHT = tactid.MassProperties(60.0, [0.4, 0.1, -0.1], np.diag([6.0, 9.0, 7.0]))


def main() -> None:
    """Prints how soon it is seen, and what is known of it then."""
    experiment = tactid.Experiment.from_file(Path(__file__).with_name("all_joints.toml"))
    robot = tactid.Manipulator.from_urdf(experiment.urdf, "floating")
    recorded = swapped(Recorded.of(experiment), robot, experiment.payload)
    table = Table("noise, %", "seen after, ms", "false alarms", "missed", "mass", "worst of ten")
    table.title = (
        f"100 kg become 60 kg at {SWAP:g} s, {RUNS} runs; rms error in % {AFTER:g} s later"
    )
    for level in LEVELS:
        seeds = track(range(RUNS), f"{100 * level:g} %", console=Console(stderr=True))
        levels = {"wrench": level, "motion": level, "effort": level}
        generators = map(np.random.default_rng, seeds)
        runs = [run(recorded.with_noise(random, **levels), robot) for random in generators]
        delays, false, errors = zip(*runs, strict=True)
        rms = np.sqrt(np.mean(np.square(errors), axis=0))
        seen = [1e3 * delay for delay in delays if delay is not None]
        table.add_row(
            f"{100 * level:g}",
            f"{min(seen):.0f} to {max(seen):.0f}" if seen else "never",
            str(sum(false)),
            str(RUNS - len(seen)),
            f"{rms[0]:.3f}",
            f"{rms.max():.3f}",
        )
    Console(width=110).print(table)


def swapped(
    recorded: Recorded, robot: tactid.Manipulator, heavy: tactid.MassProperties
) -> Recorded:
    """The same motion, with the other payload's wrench from `SWAP` on, by the right finger."""
    more = recorded.regressor(robot) @ (LIGHT.parameters - heavy.parameters)
    more[recorded.time - recorded.time[0] < SWAP] = 0
    tool, finger = (recorded.kinematics(robot, frame).pose for frame in ("tool0", FINGERS[1]))
    finger_from_tool = np.linalg.inv(finger) @ tool
    turn, arm = finger_from_tool[:, :3, :3], finger_from_tool[:, :3, 3]
    force, moment = (np.einsum("nij,nj->ni", turn, part) for part in (more[:, :3], more[:, 3:]))
    wrench = recorded.wrench.copy()
    wrench[:, 1] += np.hstack([force, moment + np.cross(arm, force)])
    return replace(recorded, wrench=wrench)


def run(recorded: Recorded, robot: tactid.Manipulator) -> tuple[float | None, int, Array]:
    """How long until it is seen, s; how often it was seen without; the errors after, in %."""
    identifier = tactid.Identifier(robot, FINGERS)
    swap = recorded.time[0] + SWAP
    before, after = (int(np.searchsorted(recorded.time, swap + t)) for t in (0, AFTER))
    pose, twist = recorded.pose(), recorded.world_twist()

    def push(rows: slice) -> None:
        identifier.push(
            recorded.time[rows],
            recorded.q[rows],
            recorded.qd[rows],
            recorded.wrench[rows],
            pose=pose[rows],
            twist=twist[rows],
        )

    push(slice(0, before))
    false = identifier.estimate().payload_changes
    delay = None
    for k in range(before, after):
        push(slice(k, k + 1))
        if delay is None and identifier.estimate().payload_changes > false:
            delay = recorded.time[k] - swap
    estimate = identifier.estimate()
    false = estimate.payload_changes - (delay is not None)
    errors = 100 * (estimate.values - values_of(LIGHT)) / scales(LIGHT)
    return delay, false, errors


if __name__ == "__main__":
    main()
