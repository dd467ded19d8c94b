"""A bag of an arm that carries a known body: joint states, and three wrenches for each of them."""

from pathlib import Path

import numpy as np

import bags
import tactid

BODY = tactid.MassProperties(2.5, [0.02, -0.01, 0.16], np.diag([0.012, 0.015, 0.008]))
RATES = np.array([1.1, 1.3, 1.7, 2.3, 2.9, 3.7])
NOISE = [0.3, 0.3, 0.3, 0.02, 0.02, 0.02]
START_NS = 1_700_000_000_000_000_000


def arm_urdf() -> str:
    """The arm of the built-in robot, bolted down, without its gripper."""
    return tactid.Experiment.paper().urdf.split('<joint name="gripper_mount"')[0] + "</robot>"


def record(folder: Path, duration: float, joint_hz: int) -> Path:
    """Writes the bag, with the description of the robot."""
    arm = tactid.Manipulator.from_urdf(arm_urdf())
    time = np.arange(0.0, duration, 1 / 3 / joint_hz)
    angles = np.outer(time, RATES) + np.arange(6)
    q = [0, -1.2, 1.6, -0.4, 1.57, 0] + 0.6 * np.sin(angles)
    qd, qdd = 0.6 * RATES * np.cos(angles), -0.6 * RATES**2 * np.sin(angles)
    tool = arm.kinematics("tool0", q, qd, qdd)
    felt = tool.acceleration + np.array([0, 0, 9.81])
    in_world = felt, tool.angular_velocity, tool.angular_acceleration
    motion = np.einsum("nji,snj->sni", tool.pose[:, :3, :3], in_world)
    wrench = tactid.wrench_regressor(*motion) @ BODY.parameters
    wrench += np.random.default_rng(0).normal(size=wrench.shape) * NOISE
    described = bags.message("std_msgs/msg/String", data=arm_urdf())
    messages = [("/robot_description", START_NS, described)]
    for k, ns in enumerate((START_NS + np.round(time * 1e9).astype(int)).tolist()):
        if k % 3 == 0:
            states = bags.joints(ns, arm.joint_names, q[k].tolist(), qd[k].tolist())
            messages.append(("/joint_states", ns, states))
        force, moment = wrench[k, :3].tolist(), wrench[k, 3:].tolist()
        messages.append(("/wrench", ns, bags.wrench(ns, "tool0", force, moment)))
    return bags.write_bag(folder, messages)
