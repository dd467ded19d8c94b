"""The command in terminals that are not UTF-8, closed or full, and with names that control them."""

import json
import os
import shlex
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

import tactid
from conftest import TactidCommand
from recorded_arm import FIXED
from recordings import state, wrenches, write_bag
from test_cli import assert_refused

Shell = Callable[..., "subprocess.CompletedProcess[bytes]"]

ENCODINGS = {
    "C": {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"},
    "ascii": {"PYTHONIOENCODING": "ascii"},
    "latin-1": {"PYTHONIOENCODING": "latin-1"},
}


@pytest.fixture
def shell(tmp_path: Path, log: Path) -> Shell:
    """Runs a line of the shell in which ``tactid`` is the command and ``$LOG`` a log."""

    def run(line: str, **environment: str) -> "subprocess.CompletedProcess[bytes]":
        called = f'tactid() {{ {shlex.quote(sys.executable)} -m tactid "$@"; }}; {line}'
        return subprocess.run(
            ["bash", "-c", called],
            cwd=tmp_path,
            env=os.environ | {"LOG": str(log)} | environment,
            capture_output=True,
            timeout=60,
            check=False,
        )

    return run


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_a_result_is_readable_in_every_encoding(shell: Shell, encoding: str) -> None:
    done = shell("tactid identify $LOG", **ENCODINGS[encoding])
    assert done.returncode == 0, done.stderr
    table = done.stdout.decode("latin-1" if encoding == "latin-1" else "ascii")
    assert ("kg m²" if encoding == "latin-1" else "kg m2") in table
    assert ("± 95 %" if encoding == "latin-1" else "+-95 %") in table
    _, top, *rows = table.splitlines()
    assert {len(row) for row in rows} == {len(top)}  # the columns are still aligned
    remarks = done.stderr.decode("latin-1" if encoding == "latin-1" else "ascii")
    assert "Every value is known within 1 %." in remarks
    assert "\\x" not in table + remarks


@pytest.mark.parametrize("arguments", ["--help", "calibrate --help", "info $LOG"])
def test_the_help_and_the_topics_are_readable_in_ascii(shell: Shell, arguments: str) -> None:
    done = shell(f"tactid {arguments}", **ENCODINGS["ascii"])
    assert done.returncode == 0, done.stderr
    assert "\\" not in done.stdout.decode("ascii")


@pytest.mark.parametrize("encoding", ["ascii", "latin-1"])
def test_json_keeps_every_character_in_every_encoding(shell: Shell, encoding: str) -> None:
    done = shell("tactid identify $LOG --json --result result.json", **ENCODINGS[encoding])
    assert done.returncode == 0, done.stderr
    printed = json.loads(done.stdout.decode("ascii"))
    assert printed["units"]["inertia"] == "kg m²"


def test_neither_a_name_that_is_not_utf8_nor_a_backend_of_matplotlib_prevents_a_report(
    shell: Shell, tmp_path: Path, log: Path
) -> None:
    (tmp_path / os.fsdecode(b"\xff.mcap")).symlink_to(log)
    done = shell(
        "tactid identify $'\\xff.mcap' --report report.html --result result.json",
        MPLBACKEND="nonsense",
    )
    assert done.returncode == 0, done.stderr
    assert "?.mcap" in (tmp_path / "report.html").read_text(encoding="utf-8")
    json.loads((tmp_path / "result.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize(
    ("line", "code", "says"),
    [
        ("tactid info $LOG >&-", 141, b""),
        ("tactid --help >&-", 141, b""),
        ("tactid simulate e.toml >&- 2>&- <&-", 0, b""),
        ("tactid identify missing.mcap 2>&-", 2, b""),
        ("(tactid --help; echo $? >code) | true; exit $(cat code)", 141, b""),
        ("(tactid identify $LOG 2>&1 >out; echo $? >code) | true; exit $(cat code)", 141, b""),
        (
            "tactid info $LOG >/dev/full",
            2,
            b"tactid: error: cannot use standard output: No space left on device\n",
        ),
    ],
)
def test_a_stream_that_is_closed_or_full(
    shell: Shell, tmp_path: Path, line: str, code: int, says: bytes
) -> None:
    (tmp_path / "e.toml").write_text("duration_s = 0.1\n")
    done = shell(line)
    assert (done.returncode, done.stdout, done.stderr) == (code, b"", says)
    if "simulate" in line:
        assert tactid.info(tmp_path / "run.mcap").duration == pytest.approx(0.099)


def test_files_are_written_though_nobody_reads_what_is_printed(
    shell: Shell, tmp_path: Path
) -> None:
    done = shell("tactid identify $LOG --result result.json >&-")
    assert done.returncode == 141
    json.loads((tmp_path / "result.json").read_text(encoding="utf-8"))


def test_control_characters_in_names_are_escaped(command: TactidCommand, tmp_path: Path) -> None:
    at_rest = state(FIXED, 0.1, 10.0)
    felt = wrenches(at_rest.time, at_rest.wrench, topic="/\x1b[31mred", frame="\x1b]0;title\x07")
    bag = write_bag(tmp_path / "bag", felt)
    done = command("info", bag)
    assert "/\\x1b[31mred" in done.stdout
    assert "\x1b" not in done.stdout
    refused = command("identify", bag, "--method", "tactile")
    assert_refused(refused)
    assert "\x1b" not in refused.stderr
    assert_refused(command("identify", "\x1b[2J.mcap"), "\\x1b[2J.mcap")


@pytest.mark.parametrize("columns", ["99999999", "9" * 5000, "²²", "none"])
def test_an_absurd_width_is_bounded(shell: Shell, columns: str) -> None:
    done = shell("tactid --help", COLUMNS=columns)
    assert done.returncode == 0, done.stderr
    assert max(map(len, done.stdout.splitlines())) < 10_000
