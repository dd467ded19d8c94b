"""`make bench-real` on recordings in the forms of the published ones, which are written here.

The recordings of real robots are published by others, and are not part of the repository.
"""

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from calibrated_arms import COULOMB, VISCOUS
from pages import ROOT
from recorded_arm import Arm, State, body, ur5e
from recordings import accelerations, clock, odometry, wrenches, write_bag

DATA = ROOT.parent / "shared/data"
CHECKS = ["B by A", "C by A", "A by B", "C by B", "A by C", "B by C"]
TOOL = body(0.7, [0.01, 0.15, -0.02], [0.0069, 0.0006, 0.0064], [0.1, 0.2, 0.0])


def rows_of(data: Path) -> tuple[list[list[str]], list[str]]:
    """The rows of the table, a text for each column, and the lines above it."""
    command = [sys.executable, ROOT / "bench" / "real.py", data]
    printed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    lines = printed.splitlines()
    cells = [[cell.strip() for cell in line[1:-1].split("│")] for line in lines if line[:1] == "│"]
    return cells, [line for line in lines if "is missing" in line]


def write_tool(bag: Path) -> None:
    """A tool on a sensor that feels no noise."""
    state = Arm(TOOL, seed=5).at(clock(6.0, 100.0))
    messages = [
        *wrenches(state.time, state.wrench, topic="/ft_sensor/wrench", frame="ft_sensor"),
        *odometry(state.time, state.tip, child="ft_sensor", topic="/ft_sensor/odom"),
        *accelerations(state.time, state.tip, frame="ft_sensor", topic="/ft_sensor/accel"),
    ]
    write_bag(bag, messages)
    inertia = TOOL.inertia[np.triu_indices(3)].tolist()
    names = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    truth = {
        "mass_kg": TOOL.mass,
        "com_m": TOOL.com.tolist(),
        "inertia_about_com_kgm2": dict(zip(names, inertia, strict=True)),
        "gravity_in_world": [0, 0, -9.81],
    }
    (bag / "truth.json").write_text(json.dumps(truth))


def write_currents(path: Path, state: State, torque: np.ndarray, first_s: float) -> None:
    """Currents of 10 N m each as the UR10e's were published, after rows that do not belong."""
    noise = np.random.default_rng(len(path.name)).normal(size=torque.shape) * 0.01
    friction = np.tanh(state.v / 0.02) * COULOMB + VISCOUS * state.v
    current = (torque + friction) / 10 + noise
    table = np.hstack([first_s + state.time[:, None], state.q, state.v, current, 0 * current])
    before = np.full((7, table.shape[1]), 3.0)
    before[:, 0] = first_s + np.arange(-7, 0)
    np.savetxt(path, np.vstack([before, table]), fmt="%.4f", delimiter=",")


def test_a_tool_beside_what_is_missing(tmp_path: Path) -> None:
    """Without noise both fits are exact, and the other robots are named, each in a line."""
    (tmp_path / "utias").mkdir()
    write_tool(tmp_path / "utias/hammer_high")
    rows, missing = rows_of(tmp_path)
    assert [row[:3] for row in rows] == [["wrist sensor, simulated", "hammer", "0.700"]]
    assert [abs(float(cell.split()[0])) for cell in rows[0][3:11]] == [0.0] * 8
    named = [re.match(r"(\S+) is missing: .* from (\S+)", line) for line in missing]
    assert [Path(found[1]).name for found in named if found] == [
        "ur10e.urdf",
        "ur10_exciting_trajectory.db3",
        "panda_exciting_trajectory.db3",
        "c_clamp_high",
        "ruler_high",
        "screwdriver_high",
    ]


def test_currents_as_they_were_published(tmp_path: Path) -> None:
    """Six weighed loads, each with the calibration of another pair: every interval holds."""
    folder = tmp_path / "ur10e"
    folder.mkdir()
    (folder / "ur10e.urdf").write_text(ur5e())
    seed = 20
    for mass, files in (
        (2.602, (("ur-19_12_23_free", 446.415), ("ur-20_01_13-load_2600", 316.083))),
        (2.805, (("ur-20_01_31-unload", 780.311), ("ur-20_01_31-load", 1114.597))),
        (2.805, (("ur-20_02_19_14harm50sec", 840.487), ("ur-20_02_19_14harm50secLoad", 1887.417))),
    ):
        load = body(mass, [0.03, 0.1, 0.04], [0.02, 0.01, 0.02], [0.0, 0.0, 0.0])
        for (name, first_s), is_loaded in zip(files, (False, True), strict=True):
            state = Arm(load, seed=seed).at(clock(20.0, 100.0))
            torque = state.effort if is_loaded else state.unloaded_effort
            write_currents(folder / f"{name}.csv", state, torque, first_s)
            seed += 1
    rows, _ = rows_of(tmp_path)
    checks = [row for row in rows if " by " in row[1]]
    assert [row[1] for row in checks] == CHECKS
    assert [row[-1] for row in checks] == ["1 of 1"] * 6
    assert all(abs(float(row[3].split()[0])) < 1 for row in checks), checks


@pytest.mark.skipif(not DATA.is_dir(), reason="the recordings are not part of the repository")
def test_the_loads_of_a_real_arm(tmp_path: Path) -> None:
    """Loads that were weighed, on a UR10e on other days than those of its calibration."""
    (tmp_path / "ur10e").symlink_to(DATA / "ur10e")
    rows, _ = rows_of(tmp_path)
    checks = [row for row in rows if " by " in row[1]]
    assert [row[-1] for row in checks] == ["1 of 1"] * 6
    assert all(abs(float(row[3].split()[0])) < 2 for row in checks), checks
