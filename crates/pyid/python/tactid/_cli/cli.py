"""The commands of ``tactid``. Results go to standard output, all else to standard error."""

import tempfile
from pathlib import Path
from typing import Annotated

import typer
from typer.exceptions import TyperException

from tactid._base import terminal
from tactid._base.errors import ArgumentError, InternalError, TactidError
from tactid._base.files import new_folder
from tactid._base.output_files import FigureFormat
from tactid._base.startup import ending, interruption
from tactid._cli import log_contents
from tactid._cli.calibrate_command import calibrate_arm
from tactid._cli.compare_command import compare_recording
from tactid._cli.compensate_command import compensate_log
from tactid._cli.console import (
    FLAG,
    Command,
    Group,
    Stream,
    check_files,
    interruptible,
    notes,
    print_whole,
    print_written,
    progress,
    reporting_partial_log,
)
from tactid._cli.excite_command import excite
from tactid._cli.fleet_command import identify_fleet, report_fleet
from tactid._cli.identify_command import identify_recording
from tactid._cli.live_command import LiveCommand, run_live
from tactid._cli.number_lists import NumberListCommand
from tactid._cli.simulate_command import run_simulation
from tactid._cli.study_command import run_study
from tactid._native import Experiment, __version__, info as log_info, set_log_memory
from tactid._options.options import Estimator
from tactid._read.recordings import contents
from tactid._read.tables import Table
from tactid._results import table

EXIT_CODES = (
    "Exit codes: 0, the payload is identified; 1, the data contradict the result (the reason is"
    " printed first) or determine none of its values, or it cannot be given in the format that was"
    " asked for; 2, an option, a file"
    " or the recording is wrong; 70, an internal error; 130, interrupted by Ctrl-C; 141, standard"
    " output was closed; 143, ended by SIGTERM."
)

app = typer.Typer(
    name="tactid",
    help="Identifies what a robot is holding: mass, centre of mass and inertia.",
    cls=Group,
    no_args_is_help=True,
    epilog=EXIT_CODES,
    add_completion=False,
    pretty_exceptions_enable=False,
)


def run() -> int:
    """Runs the command line and returns the exit code; every expected error is one line."""
    try:
        return app(standalone_mode=False) or 0
    except TyperException as error:
        # Without a command typer has shown the help, and the message is empty.
        # Typer begins the reason with the class of its own exception.
        message = error.format_message().replace(": Value error, ", ": ")
        if isinstance(error.__cause__, ValueError) and hasattr(error.__cause__, "errors"):
            given = error.__cause__.errors()[0]["input"]  # Pydantic's reason is without the value.
            message = message.replace("Invalid value", f"Invalid value {given!r}", 1)
        return _fail(message) if message else 2
    except InternalError:
        raise
    except TactidError as error:
        return _fail(error.worded("command-line"))
    except OSError as error:
        if error.filename is not None:
            return _fail(f"cannot use {error.filename}: {error.strerror}")
        if error.strerror or isinstance(error, BrokenPipeError):
            raise  # of a standard stream: every file of ours is named
        return _fail(str(error))


def _fail(message: str) -> int:
    """Reports an error, unless a signal has caused it, and returns the exit code."""
    if (signalled := interruption()) is not None:
        word, code = ending(signalled)
        terminal.report(word)
        return code
    terminal.report(f"error: {message}")
    return 2


def _show_version(requested: bool) -> None:
    if requested:
        print(f"tactid {__version__}")
        raise typer.Exit


def _set_log_memory(mebibytes: float | None) -> None:
    if mebibytes is None:
        return
    if not mebibytes > 0:
        raise ArgumentError(f"--log-memory is {mebibytes:g}: expected more than 0 MiB")
    set_log_memory(mebibytes)


@app.callback()
def _main(
    version: Annotated[
        bool,
        typer.Option(
            "--version",
            callback=_show_version,
            is_eager=True,
            help="Shows the version and exits.",
            metavar=FLAG,
        ),
    ] = False,
    log_memory: Annotated[
        float | None,
        typer.Option(
            callback=_set_log_memory,
            help="Memory that the messages of a log may occupy at once, MiB: 256. A log that needs"
            " more is refused.",
            metavar="MIB",
        ),
    ] = None,
) -> None:
    """Takes the options that stand before a command."""


