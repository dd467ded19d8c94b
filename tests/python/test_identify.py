"""Simulation, log and identification through Python."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tactid
from tactid._base.values import values_of

NOMINAL = np.array([100, 0.5, 0, 0, 10, 0, 0, 20, 0, 10])
SCALE = np.array([100, 0.5, 0.5, 0.5, 10, 20, 20, 20, 20, 10])


def test_three_seconds_are_enough_for_least_squares(log: Path) -> None:
    found = tactid.identify(log, estimator="least-squares")
    np.testing.assert_allclose((found.estimate.values - NOMINAL) / SCALE, 0, atol=5e-3)
    assert found.estimate.not_identifiable == []
    assert found.estimate.is_physical
    assert found.damage == []
    assert (found.method, found.estimator) == ("tactile", "least-squares")
    assert found.estimate.frame == "tool0"
    assert found.history.values.shape == (len(found.history.times_s), 10)
    np.testing.assert_allclose(
        found.history.values[-1], found.estimate.values, rtol=1e-3, atol=1e-3
    )


def test_each_epoch_has_its_history(log: Path) -> None:
    once, thrice = (tactid.identify(log, estimator="nlms", epochs=epochs) for epochs in (1, 3))
    default = tactid.identify(log, estimator="nlms").settings
    assert default == tactid.PaperSettings(alpha=1.8, beta=0.9, average_s=10.0, epochs=2)
    assert set(thrice.history.epoch) == {0, 1, 2}
    first = np.array(thrice.history.epoch) == 0
    np.testing.assert_array_equal(thrice.history.values[first], once.history.values)
    np.testing.assert_array_equal(thrice.history.times_s[first], once.history.times_s)
    # Counts are those of one presentation.
    assert thrice.estimate.windows == once.estimate.windows


def test_a_higher_cutoff_has_more_windows(log: Path) -> None:
    default = tactid.identify(log, estimator="nlms")
    fine = tactid.identify(log, estimator="nlms", cutoff_hz=20.0)
    assert default.cutoff_hz == 10
    assert default.estimate.windows == 94
    assert fine.estimate.windows == pytest.approx(2 * 94, abs=4)


@pytest.mark.parametrize(
    "wrong", [{"cutoff_hz": -1.0}, {"epochs": 0, "estimator": "nlms"}, {"max_gap_s": 0.0}]
)
def test_an_option_out_of_range_is_named(log: Path, wrong: dict[str, Any]) -> None:
    with pytest.raises(tactid.ArgumentError, match=next(iter(wrong))):
        tactid.identify(log, **wrong)


def test_joint_sensing_takes_the_gripper_off(log: Path, robot: tactid.Manipulator) -> None:
    estimate = tactid.identify(log, method="joint-sensing").estimate
    np.testing.assert_allclose((estimate.values - NOMINAL) / SCALE, 0, atol=1e-2)
    assert estimate.composite is not None
    gripper = robot.mass - robot.without_subtree("tool0").mass
    assert estimate.composite.mass == pytest.approx(estimate.body.mass + gripper, rel=1e-9)


def test_progress_is_reported_and_can_stop_the_work(log: Path) -> None:
    reported: list[float] = []
    tactid.identify(log, progress=reported.append)
    assert reported == sorted(reported)
    assert reported[-1] == 1.0

    def stop(_done: float) -> None:
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        tactid.simulate(tactid.Experiment.paper(), log.with_name("stopped.mcap"), progress=stop)
    assert tactid.info(log.with_name("stopped.mcap")).damage == []


def test_wrenches_without_a_delay_have_none(tmp_path: Path) -> None:
    """Weights that followed the residuals with a delay made one of this motion's noise."""
    path, experiment = tmp_path / "run.mcap", tactid.Experiment.paper().replace(duration=600.0)

    def stop(done: float) -> None:
        if done * experiment.duration > 32:
            raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        tactid.simulate(experiment, path, progress=stop)
    found = tactid.identify(path)
    assert [finding.kind for finding in found.findings] == ["wrenches_summed", "outliers"]
    assert found.estimated_delay is not None
    assert abs(found.estimated_delay.delay_s) < 3 * found.estimated_delay.std_dev_s


def test_info_has_topics_and_truth(log: Path) -> None:
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


def at_rest(count: int) -> dict[str, np.ndarray]:
    """The motion of a floating base that does not move."""
    return {"pose": np.tile([0.0, 0, 0, 0, 0, 0, 1], (count, 1)), "twist": np.zeros((count, 6))}


