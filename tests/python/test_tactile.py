"""Forces at points of a link become one wrench with its noise."""

import numpy as np
import pytest

import tactid
from wrist import BODY, about


def taxels(rng: np.random.Generator, points: int = 24) -> np.ndarray:
    """A pad of points that is curved, and away from the origin."""
    across = rng.uniform(-0.01, 0.01, (points, 2))
    return np.column_stack([across, 0.03 - 20 * (across**2).sum(axis=1)])


def test_the_wrench_is_the_sum_of_forces_and_moments(rng: np.random.Generator) -> None:
    positions, forces = taxels(rng), rng.normal(size=(5, 24, 3))
    summed = tactid.sum_forces(forces, positions)
    assert summed.noise is None
    for wrench, sample in zip(summed.wrench, forces, strict=True):
        moments = [np.cross(at, force) for at, force in zip(positions, sample, strict=True)]
        expected = np.concatenate([sample.sum(axis=0), np.sum(moments, axis=0)])
        np.testing.assert_allclose(wrench, expected, rtol=1e-12, atol=1e-12)
    moving = tactid.sum_forces(forces, np.broadcast_to(positions, forces.shape))
    np.testing.assert_array_equal(moving.wrench, summed.wrench)


@pytest.mark.parametrize("shape", [(), (3,), (24, 3)])
def test_the_noise_is_that_of_many_draws(rng: np.random.Generator, shape: tuple[int, ...]) -> None:
    positions = taxels(rng)
    noise = 0.1 * rng.uniform(0.5, 2.0, shape)
    drawn = tactid.sum_forces(noise * rng.normal(size=(20000, 24, 3)), positions, noise=noise)
    assert drawn.noise is not None
    np.testing.assert_allclose(drawn.wrench.std(axis=0), drawn.noise, rtol=0.03)


def test_a_hand_with_a_tactile_pad_identifies_what_it_holds(rng: np.random.Generator) -> None:
    """The forces of many points give the payload that their sum moves."""
    time = np.arange(0.0, 12.0, 0.01)
    turn = about(2, 2 * np.sin(1.3 * time)) @ about(1, 0.9 * np.sin(2.1 * time + 1))
    turn = turn @ about(0, 1.1 * np.sin(1.7 * time + 2))
    spin = np.gradient(turn, time, axis=0) @ np.swapaxes(turn, 1, 2)
    velocity = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)
    back = np.swapaxes(turn, 1, 2)
    own = [
        np.einsum("nij,nj->ni", back, v) for v in (velocity, np.gradient(velocity, time, axis=0))
    ]
    wrench = tactid.wrench_regressor(back @ [0.0, 0.0, 9.81], *own) @ BODY.parameters
    positions = taxels(rng)
    # The forces of least norm whose sum is the wrench.
    sums = np.hstack([np.vstack([np.eye(3), skew(at)]) for at in positions])
    forces = (wrench @ np.linalg.pinv(sums).T).reshape(len(time), -1, 3)
    forces += 0.02 * rng.normal(size=forces.shape)
    summed = tactid.sum_forces(forces, positions, noise=0.02)
    pose = np.zeros((len(time), 4, 4))
    pose[:, :3, :3], pose[:, 3, 3] = turn, 1.0
    inner = slice(5, -5)
    found = tactid.identify(
        time[inner], pose=pose[inner], wrench=summed.wrench[inner], wrench_noise=summed.noise
    )
    assert found.estimate.body.mass == pytest.approx(BODY.mass, rel=0.01)
    np.testing.assert_allclose(found.estimate.body.com, BODY.com, atol=2e-3)


def skew(at: np.ndarray) -> np.ndarray:
    x, y, z = at
    return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])


@pytest.mark.parametrize(
    ("force", "position", "noise", "words"),
    [
        (np.zeros((4, 3)), np.zeros((4, 3)), None, "`force` must be of the shape"),
        (np.zeros((4, 5, 3)), np.zeros((4, 3)), None, "`position` must be of the shape"),
        (np.zeros((4, 5, 3)), np.zeros((5, 3)), 0.0, "`noise` must be positive"),
        (np.zeros((4, 5, 3)), np.zeros((5, 3)), np.nan, "`noise` must be positive"),
        (np.zeros((4, 5, 3)), np.zeros((5, 3)), np.ones(2), "`noise` must be one number"),
    ],
)
def test_shapes_that_do_not_fit_are_errors(
    force: np.ndarray, position: np.ndarray, noise: float | None, words: str
) -> None:
    with pytest.raises(tactid.ArgumentError, match=words):
        tactid.sum_forces(force, position, noise=noise)


def test_points_in_millimetres_are_refused(rng: np.random.Generator) -> None:
    with pytest.raises(tactid.ArgumentError, match=r"30.* m from the origin .* give metres"):
        tactid.sum_forces(np.zeros((5, 24, 3)), 1e3 * taxels(rng))
