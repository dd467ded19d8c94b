"""Steps of the paper's spacecraft, beside MuJoCo with the same robot, payload and motion.

tactid holds the payload by friction between two fingers. In MuJoCo it is fixed to the tool, without
any contact, which is less work. The wrench is that at the start of a step, and the motion beside it
the mean over the step: for Runge and Kutta's method, they differ by half a step.
"""

import time
from collections.abc import Iterator
from pathlib import Path

import mujoco
import numpy as np
from mujoco import rollout
from rosbags.highlevel import AnyReader

import tactid
from peers.harness import Array, Comparison, Contender
from peers.native import BENCH, BUILD

STEP_S = 1e-3
SECONDS = 15.0
"""The three driven joints have 5 s each, a period of their motion."""

URDF = BENCH.parent / "crates" / "sim" / "robots" / "tactid.urdf"
POSTURE = [0.0, -1.2, 1.6, -0.4, np.pi / 2, 0.0]
DRIVE_GAIN = 1e2
"""Feedback of a joint's velocity in MuJoCo (N m s/rad), beside the torque of tactid's run.

Stiffer drives need implicit steps, with which the wrench that MuJoCo reports is not that of the
motion."""

INTEGRATORS = {
    "Euler": mujoco.mjtIntegrator.mjINT_EULER,
    "RK4": mujoco.mjtIntegrator.mjINT_RK4,
}


def comparisons() -> Iterator[Comparison]:
    """A step of tactid with its log, and of MuJoCo with each integrator."""
    experiment = tactid.Experiment.paper().replace(duration=SECONDS)
    log = BUILD / "simulated.mcap"
    log.parent.mkdir(parents=True, exist_ok=True)
    checks = tactid.simulate(experiment, log)
    errors = {
        "tactid": np.array(
            [
                checks.linear_momentum_drift,
                checks.angular_momentum_drift,
                checks.newton_residual,
                checks.euler_residual,
            ]
        )
    }
    contenders = [Contender("tactid, with log", lambda: with_log(experiment, log))]
    for integrator in INTEGRATORS:
        peer = Spacecraft(experiment.payload, integrator, log)
        name = f"MuJoCo {integrator}, payload fixed, no log"
        contenders.append(Contender(name, peer.seconds))
        errors[name] = peer.errors()
    texts = [f"{name}: {', '.join(f'{x:.0e}' for x in each)}" for name, each in errors.items()]
    note = (
        "change of the linear and the angular momentum as fractions of the largest of a body, and "
        "residuals of the payload's Newton and Euler equations as fractions of the largest force "
        "and moment: " + "; ".join(texts)
    )
    yield Comparison("simulation, a step of 1 ms", "µs", contenders, scale=1e6, note=note)


def with_log(experiment: tactid.Experiment, log: Path) -> float:
    """Seconds of a step, in the time of all threads."""
    start = time.process_time()
    report = tactid.simulate(experiment, log)
    return (time.process_time() - start) / report.steps


