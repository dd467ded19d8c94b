"""The command ``tactid info``: the contents of a recording."""

from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table
from rich.text import Text

from tactid._base.errors import ArgumentError
from tactid._base.terminal import printable
from tactid._base.text_table import empty_table
from tactid._cli.console import Stream, print_whole
from tactid._native import LogInfo
from tactid._read import columns
from tactid._read.foreign_logs import BagInfo
from tactid._read.recordings import contents
from tactid._read.robot_joints import array_of_joints
from tactid._read.tables import Table as Columns

MOST_TOPICS = 1000
"""Rows of the table: a row takes half a millisecond, and a log may name any number of topics."""


def topics_table(info: LogInfo | BagInfo) -> Table:
    """Returns the topics of a log, the first :data:`MOST_TOPICS` of many, as a table."""
    table = empty_table()
    table.add_column("topic", overflow="fold")
    table.add_column("type", overflow="fold")
    table.add_column("messages", justify="right")
    table.add_column("rate / Hz", justify="right")
    for topic in info.topics[:MOST_TOPICS]:
        rate = "–" if topic.frequency is None else f"{topic.frequency:.1f}"
        names = (Text(printable(name)) for name in (topic.name, topic.type_name))
        table.add_row(*names, str(topic.count), rate)
    return table


def info_lines(info: LogInfo | BagInfo) -> list[str]:
    """Returns the duration, the metadata and the damage of a log, a line each."""
    duration = "no messages" if info.duration is None else f"{info.duration:.3f} s"
    records = ", ".join(info.metadata) or "none"
    lines = [f"duration  {duration}", f"metadata  {records}"]
    if (more := len(info.topics) - MOST_TOPICS) > 0:
        lines.insert(0, f"topics    {more} more, which tactid.info in Python has")
    none = "none on opening; the messages are checked when they are read"
    return lines + [f"damage    {line}" for line in info.damage or [none]]


def columns_table(table: Columns) -> Table:
    """Returns the columns of a table, the first of many, with the arrays that they are known as.

    Those that are named after the joints of a robot are known with its URDF only, and marked so.
    """
    known: dict[str | None, str] = {}
    for array in columns.DIMENSIONS:
        try:
            found = columns.find(table, [array])
        except ArgumentError:  # several may be the array
            continue
        known |= dict.fromkeys(found[array].columns if array in found else (), array)
    shown = empty_table()
    shown.add_column("column", overflow="fold")
    shown.add_column("array")
    for name in table.names[:MOST_TOPICS]:
        likely = array_of_joints(name)
        of_joint = "–" if likely is None else f"{likely}, with a URDF that has this joint"
        shown.add_row(Text(printable(name)), known.get(name, of_joint))
    return shown


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
    is_table = isinstance(found, Columns)
    console = Stream()
    shown = columns_table(found) if is_table else topics_table(found)
    if console.is_terminal:
        console.print(shown, highlight=False)
    else:
        print_whole(shown)
    for line in [] if is_table else info_lines(found):
        console.print(line, highlight=False, markup=False, soft_wrap=True)
