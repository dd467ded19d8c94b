"""The command ``tactid live``: the payload while the robot runs."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from tactid._base.errors import ArgumentError
from tactid._base.output_files import check_outputs
from tactid._base.terminal import printable
from tactid._cli import option_flags
from tactid._cli.command import interruptible
from tactid._cli.console import notes, print_whole
from tactid._cli.number_lists import NumberListCommand
from tactid._cli.ros import ros_module
from tactid._live.replay import played
from tactid._live.session import Session
from tactid._options.options import OPTIONS, Options, options_for
from tactid._results import table
from tactid._results.payload import PayloadEstimate

SHOWN_EVERY_NS = 1_000_000_000
"""Time between two lines of the estimate, ns of the recording's clock."""


def _source(text: str, metavar: str | None = None) -> Any:
    return typer.Option(help=text, metavar=metavar, rich_help_panel="Messages", show_default=False)


def run_live(
    replay: Annotated[
        Path | None,
        _source(
            "Plays a recording (a rosbag2 folder, or an .mcap or .db3 file) instead of listening to"
            " topics. It needs no ROS."
        ),
    ] = None,
    rate: Annotated[
        float | None,
        _source("Speed of --replay relative to that of the recording: as fast as possible.", "R"),
    ] = None,
    ros_argument: Annotated[list[str] | None, typer.Option(hidden=True)] = None,
    **options: Any,
) -> None:
    """Identifies the payload while the robot runs, as a ROS 2 node.

    What is left open is chosen from the first seconds, and again from the first 12.5 s and 30 s.
    Arguments for ROS follow --ros-args. The numbers of one option are separated by commas or by
    spaces: --gravity 0 0 -9.81.
    """
    if replay is None and rate is not None:
        raise ArgumentError("--rate is the speed of --replay, which is missing")
    if rate is not None and not (math.isfinite(rate) and rate > 0):
        raise ArgumentError(f"--rate is {rate:g}: expected a finite number greater than 0")
    chosen = option_flags.read(options, "live")
    if replay is not None:
        check_outputs({}, {"--replay": replay, "--urdf": options["urdf"]})
        _replay(replay, rate, chosen)
        return
    node = ros_module("node", "; tactid live --replay LOG plays a recording without ROS")
    node.run(chosen, _from_parameters, ros_argument or [])


class LiveCommand(NumberListCommand):
    """A command that hands on what follows ``--ros-args``, as ``ros2 launch`` gives it."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Reads the arguments; each of those for ROS is a hidden option."""
        first = args.index("--ros-args") if "--ros-args" in args else len(args)
        of_ros = [f"--ros-argument={argument}" for argument in args[first:]]
        return super().parse_args(ctx, args[:first] + of_ros)


def _from_parameters(parameters: Mapping[str, Any]) -> Options:
    """Returns options from parameters of a node: texts are read as on the command line."""
    # YAML reads `yes` and `no` as truth values.
    parameters = {
        name: ("yes" if value else "no")
        if isinstance(value, bool) and isinstance(OPTIONS[name].kind, dict)
        else value
        for name, value in parameters.items()
    }
    texts = {name: value for name, value in parameters.items() if isinstance(value, str)}
    lists = {name: [value] for name, value in texts.items() if OPTIONS[name].kind == "texts"}
    read = option_flags.values(texts | lists, options_for("live"))
    others = {name: value for name, value in parameters.items() if name not in texts}
    return Options(**read, **others)


def _replay(log: Path, rate: float | None, options: Options) -> None:
    """Plays a recording, prints the estimate as it goes, and a table of the last one."""
    session = Session(options, in_background=rate is not None)
    now_ns = 0
    try:
        with interruptible():
            now_ns = _play(session, log, rate)
    except typer.Exit:
        # What was identified until Ctrl-C is shown.
        if session.estimate() is not None:
            _show(session, now_ns)
        raise
    session.finish()
    if _show(session, now_ns):
        raise typer.Exit(1)


def _play(session: Session, log: Path, rate: float | None) -> int:
    """Plays a recording, and returns the time of its last message, ns."""
    begun_ns = shown_ns = now_ns = 0
    for batch in played(log, rate):
        session.push(batch)
        now_ns = batch[-1][3]
        if now_ns - shown_ns < SHOWN_EVERY_NS:
            continue
        estimate = session.estimate()
        begun_ns = begun_ns if shown_ns else now_ns
        shown_ns = now_ns
        if estimate is not None:
            notes.print(f"{(now_ns - begun_ns) * 1e-9:8.1f} s  {line(estimate)}", markup=False)
    return now_ns


def line(estimate: PayloadEstimate) -> str:
    """Returns mass and centre of mass with their 95 % intervals on one line."""
    rows = _column(estimate).rows[:4]
    values = (f"{row.name} {row.number} ± {row.around} {row.unit}" for row in rows)
    return ", ".join(values)


def _column(estimate: PayloadEstimate) -> table.Column:
    return table.Column(
        "value",
        estimate.reported_values,
        intervals=estimate.reported_intervals,
        observability=estimate.observability,
    )


def _show(session: Session, now_ns: int) -> bool:
    """Prints the estimate and what was noticed; returns whether the result is of no use."""
    estimate = session.estimate()
    if estimate is None:
        return True
    findings, faults = session.notices(now_ns)
    print(printable(table.heading(estimate.frame)))
    print_whole(table.rich_table([_column(estimate)]))
    for notice in (*findings, *faults):
        notes.print(str(notice), markup=False)
    contradicted = any(finding.contradicts_result for finding in findings)
    return contradicted or not any(estimate.identifiable)


option_flags.show(run_live, option_flags.parameters(options_for("live")), last=("replay", "rate"))

SETTINGS = {"cls": LiveCommand}
"""Settings of typer that other commands do not have."""
