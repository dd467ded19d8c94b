"""What a user of fleets gets wrong is an error before the run, with its place."""

import shutil
import socket
from pathlib import Path

import pytest

import tactid
from tactid._cli import fleet_command
from tactid._cli.fleet_command import Counted, read_robots
from tactid._fleet import run
from tactid._fleet.recordings import find
from tactid._fleet.table import MemoryRows, rows_at
from test_fleet import write_data_set


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"shape": "nosuch.stl"}, "nosuch.stl, which does not exist"),
        ({"unloaded": "nosuch"}, "nosuch, which does not exist"),
        ({"shape_scale": 2.0}, "`shape` is missing"),
        ({"wrench_acts_on": "sensr"}, "expected 'payload' or 'sensor'"),
    ],
)
def test_options_are_checked_before_the_run(
    log: Path, options: dict[str, object], words: str
) -> None:
    with pytest.raises(tactid.ArgumentError, match=words):
        run.tasks_of(find([log]), tactid.Options(**options))
    robots = [{"pattern": "*", **options}]
    with pytest.raises(tactid.ArgumentError, match=f"entry 1 of `robots`: .*{words}"):
        run.tasks_of(find([log]), tactid.Options(), robots)


def test_an_episode_is_chosen(log: Path, urdf: str, tmp_path: Path) -> None:
    recordings = find([write_data_set(tmp_path / "set", log)])
    (task,) = run.tasks_of(recordings, tactid.Options(urdf=urdf, episode=1))
    assert task.recording.episode == 1
    with pytest.raises(tactid.ArgumentError, match="`episode` is 2, which no data set has"):
        run.tasks_of(recordings, tactid.Options(urdf=urdf, episode=2))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "has no line of a robot"),
        ("pattern,robot\n", "has no line of a robot"),
        ("pattern;robot\n*;left\n", "semicolons"),
        ("pattern,robot\n*,left\n*\n", "line 3 has 1 cells, but the table has 2 columns"),
        ("pattern,robot\n*,left,-2.0\n", "line 2 has 3 cells"),
        ("pattern,wrench-acts-on\n\n*,sensr\n", "line 3: .*expected 'payload' or 'sensor'"),
        ("pattern,robot,robot\n*,left,right\n", "has the column robot twice"),
        ("pattern,tip,--tip\n*,a,b\n", "has the column --tip twice"),
        ("pattern,urdf\n*,no.urdf\n", "line 2: .*no.urdf: No such file"),
    ],
)
def test_errors_of_a_table_of_robots_name_the_line(
    log: Path, tmp_path: Path, text: str, words: str
) -> None:
    table = tmp_path / "robots.csv"
    table.write_text(text)
    with pytest.raises(tactid.ArgumentError, match=f"--table .*robots.csv,? .*{words}"):
        run.tasks_of(find([log]), tactid.Options(), read_robots(table))


def test_a_pattern_of_a_folder_matches_what_is_below(
    log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "logs" / "arm").mkdir(parents=True)
    shutil.copy(log, tmp_path / "logs" / "arm" / "a.mcap")
    found = find(["logs"])
    for pattern in ("logs/arm", "logs/arm/", "logs", "logs/*", tmp_path.as_posix()):
        assert run.without_robot(found, [{"pattern": pattern}]) == []
    for pattern in ("logs/a", "arm", "log"):
        assert run.without_robot(found, [{"pattern": pattern}]) != []


