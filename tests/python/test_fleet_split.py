"""Recordings that are cut where the payload changes, and parts of recordings."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pyarrow import parquet
from typer.testing import CliRunner

import tactid
from tactid._cli import cli
from tactid._fleet import run, work
from tactid._fleet.recordings import find
from tactid._fleet.table import ParquetRows, new_or_changed
from tactid._live import simulated_arm
from tactid._live.simulated_arm import TIP, SimulatedArm
from test_study import run_here

ARM = SimulatedArm()
CHANGE_S = 8.0
"""When the payload changes in the recording."""


@pytest.fixture(scope="module")
def arrays() -> dict[str, Any]:
    """Samples of 8 s of the first payload and 6 s of the second one."""
    time = np.arange(0.0, 14.0, 0.005)
    q, qd, wrench = ARM.samples(simulated_arm._HELD_S - CHANGE_S + time)
    return {"time": time, "q": q, "qd": qd, "wrench": wrench}


@pytest.fixture(scope="module")
def recording(arrays: dict[str, Any], tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("split") / "two.npz"
    np.savez(path, **(arrays | {"time": 1.0 + arrays["time"]}))
    return path


def tasks_of(path: Path, *, split: bool) -> Any:
    options = tactid.Options(urdf=ARM.urdf, tip=TIP)
    return run.tasks_of(find([path]), options, split=split)


def rows_of(path: Path) -> list[dict[str, Any]]:
    """Rows of segments as a worker computes them."""
    return [row for task in tasks_of(path, split=True) for row in work.identify_recording(task)]


def test_a_recording_is_cut_where_the_payload_changes(recording: Path) -> None:
    first, second = rows_of(recording)
    assert (first["begin_s"], second["end_s"]) == pytest.approx((0.0, 14.0), abs=0.1)
    assert (first["end_s"], second["begin_s"]) == pytest.approx((CHANGE_S, CHANGE_S), abs=0.1)
    for row, payload in zip((first, second), simulated_arm._PAYLOADS, strict=True):
        assert row["outcome"] == "identified"
        error = row["estimate.values.mass"] - payload.mass
        assert abs(error) < 4 * row["estimate.std_devs.mass"] < 0.05
    assert first["address"] == second["address"]
    assert first["finished"] == second["finished"]


def test_a_contact_is_no_payload(tmp_path: Path) -> None:
    """Something pushes for 0.8 s, and the payload before and after it is the same."""
    time = np.arange(0.0, 8.0, 0.005)
    q, qd, wrench = ARM.samples(simulated_arm._PUSHED_S[0] - 4.0 + time)
    path = tmp_path / "pushed.npz"
    np.savez(path, time=1.0 + time, q=q, qd=qd, wrench=wrench)
    (row,) = rows_of(path)
    assert (row["begin_s"], row["end_s"]) == pytest.approx((0.0, 8.0), abs=0.1)
    assert row["estimate.values.mass"] == pytest.approx(2.5, abs=0.05)


def test_the_command_counts_segments(
    recording: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run, "run", run_here)
    monkeypatch.chdir(tmp_path)
    arguments = ["--split", "--tip", TIP, "--urdf", "arm.urdf", "--out", "payloads.csv"]
    (tmp_path / "arm.urdf").write_text(ARM.urdf)
    done = CliRunner().invoke(cli.app, ["fleet", str(recording), *arguments])
    assert done.exit_code == 0, done.output
    assert done.stderr.startswith("1 recording: 2 segments, 2 identified.")


def test_a_part_is_what_its_samples_alone_are(arrays: dict[str, Any]) -> None:
    given: dict[str, Any] = {"urdf": ARM.urdf, "tip": TIP, "cutoff_hz": 5.0, "delay_s": 0.0}
    time, motion = arrays["time"], {k: v for k, v in arrays.items() if k != "time"}
    part = tactid.identify(time, begin_s=CHANGE_S, end_s=13.0, **motion, **given)
    inside = (time >= CHANGE_S) & (time <= 13.0)
    alone = tactid.identify(time[inside], **{k: v[inside] for k, v in motion.items()}, **given)
    assert part.estimate.values == pytest.approx(alone.estimate.values, rel=1e-9)
    assert part.duration_s == pytest.approx(alone.duration_s) == pytest.approx(5.0, abs=0.05)


def test_a_part_of_a_log_begins_and_ends_when_it_is_said_to(log: Path) -> None:
    part = tactid.identify(log, begin_s=0.5, end_s=2.0)
    assert part.duration_s == pytest.approx(1.5, abs=0.05)
    with pytest.raises(tactid.TactidError, match="`end_s` is 1, which is not after `begin_s`, 2"):
        tactid.identify(log, begin_s=2.0, end_s=1.0)


def test_the_rows_of_a_recording_are_replaced_together(recording: Path, tmp_path: Path) -> None:
    """One that is not cut any more has one row, and the segments have none."""
    out = tmp_path / "payloads.parquet"

    def run_on(*, split: bool) -> list[dict[str, Any]]:
        table, tasks = ParquetRows(out), tasks_of(recording, split=split)
        for task in new_or_changed(tasks, table.stored()):
            table.add(work.identify_recording(task))
        table.close()
        rows: list[dict[str, Any]] = parquet.read_table(out).to_pylist()
        return rows

    cut = run_on(split=True)
    assert [row["begin_s"] is None for row in cut] == [False, False]
    assert run_on(split=True) == cut
    assert [row["begin_s"] for row in run_on(split=False)] == [None]
