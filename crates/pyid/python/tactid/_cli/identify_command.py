"""The command ``tactid identify``: from a recording to the payload and the reasons to trust it.

Its parameters are the options of an identification, and those below, which choose the output.
"""

import shlex
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from functools import partial
from pathlib import Path
from typing import Annotated, Any, TypeAlias

import typer
from rich.table import Table

from tactid._api.combined import Combination
from tactid._api.offline import identify
from tactid._api.result import Identification, PaperIdentification
from tactid._base import terminal
from tactid._base.errors import ArgumentError, IdentificationError
from tactid._base.output_files import FigureFormat, check_ending, figure_outputs
from tactid._base.terminal import printable
from tactid._cli import option_flags, option_text
from tactid._cli.command import EXIT_CODES, FLAG, interruptible
from tactid._cli.console import (
    FIGURES,
    Writers,
    check_figures,
    check_files,
    notes,
    print_json,
    print_whole,
    printing_before,
    progress,
)
from tactid._documents import combination_json, result_json
from tactid._options.options import OPTIONS, Options, options_for
from tactid._read.pose_table import read_poses
from tactid._read.recordings import log_info
from tactid._results import table
from tactid._results.controllers import MAKERS
from tactid._results.formats import uncontradicted
from tactid._results.truth import Truth, read_checks, read_truth
from tactid._show import captions, combination_text, reported, summary
from tactid._show.outlook import needs_another_motion
from tactid._show.remarks import is_at_rest, losses


class Form(str, Enum):
    """Format in which a result is printed: a table, or a method ``Identification.to_...``."""

    TABLE = "table"
    JSON = "json"
    URDF = "urdf"
    MUJOCO = "mujoco"
    ROS = "ros"
    CONTROLLER = "controller"
    UR = "ur"
    FRANKA = "franka"
    KUKA = "kuka"
    ABB = "abb"


AnyResult: TypeAlias = Identification | PaperIdentification | Combination
"""What an identification returns."""

PAYLOAD_OF_DESIGN = "--payload-mass-max KG --payload-box X,Y,Z,X,Y,Z --out motion"
"""What a designed motion is for, in the words of the option that a user fills in."""

RESULTS = "Results"

SETTINGS = {"epilog": EXIT_CODES}
"""Settings of typer that other commands do not have."""


def _result(text: str, *flags: str, metavar: str | None = None) -> Any:
    return typer.Option(*flags, help=text, metavar=metavar, rich_help_panel=RESULTS)


ACCEPT_CONTRADICTED = _result(
    "Prints a format of another program also where the data contradict the result. The exit code"
    " stays 1.",
    "--accept-contradicted",
    metavar=FLAG,
)


@dataclass(frozen=True)
class Output:
    """What the command prints and writes."""

    form: Form
    within: float
    accepts_contradicted: bool
    result_file: Path | None
    report: Path | None
    figures: FigureFormat | None
    estimates: Path | None
    design: str | None
    """The command that designs a motion, without method and payload; None without a URDF."""


