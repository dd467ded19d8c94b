"""What a controller reads from its line is the very body that was identified."""

import re

import numpy as np
import pinocchio as pin
import pytest

import tactid
from tactid._base import bodies
from tactid._results import controllers, forms
from test_forms import PLATE

NUMBER = r"-?\d+(?:\.\d+)?"
CLOSE = {"rtol": 1e-6, "atol": 1e-9}


def numbers(text: str) -> list[float]:
    """The numbers of the line below the comment."""
    comment, line = text.split("\n")
    assert comment[0] in "#/;!"
    assert "e-" not in line
    return [float(found) for found in re.findall(rf"(?<![\w.]){NUMBER}", line)]


def test_universal_robots_reads_it_back(values: list[float]) -> None:
    text = controllers.controller("ur", values, "tool0")
    assert text.splitlines()[0] == (
        "# payload for Universal Robots: the frame tool0 must be that of the flange"
    )
    assert re.fullmatch(
        r"set_target_payload\(N, \[N, N, N\], \[N, N, N, N, N, N\]\)",
        re.sub(NUMBER, "N", text.splitlines()[1]),
    )
    read = numbers(text)
    np.testing.assert_allclose(read[:4], values[:4], **CLOSE)
    xx, xy, xz, yy, yz, zz = values[4:]
    np.testing.assert_allclose(read[4:], [xx, yy, zz, xy, xz, yz], **CLOSE)


def test_franka_reads_it_back_by_columns(values: list[float]) -> None:
    text = controllers.controller("franka", values, "tool0")
    assert re.fullmatch(
        r"robot\.setLoad\(N, \{\{N, N, N\}\}, \{\{N(, N){8}\}\}\);",
        re.sub(NUMBER, "N", text.splitlines()[1]),
    )
    read = numbers(text)
    np.testing.assert_allclose(read[:4], values[:4], **CLOSE)
    by_columns = np.reshape(read[4:], (3, 3)).T
    np.testing.assert_allclose(by_columns, bodies.inertia_about_com(values), **CLOSE)


def test_kuka_reads_it_back(values: list[float]) -> None:
    text = controllers.controller("kuka", values, "tool0")
    assert re.fullmatch(
        r"LOAD_DATA\[1\] = \{M N, CM \{X N, Y N, Z N, A N, B N, C N\}, J \{X N, Y N, Z N\}\}",
        re.sub(rf"(?<= ){NUMBER}", "N", text.splitlines()[1]),
    )
    _, mass, *read = numbers(text)
    np.testing.assert_allclose([mass, *np.divide(read[:3], 1e3)], values[:4], **CLOSE)
    a, b, c = np.radians(read[3:6])
    turn = pin.utils.rotate("z", a) @ pin.utils.rotate("y", b) @ pin.utils.rotate("x", c)
    tensor = turn @ np.diag(read[6:]) @ turn.T
    np.testing.assert_allclose(tensor, bodies.inertia_about_com(values), **CLOSE)


def test_abb_reads_it_back(values: list[float]) -> None:
    text = controllers.controller("abb", values, "tool0")
    assert re.fullmatch(
        r"PERS loaddata payload := \[N, \[N, N, N\], \[N, N, N, N\], N, N, N\];",
        re.sub(NUMBER, "N", text.splitlines()[1]),
    )
    mass, *read = numbers(text)
    np.testing.assert_allclose([mass, *np.divide(read[:3], 1e3)], values[:4], **CLOSE)
    w, x, y, z = read[3:7]
    turn = pin.Quaternion(w, x, y, z).matrix()
    tensor = turn @ np.diag(read[7:]) @ turn.T
    np.testing.assert_allclose(tensor, bodies.inertia_about_com(values), **CLOSE)


def test_principal_axes_are_the_nearest_rotation() -> None:
    """Axes that are those of the frame stay, whatever the order of the moments."""
    for diagonal in ([1.0, 2.0, 2.5], [2.5, 1.0, 2.0], [2.0, 2.0, 2.0]):
        moments, axes = bodies.principal_axes(np.diag(diagonal))
        np.testing.assert_allclose(moments, diagonal)
        np.testing.assert_allclose(axes, np.eye(3), atol=1e-12)


def test_an_unknown_inertia_is_left_out_where_the_controller_permits_it() -> None:
    unknown = [*PLATE[:9], None]
    assert "set_target_payload(2.00000000, [0.100000000" in controllers.controller(
        "ur", unknown, "tool0"
    )
    assert numbers(controllers.controller("ur", unknown, "tool0")) == PLATE[:4]
    abb = numbers(controllers.controller("abb", unknown, "tool0"))
    assert abb == [2.0, 100.0, 200.0, 300.0, 1.0, *[0.0] * 6]
    for maker in ("franka", "kuka"):
        with pytest.raises(tactid.IdentificationError, match="Izz not identifiable"):
            controllers.controller(maker, unknown, "tool0")
    with pytest.raises(tactid.IdentificationError, match="message for ROS: Izz not identifiable"):
        forms.ros(unknown, "tool0")
    for maker in controllers.MAKERS:
        with pytest.raises(tactid.IdentificationError, match="mass"):
            controllers.controller(maker, [-1.0, *PLATE[1:]], "tool0")
    with pytest.raises(tactid.ArgumentError, match="expected one of ur, franka, kuka, abb"):
        controllers.controller("fanuc", PLATE, "tool0")


def test_ros_has_the_fields_of_the_message() -> None:
    assert forms.ros(PLATE, 'a "tip"').splitlines() == [
        "header:",
        '  frame_id: "a \\"tip\\""',
        "inertia:",
        "  m: 2.0",
        "  com: {x: 0.1, y: 0.2, z: 0.3}",
        "  ixx: 1.0",
        "  ixy: 0.0",
        "  ixz: 0.0",
        "  iyy: 1.0",
        "  iyz: 0.0",
        "  izz: 2.0",
    ]


def test_a_comment_stays_one_line() -> None:
    text = controllers.controller("kuka", PLATE, "a\nframe")
    assert text.splitlines()[0].endswith("the frame a frame must be that of the flange")
    assert len(text.splitlines()) == 2
