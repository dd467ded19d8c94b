"""Ctrl-C ends every command with exit code 130 and one line, whenever it comes."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
import typer
from mcap.writer import Writer

from tactid._cli import cli, console, info_command

INTERRUPTING = """
import os, signal, sys

class Interrupt:
    def find_spec(self, name, path=None, target=None):
        if name == os.environ["INTERRUPT_AT"]:
            os.kill(os.getpid(), signal.SIGINT)

sys.meta_path.insert(0, Interrupt())
"""
"""A module that Python runs first; it sends SIGINT when a module is about to be imported."""


def interrupted_at(
    module: str, folder: Path, *arguments: str
) -> "subprocess.CompletedProcess[str]":
    (folder / "sitecustomize.py").write_text(INTERRUPTING, encoding="utf-8")
    environment = os.environ | {"PYTHONPATH": str(folder), "INTERRUPT_AT": module}
    return subprocess.run(
        [sys.executable, *arguments], env=environment, capture_output=True, text=True, check=False
    )


SCRIPT = str(Path(sys.executable).with_name("tactid"))


@pytest.mark.parametrize(
    ("module", "arguments"),
    [
        ("numpy", ["-m", "tactid", "--version"]),
        ("numpy", [SCRIPT, "--version"]),
        ("tactid._native", ["-m", "tactid", "info", "run.mcap"]),
        ("typer", [SCRIPT, "identify", "run.mcap"]),
    ],
)
def test_ctrl_c_while_libraries_load_is_one_line(
    tmp_path: Path, module: str, arguments: list[str]
) -> None:
    done = interrupted_at(module, tmp_path, *arguments)
    assert (done.returncode, done.stderr) == (130, "tactid: interrupted\n")
    assert done.stdout == ""


def test_a_program_that_imports_the_package_is_interrupted_as_usual(tmp_path: Path) -> None:
    program = (
        "import signal\n"
        "try:\n    import tactid\n    tactid.calibrate\n"
        "except KeyboardInterrupt:\n    print('caught')\n"
        "assert signal.getsignal(signal.SIGINT) is signal.default_int_handler\n"
    )
    done = interrupted_at("tactid._api.calibrating", tmp_path, "-c", program)
    assert (done.returncode, done.stdout) == (0, "caught\n"), done.stderr


def interrupt(*_: object) -> None:
    raise KeyboardInterrupt


def test_ctrl_c_that_a_command_does_not_handle_is_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(info_command, "contents", interrupt)
    monkeypatch.setattr(sys, "argv", ["tactid", "info", "run.mcap"])
    assert cli.run() == 130
    assert capsys.readouterr().err == "tactid: interrupted\n"


def test_ctrl_c_while_files_are_written_names_them(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    paths = [tmp_path / name for name in ("a.json", "b.html", "c.mcap")]
    cases = [
        (0, f"did not write {paths[0]}, {paths[1]} and {paths[2]}"),
        (1, f"wrote {paths[0]}; did not write {paths[1]} and {paths[2]}"),
        (2, f"wrote {paths[0]} and {paths[1]}; did not write {paths[2]}"),
    ]
    for stopped, outcome in cases:
        writers = dict.fromkeys(paths, Path.touch) | {paths[stopped]: interrupt}
        with pytest.raises(typer.Exit) as end:
            console.write_files(writers)
        assert end.value.exit_code == 130
        assert capsys.readouterr().err == f"tactid: interrupted: {outcome}\n"
        assert [path.exists() for path in paths] == [index < stopped for index in range(3)]
        for path in paths:
            path.unlink(missing_ok=True)
    assert console.write_files({}) == []


def test_files_beside_another_are_named(capsys: pytest.CaptureFixture[str]) -> None:
    report, figure, result = (Path(name) for name in ("r.html", "r_fit.svg", "r.json"))
    writers = {report: lambda _path: [figure], result: lambda _path: None}
    with console.printing_after(writers, []):
        pass
    assert capsys.readouterr().err == "Wrote r.html, r_fit.svg, r.json.\n"


def test_ctrl_c_while_a_result_is_printed_names_the_files(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    path = tmp_path / "a.json"
    cases = (
        (console.printing_before, f"did not write {path}"),
        (console.printing_after, f"wrote {path}"),
    )
    for printing, outcome in cases:
        with pytest.raises(typer.Exit) as end, printing({path: Path.touch}, []):
            interrupt()
        assert end.value.exit_code == 130
        assert capsys.readouterr().err == f"tactid: interrupted: {outcome}\n"
        assert path.exists() == (outcome == f"wrote {path}")


def test_files_are_written_where_nobody_reads_the_result(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    with pytest.raises(BrokenPipeError), console.printing_before({path: Path.touch}, []):
        raise BrokenPipeError
    assert path.exists()


def test_ctrl_c_while_arguments_are_read_is_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(cli.Group, "parse_args", interrupt)
    monkeypatch.setattr(sys, "argv", ["tactid", "info", "run.mcap"])
    assert cli.run() == 130
    assert capsys.readouterr().err == "tactid: interrupted\n"


def test_sigterm_ends_a_command_with_143_and_leaves_nothing_half_written(
    log: Path, tmp_path: Path
) -> None:
    """As a service manager ends it: the signal comes while the result is being written."""
    slow = (
        "import os, signal, sys\n"
        "from pathlib import Path\n"
        "from tactid import __main__\n"
        "def write(path, content):\n"
        "    path.open('wb').write(content[:9])\n"
        "    os.kill(os.getpid(), signal.SIGTERM)\n"
        "Path.write_bytes = write\n"
        f"sys.argv = ['tactid', 'identify', {str(log)!r}, '--result', 'r.json']\n"
        "__main__.main()\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", slow], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 143, done.stderr
    assert done.stderr.splitlines()[-1] == "tactid: terminated: did not write r.json"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("name", "code"), [("SIGINT", 130), ("SIGTERM", 143)])
def test_an_interruption_that_a_library_turns_into_its_own_error_is_one_line(
    tmp_path: Path, name: str, code: int
) -> None:
    """As matplotlib does while it is loaded, and libraries in C++ do."""
    program = (
        "import os, signal, sys\n"
        "sys.argv = ['tactid', 'info', 'run.mcap']\n"
        "from tactid import __main__\n"
        "from tactid._cli import info_command\n"
        "def swallow(_):\n"
        f"    try:\n        os.kill(os.getpid(), signal.{name})\n"
        "    except BaseException:\n        pass\n"
        "    raise ValueError('invalid bounding box')\n"
        "info_command.contents = swallow\n"
        "__main__.main()\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    word = "interrupted" if name == "SIGINT" else "terminated"
    assert (done.returncode, done.stderr) == (code, f"tactid: {word}\n")


def test_ctrl_c_while_numpy_is_loaded_is_no_panic() -> None:
    program = (
        "import sys, tactid\n"
        "class Interrupting:\n"
        "    def find_spec(self, name, path, target=None):\n"
        "        if name == 'numpy':\n            raise KeyboardInterrupt\n"
        "sys.meta_path.insert(0, Interrupting())\n"
        "try:\n    tactid.info\n"
        "except KeyboardInterrupt:\n    print('caught')\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "caught\n", "")


def test_ctrl_c_ends_the_opening_of_a_log_without_index(tmp_path: Path) -> None:
    """Such a log is read to its end, and its chunks hold back the signal if nothing looks."""
    path = tmp_path / "long.mcap"
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=1000)
        writer.start("ros2", "")
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data\n")
        channel = writer.register_channel("/text", "cdr", schema)
        for k in range(2000):
            writer.add_message(channel, k, bytes(1000), k)
    whole = path.read_bytes()  # without its end
    begin = whole.find(b"\x06")
    with path.open("ab") as file:
        for _ in range(400):
            file.write(whole[begin:])
    program = (
        "import os, signal, threading\n"
        "from tactid import info\n"
        "threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)).start()\n"
        f"try:\n    info({str(path)!r})\n"
        "except KeyboardInterrupt:\n    print('caught')\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout) == (0, "caught\n"), done.stderr