def test_online_identifier_on_a_known_motion(
    robot: tactid.Manipulator, rng: np.random.Generator
) -> None:
    """A payload that inverse dynamics carries through a smooth motion is found from its wrench."""
    payload = tactid.MassProperties(7.0, [0.1, -0.2, 0.3], np.diag([0.4, 0.5, 0.6]))
    time = np.arange(0, 4, 1e-3)
    q, qd, regressor = carried(robot, time, rng)
    wrench = regressor @ payload.parameters
    identifier = tactid.Identifier(robot, ["tool0"])
    assert identifier.estimate().not_identifiable == tactid.VALUE_NAMES
    rest = at_rest(len(time) - 1)
    assert identifier.push(time[0], q[0], qd[0], wrench[0, None], **at_rest(1)) == 0
    assert identifier.push(time[1:], q[1:], qd[1:], wrench[1:, None], **rest) == len(time) - 1
    estimate = identifier.estimate()
    np.testing.assert_allclose(estimate.body.parameters, payload.parameters, atol=1e-4)
    assert (
        identifier.push(time[-1], q[-1], qd[-1], wrench[-1, None], **at_rest(1)) == 0
    )  # not later
    assert identifier.push(9.0, q[-1] * np.nan, qd[-1], wrench[-1, None], **at_rest(1)) == 0
    no_pose = at_rest(1) | {"pose": np.full((1, 7), np.nan)}
    assert identifier.push(9.0, q[-1], qd[-1], wrench[-1, None], **no_pose) == 0
    assert identifier.estimate().rejected == 3
    assert identifier.estimate().frame == "tool0"


def test_the_papers_filter_sees_the_same_samples_again(
    robot: tactid.Manipulator, rng: np.random.Generator
) -> None:
    """What it learnt stays, counts start again; each pass takes it nearer to the payload."""
    payload = tactid.MassProperties(7.0, [0.1, -0.2, 0.3], np.diag([0.4, 0.5, 0.6]))
    time = np.arange(0, 4, 1e-3)
    q, qd, regressor = carried(robot, time, rng)
    wrench = (regressor @ payload.parameters)[:, None]
    filter_ = tactid.PaperFilter(robot, ["tool0"], average_s=0.0)
    errors = []
    for _ in range(2):
        assert filter_.push(time, q, qd, wrench, **at_rest(len(time))) == len(time) - 1
        assert filter_.push(time[-1], q[-1], qd[-1], wrench[-1], **at_rest(1)) == 0  # not later
        estimate = filter_.estimate()
        assert (estimate.rejected, estimate.not_identifiable) == (1, [])
        assert set(estimate.reported_intervals) == {None}
        errors.append(np.abs(estimate.values - values_of(payload)).max())
        filter_.rewind()
    assert errors[1] < errors[0]
    assert filter_.estimate().rejected == 0
    assert (filter_.singular_values().mass >= 0).all()


def test_a_contact_is_what_the_load_does_not_explain(
    robot: tactid.Manipulator, rng: np.random.Generator
) -> None:
    """15 N are no change of a payload that is held, and else are within the interval of either."""
    body = tactid.MassProperties(7.0, [0.1, -0.2, 0.3], np.diag([0.4, 0.5, 0.6]))
    time = np.arange(0, 6, 2e-3)
    q, qd, regressor = carried(robot, time, rng)
    force = np.array([9.0, -12.0, 0, 0, 0, 0])
    wrench = regressor @ body.parameters + np.where(time[:, None] < 4, 0, force)
    wrench += np.repeat([0.1, 0.01], 3) * rng.standard_normal(wrench.shape)
    for hold in (True, False):
        identifier = tactid.Identifier(robot, ["tool0"], gravity=[0, 0, 0], wrench_acts_on="sensor")
        assert identifier.contact_wrench("tool0") is None
        assert identifier.estimate_before_change() is None
        assert not identifier.hold_payload()
        for rows in np.split(np.arange(3000), [2000]):
            rest = at_rest(len(rows))
            identifier.push(time[rows], q[rows], qd[rows], -wrench[rows, None], **rest)
            if rows[0] == 0:
                assert identifier.is_settled()
                identifier.hold_payload(hold)
        found = identifier.contact_wrench("tool0")
        latency = identifier.contact_latency()
        assert found is not None
        assert latency is not None
        np.testing.assert_allclose(found.time, time[-1] - latency)
        assert found.is_changing is not hold
        assert (np.abs(found.values + force) < 6 * found.std_devs).all()
        assert bool(found.std_devs[:3].max() < 0.2) is hold
        load = identifier.load_wrench("tool0", "world")
        assert load is not None
        assert load.covariance.shape == (6, 6)
        before = identifier.estimate_before_change()
        assert (before is None) is hold
        if before is not None:
            np.testing.assert_allclose(before.values[0], 7.0, atol=0.01)
            assert identifier.time_since_change() < 2
    with pytest.raises(tactid.ArgumentError, match="moves relative to the end-effector"):
        identifier.contact_wrench("base_link")


