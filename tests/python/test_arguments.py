"""Arguments as a newcomer gives them: what fits is taken, each mistake is named with its cure."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tactid
from wrist import BODY, Array, about

TIME = np.arange(0.0, 4.0, 0.01)
DOWN = [0.0, 0.0, -9.81]

ARM = """
<robot name="arm">
  <link name="base_link"><inertial><mass value="9"/>
    <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
  <link name="upper"><inertial><origin xyz="0 0 0.2"/><mass value="3"/>
    <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.02"/></inertial></link>
  <link name="tool0"><inertial><origin xyz="0.1 0 0"/><mass value="1"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial></link>
  <joint name="one" type="continuous"><origin rpy="0.6 0 0"/>
    <parent link="base_link"/><child link="upper"/><axis xyz="0 0 1"/></joint>
  <joint name="two" type="continuous"><origin xyz="0 0 0.4"/>
    <parent link="upper"/><child link="tool0"/><axis xyz="0 1 0"/></joint>
</robot>
"""
"""Two joints on a tilted pedestal."""


def swings(time: Array) -> tuple[Array, Array, Array]:
    """Positions, velocities and accelerations of both joints."""
    w, size = np.array([2.1, 3.7]), np.array([1.2, 0.9])
    angle = np.outer(time, w)
    return size * np.sin(angle), size * w * np.cos(angle), -size * w**2 * np.sin(angle)


def arm(base: str = "fixed") -> tactid.Manipulator:
    return tactid.Manipulator.from_urdf(ARM, base)  # type: ignore[arg-type]


def recorded() -> dict[str, Array]:
    """What the arm measures while it carries the body."""
    q, qd, qdd = swings(TIME)
    motion = arm().kinematics("tool0", q, qd, qdd)
    back = np.swapaxes(motion.pose[:, :3, :3], 1, 2)
    vectors = (motion.acceleration - DOWN, motion.angular_velocity, motion.angular_acceleration)
    own = [np.einsum("nij,nj->ni", back, vector) for vector in vectors]
    wrench = tactid.wrench_regressor(*own) @ BODY.parameters
    loaded = arm().with_payload("tool0", BODY)
    effort, _ = loaded.inverse_dynamics(q, qd, qdd, gravity=DOWN)
    return {"q": q, "qd": qd, "wrench": wrench, "effort": effort}


RECORDED = recorded()
WRENCHES = {name: RECORDED[name] for name in ("q", "qd", "wrench")}


def mass(**given: Any) -> float:
    """The mass that is identified from the arrays of the arm, with changes."""
    arguments = {"cutoff_hz": 5.0, "delay_s": 0.0, **WRENCHES, **given}
    return tactid.identify(TIME, **arguments).estimate.body.mass


def test_a_urdf_takes_the_place_of_a_robot(tmp_path: Path) -> None:
    file = tmp_path / "arm.urdf"
    file.write_text(ARM)
    expected = mass(robot=arm())
    assert expected == pytest.approx(BODY.mass, rel=1e-3)
    for urdf in (ARM, ARM.strip(), file, str(file)):
        assert mass(urdf=urdf) == expected


def test_the_base_is_fixed_unless_it_is_read_as_floating() -> None:
    assert tactid.Manipulator.from_urdf(ARM).base == "fixed"
    pose, rest = np.array([0.0, 0, 0, 0, 0, 0, 1]), np.zeros(6)
    still = {"pose": np.tile(pose, (len(TIME), 1)), "twist": np.tile(rest, (len(TIME), 1))}
    with pytest.raises(tactid.ArgumentError, match=r"`pose` .*base=\"floating\".*`gravity`"):
        mass(robot=arm(), **still)
    assert mass(robot=arm("floating"), gravity=DOWN, **still) == pytest.approx(BODY.mass, rel=1e-3)
    assert mass(urdf=ARM, gravity=DOWN, **still) == pytest.approx(BODY.mass, rel=1e-3)
    identifier = tactid.Identifier(arm())
    one = {name: values[0] for name, values in WRENCHES.items()}
    with pytest.raises(tactid.ArgumentError, match=r"`twist` .*base=\"floating\""):
        identifier.push(0.0, **one, twist=rest)
    with pytest.raises(tactid.ArgumentError, match=r"`pose` is missing: that of the floating base"):
        tactid.Identifier(arm("floating")).push(0.0, **one)
    with pytest.raises(tactid.ArgumentError, match=r"`twist` is missing"):
        tactid.Identifier(arm("floating")).push(0.0, **one, pose=pose)


def test_an_unloaded_reference_removes_friction() -> None:
    q, qd, qdd = swings(TIME)
    friction = 2.0 * np.tanh(qd / 0.05)
    empty, _ = arm().inverse_dynamics(q, qd, qdd, gravity=DOWN)
    later = TIME + 100.0
    given = {"q": q, "qd": qd, "effort": RECORDED["effort"] + friction, "robot": arm()}
    unloaded = {"time": later, "q": q, "qd": qd, "effort": empty + friction}
    options = {"cutoff_hz": 5.0, "known_mass_kg": BODY.mass}
    found = tactid.identify(TIME, unloaded=unloaded, **given, **options).estimate
    without = tactid.identify(TIME, **given, **options).estimate
    truth = BODY.com[[0, 2]]
    assert np.abs(found.values[[1, 3]] - truth).max() < 2e-3
    assert np.abs(without.values[[1, 3]] - truth).max() > 1e-2
    doubled = unloaded | {"effort": 2 * unloaded["effort"]}
    gained = given | {"effort": 2 * given["effort"]}
    again = tactid.identify(TIME, unloaded=doubled, effort_gain=[0.5, 0.5], **gained, **options)
    np.testing.assert_allclose(again.estimate.values, found.values)


def tool(mass: float, least: float) -> tactid.MassProperties:
    """A body at the tip with the principal moments ``least``, ``least`` and 1 kg m²."""
    return tactid.MassProperties(mass, com=[0, 0, 0], inertia=np.diag([least, least, 1.0]))


@pytest.mark.parametrize(
    ("unloaded", "message"),
    [
        (
            "empty.mcap",
            "^`unloaded`: the unloaded reference of arrays is a dict with the arrays `time`, `q`",
        ),
        ({"time": TIME, "q": RECORDED["q"]}, "^`unloaded`: the unloaded reference has no `effort`"),
        (
            {"time": TIME, "q": RECORDED["q"].T, "effort": RECORDED["effort"]},
            r"`unloaded\[\"q\"\]` has the shape \(2, 400\).*transposed",
        ),
        (
            {"time": TIME[1:], "q": RECORDED["q"], "effort": RECORDED["effort"]},
            r"`unloaded\[\"q\"\]` has 400 samples, but `unloaded\[\"time\"\]` has 399",
        ),
        (
            {"time": TIME, "q": 0.5 * RECORDED["q"], "effort": RECORDED["effort"]},
            "^`unloaded`: the unloaded recording has another motion: joint `one` differs",
        ),
    ],
)
def test_an_unloaded_reference_that_does_not_fit_is_named(unloaded: Any, message: str) -> None:
    given = {name: RECORDED[name] for name in ("q", "qd", "effort")}
    with pytest.raises(tactid.TactidError, match=message):
        tactid.identify(TIME, robot=arm(), cutoff_hz=5.0, unloaded=unloaded, **given)


def test_wrenches_act_on_the_sensor_of_arrays() -> None:
    opposite = {"wrench": -RECORDED["wrench"], "wrench_acts_on": "sensor"}
    assert mass(robot=arm(), **opposite) == pytest.approx(BODY.mass, rel=1e-3)


def carried(time: Array) -> dict[str, Array]:
    """Pose, twist and wrench of a sensor that is turned about two axes."""
    yaw, pitch = 1.1 * np.sin(2 * time), 0.8 * np.sin(3 * time)
    turn = about(2, yaw) @ about(1, pitch)
    up, side = np.array([0.0, 0, 1]), about(2, yaw) @ [0.0, 1, 0]
    rates = 2.2 * np.cos(2 * time), 2.4 * np.cos(3 * time)
    spin = rates[0][:, None] * up + rates[1][:, None] * side
    spins = -4.4 * np.sin(2 * time)[:, None] * up - 7.2 * np.sin(3 * time)[:, None] * side
    spins += (rates[0] * rates[1])[:, None] * np.cross(up, side)
    back = np.swapaxes(turn, 1, 2)
    own = [np.einsum("nij,nj->ni", back, vector) for vector in (spin, spins)]
    pose = np.tile(np.eye(4), (len(time), 1, 1))
    pose[:, :3, :3] = turn
    wrench = tactid.wrench_regressor(back @ [0.0, 0, 9.81], *own) @ BODY.parameters
    return {"pose": pose, "twist": np.hstack([np.zeros_like(spin), spin]), "wrench": wrench}


def test_a_sensor_without_a_robot_is_identified_online() -> None:
    given = carried(TIME)
    identifier = tactid.Identifier()
    for k in range(10):  # one sample at a time, with a wrench of six numbers
        identifier.push(TIME[k], **{name: values[k] for name, values in given.items()})
    identifier.push(TIME[10:], **{name: values[10:] for name, values in given.items()})
    estimate = identifier.estimate()
    assert estimate.frame == "sensor"
    assert estimate.body.mass == pytest.approx(BODY.mass, rel=1e-3)
    np.testing.assert_allclose(estimate.body.com, BODY.com, atol=1e-3)
    offline = tactid.identify(TIME, cutoff_hz=10.0, delay_s=0.0, **given).estimate
    np.testing.assert_allclose(estimate.values, offline.values, atol=5e-3)
    with_acceleration = tactid.Identifier(tip="ft_sensor")
    given["acceleration"] = np.gradient(given["twist"], TIME, axis=0)
    with_acceleration.push(TIME, **given)
    assert with_acceleration.estimate().frame == "ft_sensor"
    assert with_acceleration.estimate().body.mass == pytest.approx(BODY.mass, rel=1e-2)
    with pytest.raises(tactid.ArgumentError, match=r"`pose` is missing: that of the sensor"):
        identifier.push(5.0, wrench=np.zeros(6))
    with pytest.raises(tactid.ArgumentError, match=r"`q` is given without a robot"):
        identifier.push(5.0, np.zeros(2), **{name: values[0] for name, values in given.items()})


def test_one_sensor_has_wrenches_of_any_shape() -> None:
    expected = mass(robot=arm())
    wrench = RECORDED["wrench"]
    for shaped in (wrench, wrench[:, None], wrench.tolist(), np.asfortranarray(wrench)):
        assert mass(robot=arm(), wrench=shaped) == expected
        assert mass(robot=arm(), wrench=shaped, sensors="tool0") == expected
        assert mass(robot=arm(), wrench=shaped, sensors=["tool0"]) == expected
    identifier = tactid.Identifier(arm())
    q, qd = RECORDED["q"], RECORDED["qd"]
    unknown = "unknown mass in tool0, 0 of 10 values identifiable, 0 windows"
    assert repr(identifier) == f"<tactid.Identifier: {unknown}>"
    shapes = [wrench[0], wrench[1, None], wrench[2, None, None]]
    for k, shaped in enumerate(shapes):
        identifier.push(TIME[k], q[k], qd[k], shaped)
    assert identifier.push(TIME[3:], q[3:], qd[3:], wrench[3:]) == len(TIME) - 3
    assert re.search(r" kg in tool0, 10 of 10 .*, \d\d+ windows>$", repr(identifier))
    two = tactid.Identifier(arm(), ["tool0", "upper"])
    two.push(0.0, q[0], qd[0], np.zeros((2, 6)))
    assert two.push(TIME[1:], q[1:], qd[1:], np.zeros((399, 2, 6))) == 399


class Frame:
    """What NumPy sees of a series or a frame of pandas or polars."""

    def __init__(self, values: Array) -> None:
        self.values = values

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Array:
        return np.array(self.values, dtype, copy=copy)


def test_numbers_of_other_types_are_taken() -> None:
    expected = mass(robot=arm())
    assert mass(robot=arm(), q=Frame(RECORDED["q"])) == expected
    single = np.float32(RECORDED["q"])
    assert mass(robot=arm(), q=single) == pytest.approx(expected, rel=1e-4)
    wide = np.zeros((800, 4))
    wide[::2, 1::2] = RECORDED["q"]
    assert mass(robot=arm(), q=wide[::2, 1::2]) == expected
    for times in (Frame(TIME), TIME.tolist()):
        found = tactid.identify(times, robot=arm(), cutoff_hz=5.0, delay_s=0.0, **WRENCHES)
        assert found.estimate.body.mass == expected


Q, W = RECORDED["q"], RECORDED["wrench"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"q": Q.T}, r"`q` has the shape \(2, 400\): expected \(2,\) or \(N, 2\); it is transp"),
        ({"wrench": W.T}, r"`wrench` .*\(6, 400\): expected \(6,\) or \(N, 6\) .*give its \.T"),
        ({"wrench": W[:, :3]}, r"\(400, 3\): expected .*: force and moment of one sensor"),
        (
            {"wrench": np.stack([W, W], axis=1)},
            r"\(400, 2, 6\): expected \(6,\) or \(N, 6\) or \(1, 6\) or \(N, 1, 6\).*`sensors`",
        ),
        (
            {"sensors": ["tool0", "upper"]},
            r"\(400, 6\): expected \(2, 6\) or \(N, 2, 6\): .* of each of the 2 `sensors`",
        ),
        ({"sensors": []}, r"`wrench` is given, but there is no sensor: name its link in `sensors`"),
        ({"sensors": 7}, r"`sensors` is 7: expected the name of a link, or a list of names"),
        ({"sensors": ["wrist"]}, r"no link `wrist`.*tool0"),
        ({"tip": "wrist"}, r"no link `wrist`.*tool0"),
        ({"q": None}, r"`q` is missing: the robot has joints"),
        ({"q": []}, r"`q` has the shape \(0,\): expected \(2,\) or \(N, 2\)"),
        ({"q": Q[:-1]}, r"`q` has 399 samples, but `time` has 400"),
        (
            {"q": np.full_like(Q, np.nan)},
            r"400 samples of `q` have a value that is not finite, and none could be used: leave",
        ),
        ({"q": Q.astype(str)}, r"`q` is not an array of numbers: it holds text"),
        ({"q": [["a", "b"]] * 400}, r"`q` is not an array of numbers: it holds text"),
        ({"q": [[1.0, 2.0], [3.0]]}, r"`q` is not .* its rows have different lengths"),
        ({"q": Q + 0j}, r"`q` is not an array of numbers: it holds complex numbers"),
        ({"robot": ARM}, r"`robot` is of type str: expected a tactid.Manipulator.*from_urdf"),
        ({"robot": arm(), "urdf": ARM}, r"`robot` and `urdf` are both given"),
        ({"robot": None}, r"`q` is given without a robot: give `robot`"),
        ({"pose": np.eye(3)}, r"`pose` has the shape \(3, 3\): expected \(4, 4\) or \(N, 4, 4\)"),
        ({"foo": 1}, r"no keyword `foo`\. The keywords are robot, .*wrench, .*progress, urdf, "),
        ({"wrenches": W}, r"no keyword `wrenches`; did you mean `wrench`\? The keywords are wren"),
        ({"options": {"cutoff_hz": 5.0}}, r"`options` is of type dict: expected tactid.Options"),
        (
            {"gravity": -9.81},
            r"`gravity` is -9\.81: expected three numbers, or 'auto' or 'unknown'$",
        ),
        (
            {"bounding_box": [1, 2, 3]},
            r"`bounding_box` is \[1, 2, 3\]: expected .* shape \(2, 3\)$",
        ),
        ({"wrench_noise": [1, 2, 3]}, r"expected six numbers for all sensors, \(6,\), or for each"),
        ({"cutoff_hz": "5 Hz"}, r"`cutoff_hz` is '5 Hz': expected a number"),
        ({"tip": 3}, r"`tip` is 3: expected text"),
        ({"wrench_offset": "on"}, r"`wrench_offset` is 'on': expected 'auto' or 'yes' or 'no'"),
        ({"known_tool": 1.0}, r"`known_tool` is 1\.0: expected a tactid\.MassProperties"),
        ({"known_tool": tool(-1.0, 1.0)}, "^`known_tool` is no body that can exist: its mass must"),
        ({"known_tool": tool(1.0, 0.1)}, "each principal moment of inertia .* at most the sum of"),
        ({"method": "wrench"}, r"`method` is 'wrench': expected 'tactile' or 'effort' or"),
        ({"urdf": 3, "robot": None}, "^`urdf`: a URDF is given as its text, .* or as the path "),
        ({"wrench": None}, r"`wrench` is missing: nothing measures the load: .* the efforts"),
        ({"method": "effort"}, r"`effort` is missing: the effort method needs it"),
        (
            {"gravity": "unknown", "method": "effort", "effort": Q},
            "^a direction of gravity that is unknown needs the tactile method and not the effort",
        ),
        ({"method": "joint-sensing"}, "needs a free-floating base.*; `method` chooses the method$"),
        ({"robot": arm("floating"), "pose": np.zeros((400, 7))}, r"`pose` .* of norm one"),
        ({"robot": arm("floating"), "pose": np.full((400, 4, 4), np.nan)}, r"`pose` .*without NaN"),
    ],
)
def test_a_mistake_is_named_with_its_cure(change: dict[str, Any], message: str) -> None:
    with pytest.raises(tactid.TactidError, match=message):
        mass(**{"robot": arm()} | change)


@pytest.mark.parametrize(
    ("time", "message"),
    [
        (None, r"`time` is not an array of numbers: it is None"),
        ([], r"`time` is empty: there is no sample"),
        (TIME[:, None], r"`time` has the shape \(400, 1\): expected \(\) or \(N,\)"),
        (TIME.astype("datetime64[s]"), r"`time` .* dates; give seconds, such as \(t - t\[0\]\) /"),
    ],
)
def test_times_that_do_not_fit_are_named(time: Any, message: str) -> None:
    given = {} if time is not None and len(time) == 0 else WRENCHES
    with pytest.raises(tactid.ArgumentError, match=message):
        tactid.identify(time, robot=arm(), **given)


@pytest.mark.parametrize("solver", [tactid.Identifier, tactid.PaperFilter])
def test_an_unknown_keyword_of_an_online_solver_lists_what_there_is(solver: Any) -> None:
    with pytest.raises(tactid.ArgumentError, match=r"`foo`\. The keywords are robot, sensors"):
        solver(arm(), foo=1)
    with pytest.raises(tactid.ArgumentError, match=r"did you mean `gravity`\? .* are gravity, "):
        solver(arm(), gravitiy=DOWN)
    with pytest.raises(tactid.ArgumentError, match=r"`robot` is of type str"):
        solver("arm.urdf")


def test_a_sample_that_lacks_something_is_named() -> None:
    q, wrench = Q[0], W[0]
    with pytest.raises(tactid.ArgumentError, match=r"`q` is missing: the robot has 2 joints"):
        tactid.Identifier(arm()).push(0.0, wrench=wrench)
    with pytest.raises(tactid.ArgumentError, match=r"`wrench` is missing: .* of 1 sensor$"):
        tactid.Identifier(arm()).push(0.0, q, q)
    with pytest.raises(tactid.ArgumentError, match=r"`effort` is missing"):
        tactid.Identifier(arm(), method="effort").push(0.0, q, q)
    with pytest.raises(tactid.ArgumentError, match=r"`wrench` is given, but there is no sensor"):
        tactid.Identifier(arm(), method="effort").push(0.0, q, q, wrench, effort=q)
    with pytest.raises(tactid.ArgumentError, match=r"`time` is not .* it holds text"):
        tactid.Identifier(arm()).push("now", q, q, wrench)
    with pytest.raises(tactid.ModelError, match=r"^`tip`: the robot has no link `paw`; it has: "):
        tactid.Identifier(arm(), tip="paw")


def test_masked_values_are_missing() -> None:
    masked = np.ma.masked_array(Q, mask=np.zeros_like(Q, dtype=bool))
    masked[100] = np.ma.masked
    found = tactid.identify(TIME, robot=arm(), **WRENCHES | {"q": masked})
    counted = {(fault.topic, fault.kind): fault.count for fault in found.faults}
    assert counted["q", "not_finite"] == 1


def test_ctrl_c_while_an_array_is_converted_is_no_argument_error() -> None:
    class Interrupted:
        def __array__(self, *_: object, **__: object) -> Array:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        tactid.MassProperties(1.0, Interrupted(), np.eye(3))  # type: ignore[arg-type]
