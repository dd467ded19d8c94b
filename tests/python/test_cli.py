"""The command: results on standard output, one clear line for whatever is wrong."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from typer.main import get_command

import tactid
from commands import Done
from conftest import TactidCommand
from expectations import LAYOUT, assert_fits_schema
from tactid._cli import cli

VALUES = {"mass": None, "com": {"x", "y", "z"}, "inertia": {"xx", "xy", "xz", "yy", "yz", "zz"}}


def assert_refused(done: Done, *parts: str, stdout: str = "") -> None:
    """Exit code 2, and a single line that says it."""
    assert done.returncode == 2, done.stderr
    assert done.stdout == stdout
    assert done.stderr.startswith("tactid: error: ")
    assert done.stderr.count("\n") == 1, done.stderr
    for part in parts:
        assert part in done.stderr


def assert_has_values(record: dict[str, Any]) -> None:
    assert record.keys() == VALUES.keys()
    assert record["com"].keys() == VALUES["com"]
    assert record["inertia"].keys() == VALUES["inertia"]


def test_version(command: TactidCommand) -> None:
    assert command("--version").stdout == f"tactid {tactid.__version__}\n"
    script = shutil.which("tactid", path=Path(sys.executable).parent)
    assert script is not None
    assert subprocess.check_output([script, "--version"], text=True).startswith("tactid ")


def test_identify_prints_json_and_nothing_else(command: TactidCommand, log: Path) -> None:
    done = command("identify", log, "--json", "--estimator", "least-squares")
    assert done.returncode == 0
    assert done.stderr == ""
    record = json.loads(done.stdout)
    assert list(record) == [*LAYOUT, "simulation"]
    assert_fits_schema(record)
    assert_has_values(record["estimate"]["values"])
    assert record["estimate"]["values"]["mass"] == pytest.approx(100, rel=2e-3)
    assert record["estimator"] == "least-squares"
    assert len(record["fit"]["excitation"]) == 10
    assert record["simulation"]["linear_momentum_drift"] < 1e-3


def test_identify_shows_a_table_beside_the_truth(command: TactidCommand, log: Path) -> None:
    done = command("identify", log, "--estimator", "least-squares", "--method", "joint-sensing")
    assert done.returncode == 0
    for part in ("Izz", "kg m²", "nominal", "101.60", "moment 3"):
        assert part in done.stdout


def test_identify_says_how_much_longer_to_move(command: TactidCommand, log: Path) -> None:
    done = command("identify", log, "--within", "0.03%")
    assert "Every value is known within 0.03 % after another" in done.stderr
    done = command("identify", log, "--within", "0.0001%")
    assert "This motion does not determine the inertia within 0.0001 % (" in done.stderr
    record = json.loads(command("identify", log, "--within", "50%", "--json").stdout)
    assert record["remaining_s"]["within"] == 0.5
    assert record["remaining_s"]["all"] == 0
    moments = record["principal_moments"]
    assert moments["values"] == pytest.approx([10, 10, 20], abs=0.1)
    assert all(low < high for low, high in moments["intervals"])


def test_info(command: TactidCommand, log: Path) -> None:
    done = command("info", log)
    assert done.returncode == 0
    (line,) = (line for line in done.stdout.splitlines() if "/finger_left/wrench" in line)
    assert "geometry_msgs/msg/WrenchStamped" in line  # a pipe is not as narrow as a terminal
    for part in ("/joint_states", "sensor_msgs/msg/JointState", "3000", "2.999 s", "tactid.truth"):
        assert part in done.stdout
    assert done.stdout.endswith("none on opening; the messages are checked when they are read\n")


def test_simulate_then_identify(command: TactidCommand, tmp_path: Path, log: Path) -> None:
    (tmp_path / "short.toml").write_text("duration_s = 0.5\n")
    (tmp_path / "run.mcap").write_bytes(log.read_bytes())  # that of an earlier run
    assert command("simulate", "short.toml", "--out", "run.mcap").returncode == 0
    assert tactid.info(tmp_path / "run.mcap").duration == pytest.approx(0.499)


def test_paper_writes_everything(command: TactidCommand, tmp_path: Path) -> None:
    done = command(
        "paper", "--out", "a/b", "--duration", 3, "--estimator", "least-squares", "--seed", 3
    )
    assert done.returncode == 0, done.stderr
    assert "101.60" in done.stdout
    folder = tmp_path / "a/b"
    names = {file.name for file in folder.iterdir()}
    figures = {f"figure_{number:02}.png" for number in range(5, 11)}
    assert names == {"run.mcap", "result.json", "report.html"} | figures
    record = json.loads((folder / "result.json").read_text())
    assert_fits_schema(record)
    for values in (record["estimate"]["values"], record["truth"], record["error_percent"]):
        assert_has_values(values)
    assert record["estimator"] == "least-squares"
    assert record["truth"]["inertia"]["yy"] == pytest.approx(20, rel=1e-3)
    assert record["simulation"]["steps"] == 3000
    page = (folder / "report.html").read_text()
    assert page.count("data:image/png;base64,") == 6
    assert "http://" not in page
    assert "https://" not in page


def test_what_was_not_identifiable_is_no_number(command: TactidCommand, tmp_path: Path) -> None:
    """At the paper's own posture joints 3 and 6 are parallel, and nothing turns about x."""
    done = command("paper", "--posture", "table1", "--duration", 15, "--out", "out")
    assert done.returncode == 0, done.stderr
    assert "unobservable" in done.stdout
    record = json.loads((tmp_path / "out/result.json").read_text())
    assert_fits_schema(record)
    assert record["estimate"]["values"]["inertia"]["xx"] is None
    assert record["error_percent"]["inertia"]["xx"] is None
    assert "Ixx" in record["not_identifiable"]


