"""How much longer to move: what is told after a while comes true when the motion goes on."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import tactid
from tactid import result

Array = NDArray[np.float64]

BODY = tactid.MassProperties(
    1.84,
    [0.012, -0.031, 0.094],
    [[0.0112, 0.0011, -0.0009], [0.0011, 0.0093, 0.0014], [-0.0009, 0.0014, 0.0046]],
)
NOISE = np.array([0.3, 0.3, 0.3, 0.02, 0.02, 0.02])
PERIOD, RATE, EARLY = 4.0, 100.0, 8.0
KINDS = np.repeat([0, 1, 2], [1, 3, 6])


def turned(time: Array, calm_until: float) -> Array:
    """Attitudes of a wrist that swings with a period of 4 s, by less up to a second before a time."""
    rise = np.clip(time - calm_until + 1, 0, 1)
    size = (0.65 - 0.35 * np.cos(np.pi * rise))[:, None]
    rates = 2 * np.pi / PERIOD * np.array([[1, 3], [2, 5], [1, 4]])
    waves = np.sin(time[:, None, None] * rates + [[0.0, 1.0], [2.0, 0.5], [1.0, 3.0]])
    roll, pitch, yaw = (size * (waves @ [0.6, 0.3])).T
    return about(2, yaw) @ about(1, pitch) @ about(0, roll)


def about(axis: int, angle: Array) -> Array:
    """Rotations about x, y or z, (N, 3, 3)."""
    one, two = (axis + 1) % 3, (axis + 2) % 3
    turn = np.zeros((len(angle), 3, 3))
    turn[:, axis, axis] = 1
    turn[:, one, one] = turn[:, two, two] = np.cos(angle)
    turn[:, two, one] = np.sin(angle)
    turn[:, one, two] = -turn[:, two, one]
    return turn


def identified(
    duration: float, seed: int, calm_until: float = 0.0, swings: bool = True
) -> tactid.Identification:
    """What is told of a recording of so many seconds, its noise drawn from the seed."""
    time = np.arange(0.0, duration, 1 / RATE)
    step = 1e-4

    def at(shift: float) -> Array:
        return turned(time + shift, calm_until) if swings else turned(0 * time, calm_until)

    def velocity(shift: float) -> Array:
        spin = (at(shift + step) - at(shift - step)) / (2 * step) @ np.swapaxes(at(shift), 1, 2)
        return np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)

    turn, back = at(0.0), np.swapaxes(at(0.0), 1, 2)
    acceleration = (velocity(step) - velocity(-step)) / (2 * step)
    felt = back @ [0.0, 0.0, 9.81]
    own = [np.einsum("nij,nj->ni", back, vector) for vector in (velocity(0.0), acceleration)]
    wrench = tactid.wrench_regressor(felt, *own) @ BODY.parameters
    wrench += NOISE * np.random.default_rng(seed).normal(size=wrench.shape)
    pose = np.zeros((len(time), 4, 4))
    pose[:, :3, :3], pose[:, 3, 3] = turn, 1.0
    twist = np.hstack([np.zeros((len(time), 3)), velocity(0.0)])
    return tactid.identify(time, pose=pose, twist=twist, wrench=wrench, cutoff=5.0, delay=0.0)


def half_parts(found: tactid.Identification) -> Array:
    """Half of each interval as a part of the largest value of its kind."""
    values = np.abs(found.estimate.values)
    largest = np.array([values[kind == KINDS].max() for kind in range(3)])
    return 1.96 * found.deviation / largest[KINDS]


@pytest.mark.parametrize("calm_until", [0.0, EARLY / 2])
def test_the_time_that_is_told_is_the_time_that_it_takes(calm_until: float) -> None:
    """For half the interval of the worst value, with a calm first half or without.

    Intervals come from residuals, and scatter: the mean over ten draws of the noise is held to four
    of its own standard errors. The mean information of the calm case would promise 24 s.
    """
    ratios = []
    for seed in range(10):
        early = identified(EARLY, seed, calm_until)
        parts = half_parts(early)
        worst, within = parts.argmax(), parts.max() / 2
        remaining = early.remaining(within)
        assert remaining.argmax() == worst
        assert remaining[worst] == pytest.approx(14 if calm_until else 23, rel=0.05)
        late = identified(EARLY + remaining[worst], seed, calm_until)
        ratios.append(half_parts(late)[worst] / within)
    assert np.std(ratios) < 0.2
    assert abs(np.mean(ratios) - 1) < 4 * np.std(ratios) / np.sqrt(len(ratios)), ratios


def test_what_is_known_takes_no_time_and_what_is_not_excited_for_ever() -> None:
    moving, still = identified(EARLY, 0), identified(EARLY, 0, swings=False)
    np.testing.assert_array_equal(moving.remaining(2 * half_parts(moving).max()), np.zeros(10))
    told = still.remaining(0.01)
    assert np.isfinite(told[0])
    assert np.isinf(told[4:]).all()
    sentence = result.outlook(still, 0.02)
    assert sentence is not None
    assert sentence.startswith("However long this motion goes on, not within 2 %:")
    assert "Ixx" in sentence
    for wrong in (0.0, -1.0, np.nan):
        with pytest.raises(tactid.ArgumentError, match="within"):
            moving.remaining(wrong)


def test_the_paper_s_filter_knows_of_no_intervals(log: Path) -> None:
    found = tactid.identify(log, estimator="nlms")
    assert np.isnan(found.remaining()).all()
    assert result.outlook(found) is None
    assert np.isfinite(found.principal_moments).all()
    assert np.isnan(found.principal_moment_deviation).all()
