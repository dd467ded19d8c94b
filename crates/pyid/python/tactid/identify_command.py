"""The command ``tactid identify``: from a recording to the payload and the reasons to trust it."""

import sys
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

import tactid
from tactid import forms, result, table
from tactid.console import interruptible, notes, print_whole, progress
from tactid.errors import ArgumentError
from tactid.result import Filter, Way


class Form(StrEnum):
    """How a result is printed."""

    TABLE = "table"
    JSON = "json"
    URDF = "urdf"
    MUJOCO = "mujoco"
    CONTROLLER = "controller"


class ActsOn(StrEnum):
    """On which body a measured wrench acts."""

    PAYLOAD = "payload"
    SENSOR = "sensor"


FORMS = {
    Form.URDF: forms.urdf,
    Form.MUJOCO: forms.mujoco,
    Form.CONTROLLER: forms.controller,
}

Log = Annotated[Path, typer.Argument(help="An .mcap file, or the folder of a rosbag2 bag.")]


def _panel(name: str, text: str, *names: str) -> Any:
    return typer.Option(*names, help=text, rich_help_panel=name)


ROBOT, TOPICS, SIGNS, SIGNALS, RESULTS = "Robot", "Topics", "Signs", "Signals", "Results"
PAYLOAD = "Payload, where something is known of it"


def identify(
    log: Log,
    urdf: Annotated[
        Path | None, _panel(ROBOT, "The robot, where the log has no /robot_description.")
    ] = None,
    tip: Annotated[
        str | None,
        _panel(ROBOT, "The end-effector frame: a link of the robot. Default: tool0."),
    ] = None,
    way: Annotated[
        Way | None,
        _panel(
            ROBOT,
            "From wrenches, from joint efforts, or from the motion of joints and free base."
            " Default: tactile where there are wrenches.",
        ),
    ] = None,
    bare: Annotated[
        Path | None,
        _panel(ROBOT, "A recording of the same motion without the payload: its efforts go off."),
    ] = None,
    effort_gain: Annotated[
        str | None,
        _panel(ROBOT, "What a unit of effort is in N m, one a joint: 12.5,12.5,9.8,..."),
    ] = None,
    joints: Annotated[
        list[str] | None, _panel(TOPICS, "JointState; more than once for parts of the joints.")
    ] = None,
    wrench: Annotated[
        list[str] | None, _panel(TOPICS, "WrenchStamped; more than once for several fingers.")
    ] = None,
    odometry: Annotated[
        str | None, _panel(TOPICS, "Odometry of the base, or of the sensor itself without joints.")
    ] = None,
    imu: Annotated[
        str | None, _panel(TOPICS, "Imu on the tool, without joints; or on a moving base.")
    ] = None,
    accel: Annotated[str | None, _panel(TOPICS, "AccelStamped of what the odometry moves.")] = None,
    gravity: Annotated[
        tuple[float, float, float] | None,
        _panel(
            SIGNS,
            "Gravitational acceleration in the world, m/s². Default: 0 0 -9.81, or none for a"
            " robot whose base moves.",
        ),
    ] = None,
    wrench_acts_on: Annotated[
        ActsOn, _panel(SIGNS, "The body on which the measured wrench acts.")
    ] = ActsOn.PAYLOAD,
    tool_mass_properties: Annotated[
        str | None,
        _panel(
            SIGNS,
            "A known tool in the measured load, to be taken off: mass, centre of mass in the tip's"
            " frame, inertia about it: m,cx,cy,cz,Ixx,Ixy,Ixz,Iyy,Iyz,Izz.",
        ),
    ] = None,
    mass: Annotated[float | None, _panel(PAYLOAD, "Its mass as it was weighed, kg.")] = None,
    mass_deviation: Annotated[
        float, _panel(PAYLOAD, "Standard deviation of the weighing, kg; 0 for an exact mass.")
    ] = 0.0,
    box: Annotated[
        str | None,
        _panel(
            PAYLOAD,
            "A box that holds all of it, in the tip's frame, m: least and largest corner,"
            " x,y,z,x,y,z.",
        ),
    ] = None,
    delay: Annotated[
        str, _panel(SIGNALS, "By how much later than the motion wrenches are stamped: auto, or s.")
    ] = "auto",
    cutoff: Annotated[
        float | None,
        _panel(SIGNALS, "Of the low-pass on both sides, Hz. Default: chosen from the data."),
    ] = None,
    max_gap: Annotated[
        float | None,
        _panel(SIGNALS, "Samples further apart are not bridged, s. Default: five periods."),
    ] = None,
    wrench_offset: Annotated[
        bool,
        _panel(
            SIGNALS,
            "The wrenches may be off by a constant: identify it as well.",
            "--wrench-offset",
        ),
    ] = False,
    wrench_noise: Annotated[
        list[str] | None,
        _panel(
            SIGNALS,
            "Noise of one sample of a wrench, N and N m: fx,fy,fz,mx,my,mz. Once for all sensors,"
            " or once for each. Default: from the residuals.",
        ),
    ] = None,
    effort_noise: Annotated[
        str | None,
        _panel(SIGNALS, "The same of a joint's effort: one for all, or 0.5,0.5,0.2,..."),
    ] = None,
    estimator: Annotated[
        Filter, _panel(SIGNALS, "Robust least squares, or the paper's filter.")
    ] = "rls",
    epochs: Annotated[
        int | None,
        typer.Option(
            min=1,
            max=2**32 - 1,
            help="How often nlms sees the log. Default: 2.",
            rich_help_panel=SIGNALS,
        ),
    ] = None,
    form: Annotated[Form, _panel(RESULTS, "What to print.", "--format")] = Form.TABLE,
    as_json: Annotated[bool, _panel(RESULTS, "The same as --format json.", "--json")] = False,
    result_file: Annotated[
        Path | None, _panel(RESULTS, "A JSON file with all time series to write.", "--result")
    ] = None,
    report: Annotated[Path | None, _panel(RESULTS, "An HTML file to write, with plots.")] = None,
    within: Annotated[
        str,
        _panel(
            RESULTS,
            "The precision for which the time left is told: half of each 95 % interval in percent"
            " of the largest value of its kind.",
        ),
    ] = "1%",
    estimates: Annotated[
        Path | None,
        _panel(RESULTS, "An .mcap file to write, with the estimate over time (InertiaStamped)."),
    ] = None,
) -> None:
    """Identifies the payload from a recording."""
    precision = _percent("--within", within)
    with interruptible("no result"), progress("identifying") as done:
        found = tactid.identify(
            log,
            tool=tip,
            way=way,
            estimator=estimator,
            epochs=epochs,
            gravity=gravity,
            cutoff=cutoff,
            max_gap=max_gap,
            wrench_offset=wrench_offset,
            wrench_noise=_each("--wrench-noise", wrench_noise, 6),
            effort_noise=None if effort_noise is None else _numbers("--effort-noise", effort_noise),
            urdf=None if urdf is None else _read(urdf),
            joints=joints or [],
            wrenches=wrench or [],
            odometry=odometry,
            imu=imu,
            acceleration=accel,
            wrench_acts_on=wrench_acts_on.value,
            known_tool=_read_tool(tool_mass_properties),
            known_mass=mass,
            known_mass_deviation=mass_deviation,
            bounding_box=None if box is None else np.reshape(_numbers("--box", box, 6), (2, 3)),
            delay=None if delay == "auto" else _numbers("--delay", delay, 1)[0],
            bare=bare,
            effort_gain=[] if effort_gain is None else _numbers("--effort-gain", effort_gain),
            progress=done,
        )
    _print(log, found, Form.JSON if as_json else form, precision)
    with interruptible("some of the files were not written"):
        _write(log, found, result_file, report, estimates, precision)


