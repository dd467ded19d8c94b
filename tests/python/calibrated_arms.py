"""Recordings for calibrations: a simulated arm with gains and friction, and measured ones.

The payload's torque in a measured recording is Pinocchio's, from the measured motion: friction,
noise and timing are real, and the truth is known.
"""

import sys
from dataclasses import dataclass
from functools import cache
from importlib.metadata import files
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

import bags
import tactid
from recorded_arm import Arm, Body, body
from recordings import EPOCH_NS, clock

sys.path.append(str(Path(__file__).parents[2] / "bench"))
from plain_fit import smooth

UNISA = Path(__file__).parents[3] / "shared/data/unisa"


@dataclass(frozen=True)
class Measured:
    """A measured recording, and the URDF that others publish of this robot."""

    name: str
    urdf_name: str
    tip: str
    bandwidth_hz: float
    """Above which the measured motion is noise."""

    @property
    def urdf(self) -> Path:
        paths = (Path(str(file.locate())) for file in files("example-robot-data") or ())
        return next(path for path in paths if path.name == self.urdf_name)

    @property
    def log(self) -> Path:
        path = UNISA / f"{self.name}_exciting_trajectory.db3"
        if not path.exists():
            pytest.skip("the measured recordings are not here")
        return path


UR10 = Measured("ur10", "ur10_robot.urdf", "tool0", 8.0)
UR5 = Measured("ur5", "ur5_robot.urdf", "tool0", 8.0)
"""The description only."""
FRANKA = Measured("panda", "panda.urdf", "panda_link8", 5.0)


def halves(robot: Measured, folder: Path, payload: Body) -> list[tuple[Path, Path]]:
    """Both halves of a measured recording as bags, each without and with a payload."""
    joints = tactid.read(robot.log, "/joint_states")
    position, effort = np.array(joints["position"]), np.array(joints["effort"])
    velocity = np.array(joints["velocity"])
    time = np.array(joints.time)
    count = len(time)
    added = _torque(robot, list(joints.names), time, position, velocity, payload)
    pairs = []
    for number, part in enumerate((slice(0, count // 2), slice(count // 2, count))):
        arrays = (time[part], position[part], velocity[part])
        pairs.append(
            (
                write(folder / f"unloaded{number}", list(joints.names), *arrays, effort[part]),
                write(
                    folder / f"loaded{number}", list(joints.names), *arrays, (effort + added)[part]
                ),
            )
        )
    return pairs


def _torque(
    robot: Measured,
    names: list[str],
    time: np.ndarray,
    position: np.ndarray,
    velocity: np.ndarray,
    payload: Body,
) -> np.ndarray:
    """The torque of a payload in a measured motion, without what is above its bandwidth."""
    model, loaded = (pin.buildModelFromUrdf(str(robot.urdf)) for _ in "ab")
    tip = model.frames[model.getFrameId(robot.tip)]
    loaded.appendBodyToJoint(tip.parentJoint, payload.spatial, tip.placement)
    own = [name.replace("fer_", "panda_") for name in names]
    places = [model.joints[model.getJointId(name)].idx_v for name in own]
    q, v = (smooth(time, values, robot.bandwidth_hz) for values in (position, velocity))
    a = np.gradient(v, time, axis=0)
    whole = np.zeros((3, len(time), model.nv))
    whole[:, :, places] = (q, v, a)
    datas = model.createData(), loaded.createData()
    added = [
        pin.rnea(loaded, datas[1], *each) - pin.rnea(model, datas[0], *each)
        for each in zip(*whole, strict=True)
    ]
    return np.array(added)[:, places]


GAINS = np.array([1.12, 0.9, 1.2, 0.85, 1.08, 0.95])
"""Recorded efforts times these are torques."""
COULOMB = np.array([6.0, 7.0, 5.0, 1.2, 1.0, 0.8])
VISCOUS = np.array([8.0, 9.0, 7.0, 1.5, 1.2, 1.0])
LOAD_FRICTION = np.array([0.05, 0.12, 0.1, 0.08, 0.06, 0.1])


KNOWN = body(2.805, [0.02, -0.01, 0.06], [0.008, 0.011, 0.009], [0.2, 0.1, -0.3])
OTHER = body(4.2, [-0.04, 0.05, 0.12], [0.021, 0.03, 0.026], [0.5, -0.2, 0.4])


def calibrated(folder: Path) -> tactid.Calibration:
    """The simulated arm of a folder, calibrated with one payload of which the mass is known."""
    found = tactid.calibrate(
        simulated(folder, None, 11),
        loaded=simulated(folder, KNOWN, 12),
        payload_mass_kg=KNOWN.mass,
        urdf=folder / "arm.urdf",
        cutoff_hz=6.0,
    )
    found.write(folder / "arm.toml")
    return found


@cache
def simulated(folder: Path, payload: Body | None, seed: int, duration_s: float = 30.0) -> Path:
    """A bag of the UR5e with gains, friction and 1 % noise, with a payload or without."""
    state = Arm(payload or Body(1.0, np.zeros(3), np.eye(3)), seed=seed).at(
        clock(duration_s, 125.0)
    )
    torque = state.unloaded_effort if payload is None else state.effort
    sign = np.tanh(state.v / 0.02)
    friction = sign * (COULOMB + LOAD_FRICTION * np.abs(torque)) + VISCOUS * state.v
    rng = np.random.default_rng(seed)
    noisy = [
        values + 0.01 * values.std(axis=0) * rng.normal(size=values.shape)
        for values in (state.q - state.q.mean(axis=0), state.v, (torque + friction) / GAINS)
    ]
    names = [
        f"{name}_joint"
        for name in ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
    ]
    q = noisy[0] + state.q.mean(axis=0)
    return write(folder / f"simulated{seed}", names, state.time, q, noisy[1], noisy[2])


def write(
    path: Path,
    names: list[str],
    time: np.ndarray,
    position: np.ndarray,
    velocity: np.ndarray,
    effort: np.ndarray,
) -> Path:
    """Writes joint states as a bag."""
    messages = []
    for t, q, v, u in zip(time, position, velocity, effort, strict=True):
        stamp = EPOCH_NS + round((t - time[0]) * 1e9)
        message = bags.joints(stamp, names, q.tolist(), v.tolist(), u.tolist())
        messages.append(("/joint_states", stamp, message))
    return bags.write_bag(path, messages)
