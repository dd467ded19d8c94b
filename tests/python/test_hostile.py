"""Hostile input ends in one error of tactid, whatever Python or the system would raise."""

import errno
import os
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

import bombs
import tactid
from conftest import TactidCommand
from tactid import __main__
from tactid._cli import info_command
from test_cli import assert_refused

NO_TEXT = os.fsdecode(b"\xff")
"""What Python makes of bytes that are no text, such as those of the name of a file."""


def assert_ordinary(call: Callable[[], object]) -> None:
    """Asserts that a call raises an error of tactid that is no fault of tactid."""
    with pytest.raises(tactid.TactidError) as error:
        call()
    assert not isinstance(error.value, tactid.InternalError)


def from_urdf(urdf: str = "<robot/>", **options: str) -> tactid.Manipulator:
    return tactid.Manipulator.from_urdf(urdf, **options)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "call",
    [
        lambda: tactid.info(NO_TEXT),
        lambda: from_urdf(NO_TEXT),
        lambda: from_urdf(f"<robot name='{NO_TEXT}'/>"),
        lambda: from_urdf(base=NO_TEXT),
        lambda: from_urdf(base_link=NO_TEXT),
        lambda: tactid.Experiment.from_toml(NO_TEXT),
        lambda: tactid.Experiment.paper().replace(robot={"tool": NO_TEXT}),
        lambda: tactid.Experiment.paper().replace(robot={NO_TEXT: "tool0"}),
        lambda: tactid.Experiment.paper().replace(posture=NO_TEXT),
    ],
)
def test_characters_that_are_no_text_are_an_error_of_tactid(call: Callable[[], object]) -> None:
    assert_ordinary(call)


def test_names_that_are_no_text_are_an_error_of_tactid(
    robot: tactid.Manipulator, log: Path
) -> None:
    calls: list[Callable[[], object]] = [
        lambda: tactid.identify(log, tip=NO_TEXT),
        lambda: tactid.read(log, NO_TEXT),
        lambda: robot.kinematics(NO_TEXT, [0.0] * robot.dof),
        lambda: robot.without_subtree(NO_TEXT),
        lambda: tactid.Identifier(robot, NO_TEXT),
    ]
    for call in calls:
        assert_ordinary(call)


@pytest.mark.parametrize("size", [-1, 0, 11, 2**80, -(2**80)])
@pytest.mark.parametrize("kind", [tactid.Nlms, tactid.Rls])
def test_a_number_of_parameters_out_of_range_is_named(
    kind: type[tactid.Nlms | tactid.Rls], size: int
) -> None:
    with pytest.raises(tactid.ArgumentError, match=rf"`size` is {size}: expected 1 to 10"):
        kind(size)


def test_a_robot_with_many_links_lists_the_similar_ones() -> None:
    links = "".join(f"<link name='link_{index}'/>" for index in range(1001))
    joints = "".join(
        f"<joint name='joint_{index}' type='fixed'><parent link='link_{index}'/>"
        f"<child link='link_{index + 1}'/></joint>"
        for index in range(1000)
    )
    robot = tactid.Manipulator.from_urdf(f"<robot name='chain'>{links}{joints}</robot>")
    with pytest.raises(tactid.ModelError) as error:
        robot.kinematics("link_5000", [])
    message = str(error.value)
    assert "no link `link_5000`" in message
    assert "link_500" in message
    assert message.endswith(" and 993 more")
    assert len(message) < 200


def test_a_gripper_that_would_close_for_ever_is_refused_with_its_line() -> None:
    for speed in (1e-12, 9e-5, 0.02):
        with pytest.raises(tactid.ExperimentError, match=r"line 3: gripper.closing_speed_m_s"):
            tactid.Experiment.from_toml(
                f"duration_s = 1.0\n[gripper]\nclosing_speed_m_s = {speed}\n"
            )
    tactid.Experiment.from_toml("[gripper]\nclosing_speed_m_s = 1e-4\n")
    with pytest.raises(tactid.ExperimentError, match=r"line 2: payload.mass_kg"):
        tactid.Experiment.from_toml("[payload]\nmass_kg = 1e5\n")


