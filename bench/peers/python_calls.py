"""Inverse dynamics from Python: one call beside pin and MuJoCo, a series beside Rust."""

import re
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path

import airo_models
import numpy as np

import tactid
from peers.dynamics import Robot
from peers.harness import Array, Comparison, Contender, peer

GRAVITY = np.array([0.0, 0.0, -9.81])
CALLS = 5000
SERIES = 100_000
DOF = 6


def comparisons() -> list[Comparison]:
    """A call for one state, and a call for many."""
    one = {"tactid": one_by_tactid, "pin": one_by_pin, "MuJoCo": one_by_mujoco}
    many = {"tactid": many_by_tactid, "tactid in Rust": many_in_rust}
    return [
        Comparison("Python: one inverse dynamics", "µs", one, scale=1e6, bar=1.0),
        Comparison("Python: 100 000 inverse dynamics", "ns", many, bar=0.95),
    ]


def urdf() -> str:
    """The robot."""
    return Path(airo_models.get_urdf_path("ur5e")).read_text()


def state() -> tuple[Array, ...]:
    """Positions, velocities and accelerations, random and the same in every run.

    Arrays of their own: to take them from one array in each call costs as much as a computation.
    """
    return tuple(np.random.default_rng(5).normal(size=(3, DOF)))


def one_by_tactid() -> Contender:
    """A call of tactid."""
    robot, joints = tactid.Manipulator.from_urdf(urdf(), base="fixed"), state()
    call = lambda: robot.inverse_dynamics(*joints, gravity=GRAVITY)[0]  # noqa: E731
    return Contender(timed(call), call())


def one_by_pin() -> Contender:
    """A call of Pinocchio."""
    pin, joints = peer("pinocchio", "pin"), state()
    model = pin.buildModelFromXML(urdf())
    data = model.createData()
    call = lambda: pin.rnea(model, data, *joints)  # noqa: E731
    return Contender(timed(call), call().copy())


def one_by_mujoco() -> Contender:
    """A call of MuJoCo, whose links need no meshes for it."""
    mujoco = peer("mujoco", "mujoco")
    text = re.sub(r"<(visual|collision)\b.*?</\1>", "", urdf(), flags=re.DOTALL)
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    q, qd, qdd = state()

    def call() -> Array:
        data.qpos[:], data.qvel[:], data.qacc[:] = q, qd, qdd
        mujoco.mj_inverse(model, data)
        return data.qfrc_inverse

    return Contender(timed(call), call().copy())


@cache
def robot_with_states() -> Robot:
    """The robot and the states of a series."""
    return Robot(SERIES, floating=False)


def many_by_tactid() -> Contender:
    """One call for all states."""
    robot = tactid.Manipulator.from_urdf(urdf(), base="fixed")
    states = np.ascontiguousarray(np.moveaxis(robot_with_states().states.joints, 1, 0))
    call = lambda: robot.inverse_dynamics(*states, gravity=GRAVITY)  # noqa: E731
    return Contender(timed(call, calls=1, states=SERIES), call()[0])


def many_in_rust() -> Contender:
    """The same states in Rust, without Python."""
    kernel = robot_with_states().tactid("series_inverse_dynamics", DOF)
    return Contender(kernel, kernel.out.copy())


def timed(call: Callable, *, calls: int = CALLS, states: int = 1) -> Callable[[], float]:
    """Seconds of one state in the time of this thread: other processes on the core do not count."""

    def measure() -> float:
        start = time.thread_time()
        for _ in range(calls):
            call()
        return (time.thread_time() - start) / (calls * states)

    return measure
