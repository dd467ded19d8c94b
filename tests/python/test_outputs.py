"""Outputs of the commands: none replaces an input, another output or a file of somebody else."""

import os
import stat
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from matplotlib.figure import Figure

import tactid
from conftest import TactidCommand
from tactid._base.files import atomic_path, write_atomically
from tactid._base.output_files import FigureFormat, check_outputs, replaced_outputs
from tactid._cli import paper_run
from tactid._show.drawing import Figures
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
    for name in ("symbolic", "r_fit.svg"):
        (tmp_path / name).symlink_to("run.mcap")
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
        ("identify bag/bag_0.mcap --result bag/metadata.yaml", ("--result", "belongs to the log")),
        ("identify run.mcap --report a.html --result a.html", ("--result and --report", "a.html")),
        ("identify run.mcap --report r.html --figures svg", ("the figure fit of", "and the log")),
        (
            "identify run.mcap --result r_point.pdf --report r.html --figures pdf",
            ("--result and the figure point of the report",),
        ),
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


def test_a_file_beside_an_experiment_is_no_part_of_a_bag(tmp_path: Path) -> None:
    experiment = tmp_path / "e.toml"
    experiment.touch()
    check_outputs({"--result": tmp_path / "metadata.yaml"}, {"the experiment": experiment})


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


@pytest.mark.parametrize(
    ("arguments", "ending"),
    [
        ("identify run.mcap --estimates x.json", ".mcap"),
        ("identify run.mcap --result x.mcap", ".json"),
        ("identify run.mcap --report x.pdf", ".html"),
        ("compare run.mcap --result x", ".json"),
        ("simulate --out x.db3", ".mcap"),
        ("calibrate --unloaded run.mcap --urdf robot.urdf --out x.json", ".toml"),
        ("view run.mcap --save x.mcap", ".rrd"),
        ("fleet-report run.mcap --out x.pdf", ".html"),
    ],
)
def test_an_output_whose_name_promises_another_format_is_refused(
    command: TactidCommand, inputs: Path, arguments: str, ending: str
) -> None:
    expected = f"{arguments.rpartition('--')[2]}: expected a name that ends in {ending}"
    assert_refused_untouched(command, inputs, arguments, expected)


@pytest.mark.parametrize(
    "arguments",
    [
        "compensate run.mcap --out copy.mcap",
        "excite --urdf robot.urdf --out motion.mcap",
        "paper --out run_1.db3",
    ],
)
def test_a_folder_that_has_the_name_of_a_log_is_refused(
    command: TactidCommand, inputs: Path, arguments: str
) -> None:
    out = arguments.rpartition(" ")[2]
    expected = f"--out {out}: expected the name of the folder to write, without {Path(out).suffix}"
    assert_refused_untouched(command, inputs, arguments, expected)


def test_a_method_writes_no_file_whose_name_promises_another_format(
    log: Path, tmp_path: Path
) -> None:
    result = tactid.identify(log)
    for write, name, ending in (
        (result.write_result, "x.mcap", ".json"),
        (result.write_estimates, "x.json", ".mcap"),
    ):
        with pytest.raises(tactid.ArgumentError, match=rf"`path` .*{name}: .* ends in {ending}$"):
            write(tmp_path / name)
    assert not any(tmp_path.iterdir())


MARKS = {
    ".mcap": b"\x89MCAPtactid ",
    ".json": b'{"schema": "tactid.result/3"}',
    ".html": b'<!doctype html><meta name="generator" content="tactid 0">',
    ".png": b"\x89PNG Software\0tactid",
}
"""What shows that tactid has written a file."""


def earlier_run(folder: Path) -> Path:
    """Returns a folder with results of an earlier run, and two files that no run writes."""
    folder.mkdir()
    figures = [f"figure_{number:02}.png" for number in range(5, 11)]
    for name in ("run.mcap", "result.json", "report.html", *figures, "figure_99.png", "notes.txt"):
        (folder / name).write_bytes(MARKS.get(Path(name).suffix, b"") + b"earlier")
    return folder


