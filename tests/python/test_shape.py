"""What the shape of a payload adds: options, table, documents, and MuJoCo as an oracle."""

import json
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import tactid
from conftest import TactidCommand
from test_cli import assert_refused
from wrist import BODY, NOISE, TRUTH, identified

SIZE = np.array([0.06, 0.08, 0.12])
"""Sides of a box that has about the inertia of the payload of :mod:`wrist`, m."""

EXACT = "shape_position_std_dev_m", "shape_rotation_std_dev", "shape_size_std_dev"
"""Tolerances of a shape. Where they are zero, its mean is that of the uniform solid."""

FACES = "-8 -6 -5 -7", "-4 -3 -1 -2", "-8 -7 -3 -4", "-6 -2 -1 -5", "-8 -4 -2 -6", "-7 -5 -1 -3"


def write(path: Path, corners: np.ndarray[Any, Any]) -> Path:
    """Writes the box between the centre of mass less and plus half of its sides as OBJ."""
    low, high = corners
    vertices = [[(low, high)[bits >> axis & 1][axis] for axis in range(3)] for bits in range(8)]
    lines = [f"v {x} {y} {z}" for x, y, z in vertices] + [f"f {face}" for face in FACES]
    path.write_text("\n".join(lines))
    return path


@pytest.fixture(scope="module")
def box(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A box around the centre of mass of the payload, with its inertia about that."""
    moments = np.diag(BODY.inertia) / BODY.mass
    sides = np.sqrt(6 * (moments.sum() - 2 * moments))
    corners = BODY.com + np.outer([-0.5, 0.5], sides)
    return write(tmp_path_factory.mktemp("shape") / "box.obj", corners)


def short(**options: Any) -> tactid.Identification:
    return identified(2.0, 3, noise=30 * NOISE, **options)


def test_a_shape_is_in_the_estimate_and_in_what_shows_it(box: Path) -> None:
    without, found = short(), short(shape=box)
    assert without.shape is None
    shape = found.shape
    assert shape is not None
    assert shape.is_used
    assert shape.p_value > 0.01
    assert shape.fraction.shape == (10,)
    assert shape.fraction[0] < 0.1 < shape.fraction[9]
    assert (found.estimate.std_devs[4:] < without.estimate.std_devs[4:]).all()
    assert (np.abs(found.estimate.values - TRUTH) < 4 * found.estimate.std_devs).all()
    assert found.inputs["`shape`"] == box.absolute()
    assert found.forecast is None
    shown = str(found)
    assert "of shape" in shown
    assert f"shape {box.name} (given)" in shown
    assert f"{100 * shape.fraction[9]:.0f} %" in shown
    assert "of shape" not in str(without)
    assert "<th>of shape</th>" in found._repr_html_()
    record = json.loads(found.to_json())
    assert record["shape"]["fraction"]["mass"] == shape.fraction[0]
    assert "prior" not in record["shape"]


def test_the_uniform_solid_is_that_of_mujoco(tmp_path: Path) -> None:
    """Its centre of mass and inertia are those of a mesh in MuJoCo, wherever it stands."""
    for name, shift in (("a", [0.0, 0.0, 0.0]), ("b", [0.1, -0.2, 0.05])):
        path = write(tmp_path / f"{name}.obj", shift + np.outer([-0.5, 0.5], SIZE))
        model = mujoco.MjModel.from_xml_string(
            f"""<mujoco><asset><mesh name="m" file="{path}" inertia="exact"/></asset><worldbody>
            <body><geom type="mesh" mesh="m" density="1000"/></body></worldbody></mujoco>"""
        )
        turn = np.zeros(9)
        mujoco.mju_quat2Mat(turn, model.body_iquat[1])
        axes, mass = turn.reshape(3, 3), model.body_mass[1]
        about_center = axes @ np.diag(model.body_inertia[1]) @ axes.T
        body = tactid.MassProperties(mass, model.body_ipos[1], about_center)
        exact = dict.fromkeys(EXACT, 0.0)
        fit = short(shape=path, **exact).shape
        assert fit is not None
        np.testing.assert_allclose(fit.prior.mean, body.parameters[1:] / mass, atol=1e-8)


def test_a_wrong_unit_is_a_contradiction(box: Path) -> None:
    found = identified(2.0, 3, shape=box, shape_scale=1000.0)
    (finding,) = found.findings
    assert (finding.kind, finding.data["scale"]) == ("shape_contradicted", 1.0)
    assert found.is_contradicted
    assert str(finding) in str(found)
    assert found.shape is not None
    assert (found.shape.fraction == 0).all()
    alone = identified(2.0, 3)
    np.testing.assert_array_equal(found.estimate.values, alone.estimate.values)


def test_recordings_with_one_shape_are_combined(box: Path) -> None:
    runs = [identified(1.0, seed, noise=30 * NOISE, shape=box) for seed in range(3)]
    both = tactid.combine(runs)
    assert both.shape is not None
    assert both.shape.is_used
    assert both.shape.fraction[9] < runs[0].shape.fraction[9]
    assert str(both).count("of shape") == 4
    with pytest.raises(tactid.ArgumentError, match="another shape than the first"):
        tactid.combine([runs[0], identified(1.0, 7)])


def test_the_command_takes_a_shape(command: TactidCommand, log: Path, tmp_path: Path) -> None:
    """The command has the option with its units, and refuses to write over the file."""
    path = write(tmp_path / "plate.obj", 1000 * np.outer([-0.5, 0.5], [0.02, 0.1, 0.3]))
    given = ["--shape", str(path), "--shape-scale", "0.001", "--shape-rotation-std-dev", "5"]
    done = command("identify", str(log), *given, "--shape-pose", "0,0,0.1,0,0,0,1")
    assert "shape" in done.stdout + done.stderr
    done = command("identify", str(log), "--shape", str(tmp_path / "none.stl"))
    assert_refused(done, "which does not exist")
    done = command("identify", str(log), *given, "--result", str(path))
    assert_refused(done, "--shape")
