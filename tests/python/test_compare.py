"""The comparison of methods and estimators on one recording, in Python and as a command."""

import json
from pathlib import Path

import numpy as np
import pytest

import tactid
import wrist
from conftest import TactidCommand
from expectations import LAYOUT, assert_fits_schema

METHODS = [
    ("tactile", "least-squares"),
    ("effort", "least-squares"),
    ("joint-sensing", "least-squares"),
    ("combined", "least-squares"),
    ("tactile", "nlms"),
    ("joint-sensing", "nlms"),
]


def test_every_method_is_compared(command: TactidCommand, log: Path, tmp_path: Path) -> None:
    done = command("compare", log, "--result", "comparison.json")
    assert done.returncode == 0, done.stderr
    for part in ("mass", "± 95 %", "error %", "joint-sensing, NLMS", "combined", "moment 3"):
        assert part in done.stdout
    record = json.loads((tmp_path / "comparison.json").read_text())
    assert list(record) == ["schema", "truth", "results", "not_possible"]
    assert record["schema"] == "tactid.comparison/2"
    for each in record["results"]:
        assert_fits_schema(each)
    assert record["truth"]["mass"] == pytest.approx(100)
    assert record["not_possible"] == []
    found = [(each["method"], each["estimator"]) for each in record["results"]]
    assert found == METHODS
    for each in record["results"][:4]:
        assert list(each) == [*LAYOUT, "error_percent"]
        assert abs(each["error_percent"]["mass"]) < 0.5
    alone = json.loads(command("identify", log, "--json").stdout)
    assert record["results"][0]["estimate"] == alone["estimate"]


def test_what_a_recording_does_not_permit_is_a_reason(command: TactidCommand, log: Path) -> None:
    """A known mass is not for the paper's filter; no option of a comparison would change that."""
    attempts = tactid.compare(log, known_mass_kg=100.0)
    assert [attempt.result is None for attempt in attempts] == [False] * 4 + [True] * 2
    reason = attempts[4].reason()
    assert reason is not None
    assert "least squares" in reason
    done = command("compare", log, "--known-mass-kg", 100)
    assert "tactile, NLMS: not possible: " in done.stderr
    assert "estimator" not in reason + done.stderr
    assert "NLMS" not in done.stdout


def test_arrays_are_compared(rng: np.random.Generator) -> None:
    """A sensor whose own pose is measured has no joints: only its wrenches count."""
    time = np.arange(0.0, 6.0, 0.01)
    pose = np.tile(np.eye(4), (len(time), 1, 1))
    pose[:, :3, :3] = wrist.turned(time, 0.0)
    force = 2.0 * np.swapaxes(pose[:, :3, :3], 1, 2) @ [0.0, 0.0, 9.81]
    wrench = np.hstack([force, np.zeros_like(force)])  # a point mass in the sensor's origin
    wrench += rng.normal(size=wrench.shape) * [0.1, 0.1, 0.1, 0.01, 0.01, 0.01]
    attempts = tactid.compare(time, pose=pose, wrench=wrench)
    possible = {a.title: a.result.estimate.body.mass for a in attempts if a.result is not None}
    assert possible["tactile"] == pytest.approx(2.0, rel=0.02)
    assert "effort" not in possible
    assert "joint-sensing" not in possible


def test_a_comparison_chooses_the_methods_itself(command: TactidCommand, log: Path) -> None:
    with pytest.raises(tactid.ArgumentError, match="leave `method` out"):
        tactid.compare(log, method="effort")
    with pytest.raises(tactid.ArgumentError, match="leave `estimator` out"):
        tactid.compare(log, options=tactid.Options(estimator="nlms"))
    done = command("compare", log, "--method", "effort")
    assert done.returncode == 2
    assert "--method" in done.stderr


def test_what_no_method_permits_is_an_error(command: TactidCommand, log: Path) -> None:
    done = command("compare", log, "--cutoff-hz", "-1")
    assert done.returncode == 2
    assert done.stdout == ""
    assert "--cutoff-hz is -1" in done.stderr
    assert "none.mcap" in command("compare", "none.mcap").stderr