def test_a_command_says_what_it_replaces_and_never_what_tactid_has_not_written(
    command: TactidCommand, inputs: Path
) -> None:
    identify = ("identify", "run.mcap", "--urdf", "robot.urdf", "--estimates", "e.mcap")
    identify += ("--result", "r.json", "--report", "r.html", "--figures", "png")
    first = command(*identify)
    assert "earlier run" not in first.stderr
    assert (inputs / "r.html").exists(), first.stderr
    second = command(*identify)
    assert "Files of an earlier run were replaced: r.json, r.html, e.mcap" in second.stderr
    assert "Wrote r.json, r.html" in second.stderr
    broken = command("identify", "e.toml", "--result", "r.json")
    assert broken.returncode != 0
    assert "earlier run" not in broken.stderr
    of_others = (inputs / "run.mcap").read_bytes().replace(b"tactid", b"others", 1)
    for name, held in (("mine.mcap", of_others), ("mine.json", b"My notes on tactid.\n")):
        (inputs / name).write_bytes(held)
        assert_refused_untouched(
            command, inputs, f"identify run.mcap --estimates {name}", "tactid has not written it"
        )


@pytest.mark.parametrize("form", ["png", "svg", "pdf"])
def test_figures_of_an_earlier_run_are_replaced(tmp_path: Path, form: FigureFormat) -> None:
    figures = Figures(form)
    figures.html("fit", Figure(), "")
    (figure,) = figures.write(tmp_path / "r.html", "")
    assert replaced_outputs({"the figure": figure}) == [figure]
    figure.write_bytes(figure.read_bytes().replace(b"tactid", b"others"))
    with pytest.raises(tactid.ArgumentError, match="tactid has not written it"):
        replaced_outputs({"the figure": figure})


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
    long = f"new/{300 * 'n'}/folder"
    assert_refused(command("paper", "--out", long, "--duration", "0.1"), "File name too long")
    assert [path.name for path in tmp_path.rglob("*")] == ["mine"]


def test_a_new_run_removes_only_what_it_writes(command: TactidCommand, tmp_path: Path) -> None:
    folder = earlier_run(tmp_path / "mine")
    done = command("paper", "--out", "mine", "--duration", 3, "--estimator", "least-squares")
    assert done.returncode == 0, done.stderr
    earlier = {file.name for file, held in contents(folder).items() if held.endswith(b"earlier")}
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


