"""Arrays of any kind come in, and each shape that does not fit is refused with both shapes."""

from typing import Any

import numpy as np
import pytest

import tactid


def test_lists_float32_and_strided_views_are_the_same(
    robot: tactid.Manipulator, rng: np.random.Generator
) -> None:
    q = rng.normal(size=(5, robot.dof)).astype(np.float32)
    expected = robot.kinematics("tool0", q.astype(float)).pose
    wide = np.zeros((10, 2 * robot.dof))
    wide[::2, 1::2] = q
    for same in (q, q.tolist(), wide[::2, 1::2], np.asfortranarray(q)):
        np.testing.assert_array_equal(robot.kinematics("tool0", same).pose, expected)


def test_one_sample_has_no_leading_axis(robot: tactid.Manipulator) -> None:
    q = np.zeros(robot.dof)
    torques, wrench = robot.inverse_dynamics(q)
    assert torques.shape == (robot.dof,)
    assert wrench.shape == (6,)
    assert robot.kinematics("tool0", q).pose.shape == (4, 4)
    assert robot.momentum(q[None]).shape == (1, 6)
    assert robot.base_acceleration(np.zeros((0, robot.dof))).shape == (0, 6)


def test_one_value_holds_for_all_samples(
    robot: tactid.Manipulator, rng: np.random.Generator
) -> None:
    q, twist = rng.normal(size=(4, robot.dof)), rng.normal(size=6)
    one = robot.momentum(q, base_twist=twist)
    np.testing.assert_array_equal(one, robot.momentum(q, base_twist=np.tile(twist, (4, 1))))


def test_a_long_series_has_the_results_of_its_states(
    robot: tactid.Manipulator, rng: np.random.Generator
) -> None:
    """Its states are copied a thousand at a time; one twist holds for all."""
    count = 2500
    q, qd, qdd = rng.normal(size=(3, count, robot.dof))
    pose = np.concatenate([rng.normal(size=(count, 3)), rng.normal(size=(count, 4))], axis=1)
    pose[:, 3:] /= np.linalg.norm(pose[:, 3:], axis=1, keepdims=True)
    base = {"base_twist": rng.normal(size=6), "gravity": [0.0, 0.0, -9.81]}
    acceleration = rng.normal(size=(count, 6))
    whole = robot.inverse_dynamics(
        q, qd, qdd, base_pose=pose, base_acceleration=acceleration, **base
    )
    for k in (0, 1, 1023, 1024, 1025, 2047, 2048, 2499):
        of_one = robot.inverse_dynamics(
            q[k], qd[k], qdd[k], base_pose=pose[k], base_acceleration=acceleration[k], **base
        )
        for several, one in zip(whole, of_one, strict=True):
            np.testing.assert_allclose(several[k], one, rtol=1e-10, atol=1e-10)


def test_poses_as_quaternions_or_matrices(
    robot: tactid.Manipulator, rng: np.random.Generator
) -> None:
    half = 0.7
    quaternion = [1.0, 2.0, 3.0, 0.0, np.sin(half), 0.0, np.cos(half)]
    matrix = np.eye(4)
    matrix[:3, 3] = quaternion[:3]
    c, s = np.cos(2 * half), np.sin(2 * half)
    matrix[:3, :3] = [[c, 0, s], [0, 1, 0], [-s, 0, c]]
    q = rng.normal(size=(3, robot.dof))
    poses = [robot.kinematics("tool0", q, base_pose=p).pose for p in (quaternion, matrix)]
    np.testing.assert_allclose(*poses, atol=1e-12)
    in_base = robot.kinematics("tool0", q).pose
    np.testing.assert_allclose(poses[0], matrix @ in_base, atol=1e-12)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"q": np.zeros((3, 5))}, r"`q` has the shape \(3, 5\): expected \(8,\) or \(N, 8\)"),
        ({"q": np.zeros((1, 2, 8))}, r"shape \(1, 2, 8\)"),
        ({"q": np.zeros((3, 8)), "qd": np.zeros((2, 8))}, "`qd` has 2 samples, but `q` has 3"),
        ({"q": ["a"] * 8}, "`q` is not an array of numbers"),
        ({"q": [[0] * 8, [0]]}, "`q` is not an array of numbers"),
        ({"q": np.zeros(8), "base_pose": np.zeros((4, 4))}, "not a rotation"),
        ({"q": np.zeros(8), "base_pose": np.zeros((3, 3))}, r"\(4, 4\) or \(N, 4, 4\) or \(7,\)"),
        ({"q": np.zeros(8), "base_pose": np.zeros((2, 7))}, "entry 0: the quaternion"),
        ({"q": np.zeros(8), "base_pose": -np.eye(4)}, "not a rotation"),
    ],
)
def test_what_does_not_fit_is_refused(
    robot: tactid.Manipulator, arguments: dict[str, Any], message: str
) -> None:
    assert robot.dof == 8
    with pytest.raises(tactid.ArgumentError, match=message):
        robot.momentum(**{"qd": None, **arguments})
    assert issubclass(tactid.ArgumentError, ValueError)


def test_unknown_names_are_refused(robot: tactid.Manipulator) -> None:
    with pytest.raises(tactid.ModelError, match=r"no link `tool9`.*tool0"):
        robot.kinematics("tool9", np.zeros(8))
    with pytest.raises(tactid.ArgumentError, match='"fixed" or "floating"'):
        tactid.Manipulator.from_urdf("<robot/>", base="bolted")  # type: ignore[arg-type]
    with pytest.raises(tactid.ModelError, match=r"cannot read the URDF `nowhere\.urdf`"):
        tactid.Manipulator.from_urdf("nowhere.urdf")
    with pytest.raises(tactid.ModelError, match="not a URDF"):
        tactid.Manipulator.from_urdf("<robot")
    with pytest.raises(tactid.ArgumentError, match=r"its text, .* the path .* not as int"):
        tactid.Manipulator.from_urdf(3)  # type: ignore[arg-type]
