"""The printed inertial, added to a robot as the README says, gives the robot with its payload."""

from pathlib import Path
from xml.etree import ElementTree

import mujoco
import numpy as np
import pinocchio as pin
import pytest

import tactid

PAYLOAD = tactid.MassProperties(
    1.3,
    [0.02, -0.03, 0.11],
    [[0.011, 0.001, -0.002], [0.001, 0.012, 0.0015], [-0.002, 0.0015, 0.007]],
)
ARM_KG, TOOL_KG = (4.0, 3.0, 2.0), 0.8
GRAVITY = np.array([0.0, 0.0, -9.81])
POSTURES = np.random.default_rng(3).uniform(-1.5, 1.5, size=(10, 3))


def link(name: str, mass: float) -> str:
    return f"""<link name="{name}"><inertial>
      <origin xyz="0.01 -0.02 0.1" rpy="0.1 0.2 0.3"/><mass value="{mass}"/>
      <inertia ixx="0.02" ixy="0.001" ixz="0" iyy="0.03" iyz="0" izz="0.015"/></inertial></link>"""


def joint(kind: str, parent: str, child: str, place: str, axis: str = "0 0 1") -> str:
    return f"""<joint name="{child}_joint" type="{kind}"><parent link="{parent}"/>
      <child link="{child}"/><origin {place}/><axis xyz="{axis}"/>
      <limit lower="-3" upper="3" effort="100" velocity="10"/></joint>"""


def arm(*parts: str) -> str:
    """A robot of three joints with a tool of its own, whose frame is turned against its wrist."""
    places = ('xyz="0 0 0.2"', 'xyz="0.05 0 0.3" rpy="0.2 0 0"', 'xyz="0 0.04 0.3" rpy="0 0.3 0"')
    names = ("base", "shoulder", "elbow", "wrist")
    chain = zip(names, names[1:], places, ("0 0 1", "0 1 0", "1 0 0"), strict=False)
    links = [link(*pair) for pair in zip(names[1:], ARM_KG, strict=True)]
    joints = [joint("revolute", *each) for each in chain]
    tool = joint("fixed", "wrist", "tool0", 'xyz="0.03 0 0.12" rpy="0.4 -0.3 1.2"')
    body = "".join([*links, *joints, link("tool0", TOOL_KG), tool, *parts])
    keep = '<mujoco><compiler fusestatic="false"/></mujoco>'  # else MuJoCo merges fixed links
    return f'<robot name="arm">{keep}<link name="base"/>{body}</robot>'


def merged(inertial: str) -> str:
    """As the README says: a link of its own, fixed to the tool's link, whose inertial stays."""
    fixed = joint("fixed", "tool0", "payload", 'xyz="0 0 0" rpy="0 0 0"')
    return arm(f'<link name="payload">{inertial}</link>', fixed)


def truth() -> pin.Model:
    """The robot with its true payload, put together by Pinocchio alone."""
    model = pin.buildModelFromXML(arm())
    frame = model.frames[model.getFrameId("tool0")]
    body = pin.Inertia(PAYLOAD.mass, PAYLOAD.com, PAYLOAD.inertia)
    model.appendBodyToJoint(frame.parentJoint, body, frame.placement)
    return model


@pytest.fixture(scope="module")
def found() -> tactid.Identification:
    """The payload, identified from the efforts that Pinocchio computes."""
    model = truth()
    data = model.createData()
    time = np.arange(0.0, 12.0, 0.002)
    rates = np.array([[1.1, 2.7], [1.7, 3.1], [1.3, 2.3]])
    phase = time[:, None, None] * rates + [[0.0, 1.0], [2.0, 0.5], [1.0, 3.0]]
    q = (0.6 * np.sin(phase)).sum(axis=2)
    qd = (0.6 * rates * np.cos(phase)).sum(axis=2)
    qdd = (-0.6 * rates**2 * np.sin(phase)).sum(axis=2)
    effort = np.array([pin.rnea(model, data, *row).copy() for row in zip(q, qd, qdd, strict=True)])
    robot = tactid.Manipulator.from_urdf(arm(), base="fixed")
    return tactid.identify(
        time, robot=robot, q=q, qd=qd, effort=effort, method="effort", gravity=GRAVITY, tip="tool0"
    )


def test_the_payload_is_what_the_robot_lacks(found: tactid.Identification) -> None:
    """The tool's own inertial is in the URDF, so that it is no part of the payload."""
    assert found.estimate.body.mass == pytest.approx(PAYLOAD.mass, rel=1e-5)
    np.testing.assert_allclose(found.estimate.body.com, PAYLOAD.com, atol=1e-6)


def test_pinocchio_has_the_robot_with_its_payload(found: tactid.Identification) -> None:
    model = pin.buildModelFromXML(merged(found.to_urdf()))
    expected = truth()
    assert pin.computeTotalMass(model) == pytest.approx(
        sum(ARM_KG) + TOOL_KG + PAYLOAD.mass, rel=1e-6
    )
    for q in POSTURES:
        torque = pin.computeGeneralizedGravity(model, model.createData(), q)
        true = pin.computeGeneralizedGravity(expected, expected.createData(), q)
        np.testing.assert_allclose(torque, true, rtol=0, atol=1e-5 * np.abs(true).max())


@pytest.mark.parametrize("form", ["URDF", "MJCF"])
def test_mujoco_has_the_robot_with_its_payload(
    found: tactid.Identification, form: str, tmp_path: Path
) -> None:
    if form == "URDF":
        model = mujoco.MjModel.from_xml_string(merged(found.to_urdf()))
    else:
        model = mujoco.MjModel.from_xml_string(with_body(found.to_mujoco(), tmp_path / "arm.xml"))
    data, expected = mujoco.MjData(model), truth()
    assert model.body("tool0").mass[0] == TOOL_KG
    assert model.body("payload").mass[0] == found.estimate.body.mass
    assert model.body_mass.sum() == pytest.approx(sum(ARM_KG) + TOOL_KG + PAYLOAD.mass, rel=1e-6)
    for q in POSTURES:
        data.qpos[:], data.qvel[:] = q, 0.0
        mujoco.mj_forward(model, data)
        true = pin.computeGeneralizedGravity(expected, expected.createData(), q)
        np.testing.assert_allclose(data.qfrc_bias, true, rtol=0, atol=1e-5 * np.abs(true).max())


def with_body(inertial: str, file: Path) -> str:
    """As the README says: a body of its own inside the tool's body, whose inertial stays."""
    mujoco.mj_saveLastXML(str(file), mujoco.MjModel.from_xml_string(arm()))
    tree = ElementTree.fromstring(file.read_text())
    tool = tree.find(".//body[@name='tool0']")
    assert tool is not None
    tool.append(ElementTree.fromstring(f'<body name="payload">{inertial}</body>'))
    return ElementTree.tostring(tree, encoding="unicode")