def test_wrong_logs_are_refused(command: TactidCommand, tmp_path: Path, log: Path) -> None:
    (tmp_path / "text.mcap").write_text("this is not a log\n" * 100)
    (tmp_path / "empty.mcap").touch()
    (tmp_path / "folder").mkdir()
    for name in ("missing.mcap", "text.mcap", "empty.mcap", "folder"):
        for subcommand in ("identify", "info"):
            assert_refused(command(subcommand, name), name)
    assert_refused(
        command("identify", "text.mcap", "--json"), "neither an MCAP log nor an SQLite bag"
    )
    assert_refused(command("identify", log, "--tip", "hand"), "no link `hand`", "tool0")


@pytest.mark.parametrize("part", [0.35, 0.75, 0.98])
def test_a_truncated_log_is_read_as_far_as_it_goes(
    command: TactidCommand, tmp_path: Path, log: Path, part: float
) -> None:
    whole = log.read_bytes()
    (tmp_path / "cut.mcap").write_bytes(whole[: int(part * len(whole))])
    done = command("identify", "cut.mcap", "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    (damage,) = found["damage"]
    assert f" of {int(part * len(whole))}: " in damage
    used = f"{found['duration_s']:.{found['duration_s'] < 10:d}f} s"
    assert done.stderr == f"tactid: note: {damage}; what could be read, {used}, was used\n"
    assert done.stderr.count("\n") == 1
    assert "damage" in command("info", "cut.mcap").stdout


def test_an_error_keeps_every_word_of_its_message(command: TactidCommand, tmp_path: Path) -> None:
    """Also those with a bar."""
    assert_refused(command("identify", "left|right.mcap"), "left|right.mcap")
    (tmp_path / "bad.toml").write_text("seed = 1\n[payload]\nname = 'a|b'\n")
    done = command("simulate", "bad.toml")
    assert_refused(done, "line 3", "name")
    assert "a|b" not in done.stderr


def test_wrong_options_are_refused(command: TactidCommand, log: Path) -> None:
    assert_refused(command("paper", "--speed", "3"), "--speed")
    assert_refused(command("fly"), "fly")
    assert_refused(command("identify"), "Missing argument")
    assert_refused(command("identify", log, "--estimator", "magic"), "magic")
    assert_refused(command("identify", log, "--within", "soon"), "--within", "soon")
    assert_refused(command("identify", log, "--within", "-1%"), "--within", "-1%")
    assert_refused(command("identify", log, "--within", "0.05"), "'0.05'", "with its sign")
    assert_refused(command("paper", "--frequency", "fast"), "--frequency", "'fast'")
    assert_refused(command("identify", log, "--json", "--format", "ur"), "--json", "--format ur")
    assert_refused(command("paper", "--frequency", "nan"), "frequency")
    assert_refused(command("paper", "--posture", "table2"), "table2", "table1")
    assert_refused(command("paper", "--posture", "1,2,x"), "1,2,x")
    assert_refused(command("paper", "--posture", "1,2"), "posture")
    assert_refused(command("paper", "--seed", "-1"), "seed")
    assert_refused(command("paper", "--duration", "-1"), "duration")


def test_wrong_experiments_are_refused_with_the_line(
    command: TactidCommand, tmp_path: Path
) -> None:
    for text, parts in {
        "seed = 1\nseed == 2\n": ("line 2",),
        "[payload]\nmass = 3\n": ("line 2", "mass"),
        "seed = 1\n[payload]\nmass_kg = 0.0\n": ("line 3", "payload.mass_kg"),
        "[robot]\nurdf = 'none.urdf'\n": ("none.urdf",),
        'duration_s = "long"\n': ("line 1",),
    }.items():
        (tmp_path / "bad.toml").write_text(text)
        assert_refused(command("simulate", "bad.toml"), *parts)
    assert_refused(command("simulate", "missing.toml"), "missing.toml")
    (tmp_path / "image.toml").write_bytes(bytes(range(256)))
    assert_refused(command("simulate", "image.toml"), "image.toml")


def test_outputs_that_cannot_be_written_are_refused(command: TactidCommand, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    assert_refused(command("paper", "--out", "file", "--duration", 1), "file")
    (tmp_path / "short.toml").write_text("duration_s = 0.1\n")
    assert_refused(command("simulate", "short.toml", "--out", "no/such/run.mcap"), "no/such")


def test_a_reader_that_goes_away_is_no_error(log: Path) -> None:
    read, write = os.pipe()
    os.close(read)
    done = subprocess.run(
        [sys.executable, "-m", "tactid", "info", log],
        stdout=write,
        stderr=subprocess.PIPE,
        text=True,
        check=False,
    )
    os.close(write)
    assert done.stderr == ""
    assert done.returncode == 141


@pytest.mark.parametrize("kind", ["Exception", "BaseException"])
def test_a_fault_of_tactid_itself_is_one_line(kind: str) -> None:
    """A panic of the native part arrives as a BaseException of this name."""
    code = f"""
import sys
from tactid import __main__
from tactid._cli import cli

class PanicException({kind}):
    pass

def fail():
    raise PanicException("index out of bounds")

cli.run = fail
__main__.main()
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 70
    assert done.stderr.count("\n") <= 1
    assert "Traceback" not in done.stderr


def test_without_a_command_there_is_help(command: TactidCommand) -> None:
    done = command()
    assert done.returncode == 2
    assert "identify" in done.stdout
    assert done.stderr == ""


def test_help_has_the_names_of_all_options_in_a_narrow_terminal(
    command: TactidCommand, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    group: Any = get_command(cli.app)
    for name in ("fleet", "view"):
        words = command(name, "--help").stdout.split()
        for parameter in group.get_command(None, name).params:
            if not parameter.hidden and parameter.opts[0].startswith("--"):
                assert ",".join(parameter.opts) in words, name


def test_no_number_loses_digits_in_a_narrow_terminal(
    command: TactidCommand, log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "40")
    assert "…" not in command("identify", log).stdout