def _print(log: Path, found: tactid.Identification, form: Form, within: float) -> None:
    for damage in found.damage:
        notes.print(f"tactid: note: {damage}; what stands before was used", style="yellow")
    values = result.estimate_values(found)
    if form is Form.JSON:
        sys.stdout.write(result.to_json(_record(log, found, within)))
        return
    if form is not Form.TABLE:
        sys.stdout.write(FORMS[form](values, found.tool).rstrip() + "\n")
    else:
        truth = result.read_truth(tactid.info(log))
        print_whole(table.rich_table([table.Column.of(found, truth)], truth))
    for line in result.facts(found):
        notes.print(line)
    outlook = result.outlook(found, within)
    if outlook is not None:
        notes.print(outlook)
    for remark in result.recording_remarks(found):
        notes.print(remark)


def _record(log: Path, found: tactid.Identification, within: float) -> dict[str, object]:
    record = result.record(found, within)
    record["diagnostics"] |= result.read_checks(tactid.info(log))
    return record


def _write(
    log: Path,
    found: tactid.Identification,
    result_file: Path | None,
    report: Path | None,
    estimates: Path | None,
    within: float,
) -> None:
    if result_file is not None:
        record = _record(log, found, within) | {"series": result.series(found)}
        result.write_atomically(result_file, result.to_json(record))
    if report is not None:
        from tactid import recording_report  # with matplotlib, which takes a while to load

        with notes.status("drawing"):
            recording_report.write_report(found, log.name, report, within)
    if estimates is not None:
        with result.atomic_path(estimates) as path:
            found.write_estimates(path)
    written = [str(path) for path in (result_file, report, estimates) if path is not None]
    if written:
        notes.print(f"Wrote {', '.join(written)}.")


def _read(urdf: Path) -> str:
    try:
        return urdf.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        raise ArgumentError(f"--urdf {urdf} is not a text file") from None


def _read_tool(text: str | None) -> tactid.MassProperties | None:
    if text is None:
        return None
    mass, x, y, z, xx, xy, xz, yy, yz, zz = _numbers("--tool-mass-properties", text, 10)
    inertia = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
    return tactid.MassProperties(mass=mass, com=[x, y, z], inertia=inertia)


def _numbers(option: str, text: str, count: int | None = None) -> list[float]:
    try:
        numbers = [float(word) for word in text.replace(",", " ").split()]
    except ValueError:
        numbers = []
    if not numbers or (count is not None and len(numbers) != count):
        many = "numbers" if count is None else f"{count} number{'s' if count > 1 else ''}"
        raise ArgumentError(f"{option} is {text!r}: expected {many}, separated by commas")
    return numbers


def _each(option: str, texts: list[str] | None, count: int) -> list[list[float]] | None:
    return [_numbers(option, text, count) for text in texts] if texts else None


def _percent(option: str, text: str) -> float:
    """A part of one, from a number in percent, with its sign or without."""
    try:
        percent = float(text.strip().removesuffix("%"))
    except ValueError:
        percent = 0.0
    if not 0 < percent < float("inf"):
        raise ArgumentError(f"{option} is {text!r}: expected a positive percentage, such as 1%")
    return percent / 100
