"""What a simulator reads from a form is the very body that was identified."""

import re
from collections.abc import Callable, Sequence
from xml.etree import ElementTree

import mujoco
import numpy as np
import pinocchio as pin
import pytest

import tactid
from tactid._base import bodies
from tactid._results import forms

PLATE = [2.0, 0.1, 0.2, 0.3, 1.0, 0.0, 0.0, 1.0, 0.0, 2.0]


def test_pinocchio_reads_the_urdf_back(values: list[float]) -> None:
    model = pin.buildModelFromXML(f"""<robot name="one">
        <link name="world"/><link name="tool0">{forms.urdf(values, "tool0")}</link>
        <joint name="hinge" type="continuous">
          <parent link="world"/><child link="tool0"/><axis xyz="0 0 1"/></joint></robot>""")
    read = model.inertias[model.getJointId("hinge")]
    assert read.mass == values[0]
    np.testing.assert_array_equal(read.lever, values[1:4])
    np.testing.assert_allclose(read.inertia, bodies.inertia_about_com(values), rtol=0, atol=1e-15)


def test_mujoco_reads_its_own_back(values: list[float]) -> None:
    """It keeps principal moments and a quaternion: together they are the whole tensor."""
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><worldbody><body name="tool0"><freejoint/>
        {forms.mujoco(values, "tool0")}</body></worldbody></mujoco>"""
    )
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, model.body("tool0").iquat)
    principal = turn.reshape(3, 3)
    read = principal @ np.diag(model.body("tool0").inertia) @ principal.T
    assert model.body("tool0").mass[0] == values[0]
    np.testing.assert_array_equal(model.body("tool0").ipos, values[1:4])
    np.testing.assert_allclose(read, bodies.inertia_about_com(values), rtol=0, atol=1e-14)


def test_the_forms_are_xml_that_gives_every_number_back(values: list[float]) -> None:
    block = ElementTree.fromstring(forms.urdf(values, "gripper--tip---"))
    origin, mass, inertia = (block.find(name) for name in ("origin", "mass", "inertia"))
    assert block.tag == "inertial"
    assert origin is not None
    assert mass is not None
    assert inertia is not None
    read = [mass.attrib["value"], *origin.attrib["xyz"].split()]
    read += [inertia.attrib[name] for name in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")]
    assert [float(number) for number in read] == values
    assert origin.attrib["rpy"] == "0 0 0"

    element = ElementTree.fromstring(forms.mujoco(values, "gripper--tip---"))
    assert element.tag == "inertial"
    full = [float(number) for number in element.attrib["fullinertia"].split()]
    assert full == [values[index] for index in (4, 7, 9, 5, 6, 8)]
    assert "orientation" not in " ".join(element.attrib)


def test_a_controller_gets_both_inertias_by_name(values: list[float]) -> None:
    text = forms.controller(values, "flange")
    number = re.compile(r"-?\d+\.\d+")
    lines = text.splitlines()
    assert re.search(r"\d[eE]", text) is None  # no exponent, which a pendant refuses

    def matrix(title: str) -> np.ndarray:
        at = lines.index(f"inertia about {title}, kg m², rows x y z")
        return np.array([number.findall(line) for line in lines[at + 1 : at + 4]], dtype=float)

    body = tactid.MassProperties(values[0], values[1:4], bodies.inertia_about_com(values))
    assert_nine_figures(matrix("the centre of mass"), body.inertia)
    xx, xy, xz, yy, yz, zz = body.parameters[4:]
    assert_nine_figures(
        matrix("the origin of flange"), np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    )
    metres, millimetres = (
        [float(n) for n in number.findall(line)[-3:]] for line in lines if "x y z m" in line[:24]
    )
    assert_nine_figures(np.array(metres), np.array(values[1:4]))
    np.testing.assert_allclose(millimetres, 1000 * np.array(metres), rtol=1e-15)
    assert "flange" in lines[0]


def assert_nine_figures(shown: np.ndarray, exact: np.ndarray) -> None:
    """Each number is exact to nine figures of the largest."""
    np.testing.assert_allclose(shown, exact, rtol=0, atol=0.5e-8 * np.abs(exact).max())


def test_a_tiny_body_has_no_exponents_either() -> None:
    text = forms.controller([2e-5, 1e-17, 0.0, -3e-4, 2e-9, 0.0, 0.0, 3e-9, 1e-30, 3e-9], "tool0")
    assert "kg  0.000020000000" in text
    assert "0.000000002000" in text
    assert re.search(r"\d[eE]|-0\.0*\b(?!\d)", text) is None


@pytest.mark.parametrize("form", [forms.urdf, forms.mujoco])
@pytest.mark.parametrize("nothing", [None, float("nan"), float("inf")])
def test_what_is_not_known_is_not_written(
    form: Callable[[Sequence[float | None], str], str], nothing: float | None
) -> None:
    unknown = [*PLATE[:5], nothing, *PLATE[6:8], nothing, PLATE[9]]
    with pytest.raises(tactid.IdentificationError, match="Ixy, Iyz not identif") as e:
        form(unknown, "tool0")
    assert "\n" not in str(e.value)


def test_a_controller_does_without_inertia_but_not_without_centre_of_mass() -> None:
    text = forms.controller([*PLATE[:9], None], "tool0")
    assert "inertia              not identifiable: Izz" in text
    assert "rows x y z" not in text
    with pytest.raises(tactid.IdentificationError, match="com y not identifiable"):
        forms.controller([*PLATE[:2], None, *PLATE[3:]], "tool0")


@pytest.mark.parametrize(
    ("changed", "reason"),
    [
        ({0: 0.0}, "its mass is 0 kg"),
        ({0: -2.0}, "its mass is -2 kg"),
        ({4: -0.1}, "principal moments .* -0.1, 1, 2 kg m².*zero or less"),
        ({4: 0.0, 9: 1.0}, "principal moments .* 0, 1, 1 kg m².*zero or less"),
        ({9: 2.01}, "principal moments .* 1, 1, 2.01 kg m².*exceed the sum"),
        ({6: 0.9}, "exceed the sum"),
    ],
)
def test_what_mujoco_refuses_is_refused_with_the_reason(
    changed: dict[int, float], reason: str
) -> None:
    body = [changed.get(index, value) for index, value in enumerate(PLATE)]
    for form in (forms.urdf, forms.mujoco, forms.controller):
        if form is forms.controller and body[0] <= 0:
            continue  # a test of its own below
        with pytest.raises(tactid.IdentificationError, match=f"no body can have .*{reason}") as e:
            form(body, "tool0")
        assert "\n" not in str(e.value)
    xx, xy, xz, yy, yz, zz = body[4:]
    with pytest.raises(ValueError, match=r"mass|inertia"):
        mujoco.MjModel.from_xml_string(
            f"""<mujoco><worldbody><body><freejoint/><inertial pos="0 0 0" mass="{body[0]}"
            fullinertia="{xx} {yy} {zz} {xy} {xz} {yz}"/></body></worldbody></mujoco>"""
        )


@pytest.mark.parametrize("inertia", [PLATE[4:], [None] * 6])
def test_a_controller_gets_no_mass_that_is_not_positive(inertia: list[float | None]) -> None:
    for mass in (0.0, -2.0):
        with pytest.raises(tactid.IdentificationError, match=f"is positive, not {mass:g} kg"):
            forms.controller([mass, *PLATE[1:4], *inertia], "tool0")


def test_a_plate_without_thickness_is_possible() -> None:
    assert bodies.why_impossible(PLATE) is None
    assert 'izz="2.0"' in forms.urdf(PLATE, "tool0")


def test_the_ellipsoid_has_the_bodys_inertia(values: list[float]) -> None:
    """Sampled: the second moments of a uniform solid ellipsoid are a fifth of its semi-axes'."""
    semi_axes, directions = bodies.ellipsoid(values)
    rng = np.random.default_rng(1)
    ball = rng.uniform(-1, 1, size=(400_000, 3))
    ball = ball[(ball**2).sum(axis=1) < 1]
    points = (ball * semi_axes) @ directions.T
    second = values[0] * points.T @ points / len(points)
    expected = bodies.inertia_about_com(values)
    sampled = np.trace(second) * np.eye(3) - second
    np.testing.assert_allclose(sampled, expected, rtol=0, atol=0.02 * np.trace(expected))
    flat, _ = bodies.ellipsoid([*PLATE[:9], 2.02])
    assert min(flat) == 0.0
