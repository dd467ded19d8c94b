"""The exit code says whether a result can be used, and the help says what each code means."""

from pathlib import Path

from conftest import TactidCommand
from expectations import Identify


def test_a_result_of_a_wrong_sign_ends_with_1_and_its_finding_first(
    command: TactidCommand, log: Path, tmp_path: Path
) -> None:
    """A format that cannot be given does not prevent the report that was asked for."""
    wrong = ("identify", log, "--wrench-acts-on", "sensor")
    done = command(*wrong)
    assert done.returncode == 1
    assert "-100.0" in done.stdout
    first = done.stderr.splitlines()[0]
    assert first.startswith("The identified mass is negative")
    assert "(`--wrench-acts-on sensor`, or payload where sensor is given)" in first
    assert "Every value is known" not in done.stderr
    report = tmp_path / "report.html"
    for form, more in (("urdf", ("--report", report)), ("mujoco", ()), ("controller", ())):
        done = command(*wrong, "--format", form, *more)
        assert done.returncode == 1
        assert done.stdout == ""
        last = done.stderr.splitlines()[-1]
        assert last.startswith("tactid: error: no ")
        assert "-100 kg" in last
    assert report.exists()


def test_json_and_exit_code_agree(identify: Identify, log: Path) -> None:
    sound = identify(log, "--method", "joint-sensing")
    assert sound["is_contradicted"] is False
    wrong = identify(log, "--gravity", "0", "0", "9.81")
    assert wrong["is_contradicted"] is True
    first = wrong["remarks"][0]
    assert first.startswith("No gravity at all, (")
    assert "m/s² in world axes, explains the wrenches far better than the given one" in first
    (found,) = (each for each in wrong["findings"] if each["kind"] == "wrong_assumption")
    assert (found["text"], found["severity"]) == (first, "contradicts")
    assert max(map(abs, found["values"])) < 0.01


def test_the_help_says_what_the_codes_mean(command: TactidCommand) -> None:
    for arguments in (("--help",), ("identify", "--help")):
        text = " ".join(command(*arguments).stdout.replace("│", " ").split())
        assert "Exit codes: 0, the payload is identified; 1, the data contradict" in text
        assert "<bool>" not in text
    of_live = command("live", "--help").stdout
    assert "Speed of --replay" in of_live
    assert "--ros-argument" not in of_live


def test_every_command_ends_with_2_for_a_file_that_is_not_there(
    command: TactidCommand, tmp_path: Path
) -> None:
    gone = tmp_path / "gone"
    arm = ("--urdf", gone, "--tip", "tool0")
    commands = {
        "simulate": (gone, "--out", tmp_path / "o.mcap"),
        "paper": ("--out", __file__),
        "identify": (gone,),
        "calibrate": (*arm, "--unloaded", gone, "--out", tmp_path / "a.toml"),
        "excite": (*arm, "--out", tmp_path / "m"),
        "compare": (gone,),
        "fleet": (gone,),
        "fleet-report": (gone,),
        "study": (gone,),
        "info": (gone,),
        "view": (gone,),
    }
    listed = command("--help").stdout
    assert all(f"│ {name} " in listed for name in commands)
    for name, arguments in commands.items():
        done = command(name, *arguments)
        assert done.returncode == 2, (name, done.stderr)
        assert done.stderr.count("\n") == 1, (name, done.stderr)
    assert command("unknown").returncode == 2
    assert list(tmp_path.iterdir()) == []
