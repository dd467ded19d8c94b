"""What the viewer is given: the robot as it moved, the forces, the payload, and its curves."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from rerun.chunk import RrdReader

import tactid
from bags import joints, message, odometry, wrench, write_bag
from conftest import TactidCommand
from tactid._base.output_files import replaced_outputs
from tactid._base.values import nested
from tactid._view import open_viewer, record
from tactid._view.estimate import Estimate
from tactid._view.shapes import shapes_of
from test_cli import assert_refused

SEMI_AXES = np.array([0.1, 0.2, 0.4])
MASS, COM = 12.5, np.array([0.3, -0.1, 0.2])
TURN = pin.rpy.rpyToMatrix(0.3, -0.7, 1.1)
INERTIA = TURN @ np.diag(MASS / 5 * ((SEMI_AXES**2).sum() - SEMI_AXES**2)) @ TURN.T
VALUES = [MASS, *COM, *INERTIA[np.triu_indices(3)]]
CHANNELS = [f"{kind} {axis}" for kind in ("force", "moment") for axis in "xyz"]


def result_record(values: list[float | None], start_ns: int) -> dict[str, Any]:
    """A result as the contract of ``tactid identify --result`` has it."""
    time = np.linspace(0.5, 2.5, 21)
    history = [[None if v is None else v * (1 + 0.1 / t) for v in values] for t in time]
    history[0] = [None] * 10
    return {
        "estimate": {
            "frame": "tool0",
            "values": nested(values),
            "intervals": nested([None if v is None else [v - 0.0104, v + 0.0104] for v in values]),
        },
        "estimator": "least-squares",
        "remarks": ["A remark."],
        "start_ns": start_ns,
        "fit": {
            "times_s": list(time),
            "held_out": [False] * len(time),
            "weights": [1.0] * len(time),
            "channels": [
                {"name": name, "unit": "N" if name.startswith("force") else "N m"}
                for name in CHANNELS
            ],
            "measured": [[n + np.sin(t) for n in range(6)] for t in time],
            "predicted": [[n + np.cos(t) for n in range(6)] for t in time],
        },
        "history": {
            "times_s": list(time),
            "values": history,
            "std_devs": [[None if v is None else 0.2 / t / 1.96 for v in values] for t in time],
        },
    }


def write_result(path: Path, values: list[float | None], start_ns: int = 10**9) -> Path:
    path.write_text(json.dumps(result_record(values, start_ns)))
    return path


class Recording:
    """An .rrd file, read back."""

    def __init__(self, path: Path) -> None:
        self.reader = RrdReader(path)
        self.chunks = list(self.reader.stream())

    @property
    def entities(self) -> set[str]:
        return {chunk.entity_path for chunk in self.chunks}

    def column(self, entity: str, component: str) -> np.ndarray:
        """The values of a component, one row a time (or a single one where it is static)."""
        rows: list[Any] = []
        for chunk in self.chunks:
            batch = chunk.to_record_batch()
            if chunk.entity_path == entity and component in batch.schema.names:
                rows += batch.column(component).to_pylist()
        assert rows, f"{entity} has no {component}"
        return np.array(rows)

    def time(self, entity: str) -> np.ndarray:
        """Its times, s."""
        batches = [chunk.to_record_batch() for chunk in self.chunks if chunk.entity_path == entity]
        columns = [batch.column("time") for batch in batches if "time" in batch.schema.names]
        return np.concatenate([column.cast("int64").to_numpy() for column in columns]) * 1e-9


@pytest.fixture(scope="module")
def recording(log: Path, tmp_path_factory: pytest.TempPathFactory) -> Recording:
    """The simulated log with a result, through the command."""
    folder = tmp_path_factory.mktemp("view")
    result = write_result(folder / "result.json", VALUES)
    command = [sys.executable, "-m", "tactid", "view", log, "--result", result, "--save", "a.rrd"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, ""), done.stderr
    assert done.stderr == "Wrote a.rrd: open it with rerun a.rrd\n"
    assert {path.name for path in folder.iterdir()} == {"a.rrd", "result.json"}
    assert replaced_outputs({"--save": folder / "a.rrd"})
    return Recording(folder / "a.rrd")


def test_every_link_moves_as_pinocchio_says(recording: Recording, log: Path, urdf: str) -> None:
    model = pin.buildModelFromXML(urdf, pin.JointModelFreeFlyer())
    data = model.createData()
    state, base = (tactid.read(log, topic) for topic in ("/joint_states", "/base/odom"))
    time = recording.time("/world/tool0")
    assert len(time) == 150  # 50 Hz
    frames = [frame.name for frame in model.frames if frame.type == pin.FrameType.BODY]
    moved = {}
    for frame in frames[1:]:
        position = recording.column(f"/world/{frame}", "Transform3D:translation")[:, 0]
        quaternion = recording.column(f"/world/{frame}", "Transform3D:quaternion")[:, 0]
        moved[frame] = np.ptp(position, axis=0).max()
        for k in (0, 70, 149):
            sample = round(time[k] * 1000)
            q = pin.neutral(model)
            q[:7] = base["pose"][sample]
            for name, value in zip(state.names, state["position"][sample], strict=True):
                q[model.joints[model.getJointId(name)].idx_q] = value
            pin.framesForwardKinematics(model, data, q)
            expected = data.oMf[model.getFrameId(frame)]
            np.testing.assert_allclose(position[k], expected.translation, atol=1e-5)
            rotation = pin.Quaternion(quaternion[k]).toRotationMatrix()
            np.testing.assert_allclose(rotation, expected.rotation, atol=1e-5)
    assert moved["tool0"] > 0.05
    assert {"/world/base_link/shape_0", "/world/shoulder_link/shape_0"} <= recording.entities


def test_an_arrow_for_each_finger(recording: Recording, log: Path) -> None:
    scales = []
    for side in ("left", "right"):
        entity = f"/world/finger_{side}_link/force\\ finger_{side}\\ wrench"
        felt = tactid.read(log, f"/finger_{side}/wrench", every=0.02)["wrench"][:, :3]
        arrows = recording.column(entity, "Arrows3D:vectors")[:, 0]
        scales.append(np.linalg.norm(arrows, axis=1) / np.linalg.norm(felt, axis=1))
        np.testing.assert_allclose(arrows, scales[-1][:, None] * felt, atol=1e-5)
        # Fingers press from outside.
        np.testing.assert_allclose(recording.column(entity, "Arrows3D:origins")[:, 0], -arrows)
        labels = recording.column(entity, "Arrows3D:labels")[:, 0]
        assert labels[0] == f"{np.linalg.norm(felt[0]):.0f} N"
    np.testing.assert_allclose(scales, scales[0][0], rtol=1e-4)
    assert 1e-5 < scales[0][0] < 1e-3  # 1500 N are some decimetres


def test_the_payload_is_its_ellipsoid(recording: Recording) -> None:
    entity = "/world/tool0/payload/ellipsoid"
    half_sizes = recording.column(entity, "Ellipsoids3D:half_sizes").reshape(3)
    np.testing.assert_allclose(np.sort(half_sizes), SEMI_AXES, rtol=1e-5)
    axes = recording.column(entity, "Transform3D:mat3x3").reshape(3, 3).T  # column by column
    assert np.linalg.det(axes) == pytest.approx(1, abs=1e-5)
    shape = axes @ np.diag(half_sizes**2) @ axes.T
    np.testing.assert_allclose(shape, TURN @ np.diag(SEMI_AXES**2) @ TURN.T, atol=1e-6)
    np.testing.assert_allclose(
        recording.column(entity, "Transform3D:translation").reshape(3), COM, rtol=1e-6
    )
    label = recording.column("/world/tool0/payload/com", "Points3D:labels")
    assert label.tolist() == [["12.5 kg"]]


def test_ten_curves_with_their_intervals(recording: Recording) -> None:
    names = ["mass", *(f"com/{axis}" for axis in "xyz")]
    names += [f"inertia/{axes}" for axes in ("xx", "xy", "xz", "yy", "yz", "zz")]
    found = {entity for entity in recording.entities if entity.startswith("/estimate/")}
    assert found == {f"/estimate/{name}" for name in names}
    for name, value in zip(names, VALUES, strict=True):
        time = recording.time(f"/estimate/{name}")
        np.testing.assert_allclose(time, np.linspace(0.5, 2.5, 21), atol=1e-9)
        lines = recording.column(f"/estimate/{name}", "Scalars:scalars")
        assert np.isnan(lines[0]).all()  # nothing was known yet
        middle, half = value * (1 + 0.1 / time), 0.2 / time
        expected = np.stack([middle, middle - half, middle + half], axis=1)
        np.testing.assert_allclose(lines[1:], expected[1:], rtol=1e-9)


def test_measured_and_predicted(recording: Recording) -> None:
    for number, name in enumerate(CHANNELS):
        entity = f"/fit/{name}".replace(" ", "\\ ")
        time = recording.time(entity)
        expected = number + np.stack([np.sin(time), np.cos(time)], axis=1)
        np.testing.assert_allclose(recording.column(entity, "Scalars:scalars"), expected)


def test_there_is_a_layout_and_a_summary(recording: Recording) -> None:
    assert len(recording.reader.blueprints()) == 1
    (text,) = recording.column("/summary", "TextDocument:text")[0]
    for part in ("tool0", "mass | 12.500 ± 0.010 kg", "A remark."):
        assert part in text


def test_without_a_result_the_robot_is_shown(tmp_path: Path, log: Path) -> None:
    assert record(log, tmp_path / "a.rrd") == []
    entities = Recording(tmp_path / "a.rrd").entities
    assert {"/world/tool0", "/world/tool0/axes"} <= entities
    assert not any(entity.startswith(("/estimate", "/fit", "/summary")) for entity in entities)


def test_a_log_whose_name_is_not_utf8_is_shown(tmp_path: Path, log: Path) -> None:
    named = tmp_path / os.fsdecode(b"l\xff.mcap")
    named.write_bytes(log.read_bytes())
    record(named, tmp_path / "shown.rrd")
    assert (tmp_path / "shown.rrd").stat().st_size > 0


def test_meshes_that_cannot_be_shown_have_reasons(tmp_path: Path) -> None:
    """Each may have 64 MiB, and all together 96 MiB, links to one file counted each."""
    sizes = {"larger.stl": (64 << 20) + 1, "a.stl": 64 << 20, "c.stl": (32 << 20) - 10, "d.stl": 10}
    for name, size in sizes.items():
        with (tmp_path / name).open("wb") as file:
            file.truncate(size)
    (tmp_path / "b.stl").hardlink_to(tmp_path / "c.stl")
    (tmp_path / "empty.stl").touch()
    (tmp_path / "folder.stl").mkdir()
    names = (
        "larger.stl",
        "a.stl",
        "b.stl",
        "c.stl",
        "d.stl",
        "e.stl",
        "f.ply",
        300 * "g" + ".stl",
        "empty.stl",
        "folder.stl",
    )
    shape = "<visual><geometry><mesh filename='{}'/></geometry></visual>"
    link = "".join(map(shape.format, names))
    shapes, reasons = shapes_of(
        f"<robot name='r'><link name='l'>{link}</link></robot>", tmp_path, {"l"}
    )
    assert [shape.mesh for shape in shapes["l"]] == [
        tmp_path / name for name in ("a.stl", "b.stl", "d.stl")
    ]
    together = "with it, the meshes of the robot exceed 96 MiB"
    assert reasons == {
        "larger.stl": "its file is larger than 64 MiB",
        "c.stl": together,
        "e.stl": "its file was not found",
        "f.ply": "its name ends in none of .glb, .gltf, .obj, .stl and .dae",
        300 * "g" + ".stl": "its file was not found",
        "empty.stl": "its file has no content",
        "folder.stl": "it is not a regular file",
    }
    many = "".join(shape.format(f"{k}.stl") for k in range(1001))
    urdf = f"<robot name='r'><link name='l'>{many}</link></robot>"
    _, reasons = shapes_of(urdf, tmp_path, {"l"})
    assert reasons["999.stl"] == "its file was not found"
    assert reasons["1000.stl"] == "the URDF names more than 1000 other meshes"


@pytest.mark.parametrize(
    ("values", "ellipsoid", "com", "why"),
    [
        # Flat plates are on the border of what there can be, and their estimates around it.
        ([100, 0.5, 0, 0, 10, 0, 0, 20.05, 0, 10], True, True, None),
        ([100, 0.5, 0, 0, 10, 0, 0, 30, 0, 10], False, True, "no body has"),
        ([-1, 0.5, 0, 0, 10, 0, 0, 10, 0, 10], False, True, "no body has"),
        ([100, 0.5, 0, 0, None, 0, 0, 20, 0, 10], False, True, "not all known"),
        ([100, None, None, None, 10, 0, 0, 10, 0, 10], False, False, "centre of mass is not known"),
    ],
)
def test_only_what_is_known_of_the_payload_is_shown(
    tmp_path: Path,
    log: Path,
    values: list[float | None],
    ellipsoid: bool,
    com: bool,
    why: str | None,
) -> None:
    result = write_result(tmp_path / "result.json", values)
    notes = record(log, tmp_path / "a.rrd", result=result)
    assert len(notes) == (why is not None)
    if why is not None:
        assert why in notes[0]
    entities = Recording(tmp_path / "a.rrd").entities
    assert ("/world/tool0/payload/ellipsoid" in entities) == ellipsoid
    assert ("/world/tool0/payload/com" in entities) == com


def test_a_flat_plate_has_some_thickness(tmp_path: Path) -> None:
    path = write_result(tmp_path / "result.json", [100, 0.5, 0, 0, 10, 0, 0, 20.05, 0, 10])
    found = Estimate.read(path).ellipsoid()
    assert found is not None
    np.testing.assert_allclose(np.sort(found[0]), [0, 0.707, 0.707], atol=2e-3)


def test_a_result_without_series_shows_the_payload(tmp_path: Path, log: Path) -> None:
    """That is what ``tactid identify --json`` prints."""
    content = result_record(VALUES, 10**9)
    for key in ("fit", "history", "remarks"):
        del content[key]
    del content["estimate"]["intervals"]
    (tmp_path / "result.json").write_text(json.dumps(content))
    record(log, tmp_path / "a.rrd", result=tmp_path / "result.json")
    entities = Recording(tmp_path / "a.rrd").entities
    assert "/world/tool0/payload/ellipsoid" in entities
    assert not any(entity.startswith("/estimate") for entity in entities)


def test_no_interval_is_shown_where_the_result_has_none(tmp_path: Path, log: Path) -> None:
    content = result_record(VALUES, 10**9)
    del content["estimate"]["intervals"], content["history"]["std_devs"]
    (tmp_path / "result.json").write_text(json.dumps(content))
    record(log, tmp_path / "a.rrd", result=tmp_path / "result.json")
    found = Recording(tmp_path / "a.rrd")
    assert found.column("/estimate/mass", "Scalars:scalars").shape == (21, 1)
    assert "±" not in found.column("/summary", "TextDocument:text")[0][0]


def sensor_log(path: Path) -> Path:
    """A sensor in somebody's hand, with samples that no sensor measures."""
    turn = [0, 0, np.sin(0.5), np.cos(0.5)]
    content = []
    for k in range(1, 101):
        t = k * 10_000_000
        sign = -1.0 if k % 3 else 1.0  # the same rotation, whichever sign
        content.append(("/odom", t, odometry(t, "ft", [0.01 * k, 0, 1], [sign * x for x in turn])))
        # At odd samples: of 100 Hz, every other is shown.
        force = {51: [1e154, 0, 0], 61: [np.nan, 0, 0]}.get(k, [0, 0, 9.81])
        content.append(("/wrench", t, wrench(t, "ft", force, [0, 0, 0])))
    return write_bag(path, content)


