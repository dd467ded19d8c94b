"""A bag of the simulated arm with a zeroed sensor: joint states, and three wrenches for each."""

from pathlib import Path

import numpy as np

import bags
from tactid._live import simulated_arm

START_NS = 1_700_000_000_000_000_000


def record(folder: Path, duration: float, joint_hz: int) -> Path:
    """Writes the bag, with the description of the robot."""
    arm = simulated_arm.SimulatedArm()
    time = np.arange(0.0, duration, 1 / 3 / joint_hz)
    q, qd, wrench = arm.samples(time)
    wrench -= simulated_arm._OFFSET
    described = bags.message("std_msgs/msg/String", data=arm.urdf)
    messages = [("/robot_description", START_NS, described)]
    for k, ns in enumerate((START_NS + np.round(time * 1e9).astype(int)).tolist()):
        if k % 3 == 0:
            states = bags.joints(ns, arm.joint_names, q[k].tolist(), qd[k].tolist())
            messages.append(("/joint_states", ns, states))
        force, moment = wrench[k, :3].tolist(), wrench[k, 3:].tolist()
        messages.append(("/wrench", ns, bags.wrench(ns, "tool0", force, moment)))
    return bags.write_bag(folder, messages)