def test_an_interrupted_write_leaves_the_earlier_file_and_no_other(tmp_path: Path) -> None:
    path = tmp_path / "result.json"
    path.write_text("earlier")

    def interrupt() -> None:
        with atomic_path(path) as temporary:
            temporary.write_text("half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupt()
    assert contents(tmp_path) == {path: b"earlier"}


def test_an_error_of_the_writer_names_the_file_as_it_was_given(tmp_path: Path) -> None:
    path = tmp_path / "payload.mcap"
    with pytest.raises(tactid.LogError) as error, atomic_path(path) as temporary:
        raise tactid.LogError(f"cannot write {temporary}: No space left on device")
    assert str(error.value) == f"cannot write {path}: No space left on device"


@pytest.mark.parametrize("exists", [True, False])
def test_the_target_of_a_link_is_replaced_and_the_link_stays(tmp_path: Path, exists: bool) -> None:
    link, target = tmp_path / "link", tmp_path / "folder/target"
    target.parent.mkdir()
    if exists:
        target.write_text("earlier")
    link.symlink_to("folder/target")
    check_outputs({"--report": link}, {})
    write_atomically(link, "text")
    assert os.readlink(link) == "folder/target"
    assert contents(tmp_path) == {link: b"text", target: b"text"}


def test_a_link_into_a_missing_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to("missing/target")
    with pytest.raises(tactid.ArgumentError, match=r"missing of --report does not exist"):
        check_outputs({"--report": tmp_path / "link"}, {})


def test_a_link_to_itself_is_refused(tmp_path: Path) -> None:
    link = tmp_path / "loop"
    link.symlink_to("loop")
    with pytest.raises(tactid.ArgumentError, match=r"loop is a link that leads to itself"):
        check_outputs({"--report": link}, {})


def test_a_named_pipe_is_written_through(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    check_outputs({"--report": pipe}, {})
    with ThreadPoolExecutor() as pool:
        read = pool.submit(pipe.read_bytes)
        write_atomically(pipe, "text")
    assert read.result() == b"text"
    assert pipe.is_fifo()


def test_a_named_pipe_that_comes_meanwhile_is_written_through(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    with ThreadPoolExecutor() as pool:
        with atomic_path(pipe) as temporary:
            temporary.write_text("text")
            os.mkfifo(pipe)
            read = pool.submit(pipe.read_bytes)
        assert read.result() == b"text"
    assert contents(tmp_path) == {}
    assert pipe.is_fifo()


def test_a_file_that_takes_the_place_of_a_pipe_is_left(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    writing = atomic_path(pipe)
    writing.__enter__().write_text("text")
    pipe.unlink()
    pipe.write_text("of somebody else")
    with pytest.raises(tactid.ArgumentError, match="has become a file"):
        writing.__exit__(None, None, None)
    assert contents(tmp_path) == {pipe: b"of somebody else"}


def test_a_folder_of_temporary_files_that_is_missing_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "missing"))
    with pytest.raises(FileNotFoundError) as error:
        write_atomically(Path("/dev/null"), "text")
    assert error.value.filename == "the folder of temporary files (TMPDIR)"


def test_a_full_device_is_named_and_stays(tmp_path: Path) -> None:
    """The null device, too, which may be both outputs."""
    full, null = tmp_path / "full", tmp_path / "null"
    try:  # never /dev/full itself: a superuser would replace it
        os.mknod(full, stat.S_IFCHR | 0o600, os.makedev(1, 7))
        os.mknod(null, stat.S_IFCHR | 0o600, os.makedev(1, 3))
        full.open("wb").close()
    except OSError:
        pytest.skip("only a superuser makes devices")
    check_outputs({"--report": null, "--result": null}, {"the log": null})
    write_atomically(null, "text")
    with pytest.raises(OSError, match="No space left on device") as error:
        write_atomically(full, "text")
    assert error.value.filename == str(full)
    assert full.is_char_device()
    assert null.is_char_device()


def test_a_redirected_standard_output_is_written_through(
    tmp_path: Path,
) -> None:
    """``/dev/stdout`` is then a file, and it keeps what the command prints."""
    code = (
        "from pathlib import Path; from tactid._base.files import write_atomically;"
        "print('first'); write_atomically(Path('/dev/stdout'), 'second\\n'); print('third')"
    )
    with (tmp_path / "printed").open("wb") as printed:
        subprocess.run([sys.executable, "-c", code], stdout=printed, check=True)
    assert (tmp_path / "printed").read_text() == "first\nsecond\nthird\n"


@pytest.mark.parametrize("name", ["report.html", "figure_07.png"])
def test_a_folder_in_the_place_of_a_result_is_refused_before_the_simulation(
    command: TactidCommand, tmp_path: Path, name: str
) -> None:
    earlier_run(tmp_path / "mine")
    (tmp_path / "mine" / name).unlink()
    (tmp_path / "mine" / name).mkdir()
    what = f"{name} in --out mine/{name} is a folder"
    assert_refused_untouched(command, tmp_path, "paper --out mine", what)


def test_a_folder_that_cannot_be_written_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "access", lambda *_: False)  # root may write anywhere
    with pytest.raises(tactid.ArgumentError, match=r"the folder .* of --report cannot be written"):
        check_outputs({"--report": tmp_path / "report.html"}, {})


def test_a_file_that_is_replaced_keeps_its_permissions(tmp_path: Path) -> None:
    private = tmp_path / "private.json"
    private.touch(mode=0o600)
    write_atomically(private, "text")
    assert private.stat().st_mode & 0o777 == 0o600
    mask = os.umask(0o027)
    try:
        write_atomically(tmp_path / "new.json", "text")
    finally:
        os.umask(mask)
    assert (tmp_path / "new.json").stat().st_mode & 0o777 == 0o640


def test_a_name_may_be_as_long_as_the_disk_allows(tmp_path: Path) -> None:
    longest = tmp_path / ("a" * 250 + ".json")
    write_atomically(longest, "text")
    assert longest.read_text() == "text"
