"""The online update from a wrench sensor beside a plain loop in C++ with Eigen, on a UR5e."""

import ctypes
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path

import airo_models
import numpy as np

from peers.dynamics import PARAMETERS, TOOL, model_arguments
from peers.harness import TOLERANCE, Array, Comparison, Contender, peer
from peers.native import OWN_PROCESSOR, Kernel, handle, pointer, robot_library, tactid_library

SAMPLES = 10_000
"""Samples of one measurement, at 1 kHz."""

PERIOD = 1e-3
JOINTS = 6

NOISE = (1e-4, 1e-3, 0.5, 0.02)
"""Standard deviations: rad, rad/s, N and N m.

The loop in C++ knows those of the wrench; tactid estimates all."""

SEEDS = 10
"""Draws of noise from which errors are compared."""

EXACT = 1e-9
"""Largest relative difference between estimates from exact samples.

Rows agree to 1e-14; solving for the parameters multiplies rounding by the condition of the rows."""

PAYLOAD = np.array([2.0, 0.04, -0.02, 0.16, 0.03, 0.002, -0.004, 0.028, 0.003, 0.012])
"""Mass, first moments and inertia about the tool's origin, in the order of tactid."""


def comparisons() -> list[Comparison]:
    """The mean rows of windows, and the estimate after each sample."""
    return [
        Comparison(
            "online, a sample to mean rows of windows",
            "ns",
            {name: partial(timed_rows, name) for name in LIBRARIES},
            bar=1.3,
            tolerance=TOLERANCE,
        ),
        Comparison(
            "online, a sample to the estimate",
            "ns",
            {name: partial(timed_update, name) for name in LIBRARIES},
            bar=1.0,
            tolerance=EXACT,
            note="rms errors of mass, centre of mass and inertia at equal noise",
        ),
    ]


def timed_rows(name: str) -> Contender:
    """Mean rows of the windows by a library: six for each, with their targets."""
    loop = kernel(name, "rows", measured(), 66)
    return Contender(loop, comparable(name, loop.out).reshape(6, 11))


def timed_update(name: str) -> Contender:
    """The estimate after each sample by a library."""
    loop = kernel(name, "update", measured(), 10)
    return Contender(loop, comparable(name, loop.out), errors(name))


def kernel(library: str, name: str, samples: Array, width: int) -> Kernel:
    """A kernel of a library on samples."""
    return Kernel(LIBRARIES[library](samples), name, len(samples), np.zeros(width))


def tactid(samples: Array):
    """Runs tactid's kernels on samples."""
    library, size = tactid_library(), ctypes.c_size_t(samples.size)
    urdf = Path(airo_models.get_urdf_path("ur5e")).read_text().encode()
    made = library.tactid_online_new(urdf, TOOL.encode(), pointer(samples), size)
    online = handle(made, "the robot")

    def run(name: bytes, repetitions: ctypes.c_size_t, out: Array) -> bool:
        size = ctypes.c_size_t(out.size)
        return library.tactid_online_run(online, name, repetitions, pointer(out), size)

    return run


def cxx(samples: Array, flags: tuple[str, ...] = ()):
    """Runs the loop in C++ on samples."""
    library = robot_library("online", *flags)
    online = handle(library.online_new(*model_arguments(ur5e())), "the robot")

    def run(name: bytes, repetitions: ctypes.c_size_t, out: Array) -> bool:
        size = ctypes.c_size_t(len(samples))
        return library.online_run(online, name, pointer(samples), size, repetitions, pointer(out))

    return run


def comparable(name: str, out: Array) -> Array:
    """A result in the order of tactid.

    Rows of C++ lie column by column, in Pinocchio's order of the parameters.
    """
    if name == "tactid":
        return out.copy()
    if len(out) == len(PARAMETERS):
        return out[PARAMETERS]
    return out.reshape(11, 6).T[:, [*PARAMETERS, 10]].ravel()


def errors(name: str) -> str:
    """Root mean square errors of the estimates of a library from noisy samples."""
    noisy = [with_noise(measured(), seed) for seed in range(SEEDS)]
    loops = [kernel(name, "update", each, 10) for each in noisy]
    estimates = np.array([comparable(name, loop.out) for loop in loops])
    rms = lambda values: np.sqrt(np.mean(np.square(values)))  # noqa: E731
    mass = rms(estimates[:, 0] - PAYLOAD[0])
    center = rms(estimates[:, 1:4] / estimates[:, :1] - PAYLOAD[1:4] / PAYLOAD[0])
    inertia = rms(estimates[:, 4:] - PAYLOAD[4:])
    return f"{mass * 1e3:.3g} g, {center * 1e3:.3g} mm, {inertia * 1e4:.3g}e-4 kg m²"


LIBRARIES: dict[str, Callable[[Array], Callable]] = {
    "tactid": tactid,
    "C++ loop -O3": cxx,
    f"C++ loop -O3 {OWN_PROCESSOR}": partial(cxx, flags=(OWN_PROCESSOR,)),
}
"""What starts each library: a function of samples that returns what runs its kernels."""


def ur5e():
    """The robot in Pinocchio."""
    return peer("pinocchio", "pin").buildModelFromXML(
        Path(airo_models.get_urdf_path("ur5e")).read_text()
    )


@cache
def measured() -> Array:
    """Exact samples of a smooth motion, computed by Pinocchio.

    A row has the time, positions and velocities of the joints, and the wrench on the payload.
    """
    pin, model = peer("pinocchio", "pin"), ur5e()
    data, tool = model.createData(), model.getFrameId(TOOL)
    rows = np.zeros((SAMPLES, 1 + 2 * JOINTS + 6))
    rates, phases = 1.5 + 0.37 * np.arange(JOINTS), np.arange(JOINTS)
    order = np.argsort(PARAMETERS)
    for k, row in enumerate(rows):
        row[0] = time = k * PERIOD
        angle = rates * time + phases
        q, v, a = 0.6 * np.sin(angle), 0.6 * rates * np.cos(angle), -0.6 * rates**2 * np.sin(angle)
        pin.forwardKinematics(model, data, q, v, a)
        pose = pin.updateFramePlacement(model, data, tool)
        moving = pin.getFrameVelocity(model, data, tool, pin.LOCAL)
        change = pin.getFrameAcceleration(model, data, tool, pin.LOCAL)
        change.linear -= pose.rotation.T @ model.gravity.linear
        row[1:-6] = np.hstack([q, v])
        row[-6:] = pin.bodyRegressor(moving, change) @ PAYLOAD[order]
    return rows


def with_noise(samples: Array, seed: int) -> Array:
    """The samples with white noise on each channel."""
    size = np.repeat(NOISE, [JOINTS, JOINTS, 3, 3])
    noisy = samples.copy()
    noisy[:, 1:] += np.random.default_rng(seed).normal(size=(len(samples), len(size))) * size
    return noisy
