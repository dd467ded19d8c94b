"""A disk that is full, and a folder that is read-only: one error, and nothing half-written."""

import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

import kills


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A disk of 64 kB, smaller than what every command writes."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = shutil.which("mount")
    options = ["-t", "tmpfs", "-o", "size=64k", "tmpfs", str(disk)]
    if mount is None or subprocess.run([mount, *options], capture_output=True).returncode != 0:
        pytest.skip("only a superuser mounts a disk")
    yield disk
    subprocess.run(["umount", str(disk)], check=True)


@pytest.fixture
def inputs(tmp_path: Path) -> kills.Inputs:
    folder = tmp_path / "inputs"
    folder.mkdir()
    return kills.Inputs.create(folder)


def run(
    command: str, inputs: kills.Inputs, folder: Path, prefix: Sequence[str] = ()
) -> "subprocess.CompletedProcess[str]":
    """Runs a command that writes into a folder."""
    arguments = [*prefix, sys.executable, "-m", "tactid", command, *inputs.arguments(command)]
    return subprocess.run(arguments, cwd=folder, capture_output=True, text=True)


@pytest.fixture
def without_privileges() -> list[str]:
    """What begins the command line of a process that permissions hold for."""
    if os.geteuid() != 0:
        return []
    program = shutil.which("setpriv")
    if program is None:
        pytest.skip("a superuser may write everywhere")
    return [program, "--inh-caps=-all", "--bounding-set=-all"]


def test_a_full_disk_is_named_and_holds_no_half_of_a_file(
    small_disk: Path, inputs: kills.Inputs
) -> None:
    for command in kills.DURATION_S:
        done = run(command, inputs, small_disk)
        last = done.stderr.splitlines()[-1]
        assert done.returncode == 2, f"{command}: {done.stderr}"
        assert last.startswith("tactid: error: "), f"{command}: {done.stderr}"
        assert "No space left on device" in last, f"{command}: {done.stderr}"
        has_log = any(path.name == "run.mcap" for path in small_disk.iterdir())
        assert last.endswith("; run.mcap holds the run up to here") is has_log, last
        assert list(kills.faults(small_disk, signal.SIGINT)) == [], command
        assert inputs.present() == inputs.digests
        for path in small_disk.iterdir():
            shutil.rmtree(path) if path.is_dir() else path.unlink()


def test_a_folder_that_is_read_only_is_named_before_the_work(
    tmp_path: Path, inputs: kills.Inputs, without_privileges: list[str]
) -> None:
    folder = tmp_path / "read-only"
    folder.mkdir(mode=0o500)
    for command in kills.DURATION_S:
        done = run(command, inputs, folder, without_privileges)
        assert done.returncode == 2, f"{command}: {done.stderr}"
        assert "cannot be written" in done.stderr, f"{command}: {done.stderr}"
        assert done.stderr.count("\n") == 1, f"{command}: {done.stderr}"
