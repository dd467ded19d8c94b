"""Robots from Denavit-Hartenberg tables, and from xacro."""

import sys
import types
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tactid
from tactid._read.descriptions import as_urdf


def rotation(axis: int, angle: float) -> np.ndarray:
    matrix = np.eye(4)
    one, two = (axis + 1) % 3, (axis + 2) % 3
    matrix[[one, two], [one, two]] = np.cos(angle)
    matrix[two, one], matrix[one, two] = np.sin(angle), -np.sin(angle)
    return matrix


def shift(x: float, z: float) -> np.ndarray:
    matrix = np.eye(4)
    matrix[[0, 2], 3] = x, z
    return matrix


@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_a_table_is_the_product_of_its_rows(convention: str, rng: np.random.Generator) -> None:
    angles = [0.0, np.pi / 2, -np.pi / 2, np.pi, 1.1]
    for _ in range(20):
        rows = [
            {
                "a": float(rng.normal()),
                "d": float(rng.normal()),
                "alpha": float(rng.choice(angles)),
                "theta": float(rng.choice(angles)),
                "type": str(rng.choice(["revolute", "prismatic"])),
                "mass": 1.5,
                "com": rng.normal(size=3).tolist(),
                "inertia": np.diag([0.1, 0.15, 0.2]).tolist(),
            }
            for _ in range(5)
        ]
        arm = tactid.Manipulator.from_urdf(tactid.dh_urdf(rows, convention=convention))
        q = rng.normal(size=5)
        pose, _ = walked(rows, convention, q)
        np.testing.assert_allclose(arm.kinematics("tool0", q).pose, pose, atol=1e-12)
        held = arm.inverse_dynamics(q, gravity=[0, 0, -9.81])[0]
        steps = 1e-5 * np.eye(5)
        energies = [[walked(rows, convention, q + s * step)[1] for s in (1, -1)] for step in steps]
        np.testing.assert_allclose(held, -np.diff(energies)[:, 0] / 2e-5, atol=1e-5)


def walked(rows: list[dict[str, Any]], convention: str, q: np.ndarray) -> tuple[np.ndarray, float]:
    """The pose of the last frame, and the potential energy of the bodies."""
    pose, energy = np.eye(4), 0.0
    for row, position in zip(rows, q, strict=True):
        turns = row["type"] == "revolute"
        theta, d = row["theta"] + turns * position, row["d"] + (not turns) * position
        along_z = rotation(2, theta) @ shift(0.0, d)
        along_x = shift(row["a"], 0.0) @ rotation(0, row["alpha"])
        pose = pose @ (along_z @ along_x if convention == "standard" else along_x @ along_z)
        energy += row["mass"] * 9.81 * float((pose @ [*row["com"], 1.0])[2])
    return pose, energy


def test_a_table_in_toml_is_a_robot(tmp_path: Path) -> None:
    path = tmp_path / "arm.toml"
    rows = '[[joints]]\nname = "pan"\nd = 0.3\nalpha_deg = 90\n[[joints]]\na = 0.5\n'
    path.write_text('tip = "flange"\n' + rows)
    arm = tactid.Manipulator.from_urdf(as_urdf(path))
    assert arm.joint_names == ["pan", "joint_2"]
    place = arm.kinematics("flange", [0, 0]).pose[:3, 3]
    np.testing.assert_allclose(place, [0.5, 0, 0.3], atol=1e-12)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("joints = 3", "expected a table"),
        ("[[joints]\n", "is no TOML"),
        ("[[joints]]\nalfa = 1", "row 1 has `alfa`"),
        ('[[joints]]\nalpha = "x"', "`alpha` is 'x': expected 1 number"),
        ("[[joints]]\nalpha = 1\nalpha_deg = 1", "both `alpha` and `alpha_deg`"),
        ('[[joints]]\ntype = "ball"', "type 'ball'"),
        ("base = 1\n[[joints]]\na = 1", "has `base`"),
        ("joints = []", "has no row"),
        ('convention = "x"\n[[joints]]\na = 1', "`convention` is 'x'"),
    ],
)
def test_what_is_wrong_with_a_table_is_named(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "arm.toml"
    path.write_text(text)
    with pytest.raises(tactid.ModelError, match=message) as refused:
        as_urdf(path)
    assert refused.value.option == "urdf"


def test_xacro_is_expanded_where_it_is_installed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "arm.urdf.xacro"
    path.write_text("<robot/>")
    monkeypatch.setitem(sys.modules, "xacro", None)
    with pytest.raises(tactid.ArgumentError, match=r"pip install xacro, or .* xacro .*\.xacro >"):
        as_urdf(path)
    # A stand-in with the function of the package that is called.
    text = '<robot name="a"><link name="tool0"/></robot>'
    document = types.SimpleNamespace(toxml=lambda: text)
    stand_in = types.SimpleNamespace(process_file=lambda _: document)
    monkeypatch.setitem(sys.modules, "xacro", stand_in)
    assert as_urdf(path) == text
    stand_in.process_file = lambda _: 1 / 0
    with pytest.raises(tactid.ModelError, match="division by zero"):
        as_urdf(path)
