"""Results that no robot made: a known body, a motion, noise, and least squares in NumPy.

Each is a ``tactid.Identification``, made to be shown; some are of what goes wrong.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

import tactid
from tactid import (
    Channel,
    Delay,
    FitReport,
    Forecast,
    History,
    Identification,
    LinearEstimate,
    PaperEstimate,
    PaperHistory,
    PaperIdentification,
    PaperSettings,
    PayloadEstimate,
    PrincipalMoments,
    SharedErrors,
    SingularValues,
)
from tactid._base.bodies import principal_moments
from tactid._base.values import Observability, noise_intervals, values_of
from tactid._results.records import RecordingReport, Setup

Array = NDArray[np.float64]

STRIDE = 0.02
GRAVITY = np.array([0.0, 0.0, -9.81])
BODY = tactid.MassProperties(
    1.84,
    [0.012, -0.031, 0.094],
    [[0.0112, 0.0011, -0.0009], [0.0011, 0.0093, 0.0014], [-0.0009, 0.0014, 0.0046]],
)
LINEAR = LinearEstimate(
    parameters=np.array(BODY.parameters),
    information=np.eye(10),
    covariance=np.eye(10),
    shared=SharedErrors([], np.zeros((0, 10))),
    degrees_of_freedom=100.0,
)
"""What a combination takes, which no table shows."""
LENGTH = 0.1
SCALES = LENGTH ** np.array([0, 1, 1, 1, 2, 2, 2, 2, 2, 2])
"""By which a parameter is divided: a body of 0.1 m has them all of the size of its mass."""


def offset_finding(
    force: float, moment: float = 0.0, *, mass_change: float = 0.0, shift: float = 0.0
) -> tactid.Finding:
    """A suspected offset along x, N and N m, by what it certainly changes, a fraction and m."""
    data = {
        "cause": "offset",
        "runner_up": None,
        "names": ["force x", "force y", "force z", "moment x", "moment y", "moment z"],
        "values": [force, 0.0, 0.0, moment, 0.0, 0.0],
        "std_devs": [0.1, 0.1, 0.1, 0.01, 0.01, 0.01],
        "assumed": [0.0] * 6,
        "frame": "tool0",
        "residual_ratio": 0.1,
        "mass_kg": 2.0,
        "mass_std_dev_kg": 0.01,
        "mass_change": mass_change,
        "shift_m": shift,
        "value_change": 0.0,
    }
    return tactid.Finding("wrong_assumption", data)


def mean_forecast(duration: float) -> Forecast:
    """By the mean of the whole recording: the information grows in proportion to the time."""
    growth = np.full(10, 1 / duration)
    return Forecast(growth, fractions=np.eye(10), noise_fraction=np.ones(10), length_s=duration)


def with_estimate(found: Identification, **changes: Any) -> Identification:
    """The result with another estimate, and with what follows from it."""
    # The intervals follow from values and standard deviations unless they are given.
    estimate = replace(found.estimate, **{"intervals": np.empty((0, 2)), **changes})
    values, std_devs = estimate.values, estimate.std_devs
    finite = np.isfinite(values).all()
    moments = principal_moments(values.tolist()) if finite else [np.nan] * 3
    return replace(
        found,
        estimate=estimate,
        # As uncertain as the worst known entry of the inertia.
        principal_moments=with_intervals(moments, np.full(3, std_devs[4:].max())),
        forecast=mean_forecast(found.duration_s),
    )


def with_intervals(moments: Sequence[float], std_devs: Array) -> PrincipalMoments:
    """Principal moments whose intervals are as wide as the noise makes them."""
    values = np.array(moments)
    return PrincipalMoments(values, std_devs, noise_intervals(values, std_devs))


def observability(known: Iterable[bool]) -> list[Observability]:
    """Identifiable where the value is known, and else unobservable."""
    return ["identifiable" if yes else "unobservable" for yes in known]


def with_fit(found: Identification, **changes: Any) -> Identification:
    """The result with another fit."""
    return replace(found, fit=replace(found.fit, **changes))


def with_history(found: Identification, **changes: Any) -> Identification:
    """The result with another history."""
    return replace(found, history=replace(found.history, **changes))


def tactile(duration: float = 40.0, swing: Sequence[float] = (0.9, 0.7, 1.1)) -> Identification:
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


def effort(joints: int = 7, duration: float = 20.0) -> Identification:
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
    found = with_estimate(found, frame="panda_link8")
    return replace(found, method="effort", delay_s=0.0, estimated_delay=None)


def turned_about_one_axis() -> Identification:
    """A turntable with an upright axis: the height stays unknown, and most of the inertia."""
    return tactile(swing=(0.0, 0.0, 1.1))


def nothing_known() -> Identification:
    """A log in which nothing moved and nothing was felt, by an estimator that then gives NaN."""
    found = tactile(duration=2.0)
    nothing, infinite = np.full(10, np.nan), np.full(10, np.inf)
    known, history = found.fit, found.history
    dead = np.zeros_like(known.measured)
    found = with_estimate(
        found,
        values=nothing,
        std_devs=infinite,
        observability=["unobservable"] * 10,
        is_physical=False,
    )
    found = with_history(
        found,
        values=np.full_like(history.values, np.nan),
        std_devs=np.full_like(history.std_devs, np.inf),
    )
    found = with_fit(
        found,
        measured=dead,
        predicted=np.full_like(dead, np.nan),
        excitation=np.zeros(10),
        excitation_directions=np.eye(10),
        residual_rms=np.full(6, np.nan),
        held_out_rms=np.full(6, np.nan),
        held_out_plain_rms=np.full(6, np.nan),
    )
    return replace(found, delay_s=float("nan"), cutoff_hz=float("nan"))


def cut(found: Identification, windows: int, history: int) -> Identification:
    """The same with so many windows and points of history only."""
    known, past = found.fit, found.history
    names = ("times_s", "measured", "predicted", "weights", "held_out")
    found = with_fit(found, **{name: getattr(known, name)[:windows] for name in names})
    names = ("times_s", "values", "std_devs")
    return with_history(found, **{name: getattr(past, name)[:history] for name in names})


def impossible() -> Identification:
    """Noise has made one moment of inertia larger than the sum of the other two."""
    found = tactile(duration=4.0)
    values = found.estimate.values.copy()
    values[9] = 0.03
    return with_estimate(found, values=values, is_physical=False)


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
) -> Identification:
    held_out = time >= 0.8 * time[-1]
    # One of each of these for each window; the windows held out count nothing.
    used = np.where(held_out[:, None], 0.0, weight) / noise**2
    scaled = rows * SCALES
    information = np.cumsum(np.einsum("nca,nc,ncb->nab", scaled, used, scaled), axis=0)
    targets = np.cumsum(np.einsum("nca,nc,nc->na", scaled, used, measured), axis=0)
    points = np.arange(4, len(time), 5)
    points = points[~held_out[points]]
    steps = [_estimate(information[k], targets[k]) for k in points]
    values, std_devs = (np.array(part) for part in list(zip(*steps, strict=True))[:2])
    final, sigma, parameters = _estimate(information[-1], targets[-1])
    predicted = rows @ parameters
    error = measured - predicted
    strengths, directions = np.linalg.eigh(information[-1])
    fit = FitReport(
        channels=[Channel(*pair) for pair in zip(channels, units, strict=True)],
        times_s=time,
        measured=measured,
        predicted=predicted,
        weights=weight[:, 0],
        held_out=held_out,
        residual_rms=np.sqrt(np.average(error**2, axis=0, weights=used + 1e-12)),
        held_out_rms=np.sqrt((error[held_out] ** 2).mean(axis=0)),
        held_out_plain_rms=np.sqrt((error[held_out] ** 2).mean(axis=0)),
        motion="smoothed",
        stride_s=STRIDE,
        excitation=np.sqrt(np.maximum(strengths[::-1], 0.0)),
        excitation_directions=directions.T[::-1],
        noise_fraction=np.ones(10),
        cutoff_hz=10.0,
    )
    nothing = np.full(3, np.nan)
    found = Identification(
        estimate=PayloadEstimate(
            "tool0",
            values=final,
            std_devs=sigma,
            observability=observability(np.isfinite(sigma)),
            is_physical=True,
        ),
        setup=Setup(
            beginning="",
            topics=["/joint_states", "/wrench"],
            wrench_topics=["/wrench"],
            wrench_frames=["tool0"],
            wrench_acts_on="payload",
        ),
        method="tactile",
        estimator="least-squares",
        principal_moments=with_intervals(nothing, nothing),
        history=History(time[points], values, std_devs),
        gravity_m_s2=GRAVITY.copy(),
        cutoff_hz=10.0,
        max_gap_s=0.1,
        duration_s=float(time[-1] + STRIDE),
        delay_s=0.0123,
        subtracts_unloaded=False,
        clock="stamps",
        faults=(),
        findings=(),
        interrupted=False,
        damage=(),
        estimated_delay=Delay(0.0123, 0.0004),
        start_ns=1_700_000_000_000_000_000,
        fit=fit,
        linear=LINEAR,
    )
    return with_estimate(found)


def _estimate(information: Array, targets: Array) -> tuple[Array, Array, Array]:
    """Values, standard deviations and parameters; an unexcited direction is unknown."""
    strengths, directions = np.linalg.eigh(information)
    known = strengths > 1e-8 * strengths[-1]
    inverse = np.where(known, 1 / np.where(known, strengths, 1.0), 0.0)
    covariance = directions * inverse @ directions.T
    parameters = SCALES * (covariance @ targets)
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


def without_finite_numbers() -> Identification:
    """Values marked as known are NaN: no estimate should be so, and no page may break."""
    found = tactile(duration=2.0)
    nothing, known = np.full(10, np.nan), found.fit
    blank = np.full_like(found.history.values, np.nan)
    found = with_estimate(found, values=nothing, std_devs=nothing, is_physical=False)
    found = with_history(found, values=blank, std_devs=blank)
    found = with_fit(
        found,
        measured=np.full_like(known.measured, np.nan),
        weights=np.full_like(known.weights, np.nan),
        excitation=nothing,
        excitation_directions=np.full((10, 10), np.nan),
    )
    return replace(found, gravity_m_s2=np.full(3, np.nan))


def by_the_papers_filter() -> PaperIdentification:
    """What the paper's filter returns: no fit, no intervals, no forecast."""
    found = tactile(duration=4.0)
    report = {each.name: getattr(found, each.name) for each in fields(RecordingReport)}
    estimate, history = found.estimate, found.history
    known = {name: getattr(estimate, name) for name in ("frame", "values", "observability")}
    return PaperIdentification(
        **report | {"estimator": "nlms"},
        estimate=PaperEstimate(**known, is_physical=True),
        principal_moments=found.principal_moments.values,
        history=PaperHistory([0] * len(history.times_s), history.times_s, history.values),
        singular_values=SingularValues(np.ones(4), np.ones(6)),
        settings=PaperSettings(1.8, 0.9, 10.0, 2),
    )


DEGENERATE: dict[str, Callable[[], Identification | PaperIdentification]] = {
    "nothing known": nothing_known,
    "no finite number": without_finite_numbers,
    "impossible": impossible,
    "no history": lambda: cut(tactile(duration=4.0), windows=200, history=0),
    "one window": lambda: cut(tactile(duration=4.0), windows=1, history=1),
    "no window": lambda: cut(tactile(duration=4.0), windows=0, history=0),
    "all held out": lambda: with_fit(tactile(duration=4.0), held_out=np.ones(200, dtype=bool)),
    "one joint": lambda: effort(joints=1),
    "paper's filter": by_the_papers_filter,
}
"""What goes wrong, by name."""