def identify_recording(
    logs: Annotated[
        list[Path],
        typer.Argument(
            help="A rosbag2 folder, or an .mcap or .db3 file; a table (.csv, .npz, .parquet), a"
            " data set of LeRobot, a ROS 1 bag, or a table of poses at rest, without times. Several"
            " recordings of one payload give one estimate, and a verdict on whether they agree.",
            metavar="LOG...",
        ),
    ],
    form: Annotated[Form, _result("What to print.", "--format")] = Form.TABLE,
    as_json: Annotated[
        bool, _result("Prints JSON, as --format json does.", "--json", metavar=FLAG)
    ] = False,
    result_file: Annotated[
        Path | None, _result("A JSON file with all time series to write.", "--result")
    ] = None,
    report: Annotated[Path | None, _result("An HTML file to write, with plots.")] = None,
    figures: Annotated[FigureFormat | None, _result(FIGURES)] = None,
    within: Annotated[
        str,
        _result(
            "Target precision: half of each 95 % interval in percent of the largest value of its"
            " kind. The output says how much longer the motion must go on to reach it."
        ),
    ] = "1%",
    estimates: Annotated[
        Path | None,
        _result("An .mcap file to write, which contains the estimate over time (InertiaStamped)."),
    ] = None,
    accept_contradicted: Annotated[bool, ACCEPT_CONTRADICTED] = False,
    **options: Any,
) -> None:
    """Identifies the payload from a recording, or from several.

    The numbers of one option are separated by commas or by spaces: --gravity 0 0 -9.81.
    """
    precision = option_text.fraction("--within", within)
    if as_json and form not in (Form.TABLE, Form.JSON):
        raise ArgumentError(
            f"--json and --format {form.value} exclude each other: give one of them"
        )
    chosen, design = Form.JSON if as_json else form, _design_command(options)
    output = Output(
        chosen, precision, accept_contradicted, result_file, report, figures, estimates, design
    )
    replaced = _check(output, logs, options)
    with interruptible("no result"), progress("identifying") as done:
        result = _identified(logs, option_flags.read(options, "log"), done)
    if estimates is not None and not isinstance(result, Combination):
        result.check_times()
    with printing_before(_writers(logs[0], result, output), replaced):
        refusal = _print(logs[0], result, output)
    if refusal is not None:
        terminal.report(f"error: {refusal.worded('command-line')}")
    if refusal is not None or result.is_contradicted or not any(result.estimate.identifiable):
        raise typer.Exit(1)


option_flags.show(
    identify_recording,
    option_flags.parameters(options_for("log")),
    last=(
        "form",
        "as_json",
        "accept_contradicted",
        "result_file",
        "report",
        "figures",
        "within",
        "estimates",
    ),
)


def _check(output: Output, logs: list[Path], options: dict[str, Any]) -> list[Path]:
    """Checks that the files to write can be written, and replace nothing that is read.

    Returns:
        The files of an earlier run that they replace.
    """
    names = captions.RECORDING if len(logs) == 1 else captions.COMBINATION
    replaced = check_files(
        {
            "--result": output.result_file,
            "--report": output.report,
            "--estimates": output.estimates,
            **figure_outputs(output.report, names, output.figures),
        },
        {
            **{f"the log {log}" if len(logs) > 1 else "the log": log for log in logs},
            "--urdf": options["urdf"],
            "--unloaded": options["unloaded"],
            "--calibration": options["calibration"],
            "--known-tool": option_text.tool_file(options["known_tool"]),
            "--shape": options["shape"],
        },
    )
    check_figures(output.report, output.figures)
    check_ending("--result", output.result_file, ".json")
    check_ending("--estimates", output.estimates, ".mcap")
    if output.estimates is not None and len(logs) > 1:
        raise ArgumentError(
            f"--estimates writes the estimate over time of one recording, but {len(logs)} are given"
        )
    return replaced


def _identified(logs: list[Path], options: Options, done: Callable[[float], object]) -> AnyResult:
    """Identifies the payload from logs, or from a table of poses at rest."""
    poses = read_poses(logs[0], options) if len(logs) == 1 else None
    if poses is not None:
        from tactid._api.poses import identify_pose_table  # only such a table needs it

        return identify_pose_table(logs[0], poses, options)
    return identify(tuple(logs), options=options, progress=done)


def _print(log: Path, result: AnyResult, output: Output) -> IdentificationError | None:
    """Prints the result; returns why it cannot be given in the format that was asked for.

    Args:
        log: The log, or the first of several.
        result: The result of the log, or of several.
        output: What to print.
    """
    runs = result.runs if isinstance(result, Combination) else [result]
    for run in runs:
        for loss in losses(run):
            notes.print(f"tactid: note: {loss}", style="yellow")
    if output.form is Form.JSON:
        print_json(result_json.to_json(_record(log, result, output)))
        return None
    refusal = None
    if output.form is Form.TABLE:
        print(printable(table.heading(result.estimate.frame)))
        print_whole(_table(log, result))
        each = combination_text.rows(result) if isinstance(result, Combination) else None
        if each is not None:
            print_whole(each)
    else:
        if isinstance(result, Combination) and result.disagreement is not None:
            notes.print(f"tactid: warning: {result.disagreement}", style="yellow")
        try:
            text = _in_form(output.form, result)
            accepted = output.accepts_contradicted
            print(printable(uncontradicted(result, text, accepted, "command-line")))
        except IdentificationError as error:
            refusal = error
    for line in _lines(result, output):
        # What contradicts the result is in the refusal.
        if refusal is None or line not in refusal.message:
            notes.print(line, markup=False)
    return refusal