def test_a_sensor_that_moves_by_itself(tmp_path: Path) -> None:
    result = write_result(tmp_path / "result.json", VALUES, start_ns=10_000_000)
    log = sensor_log(tmp_path / "bag")
    assert record(log, tmp_path / "a.rrd", result=result) == []
    found = Recording(tmp_path / "a.rrd")
    position = found.column("/world/ft", "Transform3D:translation")[:, 0]
    np.testing.assert_allclose(position[[0, -1]], [[0.01, 0, 1], [0.99, 0, 1]], atol=1e-6)
    quaternions = found.column("/world/ft", "Transform3D:quaternion")[:, 0]
    np.testing.assert_allclose(quaternions - quaternions[0], 0, atol=1e-6)
    arrows = found.column("/world/ft/force\\ wrench", "Arrows3D:vectors")[:, 0]
    np.testing.assert_allclose(arrows[:, :2], 0)
    assert len(arrows) == 48
    assert np.ptp(arrows[:, 2]) < 1e-6
    assert arrows[0, 2] > 0.01
    assert {"/world/path", "/world/ft/payload/ellipsoid"} <= found.entities


INERTIAL = (
    '<inertial><mass value="1"/>'
    '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
)
ARM = """<?xml version="1.0" encoding="UTF-8"?>
<robot name="arm">
  <link name="base"/>
  <joint name="a" type="revolute">
    <parent link="base"/><child link="upper"/><origin xyz="0 0 0.5"/><axis xyz="0 1 0"/>
    <limit lower="-3" upper="3" effort="1" velocity="1"/>
  </joint>
  <link name="upper">INERTIAL
    <visual><geometry><mesh filename="package://arm/upper.stl"/></geometry></visual>
    <collision><origin xyz="0.2 0 0"/><geometry><sphere radius="0.1"/></geometry></collision>
  </link>
  <joint name="b" type="revolute">
    <parent link="upper"/><child link="lower"/><origin xyz="0.4 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-3" upper="3" effort="1" velocity="1"/>
  </joint>
  <link name="lower">INERTIAL
    <visual>
      <geometry><mesh filename="lower.obj" scale="2 2 2"/></geometry>
    </visual>
  </link>
  <joint name="c" type="prismatic">
    <parent link="lower"/><child link="hand"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="1" effort="1" velocity="1"/>
  </joint>
  <link name="hand">INERTIAL</link>
</robot>
""".replace("INERTIAL", INERTIAL)
OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


