"""Simulation, log and identification through Python."""

import json
from pathlib import Path

import numpy as np
import pytest

import tactid

NOMINAL = np.array([100, 0.5, 0, 0, 10, 0, 0, 20, 0, 10])
SCALE = np.array([100, 0.5, 0.5, 0.5, 10, 20, 20, 20, 20, 10])


def test_three_seconds_are_enough_for_least_squares(log: Path) -> None:
    found = tactid.identify(log, estimator="rls")
    np.testing.assert_allclose((found.estimate.values - NOMINAL) / SCALE, 0, atol=5e-3)
    assert found.estimate.not_identifiable == []
    assert found.estimate.is_physical
    assert found.damage == []
    assert (found.way, found.estimator, found.tool) == ("tactile", "rls", "tool0")
    assert found.history.shape == (len(found.history_time), 10)
    np.testing.assert_allclose(found.history[-1], found.estimate.values, rtol=1e-3, atol=1e-3)


def test_each_epoch_has_its_history(log: Path) -> None:
    once, thrice = (tactid.identify(log, estimator="nlms", epochs=epochs) for epochs in (1, 3))
    assert tactid.identify(log, estimator="nlms").epochs == 2
    assert set(thrice.history_epoch) == {0, 1, 2}
    first = thrice.history_epoch == 0
    np.testing.assert_array_equal(thrice.history[first], once.history)
    np.testing.assert_array_equal(thrice.history_time[first], once.history_time)
    # Counts are those of one presentation.
    assert thrice.estimate.intervals == once.estimate.intervals


def test_a_higher_cutoff_has_more_windows(log: Path) -> None:
    default = tactid.identify(log, estimator="nlms")
    fine = tactid.identify(log, estimator="nlms", cutoff=20.0)
    assert default.cutoff == 10
    assert default.estimate.intervals == 94
    assert fine.estimate.intervals == pytest.approx(2 * 94, abs=4)
    for wrong in ({"cutoff": -1.0}, {"epochs": 0}, {"max_gap": 0.0}):
        with pytest.raises(tactid.ArgumentError, match=next(iter(wrong))):
            tactid.identify(log, **wrong)


def test_joint_sensing_takes_the_gripper_off(log: Path, robot: tactid.Manipulator) -> None:
    estimate = tactid.identify(log, way="joint-sensing", estimator="rls").estimate
    np.testing.assert_allclose((estimate.values - NOMINAL) / SCALE, 0, atol=1e-2)
    assert estimate.composite is not None
    gripper = robot.mass - robot.without_subtree("tool0").mass
    assert estimate.composite.mass == pytest.approx(estimate.body.mass + gripper, rel=1e-9)


def test_progress_is_told_and_can_stop_the_work(log: Path) -> None:
    told: list[float] = []
    tactid.identify(log, progress=told.append)
    assert told == sorted(told)
    assert told[-1] == 1.0

    def stop(_done: float) -> None:
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        tactid.simulate(tactid.Experiment.paper(), log.with_name("stopped.mcap"), progress=stop)
    assert tactid.info(log.with_name("stopped.mcap")).damage == []


def test_info_tells_topics_and_truth(log: Path) -> None:
    info = tactid.info(log)
    topics = {topic.name: topic for topic in info.topics}
    assert topics["/joint_states"].type_name == "sensor_msgs/msg/JointState"
    assert topics["/joint_states"].count == 3000
    assert topics["/joint_states"].frequency == pytest.approx(1000)
    assert topics["/robot_description"].frequency is None
    assert info.duration == pytest.approx(2.999)
    truth = json.loads(info.metadata["tactid.truth"]["json"])
    assert truth["mass"] == pytest.approx(100)
    assert info.damage == []


def test_the_same_seed_gives_the_same_log(tmp_path: Path) -> None:
    short = tactid.Experiment.paper().replace(duration=0.2)
    logs = []
    for name, seed in {"first": 1, "again": 1, "other": 2}.items():
        tactid.simulate(short.replace(seed=seed), tmp_path / f"{name}.mcap")
        logs.append((tmp_path / f"{name}.mcap").read_bytes())
    assert logs[0] == logs[1]
    assert logs[0] != logs[2]