def _record(log: Path, result: AnyResult, output: Output) -> dict[str, Any]:
    if isinstance(result, Combination):
        return combination_json.record(result, output.within, "command-line")
    return result_json.record(result, output.within, "command-line", _checks(log, result))


def _checks(log: Path, result: Identification | PaperIdentification) -> dict[str, Any] | None:
    """Returns the checks of the run of a simulated log; poses at rest are in no log."""
    return None if is_at_rest(result) else read_checks(log_info(log))


def _table(log: Path, result: AnyResult) -> Table:
    if isinstance(result, Combination):
        return table.rich_table(combination_text.columns(result))
    is_log = not is_at_rest(result)
    truth = truth_in_frame(log, result.estimate.frame) if is_log else None
    return table.rich_table([reported.column(result, truth)], truth)


def _lines(result: AnyResult, output: Output) -> list[str]:
    if isinstance(result, Combination):
        return combination_text.lines(result, "command-line")
    lines = summary.lines(result, output.within, "command-line")
    if output.design is None or isinstance(result, PaperIdentification):
        return lines
    if needs_another_motion(result, output.within):
        design = f"{output.design} {OPTIONS['method'].flag} {result.method} {PAYLOAD_OF_DESIGN}"
        lines.append(f"A motion that would determine more: {design}")
    return lines


def _design_command(options: dict[str, Any]) -> str | None:
    """Returns the command that designs a motion for the robot and the tip."""
    if options["urdf"] is None:
        return None
    given = {name: options[name] for name in ("urdf", "tip") if options[name] is not None}
    words = [word for name, value in given.items() for word in (OPTIONS[name].flag, str(value))]
    return f"tactid excite {shlex.join(words)}"


def _in_form(form: Form, result: AnyResult) -> str:
    forms: dict[Form, Callable[..., str]] = {
        Form.URDF: result.to_urdf,
        Form.MUJOCO: result.to_mujoco,
        Form.ROS: result.to_ros,
        Form.CONTROLLER: result.to_controller,
        **{Form(maker): partial(result.to_controller, maker) for maker in MAKERS},
    }
    return forms[form](accept_contradicted=True)


def truth_in_frame(log: Path, frame: str) -> Truth | None:
    """Returns the truth of a simulated log; None for another log or frame, which is printed."""
    truth = read_truth(log_info(log))
    if truth is None or truth.frame == frame:
        return truth
    notes.print(
        f"tactid: note: the true payload of this simulated log is in the frame {truth.frame}, so no"
        f" errors are shown for {frame}",
        style="yellow",
    )
    return None


def _writers(log: Path, result: AnyResult, output: Output) -> Writers:
    """Returns what writes each of the files that are asked for."""
    writers: dict[Path, Callable[[Path], list[Path] | None]] = {}
    if output.result_file is not None:
        writers[output.result_file] = partial(_write_result, log, result, output.within)
    if output.report is not None:
        writers[output.report] = partial(_write_report, result, output)
    if output.estimates is not None and not isinstance(result, Combination):
        writers[output.estimates] = result.write_estimates
    return writers


def _write_result(log: Path, result: AnyResult, within: float, path: Path) -> None:
    if isinstance(result, Combination):
        combination_json.write(result, path, within, "command-line")
    else:
        result_json.write(result, path, within, "command-line", _checks(log, result))


def _write_report(result: AnyResult, output: Output, path: Path) -> list[Path]:
    with notes.status("drawing"):
        # matplotlib takes a while to load.
        from tactid._show import combination_report, recording_report

        if isinstance(result, Combination):
            return combination_report.write_report(result, path, "command-line", output.figures)
        return recording_report.write_report(
            result, path, output.within, "command-line", output.figures
        )
