"""Mass properties, the wrench regressor and the estimators against NumPy."""

import pickle

import numpy as np
import pytest

import tactid


@pytest.fixture
def body(rng: np.random.Generator) -> tactid.MassProperties:
    points = rng.normal(size=(9, 3)) * [0.1, 0.2, 0.4]
    points -= points.mean(axis=0)
    second = points.T @ points
    return tactid.MassProperties(9.0, rng.normal(size=3), np.trace(second) * np.eye(3) - second)


def test_parameters_there_and_back(body: tactid.MassProperties) -> None:
    m, a = body.mass, body.com
    about_origin = body.inertia + m * (a @ a * np.eye(3) - np.outer(a, a))
    expected = [m, *(m * a), *about_origin[np.triu_indices(3)]]
    np.testing.assert_allclose(body.parameters, expected, rtol=1e-14)
    back = tactid.MassProperties.from_parameters(body.parameters)
    np.testing.assert_allclose(back.parameters, expected, rtol=1e-14)
    assert body.is_physical


def test_a_body_is_sent_to_another_process(body: tactid.MassProperties) -> None:
    assert pickle.loads(pickle.dumps(body)) == body


def test_change_of_frame_moves_the_centre_and_turns_the_inertia(
    body: tactid.MassProperties,
) -> None:
    c, s = np.cos(0.3), np.sin(0.3)
    pose = np.eye(4)
    pose[:3, :3] = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ [[1, 0, 0], [0, 0, -1], [0, 1, 0]]
    pose[:3, 3] = [0.2, -0.5, 1.0]
    moved = body.expressed_in(pose)
    rotation = pose[:3, :3]
    np.testing.assert_allclose(moved.com, rotation @ body.com + pose[:3, 3], rtol=1e-13)
    np.testing.assert_allclose(moved.inertia, rotation @ body.inertia @ rotation.T, rtol=1e-11)
    assert moved.mass == pytest.approx(body.mass, rel=1e-15)


def test_taking_off_undoes_adding(body: tactid.MassProperties) -> None:
    gripper = tactid.MassProperties(2.0, [0.1, 0, 0.3], np.diag([0.3, 0.2, 0.4]))
    rest = body + gripper - gripper
    np.testing.assert_allclose(rest.parameters, body.parameters, rtol=1e-13)
    with pytest.raises(tactid.ArgumentError, match="mass is zero"):
        body - body
    assert body == body.expressed_in(np.eye(4)) or np.allclose(
        body.parameters, body.expressed_in(np.eye(4)).parameters
    )


def test_an_inconsistent_body_is_reported() -> None:
    # The triangle inequality: no principal moment exceeds the sum of the other two.
    assert not tactid.MassProperties(1.0, [0, 0, 0], np.diag([1, 1, 3])).is_physical
    with pytest.raises(tactid.ArgumentError, match="not symmetric"):
        tactid.MassProperties(1.0, [0, 0, 0], [[1, 0.1, 0], [0, 1, 0], [0, 0, 1]])


@pytest.mark.parametrize(
    ("mass", "com", "inertia", "message"),
    [
        (np.nan, [0.0, 0.0, 0.0], np.eye(3), "`mass` has NaN: expected finite numbers"),
        (1.0, [0.0, np.inf, 0.0], np.eye(3), "`com` has inf"),
        (1.0, [0.0, 0.0, 0.0], np.full((3, 3), -np.inf), "`inertia` has -inf"),
    ],
)
def test_a_body_has_finite_numbers(
    mass: float, com: list[float], inertia: np.ndarray, message: str
) -> None:
    with pytest.raises(tactid.ArgumentError, match=message):
        tactid.MassProperties(mass, com, inertia)


