"""Robots whose collision shapes are missing, and what the outputs report as tested."""

import re
import shutil
from importlib.metadata import files
from pathlib import Path
from xml.etree import ElementTree

import pytest

import tactid
from conftest import TactidCommand

URDF = Path(__file__).parents[2] / "crates" / "sim" / "robots" / "tactid.urdf"
UR10 = "example-robot-data/robots/ur_description/urdf/ur10_robot.urdf"
PUBLISHED = next(
    Path(str(file.locate()))
    for file in files("example-robot-data") or ()
    if str(file).endswith(UR10)
)
"""A UR10 with its meshes."""
START = [0.0, -1.2, 1.6, -0.4, 1.5, 0.0]
BOX = ("--payload-mass-max", "2", "--payload-box=-0.1,-0.1,0,0.1,0.1,0.2")


def _mesh(link: ElementTree.Element, file: str) -> None:
    geometry = ElementTree.SubElement(ElementTree.SubElement(link, "collision"), "geometry")
    ElementTree.SubElement(geometry, "mesh", filename=file)


def _robot(path: Path, **meshes: str) -> Path:
    """Writes the built-in robot with a further mesh of some links."""
    tree = ElementTree.parse(URDF)
    for name, file in meshes.items():
        link = tree.getroot().find(f"link[@name='{name}']")
        assert link is not None
        _mesh(link, file)
    path.parent.mkdir(parents=True, exist_ok=True)
    tree.write(path)
    return path


def _design(urdf: Path, **keywords: object) -> tactid.DesignedMotion:
    given = {
        "start": START,
        "duration": 1.0,
        "payload": tactid.MassProperties(2.0, [0.02, 0.01, 0.1], INERTIA),
        **keywords,
    }
    return tactid.design_excitation(tactid.Manipulator.from_urdf(urdf), **given)  # type: ignore[arg-type]


INERTIA = [[0.01, 0, 0], [0, 0.01, 0], [0, 0, 0.01]]


def test_an_arm_without_its_meshes_is_refused(command: TactidCommand, tmp_path: Path) -> None:
    """A UR10 outside of ROS, whose upper arm would meet its wrist."""
    urdf = shutil.copy(PUBLISHED, tmp_path)
    arm = ("excite", "--urdf", urdf, "--from", "0 -1.5 1.5 -1.5 -1.5 0", "--duration", "2")
    out = ("--out", tmp_path / "motion")
    done = command(*arm, *BOX, *out)
    assert done.returncode == 2
    assert not (tmp_path / "motion").exists()
    (line,) = done.stderr.splitlines()
    links = "links base_link, shoulder_link, upper_arm_link, forearm_link, wrist_1_link, wrist_2"
    assert f"collision shapes of the {links}_link and wrist_3_link are left out" in line
    assert (
        "its file was not found in AMENT_PREFIX_PATH, in ROS_PACKAGE_PATH, or in a folder" in line
    )
    assert "STL, OBJ or PLY" in line
    assert line.endswith(
        "accept a motion that may run the robot through itself with --no-collisions"
    )
    accepted = command(*arm, *BOX, *out, "--no-collisions")
    assert accepted.returncode == 0
    warning = "The links of the robot are not tested for collisions: the motion may run the robot"
    assert warning in accepted.stderr
    for name in ("trajectory.csv", "trajectory.script", "franka.csv", "moveit.yaml"):
        assert warning in _head(tmp_path / "motion" / name), name


def test_the_same_arm_is_tested_where_the_package_is_found(
    command: TactidCommand, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    urdf = shutil.copy(PUBLISHED, tmp_path)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(PUBLISHED.parents[4]))
    arm = ("excite", "--urdf", urdf, "--from", "0 -1.5 1.5 -1.5 -1.5 0", "--duration", "2")
    done = command(*arm, *BOX, "--out", tmp_path / "motion")
    assert done.returncode == 0, done.stderr
    assert "Tested for collisions: the links of the robot and the payload's box." in done.stderr
    floor = "What stands around the robot, such as a floor or a table, is not tested: --keep-out"
    assert floor in done.stderr


