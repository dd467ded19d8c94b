"""Studies: simulations of one experiment, and the errors of methods."""

from pathlib import Path
from typing import Any

import pytest
from pyarrow import parquet

import tactid
from conftest import TactidCommand
from tactid._base.values import PATHS, values_of
from tactid._fleet import study, work
from tactid._fleet.rows import rows_of
from tactid._fleet.table import ParquetRows, new_or_changed

EXPERIMENT = """
duration_s = 1.0
[excitation]
mode = "together"
[noise]
finger_force_n = 5.0
finger_moment_nm = 0.5
"""


def test_each_seed_and_method_has_a_row(tmp_path: Path) -> None:
    experiment = tactid.Experiment.from_toml(EXPERIMENT)
    out, methods = tmp_path / "study.parquet", ["tactile", "combined"]

    def run_on(seeds: int) -> list[dict[str, Any]]:
        table = ParquetRows(out)
        tasks = study.tasks_of_study("e.toml", experiment, seeds, methods, tactid.Options())
        for task in new_or_changed(tasks, table.stored()):
            table.add(work.identify_recording(task))
        table.close()
        return rows_of(table.all(), (task.recording for task in tasks))

    first = run_on(1)
    rows = run_on(2)
    assert [(row["episode"], row["method"]) for row in rows] == [
        (seed, method) for seed in range(2) for method in methods
    ]
    assert rows[:2] == first
    assert rows[0]["estimate.values.mass"] != rows[2]["estimate.values.mass"]
    tactid.simulate(experiment.replace(seed=1), tmp_path / "run.mcap")
    alone = tactid.identify(tmp_path / "run.mcap", method="combined")
    assert rows[3]["estimate.values.mass"] == alone.estimate.values[0]
    assert parquet.read_table(out).num_rows == 4


def test_errors_are_those_of_the_estimates() -> None:
    experiment = tactid.Experiment.paper()
    truth = values_of(experiment.payload)
    names = [".".join(path) for path in PATHS]

    def row(error: float, method: str, outcome: str = "identified") -> dict[str, Any]:
        return {
            "method": method,
            "outcome": outcome,
            **{f"estimate.values.{n}": true + error for n, true in zip(names, truth, strict=True)},
            **{f"estimate.std_devs.{name}": 1.0 for name in names},
            "estimate.values.com.x": None,
        }

    rows = [row(3.0, "tactile"), row(-1.0, "tactile"), row(9.0, "tactile", "refused")]
    found = study.errors_of([*rows, row(1.0, "effort")], experiment)
    assert [each.value for each in found if each.method == "effort"] == [
        name for name in tactid.VALUE_NAMES if name != "com x"
    ]
    mass = found[0]
    assert (mass.method, mass.value, mass.runs) == ("tactile", "mass", 2)
    assert (mass.rms, mass.bias, mass.coverage) == pytest.approx((5**0.5, 1.0, 0.5))


def test_the_command_prints_the_errors(tmp_path: Path, command: TactidCommand) -> None:
    path = tmp_path / "e.toml"
    path.write_text(EXPERIMENT)
    done = command("study", path, "--seeds", "1", "--out", tmp_path / "study.csv")
    assert done.returncode == 0, done.stderr
    mass = next(line for line in done.stdout.splitlines() if " mass " in line)
    assert mass.split()[:4] == ["tactile", "mass", "kg", "1"]
    refused = command("study", path, "--methods", "tactile,best")
    assert refused.returncode == 2
    assert "expected some of tactile, effort" in refused.stderr