@pytest.mark.parametrize(
    ("mass", "moments", "possible"),
    [
        (100, (10, 20, 10), True),  # the paper's payload, a plate
        (100, (10, 20.1, 10), True),
        (100, (10, 20.5, 10), False),
        (100, (-1, 10, 10), False),
        (-1, (10, 20, 10), False),
    ],
)
def test_an_estimate_of_a_plate_may_miss_the_border(
    mass: float, moments: tuple[float, float, float], possible: bool
) -> None:
    body = tactid.MassProperties(mass, [0.5, 0, 0], np.diag(moments))
    assert body.is_physical_within(0.01) is possible


def test_regressor_times_parameters_is_newton_and_euler(
    body: tactid.MassProperties, rng: np.random.Generator
) -> None:
    acceleration, w, dw = rng.normal(size=(3, 50, 3))
    wrench = tactid.wrench_regressor(acceleration, w, dw) @ body.parameters
    a, inertia = body.com, body.inertia
    force = body.mass * (acceleration + np.cross(dw, a) + np.cross(w, np.cross(w, a)))
    moment = dw @ inertia + np.cross(w, w @ inertia) + np.cross(a, force)
    np.testing.assert_allclose(wrench, np.hstack([force, moment]), rtol=1e-12, atol=1e-12)


def test_nlms_is_the_papers(rng: np.random.Generator) -> None:
    rows, targets = rng.normal(size=(200, 4)), rng.normal(size=200)
    weights = np.ones(4)
    for row, d in zip(rows, targets, strict=True):
        weights = weights + 1.8 * (d - weights @ row) / (0.9 + row @ row) * row  # (52)-(54)
    block, single = tactid.Nlms(4), tactid.Nlms(4)
    assert block.update(rows, targets) == 200
    assert all(single.update(row, d) == 1 for row, d in zip(rows, targets, strict=True))
    np.testing.assert_allclose(block.parameters, weights, rtol=1e-12)
    np.testing.assert_array_equal(single.parameters, block.parameters)


def test_lms_takes_a_fixed_step() -> None:
    filter_ = tactid.Lms(2, step=0.1, start=[0, 0])
    filter_.update([1, 2], 3)
    np.testing.assert_allclose(filter_.parameters, [0.3, 0.6])


def test_rls_is_least_squares(rng: np.random.Generator) -> None:
    rows, truth = rng.normal(size=(300, 10)), rng.normal(size=10)
    targets = rows @ truth + 0.1 * rng.normal(size=300)
    rls = tactid.Rls(10)
    rls.update(rows, targets)
    batch, squares, *_ = np.linalg.lstsq(rows, targets, rcond=None)
    np.testing.assert_allclose(rls.parameters, batch, atol=1e-9)
    covariance = np.linalg.inv(rows.T @ rows) * squares[0] / 290
    np.testing.assert_allclose(rls.covariance, covariance, rtol=1e-7, atol=1e-12)


def test_rows_that_are_not_finite_are_refused_and_counted() -> None:
    rls = tactid.Rls(2, start=[3, 4])
    assert rls.update([[1, 0], [np.nan, 1], [1, np.inf]], [3, 1, 1]) == 1
    assert (rls.used, rls.refused) == (1, 2)
    assert rls.covariance is None
    np.testing.assert_allclose(rls.parameters, [3, 4])


def test_settings_out_of_range_are_refused() -> None:
    with pytest.raises(tactid.ArgumentError, match="`alpha` is 2"):
        tactid.Nlms(4, alpha=2.0)
    with pytest.raises(tactid.ArgumentError, match="`beta` is 1"):
        tactid.Nlms(4, beta=1.0)
    with pytest.raises(tactid.ArgumentError, match="`step` is 0"):
        tactid.Lms(4, step=0.0)
    with pytest.raises(tactid.ArgumentError, match="`size` is 11: expected 1 to 10"):
        tactid.Rls(11)
    with pytest.raises(tactid.ArgumentError, match=r"shape \(3,\): expected \(2,\)"):
        tactid.Rls(2, start=[1, 2, 3])
