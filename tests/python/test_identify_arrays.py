"""`tactid.identify` on arrays: for those with logs of their own."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import tactid
from recorded_arm import FIXED, PAYLOAD, TIP, ur5e
from recordings import state

FINGERS = ["finger_left_link", "finger_right_link"]
Arrays = dict[str, NDArray[np.float64]]


@pytest.fixture(scope="session")
def arrays(log: Path) -> tuple[NDArray[np.float64], Arrays]:
    """The log's own numbers, the twist turned into world axes."""
    joints, base = tactid.read(log, "/joint_states"), tactid.read(log, "/base/odom")
    pose, twist = base["pose"], base["twist"]
    vector, scalar = pose[:, 3:6], pose[:, 6:]

    def into_world(own: NDArray[np.float64]) -> NDArray[np.float64]:
        across = np.cross(vector, own)
        return own + 2 * (scalar * across + np.cross(vector, across))

    fingers = [tactid.read(log, f"/finger_{side}/wrench")["wrench"] for side in ("left", "right")]
    return joints.time, {
        "q": joints["position"],
        "qd": joints["velocity"],
        "effort": joints["effort"],
        "pose": pose,
        "twist": np.hstack([into_world(twist[:, :3]), into_world(twist[:, 3:])]),
        "wrench": np.stack(fingers, axis=1),
    }


def test_arrays_give_what_their_log_gives(
    log: Path, robot: tactid.Manipulator, arrays: tuple[NDArray[np.float64], Arrays]
) -> None:
    time, given = arrays
    for method in ("tactile", "combined"):
        found = tactid.identify(time, robot=robot, sensors=FINGERS, method=method, **given)
        expected = tactid.identify(log, method=method)
        assert found.cutoff_hz == pytest.approx(expected.cutoff_hz, rel=1e-2)
        np.testing.assert_allclose(
            found.estimate.values, expected.estimate.values, rtol=2e-3, atol=2e-3
        )
        assert found.fit.channels == expected.fit.channels


def test_velocities_may_be_left_out(
    robot: tactid.Manipulator, arrays: tuple[NDArray[np.float64], Arrays]
) -> None:
    time, given = arrays
    poor = {name: values for name, values in given.items() if name not in ("qd", "twist", "effort")}
    found = tactid.identify(time, robot=robot, sensors=FINGERS, **poor)
    assert found.estimate.body.mass == pytest.approx(100, rel=1e-2)


def test_unusable_poses_are_counted(
    robot: tactid.Manipulator, arrays: tuple[NDArray[np.float64], Arrays]
) -> None:
    time, given = arrays
    pose = given["pose"].copy()
    pose[500] = np.nan
    pose[1000, 0] = np.nan
    pose[1500, 3:] = 0.0
    pose[2000, 3:] *= 2.0
    result = tactid.identify(time, robot=robot, sensors=FINGERS, **given | {"pose": pose})
    counted = {(fault.topic, fault.kind): fault.count for fault in result.faults}
    assert counted["pose", "not_finite"] == 4
    assert result.estimate.body.mass == pytest.approx(100, rel=1e-2)


def test_a_matrix_with_nan_is_counted_and_one_that_is_no_rotation_is_refused(
    rng: np.random.Generator,
) -> None:
    time = np.arange(0.0, 4.0, 0.01)
    pose = np.tile(np.eye(4), (len(time), 1, 1))
    cos, sin = np.cos(3 * time), np.sin(3 * time)
    pose[:, 0, 0] = pose[:, 2, 2] = cos
    pose[:, 0, 2], pose[:, 2, 0] = sin, -sin
    force = 2.0 * 9.81 * pose[:, 2, :3]  # what holds 2 kg, in the axes of the sensor
    wrench = np.hstack([force, np.zeros_like(force)]) + 1e-3 * rng.normal(size=(len(time), 6))
    pose[50, 1, 1] = np.nan
    result = tactid.identify(time, wrench=wrench, pose=pose)
    counted = {(fault.topic, fault.kind): fault.count for fault in result.faults}
    assert counted["pose", "not_finite"] == 1
    assert result.estimate.values[0] == pytest.approx(2.0, rel=1e-2)
    pose[60] *= 2.0
    with pytest.raises(tactid.ArgumentError, match=r"`pose`, entry 60: .* not a rotation"):
        tactid.identify(time, wrench=wrench, pose=pose)


def test_a_sensor_without_a_robot_needs_its_pose() -> None:
    time = np.arange(0.0, 4.0, 0.01)
    with pytest.raises(tactid.ArgumentError, match=r"`pose` is missing: without a robot"):
        tactid.identify(time, wrench=np.ones((len(time), 6)))


def test_what_does_not_fit_is_refused(
    robot: tactid.Manipulator, arrays: tuple[NDArray[np.float64], Arrays]
) -> None:
    time, given = arrays
    short = given | {"qd": given["qd"][:-1]}
    with pytest.raises(tactid.ArgumentError, match=r"qd"):
        tactid.identify(time, robot=robot, sensors=FINGERS, **short)
    with pytest.raises(tactid.ArgumentError, match=r"`q` is missing"):
        tactid.identify(time, robot=robot, wrench=given["wrench"], sensors=FINGERS)
    with pytest.raises(tactid.ArgumentError, match=r"joint-sensing.*combined"):
        tactid.identify(time, robot=robot, method="all", **given)
    few = {name: values[:100] for name, values in given.items()}
    with pytest.raises(tactid.IdentificationError, match=r"too few windows"):
        tactid.identify(time[:100], robot=robot, sensors=FINGERS, cutoff_hz=2.0, **few)


def test_stamps_that_jitter_do_not_bias(rng: np.random.Generator) -> None:
    """Their noise shows in long windows alone: those that are chosen are long enough."""
    s = state(FIXED, 20.0, 250.0)
    time = np.sort(s.time + 3e-4 * rng.normal(size=len(s.time)))
    wrench = s.wrench + np.repeat([0.3, 0.02], 3) * rng.normal(size=s.wrench.shape)
    inertia = PAYLOAD.inertia[np.triu_indices(3)]
    truth = np.concatenate([[PAYLOAD.mass], PAYLOAD.com, inertia])

    def worst(**options: float) -> float:
        given = {"urdf": ur5e(), "tip": TIP, "sensors": TIP, **options}
        found = tactid.identify(time, q=s.q, qd=s.v, wrench=wrench, **given)
        return float(np.abs((found.estimate.values - truth) / found.estimate.std_devs).max())

    assert worst() < 3.5
    assert worst(cutoff_hz=7.2) > 5
