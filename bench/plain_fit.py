"""The plain fit beside which `bench/real.py` puts tactid: ordinary least squares of all samples.

For joint torques it is what the literature does: positions pass a filter without delay and are
differentiated twice; links, Coulomb and viscous friction and an offset of each joint are fitted to
unloaded recordings; the payload is then fitted to what this arm leaves. There are no weights, no
intervals and no constraint to bodies that can exist.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import tactid

Array = NDArray[np.float64]

GRAVITY = [0.0, 0.0, -9.81]
BANDWIDTH_HZ = 5.0
"""Of the filter of motion and torques."""
SLOW = 0.01
"""Speed below which Coulomb friction fades, rad/s: the sign of a joint at rest is noise."""


class Joints(NamedTuple):
    """A recording of joint states, with efforts in N m or in A."""

    time: Array
    q: Array
    qd: Array
    effort: Array


def smooth(time: Array, values: Array, bandwidth_hz: float) -> Array:
    """Returns Gaussian means, 3 dB down at the bandwidth; the ends are mirrored at their points."""
    step = (time[-1] - time[0]) / (len(time) - 1)
    sigma = 0.1325 / bandwidth_hz / step
    reach = int(np.ceil(5 * sigma))
    weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2)
    before = 2 * values[0] - values[reach:0:-1]
    after = 2 * values[-1] - values[-2 : -reach - 2 : -1]
    columns = np.vstack([before, values, after]).T
    means = [np.convolve(column, weights / weights.sum(), "valid") for column in columns]
    return np.array(means).T


def motion(joints: Joints, bandwidth_hz: float = BANDWIDTH_HZ) -> tuple[Array, Array, Array]:
    """Returns smoothed positions, velocities and accelerations."""
    q = smooth(joints.time, joints.q, bandwidth_hz)
    qd = np.gradient(q, joints.time, axis=0)
    return q, qd, np.gradient(qd, joints.time, axis=0)


def payload_rows(robot: tactid.Manipulator, link: str, states: tuple[Array, ...]) -> Array:
    """Returns the torques of each of the ten parameters of a body on a link, (N, n, 10)."""

    def torques(arm: tactid.Manipulator) -> Array:
        return arm.inverse_dynamics(*states, gravity=GRAVITY)[0]

    # A body without mass is none: each parameter is beside 1 kg at the origin.
    bodies = np.eye(10)
    bodies[1:, 0] = 1.0
    found = [
        torques(robot.with_payload(link, tactid.MassProperties.from_parameters(body)))
        for body in bodies
    ]
    return np.stack([found[0] - torques(robot), *(each - found[0] for each in found[1:])], axis=2)


def arm_rows(robot: tactid.Manipulator, states: tuple[Array, ...]) -> Array:
    """Returns the torques of the links' parameters and of the friction, (N n, columns)."""
    of_links = [payload_rows(robot, link, states) for link in robot.frame_names]
    velocity = states[1]
    joints = velocity.shape[1]
    friction = [np.tanh(velocity / SLOW), velocity, np.ones_like(velocity)]
    of_friction = [each[:, :, None] * np.eye(joints) for each in friction]
    rows = np.concatenate([*of_links, *of_friction], axis=2)
    return rows.reshape(-1, rows.shape[2])


def arm(robot: tactid.Manipulator, unloaded: list[Joints]) -> Array:
    """Fits links and friction of an arm, whose efforts are torques, to unloaded recordings."""
    rows = np.concatenate([arm_rows(robot, motion(each)) for each in unloaded])
    return np.linalg.lstsq(rows, np.concatenate([torques(each) for each in unloaded]), rcond=None)[
        0
    ]


def torques(joints: Joints) -> Array:
    """Returns the smoothed torques of a recording, sample by sample."""
    return smooth(joints.time, joints.effort, BANDWIDTH_HZ).ravel()


def payload(robot: tactid.Manipulator, tip: str, arm: Array, loaded: Joints) -> Array:
    """Returns the ten parameters of the payload of a recording, by what the arm leaves."""
    states = motion(loaded)
    rows = payload_rows(robot, tip, states).reshape(-1, 10)
    left = torques(loaded) - arm_rows(robot, states) @ arm
    return np.linalg.lstsq(rows, left, rcond=None)[0]
