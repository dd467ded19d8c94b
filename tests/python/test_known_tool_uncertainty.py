"""A known tool has an uncertainty: that of its own recording, a given or an assumed one."""

import json
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import tactid
from conftest import TactidCommand

Array = NDArray[np.float64]

GRIPPER = np.array([0.9, 0.004, -0.003, 0.05, 2e-3, 1e-5, -2e-5, 2.2e-3, 3e-5, 1e-3])
BOX = np.array([0.6, 0.02, -0.01, 0.16, 3e-3, 1e-4, -1e-4, 4e-3, 2e-4, 3.5e-3])
FORCE_NOISE, MOMENT_NOISE = 0.3, 0.03
"""Standard deviations of the white noise, N and N m."""


def body(values: Array) -> tactid.MassProperties:
    return tactid.MassProperties.from_values(values)


def linear(values: Array) -> Array:
    """Returns the ten linear parameters of a body."""
    mass, com = values[0], values[1:4]
    inertia = np.array(body(values).inertia) + mass * (com @ com * np.eye(3) - np.outer(com, com))
    return np.concatenate([[mass], mass * com, inertia[np.triu_indices(3)]])


def motion(random: np.random.Generator, seconds: float = 8.0) -> tuple[Array, Array, Array]:
    """Returns times, poses and regressors, (N, 6, 10), of a sensor that turns about its origin."""
    time = np.arange(0.0, seconds, 0.01)
    angles, rates, accelerations = (np.zeros((3, len(time))) for _ in range(3))
    for frequency in (0.2, 0.35, 0.5):
        amplitude, phase = random.uniform(0.3, 0.6, 3), random.uniform(0, 2 * np.pi, 3)
        omega = 2 * np.pi * frequency
        turn = omega * time + phase[:, None]
        angles += amplitude[:, None] * np.sin(turn)
        rates += (amplitude * omega)[:, None] * np.cos(turn)
        accelerations -= (amplitude * omega**2)[:, None] * np.sin(turn)
    x, y, z = (turn_about(axis, angles[axis]) for axis in range(3))
    poses = np.tile(np.eye(4), (len(time), 1, 1))
    poses[:, :3, :3] = x @ y @ z
    (da, db, dc), (dda, ddb, ddc) = rates[..., None], accelerations[..., None]
    # In axes of the sensor: the rates of R = X Y Z, and their derivatives.
    of_x, of_y, of_z = (y @ z)[:, 0], z[:, 1], np.eye(3)[2]
    w_y, w_z = of_y * db, of_z * dc
    w = of_x * da + w_y + w_z
    rate_x, rate_y = -np.cross(w_y + w_z, of_x), -np.cross(w_z, of_y)
    dw = of_x * dda + rate_x * da + of_y * ddb + rate_y * db + of_z * ddc
    return time, poses, regressor(w, dw, 9.81 * poses[:, 2, :3])