def test_a_fixed_arm_whose_joints_come_from_two_publishers(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(ARM)
    (tmp_path / "lower.obj").write_text(OBJ)
    content = []
    for k in range(1, 52):
        t = k * 20_000_000
        content.append(("/a", t, joints(t, ["a"], [0.01 * k if k != 20 else np.nan])))
        content.append(("/b", t + 10_000_000, joints(t + 10_000_000, ["x", "b"], [9, -0.01 * k])))
        content.append(("/wrench", t, wrench(t, "elsewhere", [1, 2, 3], [0, 0, 0])))
    log = write_bag(tmp_path / "bag", content)
    notes = record(log, tmp_path / "a.rrd", urdf=tmp_path / "arm.urdf", tip="hand")
    assert len(notes) == 3
    for part in ("shown at zero: c", "package://arm/upper.stl", "elsewhere"):
        assert any(part in note for note in notes), notes
    found = Recording(tmp_path / "a.rrd")
    time = found.time("/world/lower")
    assert len(time) == 51
    position = found.column("/world/lower", "Transform3D:translation")[:, 0]
    angle = np.interp(time, 0.02 * np.arange(51), 0.01 * np.arange(1, 52))
    expected = np.stack([0.4 * np.cos(angle), 0 * angle, 0.5 - 0.4 * np.sin(angle)], axis=1)
    np.testing.assert_allclose(position, expected, atol=1e-6)
    # Lines, the shape for collisions in place of a mesh that is not there, and a mesh that is.
    assert found.column("/world/base/shape_0", "LineStrips3D:strips").reshape(-1).tolist() == [
        *(0, 0, 0),
        *(0, 0, 0.5),
    ]
    assert found.column("/world/upper/shape_0", "Ellipsoids3D:half_sizes").max() == np.float32(0.1)
    assert found.column("/world/lower/shape_0", "Asset3D:blob").size
    scale = found.column("/world/lower/shape_0", "Transform3D:mat3x3").reshape(3, 3)
    np.testing.assert_allclose(scale, 2 * np.eye(3))


def test_meshes_are_found_in_their_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Beside the URDF, in a workspace that is installed, and in one of sources; else not at all."""

    def found(folder: Path | None) -> Path | None:
        shapes, reasons = shapes_of(ARM, folder, ["upper"])
        assert ("package://arm/upper.stl" in reasons) == (shapes["upper"][0].kind == "sphere")
        return shapes["upper"][0].mesh

    for name in ("AMENT_PREFIX_PATH", "ROS_PACKAGE_PATH"):
        monkeypatch.delenv(name, raising=False)
    beside, installed, sources = (tmp_path / name for name in ("beside", "installed", "sources"))
    for folder in (beside / "arm/urdf", installed / "share/arm", sources / "arm"):
        folder.mkdir(parents=True)
        (folder / "upper.stl").write_bytes(b"x")
    (beside / "arm/upper.stl").write_bytes(b"x")
    assert found(None) is None
    assert found(tmp_path) is None
    assert found(beside / "arm/urdf") == found(beside / "arm") == beside / "arm/upper.stl"
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(sources))
    assert found(None) == sources / "arm/upper.stl"
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"/nowhere:{installed}")
    assert found(None) == installed / "share/arm/upper.stl"


def refused_logs(folder: Path) -> dict[Path, tuple[str, ...]]:
    """Logs that show nothing, and what must be said of each."""
    text = message("std_msgs/msg/String", data="hello")
    content = joints(10, ["a"], [0.0])
    return {
        folder / "missing.mcap": ("missing.mcap",),
        write_bag(folder / "text", [("/chat", 10, text)]): ("nothing to show", "/chat"),
        write_bag(folder / "joints", [("/joints", 10, content)]): ("--urdf", "/joints"),
    }


def test_a_log_with_nothing_to_show_is_refused(command: TactidCommand, tmp_path: Path) -> None:
    for path, parts in refused_logs(tmp_path).items():
        assert_refused(command("view", path, "--save", "a.rrd"), path.name, *parts)
    assert not (tmp_path / "a.rrd").exists()


def without(*keys: str) -> Callable[[dict[str, Any]], Any]:
    def remove(content: dict[str, Any]) -> dict[str, Any]:
        place = content
        for key in keys[:-1]:
            place = place[key]
        del place[keys[-1]]
        return content

    return remove


def with_value(value: Any, *keys: Any) -> Callable[[dict[str, Any]], Any]:
    def change(content: Any) -> Any:
        place = content
        for key in keys[:-1]:
            place = place[key]
        place[keys[-1]] = value
        return content

    return change


@pytest.mark.parametrize(
    ("change", "part"),
    [
        (lambda _: [1, 2], "[1, 2]"),
        (lambda _: {}, "'estimate' is missing"),
        (without("estimate"), "'estimate' is missing"),
        (with_value({}, "estimate", "values"), "none of mass, com and inertia"),
        (with_value("heavy", "estimate", "values", "mass"), '"heavy"'),
        (with_value(True, "estimate", "values", "com", "x"), "true"),
        (with_value(7, "estimate", "frame"), "'frame' is 7"),
        (without("start_ns"), "'start_ns' is missing"),
        (with_value([1.0], "history", "times_s"), "21 entries for 1 times"),
        (with_value([1.0] * 9, "history", "values", 3), "rows of 10"),
        (without("fit", "channels", 0, "unit"), "'unit' is missing"),
        (with_value({}, "fit", "measured"), "'measured' is {}"),
    ],
)
def test_what_is_no_result_is_refused(
    tmp_path: Path, change: Callable[[Any], Any], part: str
) -> None:
    path = tmp_path / "result.json"
    path.write_text(json.dumps(change(result_record(VALUES, 10**9))))
    with pytest.raises(tactid.ArgumentError) as error:
        Estimate.read(path)
    assert str(error.value).startswith(f"{path} is not a result of tactid identify: ")
    assert part in str(error.value)


def test_wrong_files_and_options_are_refused(
    command: TactidCommand, tmp_path: Path, log: Path
) -> None:
    good = write_result(tmp_path / "good.json", VALUES)
    (tmp_path / "text.json").write_text("this is no JSON")
    (tmp_path / "image.json").write_bytes(bytes(range(256)))
    late = write_result(tmp_path / "late.json", VALUES, start_ns=10**18)
    for arguments, parts in {
        ("--result", "missing.json"): ("missing.json",),
        ("--result", "text.json"): ("text.json is not JSON", "--result: "),
        ("--result", "image.json"): ("image.json is not JSON", "expected the file"),
        ("--result", late): ("different times",),
        ("--result", good, "--tip", "paw"): ("no frame paw; --tip is one of", "tool0"),
        ("--urdf", "missing.urdf"): ("missing.urdf",),
        ("--urdf", "text.json"): ("text.json is not a URDF", "not XML", "--urdf"),
        ("--urdf", "image.json"): ("image.json", "not text", "--urdf"),
    }.items():
        assert_refused(command("view", log, *arguments, "--save", "a.rrd"), *parts)
        assert not (tmp_path / "a.rrd").exists()
    assert_refused(command("view", log, "--save", "no/such/a.rrd"), "no/such")
    assert_refused(command("view", log, "--save", "a.txt"), "--save a.txt", "ends in .rrd")
    (tmp_path / "folder.rrd").mkdir()
    assert_refused(command("view", log, "--save", "folder.rrd"), "folder.rrd")


def test_a_recording_that_fails_leaves_the_old_one(
    tmp_path: Path, log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("tactid._view.draw._Drawing._send_force", fail)
    (tmp_path / "a.rrd").write_text("the old one")
    with pytest.raises(KeyboardInterrupt):
        record(log, tmp_path / "a.rrd")
    assert (tmp_path / "a.rrd").read_text() == "the old one"
    assert len(list(tmp_path.iterdir())) == 1


def test_without_rerun_the_extra_is_named(tmp_path: Path, log: Path) -> None:
    (tmp_path / "rerun.py").write_text("raise ModuleNotFoundError('no', name='rerun')")
    done = subprocess.run(
        [sys.executable, "-m", "tactid", "view", log, "--save", tmp_path / "a.rrd"],
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert_refused(done, "pip install rerun-sdk")


def test_a_viewer_that_does_not_open_is_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"):
        monkeypatch.delenv(name, raising=False)
    (tmp_path / "rerun.py").write_text("import sys; sys.exit('Error: no screen.')")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    with pytest.raises(tactid.TactidError, match=r"did not open: no screen; `save`"):
        open_viewer(tmp_path / "a.rrd")


MOTION = """time_s,q_joint_6,qd_joint_6,q_joint_2,qd_joint_2
5.0,0.0,0.0,-1.2,0.0
7.0,1.0,0.0,-1.0,0.0
"""


def test_a_designed_motion_moves_the_robot(
    urdf: str, command: TactidCommand, tmp_path: Path
) -> None:
    """Between rows positions are cubics; the file, its folder and the log show the same."""
    (tmp_path / "arm.urdf").write_text(urdf)
    (tmp_path / "motion.csv").write_text(MOTION)
    done = command("view", "motion.csv", "--urdf", "arm.urdf", "--save", "a.rrd")
    assert done.returncode == 0, done.stderr
    assert "Not in the motion, shown at zero: joint_1, joint_3" in done.stderr
    recording = Recording(tmp_path / "a.rrd")
    time = recording.time("/world/tool0")
    np.testing.assert_allclose(time, np.linspace(0, 2, 101), atol=1e-9)
    position = recording.column("/world/tool0", "Transform3D:translation")[:, 0]
    robot = tactid.Manipulator.from_urdf(urdf, "fixed")
    smooth = 3 * (time / 2) ** 2 - 2 * (time / 2) ** 3
    q = np.zeros((len(time), robot.dof))
    q[:, robot.joint_names.index("joint_6")] = smooth
    q[:, robot.joint_names.index("joint_2")] = -1.2 + 0.2 * smooth
    expected = robot.kinematics("tool0", q).pose[:, :3, 3]
    assert np.ptp(expected, axis=0).max() > 0.05
    np.testing.assert_allclose(position, expected, atol=1e-5)


def test_the_folder_of_a_motion_is_shown(tmp_path: Path, urdf: str) -> None:
    (tmp_path / "arm.urdf").write_text(urdf)
    motion = tactid.design_excitation(
        tactid.Manipulator.from_urdf(tmp_path / "arm.urdf"),
        duration=1.0,
        payload=tactid.MassProperties(2.0, [0.02, 0.01, 0.1], 0.01 * np.eye(3)),
        collisions=False,
    )
    motion.write(tmp_path / "motion")
    seen = []
    for name in ("motion", "motion/trajectory.mcap"):
        record(tmp_path / name, tmp_path / "a.rrd", urdf=tmp_path / "arm.urdf")
        recording = Recording(tmp_path / "a.rrd")
        seen.append(recording.column("/world/tool0", "Transform3D:translation")[:, 0])
    np.testing.assert_array_equal(*seen)
    robot = tactid.Manipulator.from_urdf(urdf, "fixed")
    last = robot.kinematics("tool0", motion.q[-1]).pose[:3, 3]
    np.testing.assert_allclose(seen[0][-1], last, atol=1e-5)


def test_a_motion_without_its_robot_is_an_error(
    urdf: str, command: TactidCommand, tmp_path: Path
) -> None:
    (tmp_path / "arm.urdf").write_text(urdf)
    (tmp_path / "motion.csv").write_text(MOTION)
    (tmp_path / "other.csv").write_text(MOTION.replace("joint_6", "wrist"))
    result = write_result(tmp_path / "result.json", VALUES)
    assert_refused(
        command("view", "motion.csv", "--save", "a.rrd"), "joints, but no robot: give its --urdf"
    )
    arm = ("--urdf", "arm.urdf", "--save", "a.rrd")
    assert_refused(command("view", "other.csv", *arm), "moves wrist, which the robot of --urdf")
    assert_refused(
        command("view", "motion.csv", *arm, "--result", result), "--result is of a log, but motion"
    )
    assert not (tmp_path / "a.rrd").exists()
