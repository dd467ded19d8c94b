"""Progress and notes of the commands, on standard error."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import typer
from rich.console import Console
from rich.table import Table
from typer.core import TyperGroup

from tactid.table import whole_width

FLAG = ""
"""Placeholder of an option without a value in the help of a command."""


class Group(TyperGroup):
    """A group of commands whose help shows ``--help`` as an option without a value."""

    def get_help_option(self, ctx: Any) -> Any:
        """Returns the option ``--help`` of the group."""
        return _without_value(super().get_help_option(ctx))

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Returns a command of the group by its name; None where there is none."""
        command = super().get_command(ctx, cmd_name)
        if command is not None:
            _without_value(command.get_help_option(ctx))
        return command


def _without_value(option: Any) -> Any:
    if option is not None:
        option.metavar = FLAG
    return option


class Results(Console):
    """Standard output. The program decides what follows when its reader goes away."""

    def on_broken_pipe(self) -> None:
        """Raises ``BrokenPipeError``, where Rich would exit with code 1."""
        raise BrokenPipeError


notes = Console(stderr=True, highlight=False, soft_wrap=True)


def print_whole(table: Table) -> None:
    """Prints a table on standard output without truncating cells, in a narrow terminal too."""
    console = Results()
    console.width = max(console.width, whole_width(table, console))
    console.print(table, soft_wrap=True)


@contextmanager
def interruptible(outcome: str) -> Iterator[None]:
    """Turns Ctrl-C into a line that reports the outcome, and exit code 130."""
    try:
        yield
    except KeyboardInterrupt:
        print(f"tactid: interrupted: {outcome}", file=sys.stderr)
        raise typer.Exit(130) from None


@contextmanager
def progress(label: str) -> Iterator[Callable[[float], None]]:
    """Shows a progress bar with the remaining time if standard error is a terminal."""
    if not notes.is_terminal:
        yield lambda _: None
        return
    # Takes a while to load, and no script needs it.
    from rich import progress as bars

    columns = (
        bars.TextColumn("{task.description:<12}"),
        bars.BarColumn(bar_width=None),
        bars.TaskProgressColumn(),
        bars.TimeRemainingColumn(elapsed_when_finished=True),
    )
    with bars.Progress(*columns, console=notes) as bar:
        task = bar.add_task(label, total=1.0)
        yield lambda done: bar.update(task, completed=done)
