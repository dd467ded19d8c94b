"""The commands of ``tactid``. Results go to standard output, all else to standard error."""

import functools
import importlib
from typing import Annotated, Any

import typer
from typer.core import TyperGroup
from typer.exceptions import TyperException
from typer.main import get_command

from tactid._base import terminal
from tactid._base.errors import ArgumentError, InternalError, TactidError
from tactid._base.startup import ending, interruption
from tactid._cli.command import EXIT_CODES, FLAG, interruptible, shown_without_value
from tactid._cli.conversion import convert_plain_values
from tactid._cli.number_lists import NumberListCommand
from tactid._native import __version__, set_log_memory

COMMANDS = {
    "paper": "paper_command.run_paper",
    "simulate": "simulate_command.run_simulation",
    "identify": "identify_command.identify_recording",
    "calibrate": "calibrate_command.calibrate_arm",
    "excite": "excite_command.excite",
    "live": "live_command.run_live",
    "compensate": "compensate_command.compensate_log",
    "compare": "compare_command.compare_recording",
    "fleet": "fleet_command.identify_fleet",
    "fleet-report": "fleet_command.report_fleet",
    "study": "study_command.run_study",
    "info": "info_command.show_info",
    "view": "view_command.show_view",
}
"""Module and function of each command, in the order of the help. The module is imported when the
command runs or shows its help; ``SETTINGS`` of it are those of typer that the others do not have.
"""


class Group(TyperGroup):
    """The group of the commands, whose help shows ``--help`` as an option without a value."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        convert_plain_values(self.params)
        # The library lists and suggests these names; `get_command` makes the commands.
        self.commands.update(dict.fromkeys(COMMANDS))  # type: ignore[arg-type]

    def get_help_option(self, ctx: Any) -> Any:
        """Returns the option ``--help`` of the group."""
        return shown_without_value(super().get_help_option(ctx))

    def make_context(self, info_name: Any, args: list[str], *rest: Any, **keywords: Any) -> Any:
        """Reads the arguments; Ctrl-C is one line and exit code 130, as in :meth:`invoke`."""
        _check_empty(args)
        with interruptible():
            return super().make_context(info_name, args, *rest, **keywords)

    def invoke(self, ctx: Any) -> Any:
        """Runs a command; Ctrl-C that it does not handle is one line and exit code 130."""
        with interruptible():
            return super().invoke(ctx)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Returns a command of the group by its name; None where there is none."""
        del ctx
        return _command(cmd_name) if cmd_name in COMMANDS else None


@functools.cache
def _command(name: str) -> Any:
    """Returns a command by its name; its module is imported for it."""
    place, _, function = COMMANDS[name].partition(".")
    module = importlib.import_module(f"tactid._cli.{place}")
    settings = {"cls": NumberListCommand} | getattr(module, "SETTINGS", {})
    alone = typer.Typer(add_completion=False)
    alone.command(name, **settings)(getattr(module, function))
    return get_command(alone)


def _check_empty(arguments: list[str]) -> None:
    """Refuses an empty argument, which is the current folder where a path is expected."""
    for number, argument in enumerate(arguments):
        if argument == "" or (argument.startswith("--") and argument.endswith("=")):
            before = f" after {arguments[number - 1]}" if argument == "" and number else ""
            name = argument.rstrip("=") or f"the argument{before}"
            raise ArgumentError(f"{name} is empty: is a variable of the shell not set?")


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
