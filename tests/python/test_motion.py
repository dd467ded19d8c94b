"""How the motion enters an estimate, and what the report says about it."""

from pathlib import Path

import numpy as np
import pytest

import tactid
from doubles import with_fit
from tactid._base.values import values_of
from tactid._show.remarks import assumptions

NOISE = """
duration_s = 2.0
[excitation]
mode = "together"
[noise]
joint_position_rad = 1e-4
joint_velocity_rad_s = 1e-3
joint_torque_nm = 1.0
base_velocity_m_s = 0.001
base_angular_velocity_rad_s = 0.001
finger_force_n = 15.0
finger_moment_nm = 1.0
"""


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of a base that floats, with noise of the motion."""
    path = tmp_path_factory.mktemp("motion") / "noisy.mcap"
    tactid.simulate(tactid.Experiment.from_toml(NOISE), path)
    return path


def test_motion_and_payload_at_once_have_no_cutoff(log: Path) -> None:
    found = tactid.identify(log, method="combined")
    assert found.fit.motion == "with-payload"
    line = assumptions(found)
    assert "motion estimated with the payload;" in line
    assert "cutoff" not in line
    beginning = with_fit(found, motion_until_s=found.fit.times_s[0] + 100.0)
    assert "motion estimated with the payload from the first 100 s, " in assumptions(beginning)


def test_a_given_cutoff_is_used(log: Path) -> None:
    found = [tactid.identify(log, method="combined", cutoff_hz=c) for c in (5.0, 10.0)]
    assert [each.fit.motion for each in found] == ["given-cutoff"] * 2
    assert found[0].estimate.values[0] != found[1].estimate.values[0]
    assert "cutoff 5 Hz" in assumptions(found[0])


def test_velocities_that_follow_from_poses_are_no_measurements() -> None:
    experiment = tactid.Experiment.from_toml(NOISE)
    time = np.arange(0.0, 2.0, 0.004)
    robot = tactid.Manipulator.from_urdf(experiment.urdf, "floating")
    joints = len(robot.joint_names)
    angle = 2 * np.pi * np.outer(time, 0.3 + 0.1 * np.arange(joints))
    pose = np.tile(np.eye(4), (len(time), 1, 1))
    pose[:, 0, 3] = 0.01 * np.sin(2 * np.pi * time)
    found = tactid.identify(
        time,
        robot=robot,
        q=0.2 * np.sin(angle),
        qd=0.4 * np.pi * (0.3 + 0.1 * np.arange(joints)) * np.cos(angle),
        pose=pose,
        method="joint-sensing",
    )
    assert found.fit.motion == "no-velocities"
    assert "velocities of joints or base are not measured" in assumptions(found)


def test_noise_of_filtered_sensors_is_no_error_of_the_model(tmp_path: Path) -> None:
    """Neighbouring samples share what a filter of 8 ms leaves, and differ less than noise alone."""
    path = tmp_path / "exact.mcap"
    experiment = tactid.Experiment.from_toml(NOISE.split("[noise]")[0])
    tactid.simulate(experiment, path)
    joints, base = tactid.read(path, "/joint_states"), tactid.read(path, "/base/odom")
    random = np.random.default_rng(1)

    def filtered(values: np.ndarray, std_dev: float) -> np.ndarray:
        noise, kept = std_dev * random.standard_normal(values.shape), np.exp(-1.0 / 8.0)
        for k in range(1, len(noise)):
            noise[k] = kept * noise[k - 1] + np.sqrt(1 - kept**2) * noise[k]
        return values + noise

    def turned(vectors: np.ndarray) -> np.ndarray:
        """Returns vectors, expressed in the axes of the base, in those of the world."""
        vector, scalar = base["pose"][:, 3:6], base["pose"][:, 6:]
        return vectors + 2 * np.cross(vector, np.cross(vector, vectors) + scalar * vectors)

    twist = [turned(base["twist"][:, axes]) for axes in (slice(0, 3), slice(3, 6))]
    found = tactid.identify(
        joints.time,
        robot=tactid.Manipulator.from_urdf(experiment.urdf, "floating"),
        method="effort",
        q=filtered(joints["position"], 1e-4),
        qd=filtered(joints["velocity"], 1e-3),
        effort=filtered(joints["effort"], 1.0),
        pose=base["pose"],
        twist=filtered(np.hstack(twist), 5e-4),
    )
    assert found.fit.motion == "with-payload"
    assert found.findings == []
    low, high = np.array(found.estimate.intervals).T
    truth = values_of(experiment.payload)
    assert ((low <= truth) & (truth <= high)).sum() >= 9