@pytest.mark.parametrize("link", ["forearm_link", "base_link"])
def test_a_collada_mesh_is_refused_on_the_base_too(link: str, tmp_path: Path) -> None:
    (tmp_path / "a.dae").write_text("<COLLADA/>")
    urdf = _robot(tmp_path / "arm.urdf", **{link: "a.dae"})
    expected = rf"the link {link} are left out \(`a.dae`: only STL, OBJ and PLY are read\)"
    with pytest.raises(tactid.ExcitationError, match=expected) as raised:
        _design(urdf)
    assert raised.value.option == "collisions"
    assert str(raised.value).endswith("through itself with `collisions=False`")
    assert _design(urdf, collisions=False).collision_findings is None


def test_a_robot_without_collision_shapes_is_refused(tmp_path: Path) -> None:
    text = URDF.read_text().replace("<collision", "<visual").replace("</collision", "</visual")
    (tmp_path / "arm.urdf").write_text(text)
    with pytest.raises(tactid.ExcitationError, match="the URDF has no collision shapes; give a"):
        _design(tmp_path / "arm.urdf")


def test_a_mesh_is_found_beside_its_urdf_or_refused(tmp_path: Path) -> None:
    corners = [(0, 0, 0), (0.1, 0, 0), (0, 0.1, 0), (0, 0, 0.1)]
    vertices = "".join(f"v {x} {y} {z}\n" for x, y, z in corners)
    (tmp_path / "arm").mkdir()
    (tmp_path / "arm" / "link.obj").write_text(vertices + "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    path = tmp_path / "arm" / "urdf" / "arm.urdf"
    found = _design(_robot(path, forearm_link="package://arm/link.obj"))
    assert [each.text for each in found.collision_findings or () if not each.pairs] == []
    expected = (
        "collision shapes of the link forearm_link are left out (`package://arm/missing.stl`: its"
        " file was not found in AMENT_PREFIX_PATH, in ROS_PACKAGE_PATH, or in a folder above the"
        " URDF)"
    )
    with pytest.raises(tactid.ExcitationError, match=re.escape(expected)):
        _design(_robot(path, forearm_link="package://arm/missing.stl"))


def _head(path: Path) -> str:
    """Returns the comment at the head of a file, on one line."""
    lines = path.read_text().splitlines()
    head = [line for line in lines if line.startswith("# ")]
    assert head == lines[: len(head)], path
    return " ".join(line.removeprefix("# ") for line in head)


def test_what_stands_around_the_robot_is_reported() -> None:
    table = {"table": [[-1, -1, -1.5], [1, 1, -1.0]]}
    room = [[-2, -2, -2], [2, 2, 2]]
    floor = "What stands around the robot, such as a floor or a table, is not tested"
    assert f"{floor}: `keep_out` gives its box." in str(_design(URDF))
    assert "The payload is not tested for collisions: `payload_box`" in str(_design(URDF))
    kept = str(_design(URDF, keep_out=table))
    assert floor not in kept
    assert "Tested for collisions: the links of the robot and the keep-out box table." in kept
    inside = str(_design(URDF, workspace=room))
    assert "In the workspace stay the tip, and no other links." in inside
    assert floor in inside
    blind = str(_design(URDF, keep_out=table, collisions=False))
    assert "The links of the robot are not tested for collisions" in blind
    assert "Tested for collisions: the tip and the keep-out box table." in blind


def test_a_name_in_the_urdf_is_no_command_for_a_controller(tmp_path: Path) -> None:
    """What follows a line end in the name of a joint would be a line of the program."""
    text = URDF.read_text().replace('"joint_6"', '"joint_6&#10;set_target_payload(9)"')
    (tmp_path / "arm.urdf").write_text(text)
    _design(tmp_path / "arm.urdf").write(tmp_path / "motion")
    script = (tmp_path / "motion" / "trajectory.script").read_text()
    assert not any(line.startswith("set_target_payload") for line in script.splitlines())