def test_a_line_that_an_earlier_one_hides_is_said(
    log: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    robots = [{"pattern": pattern} for pattern in ("*", "*.mcap", "x*")]
    fleet_command._print_unused([], find([log]), robots)
    assert capsys.readouterr().err == (
        "*.mcap of --table matches only what earlier lines match.\n"
        "x* of --table matches no recording.\n"
    )


def test_without_places_or_with_a_word_for_a_switch_nothing_runs(log: Path) -> None:
    with pytest.raises(tactid.ArgumentError, match="there is no recording: `urls` is empty"):
        tactid.fleet([])
    with pytest.raises(tactid.ArgumentError, match="`split` is 'yes': expected True or False"):
        tactid.fleet(log, split="yes")  # type: ignore[arg-type]


def test_rows_that_a_file_loses_are_said(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "x.csv"
    table = rows_at(out)
    table.add([{"address": name, "episode": None, "options_sha256": "x"} for name in "ab"])
    table.close()
    tasks = run.tasks_of(find([log]), tactid.Options())
    fleet_command._print_lost(out, tasks)
    assert capsys.readouterr().err == (
        f"{out} has 2 rows of other recordings, which this run leaves out: a folder of Parquet"
        " files keeps them.\n"
    )
    fleet_command._print_lost(tmp_path / "none.csv", tasks)
    assert capsys.readouterr().err == ""


def test_a_table_that_cannot_be_read_is_an_error_without_the_words_of_python(
    tmp_path: Path,
) -> None:
    table = tmp_path / "robots.csv"
    with pytest.raises(tactid.ArgumentError, match=r"robots.csv: No such file or directory$"):
        read_robots(table)
    table.write_bytes(b"pattern\n\xff\n")
    with pytest.raises(tactid.ArgumentError, match="is no CSV file in UTF-8"):
        read_robots(table)


def test_what_is_left_out_of_folders_is_said(log: Path, tmp_path: Path) -> None:
    folder = tmp_path / "logs"
    (folder / "dir.mcap").mkdir(parents=True)
    (folder / "payloads.parquet").mkdir()
    shutil.copy(log, folder / "R2.MCAP")
    shutil.copy(log, folder / ".hidden.mcap")
    (folder / "a.csv").write_text("time")
    (folder / "notes.md").write_text("")
    left_out: list[str] = []
    (folder / "link").symlink_to(tmp_path)
    (found,) = find([folder], left_out=left_out)
    assert Path(found.address).name == "R2.MCAP"
    assert [Path(each).name for each in left_out] == ["a.csv", "dir.mcap", "link"]
    (folder / "R2.MCAP").unlink()
    with pytest.raises(tactid.ArgumentError, match=r"tables, such as .*a.csv.*logs/\*.csv"):
        find([folder])


def test_an_error_in_a_list_names_the_line(log: Path, tmp_path: Path) -> None:
    names = tmp_path / "list.txt"
    names.write_text(f"# recordings\n{log}\n{log}\nftp://host/x.mcap\n")
    with pytest.raises(tactid.ArgumentError, match=r"list.txt, line 4: ftp://host/x.mcap: expect"):
        find([names])
    names.write_text(f"{log}\n{log}\n")
    assert len(find([names])) == 1


def test_the_address_of_a_scheduler_is_checked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run, "CONNECTION_S", 0.1)
    with socket.socket() as closed, socket.create_server(("127.0.0.1", 0)) as web:
        closed.bind(("127.0.0.1", 0))
        ports = [each.getsockname()[1] for each in (closed, web)]
        for address, words in {
            "localhost": "with its port, such as tcp://localhost:8786",
            "http://localhost:8787": "expected tcp://HOST:PORT",
            f"tcp://127.0.0.1:{ports[0]}": "cannot be reached: Connection refused",
            f"127.0.0.1:{ports[1]}": "cannot be reached: no scheduler of Dask answers",
        }.items():
            with pytest.raises((ValueError, OSError)) as caught:
                run.check_scheduler(address, "--scheduler")
            assert str(caught.value).startswith(f"--scheduler is {address}")
            assert words in str(caught.value)


def test_some_files_that_are_left_out_are_named(capsys: pytest.CaptureFixture[str]) -> None:
    fleet_command._print_unused(["a", "b"], [], [])
    fleet_command._print_unused(["a", "b", "c", "d", "e"], [], [])
    assert capsys.readouterr().err == (
        "Left out 2 files that may be recordings: a, b.\n"
        "Left out 5 files that may be recordings: a, b, c and 2 others.\n"
    )


def test_the_most_frequent_errors_are_printed(capsys: pytest.CaptureFixture[str]) -> None:
    rows = Counted(MemoryRows())
    assert rows.so_far(Path("x.csv")) == "no row was computed"
    for k in range(12):
        kind = "no wrench" if k < 8 else f"fault {k % 3}"
        address = f"/logs/{k}.mcap"
        rows.add([{"address": address, "outcome": "refused", "error": f"{address}: {kind}"}])
    assert rows.so_far(Path("x.csv")) == "x.csv has 12 rows of this run"
    rows.print_end("12 recordings.")
    lines = capsys.readouterr().err.splitlines()[1:]
    assert lines[0] == "8 times: /logs/0.mcap: no wrench"
    assert len(lines) == 4
    assert lines[3] == "There is 1 other error."