def test_payload_and_offset_have_a_joint_covariance(
    robot: tactid.Manipulator, rng: np.random.Generator
) -> None:
    body = tactid.MassProperties(7.0, [0.1, -0.2, 0.3], np.diag([0.4, 0.5, 0.6]))
    time = np.arange(0, 4, 2e-3)
    q, qd, regressor = carried(robot, time, rng)
    wrench = regressor @ body.parameters + np.array([5.0, 3.0, -2.0, 0.1, 0.2, 0.3])
    wrench += np.repeat([0.1, 0.01], 3) * rng.standard_normal(wrench.shape)
    identifier = tactid.Identifier(robot, ["tool0"], wrench_offset="yes")
    assert identifier.joint_covariance() is None
    identifier.push(time, q, qd, wrench[:, None], **at_rest(len(time)))
    joint, offset = identifier.joint_covariance(), identifier.wrench_offset()
    assert joint is not None
    assert offset is not None
    np.testing.assert_allclose(joint[:10, :10], identifier.covariance())
    np.testing.assert_allclose(np.sqrt(np.diagonal(joint)[10:]), offset.std_devs)
    assert (np.abs(offset.values[:3] - [5, 3, -2]) < 6 * offset.std_devs[:3]).all()


def test_online_estimates_know_their_uncertainty_and_detect_a_payload_change(
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
    identifier = tactid.Identifier(robot, ["tool0"])
    for body, rows, changes in zip(bodies, np.split(np.arange(8000), 2), (0, 1), strict=True):
        rest = at_rest(len(rows))
        assert identifier.push(time[rows], q[rows], qd[rows], wrench[rows, None], **rest) >= 3999
        estimate = identifier.estimate()
        assert estimate.payload_changes == changes
        assert estimate.is_physical
        covariance = identifier.covariance()
        assert covariance is not None
        np.testing.assert_allclose(np.sqrt(covariance[0, 0]), estimate.std_devs[0])
        error = estimate.body.parameters - body.parameters
        # Ten squares over their variances are within 30 in all but a thousandth of all cases.
        assert error @ np.linalg.solve(covariance, error) < 30
        np.testing.assert_allclose(estimate.body.parameters, body.parameters, atol=0.01)
    assert 4 < estimate.since_s < 4.2


def test_a_stamp_far_in_the_future_stops_no_identifier(
    robot: tactid.Manipulator, rng: np.random.Generator
) -> None:
    payload = tactid.MassProperties(7.0, [0.1, -0.2, 0.3], np.diag([0.4, 0.5, 0.6]))
    time = np.arange(0, 3, 1e-3)
    q, qd, regressor = carried(robot, time, rng)
    wrench = regressor @ payload.parameters + 0.05 * rng.standard_normal((len(time), 6))
    base = at_rest(len(time))
    time[600] += 1e9
    lag, online = tactid.LagIdentifier(robot, ["tool0"]), tactid.Identifier(robot)
    for identifier in (lag, online):
        # Two are rejected, and three start a stretch: the first, that of the stamp and the next.
        assert identifier.push(time, q, qd, wrench, **base) == len(time) - 5
    assert lag.until_s() > 2.9
    for estimate in (lag.window_estimate(), online.estimate()):
        assert (estimate.rejected, estimate.gaps) == (2, 2)
        assert estimate.body.mass == pytest.approx(7.0, abs=0.02)


def test_motion_and_payload_at_once_while_samples_come(
    robot: tactid.Manipulator, rng: np.random.Generator
) -> None:
    """With noise on every channel, the estimate with a lag is better than that of windows."""
    payload = tactid.MassProperties(7.0, [0.1, -0.2, 0.3], np.diag([0.4, 0.5, 0.6]))
    time = np.arange(0, 3, 1e-3)
    q, qd, regressor = carried(robot, time, rng)

    def noisy(values: np.ndarray, std_dev: float) -> np.ndarray:
        return values + std_dev * rng.standard_normal(values.shape)

    base = {name: noisy(values, 2e-3) for name, values in at_rest(len(time)).items()}
    base["pose"][:, 3:] /= np.linalg.norm(base["pose"][:, 3:], axis=1, keepdims=True)
    samples = (noisy(q, 2e-3), noisy(qd, 5e-3), noisy(regressor @ payload.parameters, 0.05))
    identifier, online = tactid.LagIdentifier(robot, ["tool0"], lag_s=0.2), tactid.Identifier(robot)
    assert (identifier.estimate(), identifier.motion()) == (None, "too-few")
    assert identifier.until_s() == -np.inf
    assert repr(identifier) == "<tactid.LagIdentifier: no estimate yet>"
    for rows in np.split(np.arange(len(time)), 3):
        q_, qd_, wrench = (values[rows] for values in samples)
        now = {name: values[rows] for name, values in base.items()}
        for each in (identifier, online):
            each.push(time[rows], q_, qd_, wrench[:, None], **now)
        assert identifier.window_estimate() == online.estimate()
    assert identifier.motion() == "with-payload"
    assert 2.9 < identifier.until_s() <= 2.999
    identifier.finish()
    # The fingers have no rail for such joint positions.
    assert [each.kind for each in identifier.findings()] == ["positions_beyond_limits"]
    estimate, windows = identifier.estimate(), identifier.window_estimate()
    assert estimate is not None
    error = (estimate.values - values_of(payload)) / estimate.std_devs
    assert np.abs(error).max() < 4
    # Splines know the mean noise of the motion; windows take it into their rows.
    assert np.exp(np.mean(np.log(estimate.std_devs / windows.std_devs))) < 0.7


def test_an_estimate_with_a_lag_that_there_never_is_is_refused(
    robot: tactid.Manipulator, urdf: str
) -> None:
    fixed = tactid.Manipulator.from_urdf(urdf, base="fixed")
    for given in (fixed, None):
        with pytest.raises(tactid.ArgumentError, match="`robot`: LagIdentifier does not"):
            tactid.LagIdentifier(given, ["sensor" if given is None else "tool0"])  # type: ignore[arg-type]
    with pytest.raises(tactid.ArgumentError, match="LagIdentifier") as refused:
        tactid.LagIdentifier(robot, ["tool0"], wrench_offset="yes")
    assert refused.value.option == "wrench_offset"
    with pytest.raises(tactid.ArgumentError, match="`average_s` does not apply to LagIdentifier"):
        tactid.LagIdentifier(robot, ["tool0"], average_s=1.0)
    with pytest.raises(tactid.ArgumentError, match=r"`lag_s` is 0\.05, but must be between 0\.1"):
        tactid.LagIdentifier(robot, ["tool0"], lag_s=0.05)


def test_what_cannot_be_identified_is_refused(robot: tactid.Manipulator, urdf: str) -> None:
    with pytest.raises(tactid.IdentificationError, match="needs at least one wrench"):
        tactid.Identifier(robot, sensors=[])
    fixed = tactid.Manipulator.from_urdf(urdf, base="fixed")
    with pytest.raises(tactid.IdentificationError, match="free-floating base"):
        tactid.Identifier(fixed, method="joint-sensing")
    with pytest.raises(tactid.ArgumentError, match="`alpha` is 3"):
        tactid.PaperFilter(robot, ["tool0"], alpha=3.0)
    with pytest.raises(tactid.ArgumentError, match="'least-squares' or 'nlms'"):
        tactid.identify("none.mcap", estimator="magic")
    for name, value in {"estimator": "nlms", "average_s": 1.0, "urdf": "<robot/>"}.items():
        with pytest.raises(tactid.ArgumentError, match=f"`{name}` does not apply to Identifier"):
            tactid.Identifier(robot, ["tool0"], **{name: value})
    with pytest.raises(tactid.ArgumentError, match="`wrench_offset` does not apply to PaperFilter"):
        tactid.PaperFilter(robot, ["tool0"], wrench_offset="yes")
    identifier = tactid.Identifier(robot, ["tool0"])
    with pytest.raises(tactid.ArgumentError, match=r"shape \(3,\): expected \(6,\) or \(N, 6\)"):
        identifier.push(0, np.zeros(8), np.zeros(8), np.zeros(3), **at_rest(1))
    with pytest.raises(tactid.ArgumentError, match="`wrench` is missing"):
        identifier.push(0, np.zeros(8), np.zeros(8))


def test_impossible_experiments_are_refused() -> None:
    with pytest.raises(tactid.ExperimentError, match=r"line 2: payload\.mass_kg = -1"):
        tactid.Experiment.from_toml("[payload]\nmass_kg = -1.0")
    with pytest.raises(tactid.ExperimentError, match="line 1"):
        tactid.Experiment.from_toml("sped = 1")
    with pytest.raises(tactid.ExperimentError, match='expected "identifiable", "table1" or a list'):
        tactid.Experiment.paper().replace(posture="table2")
    with pytest.raises(tactid.ExperimentError):
        tactid.Experiment.paper().replace(frequency=-1)
    again = tactid.Experiment.from_toml(tactid.Experiment.paper().to_toml())
    assert again == tactid.Experiment.paper()
    assert tactid.Experiment.from_toml(tactid.Experiment.PAPER_TOML) == again
