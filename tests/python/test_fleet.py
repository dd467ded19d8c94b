"""A fleet of recordings: a row for each, whatever happens, and only what is new or has changed."""

import csv
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from concurrent.futures import CancelledError
from pathlib import Path
from typing import Any

import distributed
import numpy as np
import pyarrow
import pytest
from pyarrow import parquet

import tactid
from conftest import TactidCommand
from tactid._fleet import rows as columns, run
from tactid._fleet.ranges import coalesced
from tactid._fleet.recordings import find
from tactid._fleet.table import new_or_changed, rows_at

pytestmark = [
    # Threads and sockets of Dask that are closed while Python collects them.
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
    pytest.mark.filterwarnings("ignore::DeprecationWarning"),
]


@pytest.fixture
def logs(log: Path, tmp_path: Path) -> Path:
    """A folder with two copies of a log, one that is cut to nothing, and what is no log."""
    folder = tmp_path / "logs"
    (folder / "arm1").mkdir(parents=True)
    shutil.copy(log, folder / "arm1" / "a.mcap")
    shutil.copy(log, folder / "b.mcap")
    (folder / "broken.mcap").write_bytes(log.read_bytes()[:3])
    (folder / "notes.md").write_text("no log")
    return folder


def test_each_recording_has_a_row(logs: Path, log: Path, client: Any) -> None:
    rows = tactid.fleet(logs, client=client)
    names = [Path(row["address"]).name for row in rows]
    assert names == ["a.mcap", "b.mcap", "broken.mcap"]
    assert [row["outcome"] for row in rows] == ["identified", "identified", "refused"]
    alone = json.loads(tactid.identify(log).to_json())
    for row in rows[:2]:
        assert row["estimate.values.mass"] == alone["estimate"]["values"]["mass"]
        assert row["estimate.values.com.z"] == alone["estimate"]["values"]["com"]["z"]
        assert row["estimate.covariance"] == alone["estimate"]["covariance"]
        assert row["estimate.observability.inertia.xx"] == "identifiable"
        assert row["duration_s"] == alone["duration_s"]
        assert [each["kind"] for each in row["findings"]] == [
            each["kind"] for each in alone["findings"]
        ]
        assert row["error"] is None
    assert "broken.mcap" in rows[2]["error"]
    assert rows[2]["size"] == 3


def test_the_columns_are_the_keys_of_the_document_of_a_result(log: Path) -> None:
    document = json.loads(tactid.identify(log).to_json())
    for name in columns.COLUMNS:
        place: Any = document
        for key in name.split("."):
            if place is None:
                break
            assert key in place, name
            place = place[key]


def test_a_second_run_does_what_is_new_or_changed(logs: Path, tmp_path: Path, client: Any) -> None:
    out = tmp_path / "payloads.parquet"
    counts: list[tuple[int, int]] = []

    def run(**options: Any) -> list[dict[str, Any]]:
        counts.clear()
        return tactid.fleet(
            logs, out=out, client=client, progress=lambda *each: counts.append(each), **options
        )

    first = run()
    assert counts[0] == (0, 3)
    again = run()
    assert counts == [(3, 3)]
    assert again == first
    shutil.copy(logs / "b.mcap", logs / "c.mcap")
    shutil.copy(logs / "b.mcap", logs / "broken.mcap")
    later = run()
    assert counts[0] == (2, 4)
    assert [row["outcome"] for row in later] == ["identified"] * 4
    stored = parquet.read_table(out).to_pylist()
    assert len(stored) == 4
    other = run(cutoff_hz=5.0)
    assert counts[0] == (0, 4)
    assert {row["options_sha256"] for row in other}.isdisjoint(r["options_sha256"] for r in later)
    assert parquet.read_table(out).num_rows == 4


def test_rows_have_the_types_of_the_schema(logs: Path, tmp_path: Path, client: Any) -> None:
    out = tmp_path / "payloads.parquet"
    tactid.fleet(logs, out=out, client=client)
    table = parquet.read_table(out)
    assert table.schema.equals(columns.arrow_schema(pyarrow))
    assert table.schema.field("estimate.values.inertia.xy").type == pyarrow.float64()
    first = table.sort_by("address").to_pylist()[0]
    assert np.shape(first["estimate.covariance"]) == (10, 10)


