"""Recordings that no robot made: a known body, a motion, noise, and least squares in NumPy.

They stand in for ``tactid.Identification`` where results are shown, and for what goes wrong.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

import tactid
from tactid.bodies import principal_moments
from tactid.result import values_of

Array = NDArray[np.float64]

STRIDE = 0.02
GRAVITY = np.array([0.0, 0.0, -9.81])
BODY = tactid.MassProperties(
    1.84,
    [0.012, -0.031, 0.094],
    [[0.0112, 0.0011, -0.0009], [0.0011, 0.0093, 0.0014], [-0.0009, 0.0014, 0.0046]],
)
LENGTH = 0.1
SCALES = LENGTH ** np.array([0, 1, 1, 1, 2, 2, 2, 2, 2, 2])
"""By which a parameter is divided: a body of 0.1 m has them all of the size of its mass."""

KINDS = ((1, slice(0, 1)), (3, slice(1, 4)), (6, slice(4, 10)))
"""How many values there are of mass, centre of mass and inertia, and where."""


@dataclass(frozen=True)
class EstimateDouble:
    """The part of ``tactid.PayloadEstimate`` that results are made from."""

    values: Array
    identifiable: Sequence[bool]
    is_physical: bool = True
    intervals: int = 1
    refused: int = 0
    gaps: int = 0

    @property
    def not_identifiable(self) -> list[str]:
        pairs = zip(tactid.VALUE_NAMES, self.identifiable, strict=True)
        return [name for name, known in pairs if not known]


@dataclass(frozen=True)
class RecordingDouble:
    """The part of ``tactid.Identification`` that results are made from."""

    estimate: EstimateDouble
    deviation: Array
    history_time: Array
    history: Array
    history_deviation: Array
    fit_time: Array
    fit_measured: Array
    fit_predicted: Array
    fit_weight: Array
    fit_held_out: NDArray[np.bool_]
    channels: list[str]
    channel_units: list[str]
    excitation_values: Array
    excitation_directions: Array
    residual_rms: Array
    held_out_rms: Array
    duration: float
    way: str = "tactile"
    tool: str = "tool0"
    estimator: str = "rls"
    start_ns: int = 1_700_000_000_000_000_000
    stride: float = STRIDE
    cutoff: float = 10.0
    delay: float = 0.0123
    delay_estimate: float | None = 0.0123
    delay_deviation: float | None = 0.0004
    known_mass: float | None = None
    known_mass_deviation: float | None = None
    bounding_box: Array | None = None
    offset: Array = field(default_factory=lambda: np.zeros(0))
    offset_deviation: Array = field(default_factory=lambda: np.zeros(0))
    clock: str = "stamps"
    dirt: Sequence[tuple[str, str, int, float]] = ()
    gravity: Array = field(default_factory=GRAVITY.copy)
    motion_advice: list[str] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    damage: list[str] = field(default_factory=list)

    @property
    def principal_moments(self) -> Array:
        if not np.isfinite(self.estimate.values).all():
            return np.full(3, np.nan)
        return np.array(principal_moments(self.estimate.values.tolist()))

    @property
    def principal_moment_deviation(self) -> Array:
        """As large as that of the worst known entry of the inertia."""
        return np.full(3, self.deviation[4:].max())

    def remaining(self, within: float) -> Array:
        """By the mean of the whole recording."""
        values, missing = self.estimate.values, np.full(10, np.nan)
        if not np.isfinite(values).all():
            return missing
        largest = np.concatenate([np.full(n, np.abs(values[k]).max()) for n, k in KINDS])
        part = 1.96 * self.deviation / (within * largest)
        return np.asarray(self.duration * np.maximum(part**2 - 1, 0))

    def but(self, **changes: object) -> "RecordingDouble":
        return replace(self, **changes)  # type: ignore[arg-type]

    def with_estimate(self, **changes: object) -> "RecordingDouble":
        return replace(self, estimate=replace(self.estimate, **changes))  # type: ignore[arg-type]


def tactile(duration: float = 40.0, swing: Sequence[float] = (0.9, 0.7, 1.1)) -> RecordingDouble:
    """A wrist that swings about its axes, a force sensor with noise, and two knocks against it.

    Least squares is made to give in to knocks as little as a robust one: by their weights.
    """
    rng = np.random.default_rng(7)
    time = np.arange(0.0, duration, STRIDE)
    rows = _wrench_rows(time, swing)
    noise = np.array([0.12, 0.12, 0.2, 0.006, 0.006, 0.004])
    measured = rows @ BODY.parameters + noise * rng.normal(size=(len(time), 6))
    # What no rigid body explains: a cable that swings.
    measured[:, 0] += 0.1 * np.sin(2 * np.pi * 3.1 * time)
    weight = np.ones_like(measured)
    for at in (0.21 * duration, 0.55 * duration):
        knock = np.exp(-(((time - at) / 0.08) ** 2))
        measured += knock[:, None] * [9.0, -6.0, 12.0, 0.3, 0.5, -0.2]
        weight[knock > 0.02] = 0.0
        weight[(knock > 0.003) & (knock < 0.02)] = 0.3
    names = [f"{kind} {axis}" for kind in ("force", "moment") for axis in "xyz"]
    return _solved(time, rows, measured, weight, noise, names, ["N"] * 3 + ["N m"] * 3)


def effort(joints: int = 7, duration: float = 20.0) -> RecordingDouble:
    """What the motors of an arm feel of the body: each a mixture of its wrench."""
    rng = np.random.default_rng(8)
    time = np.arange(0.0, duration, STRIDE)
    mixture = rng.normal(size=(joints, 6)) * [0.4, 0.4, 0.4, 1, 1, 1]
    sway = 1 + 0.5 * np.sin(time[:, None, None] * rng.uniform(0.3, 1.5, size=(joints, 6)))
    rows = (mixture * sway) @ _wrench_rows(time, (0.9, 0.7, 1.1))
    noise = np.full(joints, 0.15)
    measured = rows @ BODY.parameters + noise * rng.normal(size=(len(time), joints))
    names = [f"effort panda_joint{number}" for number in range(1, joints + 1)]
    found = _solved(time, rows, measured, np.ones_like(measured), noise, names, ["N m"] * joints)
    return found.but(
        way="effort", delay=0.0, delay_estimate=None, delay_deviation=None, tool="panda_link8"
    )


def turned_about_one_axis() -> RecordingDouble:
    """A turntable with an upright axis: the height stays unknown, and most of the inertia."""
    advice = "Tilting the payload, about x and about y, would make com z and the inertia known."
    return tactile(swing=(0.0, 0.0, 1.1)).but(motion_advice=[advice])


def nothing_known() -> RecordingDouble:
    """A log in which nothing moved and nothing was felt, by an estimator that then gives NaN."""
    found = tactile(duration=2.0)
    nothing, infinite = np.full(10, np.nan), np.full(10, np.inf)
    dead = np.zeros_like(found.fit_measured)
    return found.with_estimate(values=nothing, identifiable=[False] * 10, is_physical=False).but(
        deviation=infinite,
        history=np.full_like(found.history, np.nan),
        history_deviation=np.full_like(found.history, np.inf),
        fit_measured=dead,
        fit_predicted=np.full_like(dead, np.nan),
        excitation_values=np.zeros(10),
        excitation_directions=np.eye(10),
        residual_rms=np.full(6, np.nan),
        held_out_rms=np.full(6, np.nan),
        delay=float("nan"),
        cutoff=float("nan"),
    )


def cut(found: RecordingDouble, windows: int, history: int) -> RecordingDouble:
    """The same with so many windows and points of history only."""
    return found.but(
        **{
            name: getattr(found, name)[:windows]
            for name in ("fit_time", "fit_measured", "fit_predicted", "fit_weight", "fit_held_out")
        },
        **{
            name: getattr(found, name)[:history]
            for name in ("history_time", "history", "history_deviation")
        },
    )


def impossible() -> RecordingDouble:
    """Noise has made one moment of inertia larger than the sum of the other two."""
    found = tactile(duration=4.0)
    values = found.estimate.values.copy()
    values[9] = 0.03
    return found.with_estimate(values=values, is_physical=False)


def _wrench_rows(time: Array, swing: Sequence[float]) -> Array:
    """Rows for a tip that turns by such angles, rad, about x, y and z and moves a little."""
    fine = np.arange(time[0] - 0.01, time[-1] + 0.01, 1e-3)
    rates = np.array([[1.3, 2.9], [1.7, 3.7], [0.9, 4.3]])
    phase = fine[:, None, None] * rates + [[0.0, 1.0], [2.0, 0.5], [1.0, 3.0]]
    roll, pitch, yaw = (np.asarray(swing) * (np.sin(phase) @ [0.8, 0.2])).T
    turn = _about(2, yaw) @ _about(1, pitch) @ _about(0, roll)
    back = np.swapaxes(turn, 1, 2)
    rate = back @ np.gradient(turn, fine, axis=0)  # the cross product matrix of w, in the tip
    velocity = np.stack([rate[:, 2, 1], rate[:, 0, 2], rate[:, 1, 0]], axis=1)
    accelerated = np.gradient(velocity, fine, axis=0)
    moved = np.sin(fine[:, None] * [2.1, 1.6, 2.6]) * [0.6, 0.9, 0.7] * (max(swing[:2]) > 0)
    felt = np.squeeze(back @ (moved - GRAVITY)[..., None])
    at = np.searchsorted(fine, time)
    return tactid.wrench_regressor(felt[at], velocity[at], accelerated[at])


def _about(axis: int, angle: Array) -> Array:
    cos, sin = np.cos(angle), np.sin(angle)
    one, two = (axis + 1) % 3, (axis + 2) % 3
    turn = np.zeros((len(angle), 3, 3))
    turn[:, axis, axis] = 1
    turn[:, one, one] = turn[:, two, two] = cos
    turn[:, one, two], turn[:, two, one] = -sin, sin
    return turn


def _solved(
    time: Array,
    rows: Array,
    measured: Array,
    weight: Array,
    noise: Array,
    channels: list[str],
    units: list[str],
) -> RecordingDouble:
    held_out = time >= 0.8 * time[-1]
    # One of each of these for each window; the windows held out count nothing.
    used = np.where(held_out[:, None], 0.0, weight) / noise**2
    scaled = rows * SCALES
    information = np.cumsum(np.einsum("nca,nc,ncb->nab", scaled, used, scaled), axis=0)
    wanted = np.cumsum(np.einsum("nca,nc,nc->na", scaled, used, measured), axis=0)
    points = np.arange(4, len(time), 5)
    points = points[~held_out[points]]
    steps = [_estimate(information[k], wanted[k]) for k in points]
    values, deviation = (np.array(part) for part in list(zip(*steps, strict=True))[:2])
    final, sigma, parameters = _estimate(information[-1], wanted[-1])
    predicted = rows @ parameters
    error = measured - predicted
    strengths, directions = np.linalg.eigh(information[-1])
    return RecordingDouble(
        estimate=EstimateDouble(final, np.isfinite(sigma).tolist()),
        deviation=sigma,
        history_time=time[points],
        history=values,
        history_deviation=deviation,
        fit_time=time,
        fit_measured=measured,
        fit_predicted=predicted,
        fit_weight=weight,
        fit_held_out=held_out,
        channels=channels,
        channel_units=units,
        excitation_values=np.sqrt(np.maximum(strengths[::-1], 0.0)),
        excitation_directions=directions.T[::-1],
        residual_rms=np.sqrt(np.average(error**2, axis=0, weights=used + 1e-12)),
        held_out_rms=np.sqrt((error[held_out] ** 2).mean(axis=0)),
        duration=float(time[-1] + STRIDE),
    )


def _estimate(information: Array, wanted: Array) -> tuple[Array, Array, Array]:
    """Values, their deviations, and parameters; what lies in a direction unexcited is unknown."""
    strengths, directions = np.linalg.eigh(information)
    known = strengths > 1e-8 * strengths[-1]
    inverse = np.where(known, 1 / np.where(known, strengths, 1.0), 0.0)
    covariance = directions * inverse @ directions.T
    parameters = SCALES * (covariance @ wanted)
    values = _values(parameters)
    slope = np.array(
        [(_values(parameters + step) - values) / step.max() for step in np.diag(1e-6 * SCALES)]
    ).T
    variance = np.einsum("va,ab,vb->v", slope, SCALES * covariance * SCALES[:, None], slope)
    # A value has a share in an unexcited direction if it changes along it.
    open_ = np.abs((slope * SCALES) @ directions[:, ~known]).max(axis=1, initial=0.0)
    unknown = open_ > 1e-3 * np.abs(slope * SCALES).max(axis=1)
    return values, np.where(unknown, np.inf, np.sqrt(np.maximum(variance, 0))), parameters


def _values(parameters: Array) -> Array:
    mass = parameters[0] if abs(parameters[0]) > 1e-9 else 1e-9
    return np.array(
        values_of(tactid.MassProperties.from_parameters([mass, *parameters[1:]])), dtype=float
    )


def without_finite_numbers() -> RecordingDouble:
    """What is said to be known is not a number; no estimate should be so, and no page break."""
    found = tactile(duration=2.0)
    infinite = {
        name: np.full_like(getattr(found, name), np.nan)
        for name in ("deviation", "history", "history_deviation", "fit_measured", "fit_weight")
    }
    nothing = np.full(10, np.nan)
    return found.with_estimate(values=nothing, is_physical=False).but(
        **infinite,
        excitation_values=nothing,
        excitation_directions=np.full((10, 10), np.nan),
        gravity=np.full(3, np.nan),
    )


DEGENERATE: dict[str, Callable[[], RecordingDouble]] = {
    "nothing known": nothing_known,
    "no finite number": without_finite_numbers,
    "impossible": impossible,
    "no history": lambda: cut(tactile(duration=4.0), windows=200, history=0),
    "one window": lambda: cut(tactile(duration=4.0), windows=1, history=1),
    "no window": lambda: cut(tactile(duration=4.0), windows=0, history=0),
    "all held out": lambda: tactile(duration=4.0).but(fit_held_out=np.ones(200, dtype=bool)),
    "one joint": lambda: effort(joints=1),
}
"""What goes wrong, by name."""