def turn_about(axis: int, angle: Array) -> Array:
    """Returns the rotations about an axis, (N, 3, 3)."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    rotation = np.tile(np.eye(3), (len(angle), 1, 1))
    rotation[:, i, i] = rotation[:, j, j] = np.cos(angle)
    rotation[:, j, i] = np.sin(angle)
    rotation[:, i, j] = -np.sin(angle)
    return rotation


def regressor(w: Array, dw: Array, a: Array) -> Array:
    """Returns what force and moment about the origin are linear in, (N, 6, 10)."""

    def cross(v: Array) -> Array:
        return np.cross(v[:, None], np.eye(3)).transpose(0, 2, 1)

    def of_inertia(v: Array) -> Array:
        rows = np.zeros((len(v), 3, 6))
        rows[:, 0, :3] = v
        rows[:, 1, [1, 3, 4]] = v
        rows[:, 2, [2, 4, 5]] = v
        return rows

    rows = np.zeros((len(w), 6, 10))
    rows[:, :3, 0] = a
    rows[:, :3, 1:4] = cross(dw) + cross(w) @ cross(w)
    rows[:, 3:, 1:4] = -cross(a)
    rows[:, 3:, 4:] = of_inertia(dw) + cross(w) @ of_inertia(w)
    return rows


def recorded(random: np.random.Generator, parameters: Array, **options: Any) -> Any:
    """Identifies a body from a motion with noise."""
    time, poses, regressors = motion(random)
    noise = np.repeat([FORCE_NOISE, MOMENT_NOISE], 3)
    wrench = regressors @ parameters + random.normal(0, noise, (len(time), 6))
    return tactid.identify(time, pose=poses, wrench=wrench, gravity=[0, 0, -9.81], **options)


def holds(result: Any) -> Array:
    """Returns whether each interval of the box contains the truth."""
    limits = result.estimate.intervals
    return (limits[:, 0] <= BOX) & (limits[:, 1] >= BOX)


def test_the_route_of_the_tutorial_covers() -> None:
    """The gripper from one recording, the payload from the next: 93 to 97 % of the intervals hold.

    Without the uncertainty of the gripper it is about 80 %.
    """
    random = np.random.default_rng(7)
    held, without = [], []
    for _ in range(60):
        gripper = recorded(random, linear(GRIPPER)).estimate
        seed = int(random.integers(1 << 30))
        both = linear(GRIPPER) + linear(BOX)
        box = recorded(np.random.default_rng(seed), both, known_tool=gripper)
        exact = recorded(
            np.random.default_rng(seed), both, known_tool=gripper.body, known_tool_std_dev=0.0
        )
        held.append(holds(box))
        without.append(holds(exact))
    assert 0.93 <= np.mean(held) <= 0.97, np.mean(held, axis=0)
    assert np.mean(without) < 0.88


@pytest.fixture(scope="module")
def gripper() -> Any:
    return recorded(np.random.default_rng(1), linear(GRIPPER))


def both(seed: int = 2, **options: Any) -> Any:
    """Identifies gripper and box from one recording."""
    return recorded(np.random.default_rng(seed), linear(GRIPPER) + linear(BOX), **options)


def test_a_tool_is_given_as_its_result_in_four_ways(gripper: Any, tmp_path: Path) -> None:
    gripper.write_result(tmp_path / "whole.json")
    (tmp_path / "short.json").write_text(gripper.to_json())
    expected = both(known_tool=gripper)
    assert expected.findings == []
    for known_tool in (gripper.estimate, tmp_path / "whole.json", str(tmp_path / "short.json")):
        found = both(known_tool=known_tool).estimate
        np.testing.assert_allclose(found.values, expected.estimate.values, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(found.std_devs, expected.estimate.std_devs, rtol=1e-9)
    alone = both().estimate.std_devs[0]
    of_both = np.hypot(alone, gripper.estimate.std_devs[0])
    assert expected.estimate.std_devs[0] == pytest.approx(of_both, rel=1e-3)


def test_ten_numbers_are_a_body() -> None:
    expected = both(known_tool=body(GRIPPER)).estimate.values
    for numbers in (list(GRIPPER), np.array(GRIPPER)):
        np.testing.assert_array_equal(both(known_tool=numbers).estimate.values, expected)


def test_numbers_without_an_uncertainty_have_one_percent() -> None:
    assumed, given = (
        both(known_tool=body(GRIPPER), **options) for options in ({}, {"known_tool_std_dev": 0.02})
    )
    (finding,) = assumed.findings
    assert finding.kind == "tool_uncertainty_assumed"
    assert "`known_tool_std_dev`" in str(assumed)
    assert given.findings == []
    alone = both(known_tool=body(GRIPPER), known_tool_std_dev=0.0).estimate.std_devs[0]
    for result, fraction in ((assumed, 0.01), (given, 0.02)):
        of_tool = fraction * GRIPPER[0]
        assert result.estimate.std_devs[0] == pytest.approx(np.hypot(alone, of_tool), rel=1e-3)


def test_a_weighed_payload_also_corrects_its_tool() -> None:
    weighed = both(known_tool=body(GRIPPER), known_mass_kg=0.6, known_mass_std_dev_kg=1e-3)
    assert weighed.estimate.std_devs[0] < 1.01e-3
    exact = both(known_tool=body(GRIPPER), known_mass_kg=0.6)
    assert exact.estimate.values[0] == pytest.approx(0.6, rel=1e-6)
    assert exact.estimate.std_devs[0] == 0.0


def test_what_a_tool_does_not_determine_its_payload_does_not(gripper: Any, tmp_path: Path) -> None:
    document = json.loads(gripper.to_json())
    document["estimate"]["values"]["inertia"]["zz"] = None
    path = tmp_path / "part.json"
    path.write_text(json.dumps(document))
    found = both(known_tool=path).estimate
    assert found.identifiable[:4] == [True] * 4
    assert not any(found.identifiable[4:])


def test_a_wrong_tool_is_refused(gripper: Any, tmp_path: Path) -> None:
    document = json.loads(gripper.to_json())
    cases = {
        "was identified in the frame `hand`": {
            "estimate": document["estimate"] | {"frame": "hand"}
        },
        "its data contradict": {"is_contradicted": True},
        "has no mass": {
            "estimate": document["estimate"]
            | {"values": document["estimate"]["values"] | {"mass": None}}
        },
        "expected the JSON file": {"estimate": 1},
    }
    for message, changes in cases.items():
        (tmp_path / "tool.json").write_text(json.dumps(document | changes))
        with pytest.raises(tactid.ArgumentError, match=message):
            both(known_tool=tmp_path / "tool.json")
    with pytest.raises(tactid.ArgumentError, match="has its own"):
        both(known_tool=gripper, known_tool_std_dev=0.01)
    with pytest.raises(tactid.ArgumentError, match="`known_tool` is missing"):
        both(known_tool_std_dev=0.01)


def test_a_tool_whose_centre_is_in_mm_is_refused() -> None:
    mass, x, y, z, *inertia = GRIPPER
    in_mm = [mass, 1e3 * x, 1e3 * y, 1e3 * z, *inertia]
    farthest = 1e3 * max(abs(x), abs(y), abs(z))
    message = f"`known_tool` has its centre of mass {farthest:g} m from .* is it in mm"
    with pytest.raises(tactid.ArgumentError, match=message):
        both(known_tool=in_mm)


def test_the_error_of_a_tool_is_shared_by_recordings() -> None:
    known = {"known_tool": body(GRIPPER)}
    runs = [both(seed, **known) for seed in (2, 3, 4)]
    combined = tactid.combine(runs).estimate.std_devs[0]
    assert combined > 0.99 * 0.01 * GRIPPER[0]


def test_a_controller_line_contains_the_tool_where_its_payload_does(gripper: Any) -> None:
    result = both(known_tool=gripper)
    whole, payload = GRIPPER[0] + BOX[0], BOX[0]
    for maker, opening, mass_kg in (
        ("ur", "set_target_payload(", whole),
        ("kuka", "LOAD_DATA[1] = {M ", whole),
        ("franka", "robot.setLoad(", payload),
        ("abb", "PERS loaddata payload := [", payload),
    ):
        comment, *_, line = result.to_controller(maker).split("\n")
        number = line.removeprefix(opening).split(",")[0]
        assert float(number) == pytest.approx(mass_kg, rel=0.02)
        assert f"{'with' if mass_kg == whole else 'without'} the known tool 0." in comment
    assert "without the          known tool 0." in result.to_controller()


def test_the_first_part_of_a_recording_is_no_second_one() -> None:
    random = np.random.default_rng(5)
    time, poses, regressors = motion(random)
    noise = np.repeat([FORCE_NOISE, MOMENT_NOISE], 3)
    wrench = regressors @ linear(BOX) + random.normal(0, noise, (len(time), 6))
    whole, part = (
        tactid.identify(time[:n], pose=poses[:n], wrench=wrench[:n], gravity=[0, 0, -9.81])
        for n in (800, 500)
    )
    with pytest.raises(tactid.ArgumentError, match="begin with the same measurements"):
        tactid.combine([whole, part])


def test_every_reader_says_where_a_result_comes_from(
    command: TactidCommand, log: Path, tmp_path: Path
) -> None:
    hashed = sha256(log.read_bytes()).hexdigest()
    report, options = tmp_path / "report.html", ("--known-tool", "1,0,0,0,0,0,0,0,0,0")
    table = command("identify", log, *options, "--report", report)
    line = command("identify", log, *options, "--format", "ur").stdout
    record = json.loads(command("identify", log, *options, "--json").stdout)
    assert record["sha256"]["log"] == {log.name: hashed}
    assert record["setup"]["known_tool"]["mass"] == 1.0
    assert record["options"]["known_tool"][0] == 1.0
    for text in (table.stderr, line, report.read_text(), json.dumps(record["provenance"])):
        words = " ".join(text.split())
        assert hashed in words.replace(" ", "")
        assert "known tool 1.0" in words
        assert "acting on the payload" in words
