"""Steps of the paper's spacecraft, beside MuJoCo with the same robot, payload and motion.

tactid holds the payload by friction between two fingers. In MuJoCo it is fixed to the tool, without
any contact, which is less work. MuJoCo is measured with tactid's step; and its Euler method, which
is less exact, also with the longest step at which momentum and moments are as exact. Its forces
stay less exact: those of tactid are the impulses of its contacts, which are exact to rounding.
Runge and Kutta's method keeps the momentum better than tactid with the same step. The residuals of
its wrenches are those of their mean over a step, a rule of second order, and no error of MuJoCo.
"""

import time
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path

import numpy as np

import tactid
from peers.harness import Array, Comparison, Contender, MissingPeerError, peer
from peers.native import BENCH, BUILD

STEP_S = 1e-3
SECONDS = 15.0
"""The three driven joints have 5 s each, a period of their motion."""

EXPERIMENT = tactid.Experiment.paper().replace(duration=SECONDS)
URDF = BENCH.parent / "crates" / "sim" / "robots" / "tactid.urdf"
POSTURE = [0.0, -1.2, 1.6, -0.4, np.pi / 2, 0.0]
DRIVE_GAIN = 1e2
"""Feedback of a joint's velocity in MuJoCo (N m s/rad), beside the torque of tactid's run.

Stiffer drives need implicit steps, with which the wrench that MuJoCo reports is not that of the
motion."""

INTEGRATORS = ("Euler", "RK4")
SUBSTEPS = (1, 2, 4, 8, 16, 32, 64, 128)
"""Divisions of a step that are tried."""
COMPARED = [0, 1, 3]
"""Which of the four errors must be as small as tactid's: all but that of forces."""


def comparisons() -> list[Comparison]:
    """A step of tactid with its log, and of MuJoCo with each integrator."""
    contenders: dict[str, Callable[[], Contender]] = {"tactid, with log": with_log}
    for integrator in INTEGRATORS:
        contenders[f"MuJoCo {integrator}, payload fixed, no log"] = partial(
            with_equal_step, integrator
        )
    contenders["MuJoCo Euler, as exact, payload fixed, no log"] = euler_as_exact
    note = (
        "change of the linear and the angular momentum as fractions of the largest of a body, and "
        "residuals of the payload's Newton and Euler equations as fractions of the largest force "
        "and moment"
    )
    return [Comparison("simulation, 1 ms", "µs", contenders, scale=1e6, bar=0.5, note=note)]


@cache
def simulated() -> tuple[Path, Array]:
    """A log of tactid's run, and its errors."""
    log = BUILD / "simulated.mcap"
    log.parent.mkdir(parents=True, exist_ok=True)
    checks = tactid.simulate(EXPERIMENT, log)
    momentum = [checks.linear_momentum_drift, checks.angular_momentum_drift]
    return log, np.array([*momentum, checks.newton_residual, checks.euler_residual])


def with_log() -> Contender:
    """tactid, in the time of all threads."""
    log, errors = simulated()

    def measure() -> float:
        start = time.process_time()
        report = tactid.simulate(EXPERIMENT, log)
        return (time.process_time() - start) / report.steps

    return Contender(measure, note=text(errors))


def with_equal_step(integrator: str) -> Contender:
    """MuJoCo with the step of tactid."""
    spacecraft = Spacecraft(integrator, 1)
    return Contender(spacecraft.seconds, note=text(spacecraft.errors()))


def euler_as_exact() -> Contender:
    """MuJoCo with the longest step whose errors of momentum and moments are at most tactid's."""
    _, allowed = simulated()
    for substeps in SUBSTEPS:
        spacecraft = Spacecraft("Euler", substeps)
        errors = spacecraft.errors()
        if (errors <= allowed)[COMPARED].all():
            note = f"steps of {STEP_S / substeps * 1e3:.3g} ms, {text(errors)}"
            return Contender(spacecraft.seconds, note=note)
    raise MissingPeerError(f"no step down to {STEP_S / SUBSTEPS[-1] * 1e3:.2g} ms is as exact")


def text(errors: Array) -> str:
    """Errors for a note."""
    return ", ".join(f"{error:.0e}" for error in errors)


