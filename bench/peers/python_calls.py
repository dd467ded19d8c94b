"""Inverse dynamics from Python: one call beside pin and MuJoCo, a series beside Rust."""

import re
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import airo_models
import mujoco
import numpy as np
import pinocchio as pin

import tactid
from peers.dynamics import Robot
from peers.harness import Array, Comparison, Contender

GRAVITY = np.array([0.0, 0.0, -9.81])
CALLS = 5000
SERIES = 100_000


def comparisons() -> Iterator[Comparison]:
    """A call for one state, and a call for many."""
    urdf = Path(airo_models.get_urdf_path("ur5e")).read_text()
    robot = tactid.Manipulator.from_urdf(urdf, base="fixed")
    # Arrays of their own: to take them from one array in each call costs as much as a computation.
    state = tuple(np.random.default_rng(5).normal(size=(3, robot.dof)))
    model = pin.buildModelFromXML(urdf)
    data = model.createData()
    calls = {
        "tactid": lambda: robot.inverse_dynamics(*state, gravity=GRAVITY)[0],
        "pin": lambda: pin.rnea(model, data, *state),
        "MuJoCo": in_mujoco(urdf, state),
    }
    contenders = [Contender(name, timed(call), call().copy()) for name, call in calls.items()]
    yield Comparison("Python: one inverse dynamics", "µs", contenders, scale=1e6, bar=1.0)

    peer = Robot(SERIES, floating=False)
    kernel = peer.tactid("series_inverse_dynamics", robot.dof)
    states = np.ascontiguousarray(np.moveaxis(peer.states.joints, 1, 0))
    whole = lambda: robot.inverse_dynamics(*states, gravity=GRAVITY)  # noqa: E731
    contenders = [
        Contender("tactid", timed(whole, calls=1, states=SERIES), whole()[0]),
        Contender("tactid in Rust", kernel, kernel.out.copy()),
    ]
    yield Comparison("Python: 100 000 inverse dynamics", "ns", contenders, bar=1 / 1.1)


def in_mujoco(urdf: str, state: tuple[Array, ...]) -> Callable[[], Array]:
    """A call of MuJoCo for the same state; the links need no meshes for it."""
    text = re.sub(r"<(visual|collision)\b.*?</\1>", "", urdf, flags=re.DOTALL)
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    q, qd, qdd = state

    def call() -> Array:
        data.qpos[:], data.qvel[:], data.qacc[:] = q, qd, qdd
        mujoco.mj_inverse(model, data)
        return data.qfrc_inverse

    return call


def timed(call: Callable, *, calls: int = CALLS, states: int = 1) -> Callable[[], float]:
    """Seconds of one state in the time of this thread: other processes on the core do not count."""

    def measure() -> float:
        start = time.thread_time()
        for _ in range(calls):
            call()
        return (time.thread_time() - start) / (calls * states)

    return measure
