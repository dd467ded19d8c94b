"""What typer's commands of ``tactid`` have in common; no library for output is loaded for it."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import typer
from typer.core import TyperCommand

from tactid._base import terminal
from tactid._base.startup import ending
from tactid._cli.conversion import convert_plain_values

FLAG = ""
"""Placeholder of an option without a value in the help of a command."""

EXIT_CODES = (
    "Exit codes: 0, the payload is identified; 1, the data contradict the result (the reason is"
    " printed first) or determine none of its values, or it cannot be given in the format that was"
    " asked for; 2, an option, a file"
    " or the recording is wrong; 70, an internal error; 130, interrupted by Ctrl-C; 141, standard"
    " output was closed; 143, ended by SIGTERM."
)


def shown_without_value(help_option: Any) -> Any:
    """Returns the option ``--help`` of a command, if there is any, as an option without a value."""
    if help_option is not None and help_option.metavar != FLAG:
        help_option.metavar = FLAG
        convert_plain_values([help_option])
    return help_option


class Command(TyperCommand):
    """A command whose help shows the names of options in full, in a narrow terminal, too."""

    def __init__(self, *names: Any, **settings: Any) -> None:
        super().__init__(*names, **settings)
        convert_plain_values(self.params)

    def get_help_option(self, ctx: Any) -> Any:
        """Returns the option ``--help`` of the command."""
        return shown_without_value(super().get_help_option(ctx))

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Prints the help."""
        from typer import rich_utils  # takes a while to load

        from tactid._cli.option_table import OptionTable

        rich_utils.Table = OptionTable  # type: ignore[attr-defined]
        super().format_help(ctx, formatter)


@contextmanager
def interruptible(outcome: str | Callable[[], str] | None = None) -> Iterator[None]:
    """Turns Ctrl-C or SIGTERM into a line with the outcome, if there is any, and its exit code."""
    try:
        yield
    except KeyboardInterrupt as interruption:
        word, code = ending(interruption)
        outcome = outcome() if callable(outcome) else outcome
        terminal.report(word + (f": {outcome}" if outcome else ""))
        raise typer.Exit(code) from None