class Spacecraft:
    """The spacecraft in MuJoCo with locked fingers, whose joints move as in a log of tactid."""

    def __init__(self, integrator: str, substeps: int) -> None:
        self.mujoco = mujoco = peer("mujoco", "mujoco")
        # Euler's method diverges with the longest steps that are tried, and says so in every one.
        mujoco.set_mju_user_warning(lambda _: None)
        self.substeps, self.full = substeps, mujoco.mjtState.mjSTATE_FULLPHYSICS
        payload = EXPERIMENT.payload
        spec = mujoco.MjSpec.from_string(URDF.read_text())
        spec.option.timestep, spec.option.gravity = STEP_S / substeps, np.zeros(3)
        spec.option.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}")
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
        self.start = np.zeros(mujoco.mj_stateSize(self.model, self.full))
        mujoco.mj_getState(self.model, self.data, self.start, self.full)
        self.commands = np.repeat(commands(tuple(joints)), substeps, axis=0)

    def states(self) -> Array:
        """The state after each step."""
        rollout = peer("mujoco.rollout", "mujoco").rollout
        return rollout(self.model, self.data, self.start, self.commands)[0][0]

    def seconds(self) -> float:
        """Seconds of a step of tactid."""
        start = time.thread_time()
        self.states()
        return (time.thread_time() - start) * self.substeps / len(self.commands)

    def errors(self) -> Array:
        """What tactid reports of a run, of one substep of each step.

        Euler's method moves the payload with the wrench at the start of a step; for Runge and
        Kutta's it is compared with the mean of those at its start and at its end.
        """
        states, payload = self.states(), self.model.body("payload").id
        first = np.arange(0, len(states) - 1, self.substeps)
        before, after, commands = states[first], states[first + 1], self.commands[first + 1]
        momenta = np.array([self.momenta(state) for state in before])
        total = momenta.sum(axis=1)
        drift = np.linalg.norm(total - total[0], axis=2).max(axis=0)
        largest = np.linalg.norm(momenta, axis=3).max(axis=(0, 1))
        acting = self.wrenches(before, commands)
        sizes = np.linalg.norm(acting, axis=2).max(axis=0)
        if self.model.opt.integrator == self.mujoco.mjtIntegrator.mjINT_RK4:
            acting = (acting + self.wrenches(after, commands)) / 2
        change = self.about_center(after, payload) - self.about_center(before, payload)
        residual = np.linalg.norm(change / self.model.opt.timestep - acting, axis=2).max(axis=0)
        return np.hstack([drift / largest, residual / sizes])

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
        of_body = self.mujoco.mjtObj.mjOBJ_BODY
        self.mujoco.mj_objectVelocity(self.model, self.data, of_body, body, both, 0)
        angular_velocity, velocity = both[:3], both[3:]
        axes = self.data.ximat[body].reshape(3, 3)
        inertia = axes @ np.diag(self.model.body_inertia[body]) @ axes.T
        linear = self.model.body_mass[body] * velocity
        angular = inertia @ angular_velocity + np.cross(self.data.xipos[body], linear)
        return np.array([linear, angular])

    def wrenches(self, states: Array, commands: Array) -> Array:
        """Force and moment on the payload about its centre of mass, in world axes."""
        turned = []
        for state, command in zip(states, commands, strict=True):
            self.mujoco.mj_setState(self.model, self.data, state, self.full)
            self.data.ctrl[:] = command
            self.mujoco.mj_forward(self.model, self.data)
            axes = self.data.site("payload").xmat.reshape(3, 3)
            turned.append(self.data.sensordata.reshape(2, 3) @ axes.T)
        return np.array(turned)

    def move_to(self, state: Array) -> None:
        """Sets a state, and computes the poses and velocities of its bodies."""
        self.mujoco.mj_setState(self.model, self.data, state, self.full)
        self.mujoco.mj_fwdPosition(self.model, self.data)
        self.mujoco.mj_fwdVelocity(self.model, self.data)


@cache
def commands(joints: tuple[str, ...]) -> Array:
    """Inputs of the drives in each step: velocity after it, and torque in it over the gain."""
    velocity, torque = [], []
    reading = peer("rosbags.highlevel", "rosbags").AnyReader
    with reading([simulated()[0]]) as reader:
        chosen = [each for each in reader.connections if each.topic == "/joint_states"]
        for connection, _, data in reader.messages(chosen):
            message = reader.deserialize(data, connection.msgtype)
            order = [message.name.index(joint) for joint in joints]
            velocity.append(message.velocity[order])
            torque.append(message.effort[order])
    return np.array(velocity)[1:] + np.array(torque)[:-1] / DRIVE_GAIN