def test_a_folder_of_others_is_not_written_to(logs: Path, tmp_path: Path, client: Any) -> None:
    out = tmp_path / "mine"
    out.mkdir()
    parquet.write_table(pyarrow.table({"x": [1]}), out / "x.parquet")
    with pytest.raises(tactid.ArgumentError, match="tactid has not written"):
        tactid.fleet(logs, out=out, client=client)
    assert [path.name for path in out.iterdir()] == ["x.parquet"]


def test_robots_have_options_of_their_own(logs: Path, client: Any) -> None:
    robots = [{"pattern": "*/arm1/*", "robot": "left", "known_mass_kg": 0.5, "cutoff_hz": 6.0}]
    rows = tactid.fleet(logs, client=client, robots=robots)
    assert [row["robot"] for row in rows] == ["left", "", ""]
    assert rows[0]["cutoff_hz"] == 6.0
    assert rows[1]["cutoff_hz"] != 6.0
    assert rows[0]["known_mass.mass_kg"] == 0.5
    with pytest.raises(tactid.ArgumentError, match="`pattern`"):
        tactid.fleet(logs, client=client, robots=[{"robot": "left"}])
    with pytest.raises(tactid.ArgumentError, match="no keyword `tipp`"):
        tactid.fleet(logs, client=client, robots=[{"pattern": "*", "tipp": "x"}])


def test_what_is_no_recording_is_an_error(tmp_path: Path) -> None:
    for url, words in {
        str(tmp_path / "nothing.mcap"): "there is no file or folder",
        str(tmp_path): "has no recording",
        "ftp://host/x.mcap": "expected a path, or an address",
        "https://user:secret@host/x.mcap": "credentials come from the environment",
    }.items():
        with pytest.raises(tactid.ArgumentError, match=words) as caught:
            find([url])
        assert "secret" not in str(caught.value)


def test_addresses_are_patterns_lists_and_bags(log: Path, tmp_path: Path) -> None:
    bag = tmp_path / "bags" / "one"
    bag.mkdir(parents=True)
    for name in ("one_0.mcap", "one_1.mcap"):
        shutil.copy(log, bag / name)
    (bag / "metadata.yaml").write_text("")
    (alone,) = find([tmp_path / "bags"])
    assert alone.address == str(bag)
    assert alone.size == 2 * log.stat().st_size
    each = find([f"{tmp_path}/**/*.mcap"])
    assert [Path(one.address).name for one in each] == ["one_0.mcap", "one_1.mcap"]
    listed = tmp_path / "list.txt"
    shutil.copy(log, bag / "a#1.mcap")
    listed.write_text(
        f"# comment\n{bag / 'a#1.mcap'}  # the first\n\n{bag / 'a#1.mcap'} # again\n{bag}\n"
    )
    assert [one.address for one in find([listed])] == [str(bag / "a#1.mcap"), str(bag)]
    for content, words in (
        (f"{listed}\n".encode(), "names the list"),
        ("Größe.mcap\n".encode("latin-1"), "is not UTF-8"),
    ):
        listed.write_bytes(content)
        with pytest.raises(tactid.ArgumentError, match=words):
            find([listed])