class Spacecraft:
    """The spacecraft in MuJoCo with locked fingers, whose joints move as in a log of tactid."""

    def __init__(self, payload: tactid.MassProperties, integrator: str, log: Path) -> None:
        spec = mujoco.MjSpec.from_string(URDF.read_text())
        spec.option.timestep, spec.option.gravity = STEP_S, np.zeros(3)
        spec.option.integrator = INTEGRATORS[integrator]
        spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
        spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_LIMIT
        spec.compiler.fusestatic = False  # The payload stays a body, of which the wrench is known.
        spec.body("base_link").add_freejoint()
        xx, xy, xz, yy, yz, zz = np.asarray(payload.inertia)[np.triu_indices(3)]
        held = spec.body("tool0").add_body(name="payload", mass=payload.mass, ipos=payload.com)
        held.fullinertia, held.explicitinertial = [xx, yy, zz, xy, xz, yz], True
        held.add_site(name="payload", pos=payload.com)
        for finger in ("finger_left_joint", "finger_right_joint"):
            spec.delete(spec.joint(finger))
        joints = [joint.name for joint in spec.joints if joint.name.startswith("joint_")]
        for joint in joints:
            drive = spec.add_actuator(target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)
            drive.set_to_velocity(kv=DRIVE_GAIN)
        for kind in (mujoco.mjtSensor.mjSENS_FORCE, mujoco.mjtSensor.mjSENS_TORQUE):
            spec.add_sensor(type=kind, objtype=mujoco.mjtObj.mjOBJ_SITE, objname="payload")
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        self.data.qpos[7:] = POSTURE
        self.start = np.zeros(mujoco.mj_stateSize(self.model, FULL))
        mujoco.mj_getState(self.model, self.data, self.start, FULL)
        self.commands = commands(log, joints)

    def states(self) -> tuple[Array, Array]:
        """The state after each step, and the wrench on the payload at its start."""
        states, wrenches = rollout.rollout(self.model, self.data, self.start, self.commands)
        return states[0], wrenches[0]

    def seconds(self) -> float:
        """Seconds of a step."""
        start = time.thread_time()
        self.states()
        return (time.thread_time() - start) / len(self.commands)

    def errors(self) -> Array:
        """What tactid reports of a run, of all steps."""
        states, wrenches = self.states()
        payload = self.model.body("payload").id
        momenta = np.array([self.momenta(state) for state in states])
        total = momenta.sum(axis=1)
        drift = np.linalg.norm(total - total[0], axis=2).max(axis=0)
        largest = np.linalg.norm(momenta, axis=3).max(axis=(0, 1))
        changes = np.diff(self.about_center(states, payload), axis=0) / STEP_S
        at_start = self.in_world(states[:-1], wrenches[1:])
        residual = np.linalg.norm(changes - at_start, axis=2).max(axis=0)
        return np.hstack([drift / largest, residual / np.linalg.norm(at_start, axis=2).max(axis=0)])

    def momenta(self, state: Array) -> Array:
        """Linear and angular momentum of each body about the world's origin."""
        self.move_to(state)
        return np.array([self.momentum(body) for body in range(1, self.model.nbody)])

    def about_center(self, states: Array, body: int) -> Array:
        """Linear momentum of a body, and its angular momentum about its centre of mass."""
        momenta = []
        for state in states:
            self.move_to(state)
            linear, angular = self.momentum(body)
            momenta.append([linear, angular - np.cross(self.data.xipos[body], linear)])
        return np.array(momenta)

    def momentum(self, body: int) -> Array:
        """Linear and angular momentum of a body in the present state, about the world's origin."""
        both = np.zeros(6)
        mujoco.mj_objectVelocity(self.model, self.data, mujoco.mjtObj.mjOBJ_BODY, body, both, 0)
        angular_velocity, velocity = both[:3], both[3:]
        axes = self.data.ximat[body].reshape(3, 3)
        inertia = axes @ np.diag(self.model.body_inertia[body]) @ axes.T
        linear = self.model.body_mass[body] * velocity
        angular = inertia @ angular_velocity + np.cross(self.data.xipos[body], linear)
        return np.array([linear, angular])

    def in_world(self, states: Array, wrenches: Array) -> Array:
        """Force and moment about the centre of mass, in world axes."""
        turned = []
        for state, wrench in zip(states, wrenches, strict=True):
            self.move_to(state)
            axes = self.data.site("payload").xmat.reshape(3, 3)
            turned.append(wrench.reshape(2, 3) @ axes.T)
        return np.array(turned)

    def move_to(self, state: Array) -> None:
        """Sets a state, and computes the poses and velocities of its bodies."""
        mujoco.mj_setState(self.model, self.data, state, FULL)
        mujoco.mj_fwdPosition(self.model, self.data)
        mujoco.mj_fwdVelocity(self.model, self.data)


FULL = mujoco.mjtState.mjSTATE_FULLPHYSICS


def commands(log: Path, joints: list[str]) -> Array:
    """Inputs of the drives in each step: velocity after it, and torque in it over the gain."""
    velocity, torque = [], []
    with AnyReader([log]) as reader:
        chosen = [each for each in reader.connections if each.topic == "/joint_states"]
        for connection, _, data in reader.messages(chosen):
            message = reader.deserialize(data, connection.msgtype)
            order = [message.name.index(joint) for joint in joints]
            velocity.append(message.velocity[order])
            torque.append(message.effort[order])
    return np.array(velocity)[1:] + np.array(torque)[:-1] / DRIVE_GAIN
