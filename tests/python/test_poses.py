"""Poses at rest: arrays and tables without times, against the least squares of NumPy."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import tactid
from conftest import TactidCommand
from recorded_arm import ur5e
from tactid._api.poses import identify_pose_table
from tactid._read.pose_table import read_poses
from tactid._show import recording_plots, recording_report, remarks
from test_cli import assert_refused

Array = NDArray[np.float64]

MASS, CENTER = 1.2, np.array([0.001, -0.002, 0.045])
OFFSET = np.array([-3.4, -4.7, -16.7, 0.005, -0.06, 0.005])
NOISE = np.array([0.1, 0.1, 0.1, 0.005, 0.005, 0.005])


def rotations(quaternions: Array) -> Array:
    """Returns the rotation matrices of quaternions [x, y, z, w], (N, 3, 3)."""
    x, y, z, w = quaternions.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), -1, 0)


def about(axis: int, angle: float) -> list[float]:
    """Returns the quaternion of a turn about an axis."""
    return [*(np.sin(angle / 2) * np.eye(3)[axis]), np.cos(angle / 2)]


def measured(quaternions: Array, seed: int, noise: float = 0.1) -> Array:
    """Returns the wrench on the sensor in each attitude of the sensor."""
    force = -9.81 * MASS * rotations(quaternions)[:, 2]
    exact = np.hstack([force, np.cross(CENTER, force)]) + OFFSET
    random = np.random.default_rng(seed).normal(size=exact.shape)
    return exact + noise * random * NOISE


def poses(count: int, seed: int = 3) -> tuple[Array, Array]:
    quaternions = np.random.default_rng(seed).normal(size=(count, 4))
    quaternions /= np.linalg.norm(quaternions, axis=1, keepdims=True)
    pose = np.hstack([np.tile([0.4, 0, 0.5], (count, 1)), quaternions])
    return pose, measured(quaternions, seed)


def identify(pose: Any, wrench: Any, **keywords: Any) -> tactid.Identification:
    return tactid.identify_poses(pose=pose, wrench=wrench, wrench_acts_on="sensor", **keywords)


def test_plain_least_squares_agrees() -> None:
    """Forces and moments share no unknown in the frame of the sensor: weights do not count."""
    pose, wrench = poses(24)
    result = identify(pose, wrench)
    down = -9.81 * rotations(pose[:, 3:])[:, 2]
    rows = np.zeros((24, 6, 10))
    rows[:, :3, 0] = down
    rows[:, 3:, 1:4] = np.cross(np.eye(3)[None], down[:, None]).transpose(0, 2, 1)
    rows[:, :, 4:] = np.eye(6)
    expected = np.linalg.lstsq(rows.reshape(-1, 10), wrench.ravel(), rcond=None)[0]
    found = result.estimate
    assert found.body.mass == pytest.approx(expected[0], abs=1e-7)
    np.testing.assert_allclose(found.body.com, expected[1:4] / expected[0], atol=1e-8)
    assert result.fit.wrench_offset is not None
    np.testing.assert_allclose(result.fit.wrench_offset.values, expected[4:], atol=1e-6)
    assert abs(found.body.mass - MASS) < found.half_widths[0] < 0.003
    assert result.clock == "none"
    assert not result.is_contradicted
    assert [name[0] for name in found.not_identifiable] == ["I"] * 6


def test_samples_of_a_pose_are_no_poses() -> None:
    pose, wrench = poses(6)
    once = identify(pose, wrench).estimate
    random = np.random.default_rng(0).normal(size=(6, 100, 6))
    many = wrench[:, None] + (random - random.mean(axis=1, keepdims=True)) * NOISE
    of_rows = identify(np.repeat(pose, 100, axis=0), many.reshape(600, 6)).estimate
    for found in (of_rows, identify(pose, many).estimate):
        np.testing.assert_allclose(found.std_devs[:4], once.std_devs[:4], rtol=1e-6)
        np.testing.assert_allclose(found.values[:4], once.values[:4], rtol=1e-6)
    assert of_rows.windows == 6


def test_attitudes_in_all_forms_agree() -> None:
    pose, wrench = poses(5)
    turned = rotations(pose[:, 3:])
    homogeneous = np.tile(np.eye(4), (5, 1, 1))
    homogeneous[:, :3, :3] = turned
    expected = identify(pose, wrench).estimate.values
    for form in (turned, homogeneous, turned.tolist()):
        np.testing.assert_allclose(identify(form, wrench).estimate.values, expected, atol=1e-9)


@pytest.mark.parametrize(
    ("count", "known"), [(2, {"mass"}), (3, {"mass", "com"}), (4, {"mass", "com"})]
)
def test_the_wizards_few_poses_are_enough(count: int, known: set[str]) -> None:
    turns = np.array([about(0, 0), about(0, 1.5), about(1, 1.5), about(0, -1.5)][:count])
    result = identify(rotations(turns), measured(turns, 1, 0.01))
    found = result.estimate
    identifiable = set(tactid.VALUE_NAMES) - set(found.not_identifiable)
    assert "mass" in identifiable
    assert ({"com x", "com y", "com z"} <= identifiable) == ("com" in known)
    assert abs(found.body.mass - MASS) < found.half_widths[0]


def test_without_an_offset_one_pose_weighs() -> None:
    turn = np.array([about(0, 0.3)])
    wrench = measured(turn, 1, 0.01) - OFFSET
    result = identify(rotations(turn), wrench, wrench_offset="no")
    assert result.estimate.body.mass == pytest.approx(MASS, abs=0.01)


def test_a_known_tool_is_subtracted() -> None:
    pose, wrench = poses(12)
    tool = tactid.MassProperties(0.5, [0, 0, 0.02], np.eye(3) * 1e-4)
    whole, rest = identify(pose, wrench).estimate, identify(pose, wrench, known_tool=tool).estimate
    assert rest.body.mass == pytest.approx(whole.body.mass - 0.5)


@pytest.mark.parametrize("wrench_is", ["without-weight", "contact"])
def test_what_a_controller_has_subtracted_is_added_again(wrench_is: str, tmp_path: Path) -> None:
    """At rest, both are the weight of the configured payload."""
    pose, wrench = poses(12)
    configured = [0.5, 0.01, 0, 0.03]
    weight = -9.81 * configured[0] * rotations(pose[:, 3:])[:, 2]
    less = wrench - np.hstack([weight, np.cross(configured[1:], weight)])
    found = identify(pose, less, wrench_is=wrench_is, configured_payload=configured)
    expected = identify(pose, wrench).estimate.values
    np.testing.assert_allclose(found.estimate.values, expected, atol=1e-9)
    assert "configured_payload 0.5 0.01 0 0.03" in str(found)
    table = write(tmp_path / "poses.csv", pose, less, "qx,qy,qz,qw,fx,fy,fz,tx,ty,tz")
    given = tactid.Options(
        wrench_acts_on="sensor", wrench_is=wrench_is, configured_payload=configured
    )
    arrays = read_poses(table, given)
    assert arrays is not None
    of_table = identify_pose_table(table, arrays, given).estimate.values
    np.testing.assert_allclose(of_table, expected, atol=1e-9)


def test_a_pose_that_was_left_out_is_an_arrow_with_its_size() -> None:
    pose, wrench = poses(12)
    wrench[5, 2] -= 6.0  # on the sensor
    found = identify(pose, wrench)
    axes = recording_plots.figures(found)["residuals"].axes[2]
    (arrow,) = (line for line in axes.lines if line.get_marker() == "^" and len(line.get_xdata()))
    assert list(arrow.get_xdata()) == [6]
    (size,) = axes.texts
    assert float(size.get_text()) == pytest.approx(6.0, abs=0.05)
    assert "held out" not in recording_report.render(found)


def test_an_opposite_sign_is_named() -> None:
    pose, wrench = poses(8)
    result = tactid.identify_poses(pose=pose, wrench=wrench)
    assert result.is_contradicted
    assert "wrench_acts_on" in str(result)


def test_a_pose_that_is_nan_is_left_out_and_counted() -> None:
    pose, wrench = poses(8)
    expected = identify(np.delete(pose, [2, 5], axis=0), np.delete(wrench, [2, 5], axis=0))
    pose[2], wrench[5, 1] = np.nan, np.nan
    result = identify(pose, wrench)
    np.testing.assert_allclose(result.estimate.values, expected.estimate.values)
    assert {fault.topic for fault in result.faults} == {"pose", "wrench"}


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"pose": None}, "`pose` is missing"),
        ({"wrench": None}, "`wrench` is missing"),
        ({"wrench": np.zeros((5, 6))}, "`wrench`"),
        ({"wrench": np.zeros((8, 3))}, "`wrench`"),
        ({"pose": np.zeros((8, 6))}, "`pose`"),
        ({"pose": np.tile(np.eye(3), (8, 1, 1))}, "one attitude"),
        ({"wrench": np.full((8, 6), np.nan)}, "no pose has"),
        ({"gravity": [0, 0, 0]}, "`gravity` is zero"),
        ({"cutoff_hz": 3}, "does not apply to poses at rest"),
        ({"wrench_is": "without-weight"}, "`configured_payload` is missing: at rest, a weight"),
        ({"wrench_is": "contact"}, "`configured_payload` is missing"),
        ({"q": np.zeros((8, 6))}, "`q` is given without a robot"),
        ({"nonsense": 1}, "there is no keyword"),
    ],
)
def test_what_is_wrong_is_named(keywords: dict[str, Any], message: str) -> None:
    pose, wrench = poses(8)
    with pytest.raises(tactid.TactidError, match=message):
        tactid.identify_poses(**{"pose": pose, "wrench": wrench} | keywords)


def write(path: Path, pose: Array, wrench: Array, names: str) -> Path:
    np.savetxt(path, np.hstack([pose[:, 3:], wrench]), delimiter=",", header=names, comments="")
    return path


def test_the_command_reads_a_table(command: TactidCommand, tmp_path: Path) -> None:
    pose, wrench = poses(24)
    names = "qx,qy,qz,qw,fx,fy,fz,tx,ty,tz"
    table = write(tmp_path / "poses.csv", pose, wrench, names)
    options = (table, "--wrench-acts-on", "sensor")
    done = command("identify", *map(str, options), "--report", str(tmp_path / "report.html"))
    assert "never show the inertia" in done.stdout + done.stderr
    assert "cutoff" not in done.stdout + done.stderr
    record = json.loads(command("identify", *map(str, options), "--json").stdout)
    assert record["estimate"]["values"]["mass"] == pytest.approx(1.2, abs=0.01)
    assert (record["clock"], record["cutoff_hz"]) == ("none", None)
    assert (
        "set_target_payload(1.2" in command("identify", *map(str, options), "--format", "ur").stdout
    )


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("qx,qy,qz,qw,a,b,c\n0,0,0,1,1,2,3\n", "no columns that are known as `wrench`"),
        ("a,fx,fy,fz,tx,ty,tz\n0,1,1,2,3,4,5\n", "no columns that are known as `pose`"),
        ("qx,qy,qz,qw,fx,fy,fz,tx,ty,tz\n0,0,0,1,1,2,3,4,5,six\n", "six"),
        ("qx,qy,qz,qw,fx,fy,fz,tx,ty,tz\n0,0,0,1,1,2,3,4,5\n", "line 2"),
        ("qx,qy,qz,qw,fx,fy,fz,tx,ty,tz\n", "no row"),
    ],
)
def test_a_wrong_table_is_refused(
    command: TactidCommand, tmp_path: Path, text: str, message: str
) -> None:
    table = tmp_path / "poses.csv"
    table.write_text(text)
    assert_refused(command("identify", str(table)), message)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("identify", "poses.csv", "poses.csv"), "table of poses at rest"),
        (("identify", "poses.csv", "again.csv"), "table of poses at rest"),
        (("compare", "poses.csv"), "table of poses at rest"),
        (("identify", "timed.csv"), "has times"),
    ],
)
def test_poses_that_are_no_recording_are_named(
    command: TactidCommand, tmp_path: Path, arguments: tuple[str, ...], message: str
) -> None:
    pose, wrench = poses(8)
    names = "qx,qy,qz,qw,fx,fy,fz,tx,ty,tz"
    write(tmp_path / "poses.csv", pose, wrench, names)
    write(tmp_path / "again.csv", pose, wrench, names)
    times = np.arange(8)[:, None]
    rows = np.hstack([times, pose[:, 3:], wrench])
    np.savetxt(tmp_path / "timed.csv", rows, delimiter=",", header=f"t,{names}", comments="")
    name, *tables = arguments
    assert_refused(command(name, *(str(tmp_path / table) for table in tables)), message)


def test_a_column_of_numbers_of_poses_is_no_pose(tmp_path: Path) -> None:
    pose, wrench = poses(8)
    rows = np.hstack([np.arange(8)[:, None], pose[:, 3:], wrench])
    names = "pose,qx,qy,qz,qw,fx,fy,fz,tx,ty,tz"
    np.savetxt(tmp_path / "poses.csv", rows, delimiter=",", header=names, comments="")
    arrays = read_poses(tmp_path / "poses.csv", tactid.Options())
    assert arrays is not None
    np.testing.assert_allclose(arrays["pose"][:, 3:], pose[:, 3:])


@pytest.mark.parametrize("reading", ["inverse", "scalar_first", "inverse_scalar_first"])
@pytest.mark.parametrize("count", [4, 12])
def test_orientations_in_another_form_are_named_first(reading: str, count: int) -> None:
    pose, wrench = poses(count)
    given = pose.copy()
    if reading.startswith("inverse"):
        given[:, 3:6] *= -1
    if reading.endswith("scalar_first"):
        given[:, 3:] = np.roll(given[:, 3:], 1, axis=1)
    result = identify(given, wrench)
    assert result.findings[0].kind == "orientation_contradicted"
    assert result.findings[0].data["reading"] == reading
    assert result.is_contradicted
    assert "nothing_held" not in {each.kind for each in result.findings}
    assert "A further attitude" not in str(result)


def test_three_poses_on_a_wall_say_that_they_are_too_few() -> None:
    turns = np.array([about(0, 0), about(0, 1.5), about(1, 1.5)])
    force = -9.81 * MASS * rotations(turns)[:, 0]
    wrench = np.hstack([force, np.cross(CENTER, force)]) + OFFSET
    result = identify(rotations(turns), wrench)
    assert "too_few_poses" in {each.kind for each in result.findings}
    assert "`gravity`" in str(result)


def test_an_inertia_without_moments_needs_no_faster_turn() -> None:
    advice = remarks.motion_advice(["Ixx"], moments=False)
    assert advice == ["The inertia shows in moments alone, which the sensor does not measure."]


def test_a_motion_without_known_times_is_not_at_rest(
    command: TactidCommand, tmp_path: Path
) -> None:
    _pose, wrench = poses(24)
    (tmp_path / "arm.urdf").write_text(ur5e())
    names = ",".join(["Zeit", *(f"q_{k}" for k in range(6)), *(f"qd_{k}" for k in range(6))])
    rows = np.hstack([np.arange(24)[:, None], np.zeros((24, 12)), wrench])
    table = tmp_path / "motion.csv"
    np.savetxt(table, rows, delimiter=",", header=names + ",fx,fy,fz,tx,ty,tz", comments="")
    refused = command("identify", str(table), "--urdf", str(tmp_path / "arm.urdf"))
    assert_refused(refused, "no columns that are known as `time`")


def test_a_table_of_rotation_matrices_and_a_robot_in_toml(tmp_path: Path) -> None:
    pose, wrench = poses(24)
    path = tmp_path / "poses.npz"
    np.savez(path, pose=rotations(pose[:, 3:]), wrench=wrench)
    options = tactid.Options(wrench_acts_on="sensor")
    arrays = read_poses(path, options)
    assert arrays is not None
    found = identify_pose_table(path, arrays, options)
    assert np.allclose(
        found.estimate.values, identify(pose, wrench).estimate.values, equal_nan=True
    )
    (tmp_path / "arm.toml").write_text("[[joints]]\nd = 0.3\nalpha_deg = 90\n[[joints]]\na = 0.4\n")
    q = np.random.default_rng(1).uniform(-3, 3, size=(24, 2))
    result = tactid.identify_poses(urdf=tmp_path / "arm.toml", q=q, wrench=wrench)
    assert result.given["urdf"] == str(tmp_path / "arm.toml")
    assert list(result.hashes["`urdf`"]) == ["arm.toml"]


def test_a_row_of_several_samples_is_named_by_its_place() -> None:
    pose, _ = poses(24)
    wrench = np.stack([measured(pose[:, 3:], seed) for seed in range(5)], axis=1)
    wrench[6, :, 0] += 5.0
    (found,) = (each for each in identify(pose, wrench).findings if each.kind == "outlying_pose")
    assert (found.data["first_row"], found.data["last_row"]) == (7, 7)
    assert str(found).startswith("Row 7 does not fit")


def test_poses_have_no_estimate_over_time(tmp_path: Path) -> None:
    pose, wrench = poses(8)
    with pytest.raises(tactid.IdentificationError, match="poses at rest have no times"):
        identify(pose, wrench).write_estimates(tmp_path / "estimates.mcap")
    assert not list(tmp_path.iterdir())


def test_figures_of_poses_have_their_numbers_and_no_time() -> None:
    figures = recording_plots.figures(identify(*poses(6)))
    for name in ("fit", "residuals"):
        axes = figures[name].axes
        assert {each.get_xlabel() for each in axes} == {"", "pose"}
        assert {tuple(each.lines[0].get_xdata()) for each in axes} == {(1, 2, 3, 4, 5, 6)}