def carried(
    robot: tactid.Manipulator, time: np.ndarray, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Joints in a smooth motion, their rates, and the regressor of the wrench at the tool."""
    w, phase = rng.uniform(0.5, 2, (2, robot.dof))
    w[6:] = 0  # the fingers stay where they are
    angle = np.outer(time, w) + phase
    q, qd, qdd = np.sin(angle), w * np.cos(angle), -(w**2) * np.sin(angle)
    m = robot.kinematics("tool0", q, qd, qdd)
    back = np.swapaxes(m.pose[:, :3, :3], 1, 2)

    def in_tool(vectors: np.ndarray) -> np.ndarray:
        return np.einsum("nij,nj->ni", back, vectors)

    vectors = (m.acceleration, m.angular_velocity, m.angular_acceleration)
    return q, qd, tactid.wrench_regressor(*map(in_tool, vectors))


def test_online_identifier_on_a_known_motion(
    robot: tactid.Manipulator, rng: np.random.Generator
) -> None:
    """A payload that inverse dynamics carries through a smooth motion is found from its wrench."""
    payload = tactid.MassProperties(7.0, [0.1, -0.2, 0.3], np.diag([0.4, 0.5, 0.6]))
    time = np.arange(0, 4, 1e-3)
    q, qd, regressor = carried(robot, time, rng)
    wrench = regressor @ payload.parameters
    identifier = tactid.Identifier(robot, "tool0", ["tool0"], estimator="rls")
    assert identifier.estimate().not_identifiable == tactid.VALUE_NAMES
    assert identifier.push(time[0], q[0], qd[0], wrench[0, None]) == 0
    assert identifier.push(time[1:], q[1:], qd[1:], wrench[1:, None]) == len(time) - 1
    estimate = identifier.estimate()
    np.testing.assert_allclose(estimate.body.parameters, payload.parameters, atol=1e-4)
    assert identifier.push(time[-1], q[-1], qd[-1], wrench[-1, None]) == 0  # not later
    assert identifier.push(9.0, q[-1] * np.nan, qd[-1], wrench[-1, None]) == 0
    assert identifier.estimate().refused == 2
    identifier.rewind()
    assert identifier.push(time, q, qd, wrench[:, None]) == len(time) - 1
    assert identifier.estimate().refused == 0


def test_online_estimates_know_their_uncertainty_and_see_another_payload(
    robot: tactid.Manipulator, rng: np.random.Generator
) -> None:
    """7 kg become 4 kg at 4 s, under noise of 0.01 N and 0.002 N m."""
    bodies = [
        tactid.MassProperties(7.0, [0.1, -0.2, 0.3], np.diag([0.4, 0.5, 0.6])),
        tactid.MassProperties(4.0, [0.0, 0.1, 0.2], np.diag([0.3, 0.4, 0.2])),
    ]
    time = np.arange(0, 8, 1e-3)
    q, qd, regressor = carried(robot, time, rng)
    wrench = np.where(time[:, None] < 4, *(regressor @ body.parameters for body in bodies))
    wrench += np.repeat([0.01, 0.002], 3) * rng.standard_normal(wrench.shape)
    identifier = tactid.Identifier(robot, "tool0", ["tool0"])
    for body, rows, changes in zip(bodies, np.split(np.arange(8000), 2), (0, 1), strict=True):
        assert identifier.push(time[rows], q[rows], qd[rows], wrench[rows, None]) >= 3999
        estimate = identifier.estimate()
        assert estimate.changes == changes
        assert estimate.is_physical
        covariance = identifier.covariance()
        assert covariance is not None
        np.testing.assert_allclose(np.sqrt(covariance[0, 0]), estimate.deviations[0])
        error = estimate.body.parameters - body.parameters
        # Ten squares over their variances are within 30 in all but a thousandth of all cases.
        assert error @ np.linalg.solve(covariance, error) < 30
        np.testing.assert_allclose(estimate.body.parameters, body.parameters, atol=0.01)
    assert 4 < estimate.since < 4.2
    assert np.isnan(estimate.mass_singular_values).all()


def test_what_cannot_be_identified_is_refused(robot: tactid.Manipulator, urdf: str) -> None:
    with pytest.raises(tactid.IdentificationError, match="needs at least one wrench"):
        tactid.Identifier(robot, "tool0")
    fixed = tactid.Manipulator.from_urdf(urdf, base="fixed")
    with pytest.raises(tactid.IdentificationError, match="free-floating base"):
        tactid.Identifier(fixed, "tool0", way="joint-sensing")
    with pytest.raises(tactid.ArgumentError, match="alpha is 3"):
        tactid.Identifier(robot, "tool0", ["tool0"], estimator="nlms", alpha=3.0)
    with pytest.raises(tactid.ArgumentError, match='"nlms" or "rls"'):
        tactid.Identifier(robot, "tool0", ["tool0"], estimator="magic")  # type: ignore[arg-type]
    identifier = tactid.Identifier(robot, "tool0", ["tool0"])
    with pytest.raises(tactid.ArgumentError, match=r"shape \(6,\): expected \(1, 6\)"):
        identifier.push(0, np.zeros(8), np.zeros(8), np.zeros(6))
    with pytest.raises(tactid.ArgumentError, match="`wrenches` is missing"):
        identifier.push(0, np.zeros(8), np.zeros(8))


def test_impossible_experiments_are_refused() -> None:
    with pytest.raises(tactid.ExperimentError, match=r"line 2: payload\.mass_kg = -1"):
        tactid.Experiment.from_toml("[payload]\nmass_kg = -1.0")
    with pytest.raises(tactid.ExperimentError, match="line 1"):
        tactid.Experiment.from_toml("sped = 1")
    with pytest.raises(tactid.ArgumentError, match="expected"):
        tactid.Experiment.paper().replace(posture="table2")
    with pytest.raises(tactid.ExperimentError):
        tactid.Experiment.paper().replace(frequency=-1)
    again = tactid.Experiment.from_toml(tactid.Experiment.paper().to_toml())
    assert again == tactid.Experiment.paper()
    assert tactid.Experiment.from_toml(tactid.Experiment.PAPER_TOML) == again