def test_a_pipe_is_no_log(command: TactidCommand, tmp_path: Path) -> None:
    """Opening it would wait for its writer."""
    os.mkfifo(tmp_path / "pipe")
    for subcommand in ("info", "identify", "view"):
        refused = command(
            subcommand, "pipe", *(("--save", "a.rrd") if subcommand == "view" else ())
        )
        assert_refused(refused, "pipe", "no regular file")


def test_a_pipe_without_a_writer_is_no_text(command: TactidCommand, tmp_path: Path) -> None:
    """Opening it would wait for its writer, and no signal would end that."""
    os.mkfifo(tmp_path / "pipe")
    arm = "--urdf", "pipe", "--tip", "tool0"
    for arguments in (
        ("identify", "run", *arm),
        ("calibrate", *arm, "--unloaded", "run", "--out", "arm.toml"),
        ("excite", *arm, "--payload-mass-max", "1", "--out", "motion"),
        ("simulate", "pipe"),
    ):
        assert_refused(command(*arguments), "pipe", "no program writes into it")


def test_a_simulation_that_fails_leaves_a_link_and_its_target(tmp_path: Path) -> None:
    """Its log is moved only where it is a file."""
    link, target = tmp_path / "run.mcap", tmp_path / "target.mcap"
    link.symlink_to("target.mcap")
    slippery = tactid.Experiment.paper().replace(duration=5.0, bounds={"grasp_drift_m": 1e-9})
    with pytest.raises(tactid.SimulationError, match=r"run\.mcap"):
        tactid.simulate(slippery, link)
    assert link.is_symlink()
    assert sorted(tmp_path.iterdir()) == [link, target]
    tactid.info(link)


def test_a_fault_of_tactid_ends_with_70_and_is_printed_by_the_panic_hook_alone(
    run_info: Callable[[Exception], int], capsys: pytest.CaptureFixture[str]
) -> None:
    assert issubclass(tactid.InternalError, tactid.TactidError)
    assert run_info(tactid.InternalError("x")) == 70
    assert capsys.readouterr() == ("", "")


def test_a_pipe_whose_reader_leaves_is_named(
    run_info: Callable[[Exception], int], capsys: pytest.CaptureFixture[str]
) -> None:
    """Standard output without a reader ends without a message; an output file is an error."""
    assert run_info(BrokenPipeError(errno.EPIPE, "Broken pipe", "report")) == 2
    assert capsys.readouterr() == ("", "tactid: error: cannot use report: Broken pipe\n")


@pytest.fixture
def run_info(monkeypatch: pytest.MonkeyPatch) -> Callable[[Exception], int]:
    """Runs ``tactid info`` in this process where reading raises an error; gives the exit code."""

    def run(error: Exception) -> int:
        def fail(_log: Path) -> None:
            raise error

        monkeypatch.setattr(info_command, "contents", fail)
        monkeypatch.setattr(sys, "argv", ["tactid", "info", "a"])
        monkeypatch.setenv("MPLBACKEND", "agg")
        return __main__._run()

    return run


def test_the_memory_of_a_log_is_an_option(command: TactidCommand, tmp_path: Path) -> None:
    message = bombs.message(tmp_path)
    refused = command("--log-memory", "100", "view", message, "--save", tmp_path / "drawn.rrd")
    assert refused.returncode == 2
    assert "needs more than 100.0 MiB of memory at once" in refused.stderr
    assert "`tactid --log-memory`" in refused.stderr
    allowed = command("--log-memory", "1000", "view", message, "--save", tmp_path / "drawn.rrd")
    assert "250 MiB, but at most 64 MiB are decoded" in allowed.stderr
    for wrong in ("0", "-1", "nan"):
        assert "--log-memory is" in command("--log-memory", wrong, "info", message).stderr
        with pytest.raises(tactid.ArgumentError, match="expected more than 0"):
            tactid.set_log_memory(float(wrong))
