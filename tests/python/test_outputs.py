"""Outputs of the commands: none replaces an input, another output or a file of somebody else."""

import os
from pathlib import Path

import pytest

import tactid
from conftest import TactidCommand
from tactid import paper_run
from tactid.files import write_atomically
from tactid.output_files import check_outputs
from test_cli import assert_refused


def contents(folder: Path) -> dict[Path, bytes]:
    """Returns every file below a folder with its bytes."""
    return {file: file.read_bytes() for file in sorted(folder.rglob("*")) if file.is_file()}


def assert_refused_untouched(
    command: TactidCommand, folder: Path, arguments: str, *parts: str
) -> None:
    before = contents(folder)
    assert_refused(command(*arguments.split()), *parts)
    assert contents(folder) == before


@pytest.fixture
def inputs(tmp_path: Path, log: Path) -> Path:
    """A folder with a log, a bag, a robot and an experiment, and links to the log."""
    for name in ("run.mcap", "unloaded.mcap", "bag/bag_0.mcap"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(log.read_bytes())
    (tmp_path / "symbolic").symlink_to("run.mcap")
    os.link(tmp_path / "run.mcap", tmp_path / "hard")
    (tmp_path / "bag/linked.mcap").symlink_to("../unloaded.mcap")
    (tmp_path / "robot.urdf").write_text(tactid.Experiment.paper().urdf)
    (tmp_path / "e.toml").write_text("duration_s = 0.1\n[robot]\nurdf = 'robot.urdf'\n")
    return tmp_path


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        ("identify run.mcap --estimates run.mcap", ("--estimates and the log", "run.mcap")),
        ("identify run.mcap --report ./bag/../run.mcap", ("--report and the log",)),
        ("identify run.mcap --result symbolic", ("--result and the log", "symbolic")),
        ("identify run.mcap --result hard", ("--result and the log", "hard")),
        ("identify bag --estimates bag/bag_0.mcap", ("--estimates", "the folder of the log")),
        ("identify bag --result bag/new.json", ("--result", "the folder of the log")),
        ("identify bag --estimates unloaded.mcap", ("--estimates", "the folder of the log")),
        ("identify run.mcap --urdf robot.urdf --report robot.urdf", ("--report and --urdf",)),
        (
            "identify run.mcap --unloaded unloaded.mcap --estimates unloaded.mcap",
            ("--estimates and --unloaded",),
        ),
        (
            "identify run.mcap --unloaded bag --estimates bag/bag_0.mcap",
            ("--estimates", "the folder of --unloaded"),
        ),
        ("identify run.mcap --report a.html --result a.html", ("--result and --report", "a.html")),
        ("simulate e.toml --out e.toml", ("--out and the experiment", "e.toml")),
        ("simulate e.toml --out robot.urdf", ("--out and the experiment's URDF",)),
        ("view run.mcap --save run.mcap", ("--save and the log",)),
        ("view run.mcap --save robot.urdf --urdf robot.urdf", ("--save and --urdf",)),
        ("view run.mcap --save e.toml --result e.toml", ("--save and --result",)),
    ],
)
def test_an_output_that_replaces_another_file_of_the_command_is_refused(
    command: TactidCommand, inputs: Path, arguments: str, parts: tuple[str, ...]
) -> None:
    assert_refused_untouched(command, inputs, arguments, *parts)


@pytest.mark.parametrize("folder", ["nodir", "text", "taken"])
@pytest.mark.parametrize(
    ("arguments", "option"),
    [
        ("identify missing.mcap --report", "--report"),
        ("identify missing.mcap --result", "--result"),
        ("identify missing.mcap --estimates", "--estimates"),
        ("simulate --out", "--out"),
        ("view missing.mcap --save", "--save"),
    ],
)
def test_an_output_that_cannot_be_written_is_refused_before_any_reading(
    command: TactidCommand, tmp_path: Path, arguments: str, option: str, folder: str
) -> None:
    (tmp_path / "text").touch()
    (tmp_path / "taken/file").mkdir(parents=True)
    said = {
        "nodir": f"the folder nodir of {option} does not exist",
        "text": f"the folder text of {option} is not a folder",
        "taken": f"{option} taken/file is a folder",
    }
    assert_refused_untouched(command, tmp_path, f"{arguments} {folder}/file", said[folder])


def earlier_run(folder: Path) -> Path:
    """Returns a folder with results of an earlier run, and two files that no run writes."""
    folder.mkdir()
    figures = [f"figure_{number:02}.png" for number in range(5, 11)]
    for name in ("run.mcap", "result.json", "report.html", *figures, "figure_99.png", "notes.txt"):
        (folder / name).write_text(f"earlier {name}")
    return folder


@pytest.mark.parametrize("arguments", ["--posture 1,2", "--frequency 1e9", "--posture 0,0,0,0,0,9"])
def test_a_refused_experiment_leaves_the_earlier_run(
    command: TactidCommand, tmp_path: Path, arguments: str
) -> None:
    earlier_run(tmp_path / "mine")
    assert_refused_untouched(command, tmp_path, f"paper --out mine --duration 1 {arguments}")


def test_a_refused_experiment_leaves_no_empty_folder(
    command: TactidCommand, tmp_path: Path
) -> None:
    (tmp_path / "mine").mkdir()
    for out in ("new/folder", "mine/new", "mine"):
        assert_refused(command("paper", "--out", out, "--posture", "1,2"), "posture")
    assert [path.name for path in tmp_path.rglob("*")] == ["mine"]


def test_a_new_run_removes_only_what_it_writes(command: TactidCommand, tmp_path: Path) -> None:
    folder = earlier_run(tmp_path / "mine")
    done = command("paper", "--out", "mine", "--duration", 3, "--estimator", "least-squares")
    assert done.returncode == 0, done.stderr
    earlier = {file.name for file, held in contents(folder).items() if held[:7] == b"earlier"}
    assert earlier == {"figure_99.png", "notes.txt"}


def test_an_interrupted_run_leaves_no_results_of_an_earlier_log(tmp_path: Path) -> None:
    """The log is replaced when the simulation starts, and from then on the results are wrong."""
    files = paper_run.Files(earlier_run(tmp_path / "mine"))

    def interrupt(_: float) -> None:
        raise KeyboardInterrupt

    experiment = tactid.Experiment.paper().replace(duration=1.0)
    with pytest.raises(KeyboardInterrupt):
        paper_run.simulate_into(files, experiment, interrupt)
    names = {file.name for file in files.folder.iterdir()}
    assert names == {"run.mcap", "figure_99.png", "notes.txt"}


def test_a_file_that_cannot_be_made_is_named_as_it_was_given(tmp_path: Path) -> None:
    """A folder that is gone by then: the temporary file beside it is nobody's business."""
    with pytest.raises(FileNotFoundError) as error:
        write_atomically(tmp_path / "gone/report.html", "text")
    assert error.value.filename == str(tmp_path / "gone/report.html")


def test_a_folder_that_cannot_be_written_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "access", lambda *_: False)  # root may write anywhere
    with pytest.raises(tactid.ArgumentError, match=r"the folder .* of --report cannot be written"):
        check_outputs({"--report": tmp_path / "report.html"}, {})