@app.command("paper", cls=NumberListCommand)
def run_paper(
    out: Annotated[Path, typer.Option(help="Folder for the log and the results.")] = Path(
        "tactid-paper"
    ),
    estimator: Annotated[
        Estimator, typer.Option(help="The paper's filter, or least squares.")
    ] = "nlms",
    frequency: Annotated[
        float | None, typer.Option(help="Frequency of the excitation, Hz: 0.2 in the paper's text.")
    ] = None,
    posture: Annotated[
        str | None,
        typer.Option(
            help="identifiable, table1, or six joint angles in rad: 0,-1.2,1.6,-0.4,1.57,0.",
            metavar="A,A,A,A,A,A",
        ),
    ] = None,
    seed: Annotated[
        int | None, typer.Option(min=0, max=2**63 - 1, help="Seed of the noise on the command.")
    ] = None,
    duration: Annotated[
        float | None, typer.Option(help="Simulated time, s: 300 in the paper.")
    ] = None,
    figures: Annotated[FigureFormat, typer.Option(help="Format of the figures.")] = "png",
) -> None:
    """Runs the paper's experiment: simulates, logs, identifies, and shows Table 2."""
    from tactid._cli import paper_run  # imports matplotlib, which takes a while to load

    experiment = Experiment.paper().replace(
        frequency=frequency,
        posture=None if posture is None else _read_posture(posture),
        seed=seed,
        duration=duration,
    )
    files = paper_run.Files(out, figures)
    with new_folder(out, "--out"), reporting_partial_log(files.log), progress("simulating") as done:
        replaced = check_files({f"{file.name} in --out": file for file in files.written}, {})
        report = paper_run.simulate_into(files, experiment, done)
    with interruptible(f"{files.log} is complete, no result was written"):
        with progress("identifying") as done:
            results = paper_run.identify_all(files.log, experiment.tip, estimator, done)
        outcome = paper_run.Outcome(experiment, report, results, log_info(files.log))
        with notes.status("drawing"):
            outcome.write(files)
    print_whole(table.rich_table(outcome.columns[:1], outcome.truth))
    for remark in outcome.remarks:
        notes.print(remark, markup=False)
    wrote = f"Wrote {files.log}, {files.result}, {files.report} and the figures beside them."
    print_written(wrote, replaced)
    if results[0].is_contradicted:
        raise typer.Exit(1)


def _read_posture(text: str) -> str | list[float]:
    if text.replace("_", "").isalnum() and not text[0].isdigit():
        return text
    try:
        return [float(angle) for angle in text.replace(",", " ").split()]
    except ValueError:
        raise ArgumentError(
            f"--posture is {text!r}: expected identifiable, table1, or joint angles in rad"
        ) from None


app.command("simulate", cls=Command)(run_simulation)
app.command("identify", cls=NumberListCommand, epilog=EXIT_CODES)(identify_recording)
app.command("calibrate", cls=NumberListCommand)(calibrate_arm)
app.command("excite", cls=NumberListCommand)(excite)
app.command("live", cls=LiveCommand)(run_live)
app.command("compensate", cls=NumberListCommand)(compensate_log)
app.command("compare", cls=NumberListCommand)(compare_recording)
app.command("fleet", cls=NumberListCommand)(identify_fleet)
app.command("fleet-report", cls=Command)(report_fleet)
app.command("study", cls=NumberListCommand)(run_study)


@app.command("info", cls=Command)
def show_info(
    log: Annotated[
        Path,
        typer.Argument(
            help="A rosbag2 folder, or an .mcap or .db3 file; a table, a data set of LeRobot, or a"
            " ROS 1 bag."
        ),
    ],
) -> None:
    """Shows the topics of a log, or the columns of a table and what they are known as."""
    found = contents(log)
    is_table = isinstance(found, Table)
    console = Stream()
    shown = log_contents.columns_table(found) if is_table else log_contents.topics_table(found)
    if console.is_terminal:
        console.print(shown, highlight=False)
    else:
        print_whole(shown)
    for line in [] if is_table else log_contents.info_lines(found):
        console.print(line, highlight=False, markup=False, soft_wrap=True)


@app.command("view", cls=Command)
def show_view(
    log: Annotated[
        Path,
        typer.Argument(
            help="A rosbag2 folder, or an .mcap or .db3 file; or a designed motion: the folder that"
            " tactid excite wrote, its trajectory.mcap or trajectory.csv."
        ),
    ],
    result_file: Annotated[
        Path | None,
        typer.Option("--result", help="The result of tactid identify --result for this log."),
    ] = None,
    urdf: Annotated[
        Path | None,
        typer.Option(help="The robot, where the log has no /robot_description, or of a motion."),
    ] = None,
    save: Annotated[
        Path | None, typer.Option(help="An .rrd file to write instead of opening the viewer.")
    ] = None,
    tip: Annotated[
        str | None, typer.Option(help="The frame that holds the payload: the result's by default.")
    ] = None,
) -> None:
    """Shows the robot, the forces that it feels and the payload in the Rerun viewer.

    A designed motion has the joints alone, and needs --urdf.
    """
    inputs = {"the log": log, "--result": result_file, "--urdf": urdf}
    replaced = check_files({"--save": save}, inputs)
    if save is not None and save.suffix != ".rrd":
        raise ArgumentError(f"--save {save}: expected a name that ends in .rrd, which Rerun opens")
    from tactid import _view as viewer

    with tempfile.TemporaryDirectory(prefix="tactid-") as folder:
        recording = save or Path(folder, f"{log.stem}.rrd")
        with interruptible("nothing was written"), notes.status("reading"):
            remarks = viewer.record(log, recording, result=result_file, urdf=urdf, tip=tip)
        for remark in remarks:
            notes.print(f"tactid: note: {remark}", style="yellow")
        if save is None:
            with interruptible("the viewer is closed"):
                viewer.open_viewer(recording)
        else:
            print_written(f"Wrote {save}: open it with rerun {save}", replaced)