def test_a_path_is_absolute_however_it_is_typed(
    logs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    found = find(["logs", logs, "logs/*.mcap", "logs/arm1/../b.mcap"])
    assert {each.address for each in found} == {
        str(logs / name) for name in ("arm1/a.mcap", "b.mcap", "broken.mcap")
    }
    assert len(found) == 3
    robots = [{"pattern": "logs/arm1/*", "robot": "left"}, {"pattern": "x*", "robot": "none"}]
    assert run.without_recording(found, robots) == {"x*": False}
    names = {Path(task.head()["address"]).name: task.robot for task in tasks_of(found, robots)}
    assert names == {"a.mcap": "left", "b.mcap": "", "broken.mcap": ""}
    renamed = [{"pattern": "*/arm1/*", "robot": "right"}]
    stored = {task.key: task.state for task in tasks_of(found, robots)}
    (changed,) = new_or_changed(tasks_of(found, renamed), stored)
    assert changed.robot == "right"


def tasks_of(found: list[Any], robots: list[dict[str, Any]]) -> list[Any]:
    return run.tasks_of(found, tactid.Options(), robots)


def test_a_folder_of_an_unloaded_recording_is_part_of_the_state(log: Path, tmp_path: Path) -> None:
    bag = tmp_path / "bag"
    bag.mkdir()
    shutil.copy(log, bag / "bag_0.mcap")
    options = tactid.Options(unloaded=bag)
    (before,) = run.tasks_of(find([log]), options)
    (same,) = run.tasks_of(find([log]), options)
    (bag / "bag_0.mcap").write_bytes(b"another")
    (after,) = run.tasks_of(find([log]), options)
    assert before.state == same.state != after.state


def test_many_episodes_are_listed_fast_and_not_without_bound(tmp_path: Path) -> None:
    """Files that are an episode each are indexed once, not searched for each episode."""
    folder = tmp_path / "set"
    (folder / "meta").mkdir(parents=True)
    (folder / "data").mkdir()
    info = folder / "meta" / "info.json"
    for episode in range(1000):
        (folder / "data" / f"episode_{episode:06d}.parquet").write_bytes(b"x" * (episode + 1))
    info.write_text('{"total_episodes": 1000}')
    begun = time.process_time()
    found = find([folder])
    assert time.process_time() - begun < 0.5
    assert [one.size - info.stat().st_size for one in found] == list(range(1, 1001))
    info.write_text('{"total_episodes": 1000000000000}')
    (refused,) = find([folder])
    assert "expected at most" in str(refused.cause)


def test_a_data_set_has_a_row_for_each_episode(
    log: Path, urdf: str, tmp_path: Path, client: Any
) -> None:
    folder = write_data_set(tmp_path / "set", log)
    rows = tactid.fleet(folder, client=client, urdf=urdf)
    assert [row["episode"] for row in rows] == [0, 1]
    assert [row["outcome"] for row in rows] == ["refused"] * 2  # there is no effort


def write_data_set(folder: Path, log: Path) -> Path:
    """Writes a data set of LeRobot with two episodes of an arm at rest."""
    (folder / "meta").mkdir(parents=True)
    (folder / "data").mkdir()
    names = list(tactid.read(log, "/joint_states").names)
    features = {
        "timestamp": {"dtype": "float32"},
        "observation.state": {"dtype": "float32", "names": names},
        "episode_index": {"dtype": "int64"},
    }
    info = {"total_episodes": 2, "features": features}
    (folder / "meta" / "info.json").write_text(json.dumps(info))
    count = 50
    table = {
        "timestamp": np.tile(0.01 * np.arange(count), 2),
        "observation.state": [[0.1] * len(names)] * (2 * count),
        "episode_index": np.repeat([0, 1], count),
    }
    parquet.write_table(pyarrow.table(table), folder / "data" / "file-000.parquet")
    return folder


def test_the_command_writes_tables_and_says_what_has_become_of_recordings(
    logs: Path, tmp_path: Path, command: TactidCommand
) -> None:
    (tmp_path / "robots.csv").write_text(
        'pattern,robot,cutoff-hz,gravity\n*/arm1/*,left,6,"0,0,0"\n*,right,,\n'
    )
    done = command("fleet", logs, "--table", "robots.csv", "--out", "payloads.csv")
    assert done.returncode == 0, done.stderr
    assert "3 recordings: 2 identified, 1 refused." in done.stderr
    with (tmp_path / "payloads.csv").open() as file:
        found = list(csv.DictReader(file))
    assert [row["robot"] for row in found] == ["left", "right", "right"]
    assert float(found[0]["cutoff_hz"]) == 6.0
    (tmp_path / "robots.csv").write_text("pattern,colour\n*,red\n")
    done = command("fleet", logs, "--table", "robots.csv", "--out", "payloads.csv")
    assert done.returncode == 2
    assert "the column colour" in done.stderr


def test_without_dask_the_command_says_what_to_install(
    logs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "x.csv"
    rows_at(out).close()
    written = out.read_bytes() + b"an.mcap,,,3\n"
    out.write_bytes(written)
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(tactid.ArgumentError, match=r"pip install 'tactid\[fleet\]'"):
        tactid.fleet(logs, out=out)
    assert out.read_bytes() == written


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_killed_workers_and_a_stopped_run_lose_nothing(log: Path, tmp_path: Path) -> None:
    """Of real processes one is killed, Ctrl-C stops the run, and a second run goes on."""
    for k in range(12):
        os.link(log, tmp_path / f"{k:02}.mcap")
    out = tmp_path / "payloads.parquet"
    # Each row is written at once.
    program = "import tactid.__main__ as t, tactid._fleet.table as f; f.FLUSH_S = 0; t.main()"
    arguments = [sys.executable, "-c", program, "fleet", f"{tmp_path}/*.mcap", "--out", str(out)]
    process = subprocess.Popen(arguments, stderr=subprocess.PIPE, text=True)
    _wait_for(out, 1)
    os.kill(_worker_of(process.pid), signal.SIGKILL)
    _wait_for(out, 2)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130, errors
    before = {row["address"]: row["finished"] for row in parquet.read_table(out).to_pylist()}
    assert 2 <= len(before) < 12
    done = subprocess.run(arguments, capture_output=True, text=True, timeout=120, check=True)
    assert f"{12 - len(before)} identified, {len(before)} with a row of" in done.stderr
    rows = parquet.read_table(out).to_pylist()
    assert len({row["address"] for row in rows}) == len(rows) == 12
    assert {row["outcome"] for row in rows} == {"identified"}, done.stderr
    assert len({row["estimate.values.mass"] for row in rows}) == 1
    kept = {row["address"]: row["finished"] for row in rows if row["address"] in before}
    assert kept == before


class LostFuture:
    """A future that is done, and loses its result while that is fetched."""

    status = "finished"

    def result(self) -> None:
        raise CancelledError


def test_rows_that_are_lost_while_they_are_fetched_are_computed_again() -> None:
    assert run._rows_of(LostFuture(), []) is None


def test_a_connection_that_is_cut_loses_no_row(log: Path, tmp_path: Path) -> None:
    for k in range(5):
        os.link(log, tmp_path / f"{k:02}.mcap")
    done: list[int] = []
    with (
        distributed.LocalCluster(
            n_workers=1,
            threads_per_worker=2,
            processes=False,
            protocol="tcp",
            dashboard_address="127.0.0.1:0",
        ) as cluster,
        distributed.Client(cluster.scheduler_address, set_as_default=False) as connection,
    ):

        def cut(count: int, _: int) -> None:
            done.append(count)
            if count == 2:
                connection.loop.add_callback(connection.scheduler_comm.comm.abort)

        run.check_scheduler(cluster.scheduler_address, "`client`")
        rows = tactid.fleet(tmp_path, client=connection, progress=cut)
    assert done == list(range(6))
    assert [row["outcome"] for row in rows] == ["identified"] * 5


def _wait_for(out: Path, count: int) -> None:
    """Waits until a table has some files."""
    end = time.monotonic() + 60
    while len(list(out.glob("*.parquet"))) < count:
        assert time.monotonic() < end
        time.sleep(0.02)


def _worker_of(parent: int) -> int:
    """Returns the id of a worker's process, once it runs."""
    end = time.monotonic() + 60
    while time.monotonic() < end:
        for folder in Path("/proc").glob("[0-9]*"):
            try:
                stat = (folder / "stat").read_text().rpartition(")")[2].split()
                line = (folder / "cmdline").read_bytes()
            except OSError:
                continue
            if int(stat[1]) == parent and b"spawn_main" in line:
                return int(folder.name)
        time.sleep(0.05)
    raise AssertionError("there is no worker")


def test_requests_are_fewer_where_gaps_are_small() -> None:
    assert coalesced([(0, 100), (105, 200)]) == [(0, 200)]
    assert coalesced([(0, 100), (150, 200)]) == [(0, 100), (150, 200)]
    assert coalesced([(0, 100), (50, 200), (200, 300)]) == [(0, 300)]
    three = [(0, 1000), (1100, 2000), (2050, 3000)]
    assert coalesced(three) == [(0, 1000), (1100, 3000)]
    assert coalesced(three, 1) == [(0, 3000)]
    assert coalesced(three, 1, spent=400) == [(0, 1000), (1100, 3000)]
    ten = [(k * 1000 + 10 * k * k, k * 1000 + 900) for k in range(10)]
    assert len(coalesced(ten)) == 8
    read = coalesced(ten, 6)
    assert len(read) == 6
    assert all(any(a <= start < end <= b for a, b in read) for start, end in ten)
    assert len(coalesced(ten, 1)) > 1  # the others would be too many bytes
