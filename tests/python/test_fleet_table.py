"""Tables of fleets: what other runs, failures and foreign files do to them."""

import sys
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import pyarrow
import pytest
from pyarrow import parquet
from typer.testing import CliRunner

import tactid
from tactid._cli import cli
from tactid._fleet import run
from tactid._fleet.table import read_rows, rows_at


def row(address: str, mass: float = 1.2, **others: Any) -> dict[str, Any]:
    return {
        "address": address,
        "episode": None,
        "robot": "arm",
        "options_sha256": "",
        "size": 3,
        "configured": [1.0, 0.0, 0.0, 0.1],
        "finished": datetime(2026, 1, 1, tzinfo=timezone.utc),
        "outcome": "identified",
        "start_ns": 1_790_000_000_000_000_000,
        "subtracts_unloaded": False,
        "estimate.values.mass": mass,
        "estimate.std_devs.mass": 0.01,
        "findings": [{"kind": "delay", "severity": "notes", "text": "A delay, of 3 ms."}],
        **others,
    }


def test_rows_of_csv_have_the_types_of_the_schema(tmp_path: Path) -> None:
    table = rows_at(tmp_path / "x.csv")
    table.add([row("a.mcap")])
    table.close()
    (found,) = read_rows(tmp_path / "x.csv")
    assert {name: value for name, value in found.items() if value is not None} == {
        name: value for name, value in row("a.mcap").items() if value not in (None, "")
    }


def test_numbers_in_names_are_in_order(tmp_path: Path) -> None:
    table = rows_at(tmp_path / "x.csv")
    names = ["1/a", "r1.npz", "r2.npz", "r10.npz", "s"]
    table.add([row(name) for name in reversed(names)])
    table.close()
    assert [each["address"] for each in read_rows(tmp_path / "x.csv")] == names


@pytest.mark.parametrize("name", ["out.json", "out.xlsx", "run.MCAP"])
def test_a_table_has_no_name_of_another_kind(tmp_path: Path, name: str) -> None:
    with pytest.raises(tactid.ArgumentError, match=r"ends in \.csv"):
        rows_at(tmp_path / name)
    assert not (tmp_path / name).exists()


def test_an_address_is_no_path() -> None:
    for use in (lambda each: rows_at(Path(each)), tactid.identify):
        with pytest.raises(tactid.ArgumentError, match=r"s3://logs/x.*`tactid fleet`"):
            use("s3://logs/x")


def test_without_arrow_the_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(tactid.ArgumentError, match=r"pip install 'tactid\[fleet\]'"):
        rows_at(tmp_path / "x.parquet")
    for missing in ("x.csv", "x.parquet"):
        with pytest.raises(tactid.ArgumentError, match=f"there is no table at .*{missing}"):
            read_rows(tmp_path / missing)


def test_a_run_that_fails_leaves_the_rows_of_csv_that_it_has_not_replaced(tmp_path: Path) -> None:
    out = tmp_path / "x.csv"
    table = rows_at(out)
    for address in ("a.mcap", "b.mcap"):
        table.add([row(address)])
    table.close()
    before = out.read_bytes()
    rows_at(out).close(is_whole=False)
    assert out.read_bytes() == before
    table = rows_at(out)
    table.add([row("b.mcap", 2.0)])
    table.close(is_whole=False)
    masses = {each["address"]: each["estimate.values.mass"] for each in read_rows(out)}
    assert masses == {"a.mcap": 1.2, "b.mcap": 2.0}


def test_csv_replaces_no_recording_and_no_file_of_others(tmp_path: Path) -> None:
    bag = tmp_path / "bag"
    bag.mkdir()
    (bag / "metadata.yaml").write_text("")
    (bag / "bag_0.mcap").write_bytes(b"no log")
    recording, notes = tmp_path / "rec.csv", tmp_path / "notes.csv"
    recording.write_text("t,q\n0,1\n")
    notes.write_text("mine\n")
    for source, out, words in (
        (recording, recording, "the table and the recording are the same file"),
        (bag, bag / "x.csv", "is a file in the folder of the recording"),
        (recording, notes, "tactid has not written it"),
    ):
        with pytest.raises(tactid.ArgumentError, match=words):
            tactid.fleet(source, out=out)
    assert recording.read_text() == "t,q\n0,1\n"
    assert notes.read_text() == "mine\n"


def test_two_runs_do_not_write_to_one_folder(tmp_path: Path) -> None:
    out = tmp_path / "x.parquet"
    first = rows_at(out)
    with pytest.raises(tactid.ArgumentError, match=r"another run writes to .*x\.parquet"):
        rows_at(out)
    first.add([row("a.mcap")])
    first.close()
    rows_at(out).close()
    assert [each["address"] for each in read_rows(out)] == ["a.mcap"]
    assert parquet.read_table(out).num_rows == 1  # a reader of data sets skips the lock


def test_another_file_is_no_table(tmp_path: Path) -> None:
    parquet.write_table(pyarrow.table({"x": [1]}), tmp_path / "other.parquet")
    (tmp_path / "torn.parquet").write_bytes(b"PAR1")
    (tmp_path / "other.csv").write_text("x\n1\n")
    for name in ("other.parquet", "torn.parquet", "other.csv"):
        with pytest.raises(tactid.ArgumentError, match=f"{name} is no table that tactid fleet"):
            read_rows(tmp_path / name)


@pytest.mark.parametrize(("outcome", "code"), [("refused", 1), ("contradicted", 0)])
def test_a_run_without_any_result_is_no_success(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, outcome: str, code: int
) -> None:
    def computed(tasks: list[Any], rows: Any, *_: object) -> int:
        rows.add([{"outcome": outcome}] * len(tasks))
        return 0

    monkeypatch.setattr(run, "run", computed)
    (tmp_path / "a.mcap").write_bytes(b"x")
    out = tmp_path / "x.csv"
    done = CliRunner().invoke(cli.app, ["fleet", str(tmp_path / "a.mcap"), "--out", str(out)])
    assert done.exit_code == code, done.output
