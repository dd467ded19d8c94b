"""Ctrl-C and SIGTERM, while the libraries of the command load and afterwards.

The package imports this module first. In a program other than the command it changes nothing.
"""

import os
import signal
import sys
from types import FrameType

INTERRUPTED = 130
"""Exit code after Ctrl-C: 128 and the number of SIGINT."""
TERMINATED = 143
"""Exit code after SIGTERM: 128 and its number."""


WIDEST = 1000
"""Most columns of a terminal: lines of millions would take gigabytes."""


class Terminated(KeyboardInterrupt):
    """SIGTERM, which ends the command as Ctrl-C does: nothing half-written is left."""


def ending(interruption: KeyboardInterrupt) -> tuple[str, int]:
    """Returns the word for the end of an interrupted command, and its exit code."""
    if isinstance(interruption, Terminated):
        return "terminated", TERMINATED
    return "interrupted", INTERRUPTED


_arrived: list[KeyboardInterrupt] = []
"""What the signals have raised."""


def interruption() -> KeyboardInterrupt | None:
    """Returns what the first signal has raised, whatever has become of it.

    A library that is being loaded, or that is written in another language, may swallow the
    exception or turn it into another one.
    """
    return _arrived[0] if _arrived else None


def handle_interruption() -> None:
    """Makes Ctrl-C end the command with one line, if this process is the command."""
    if _is_command() and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _exit)


def leave_interruption_to_command() -> None:
    """Makes Ctrl-C and SIGTERM raise exceptions, once the libraries are loaded."""
    if signal.getsignal(signal.SIGINT) is _exit:
        signal.signal(signal.SIGINT, _raise)
    if signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:
        signal.signal(signal.SIGTERM, _raise)


def ignore_interruption() -> None:
    """Ignores Ctrl-C and SIGTERM when all is written, while Python ends.

    Python itself would give them back their defaults first, and the exit code would be a signal's.
    """
    for number in (signal.SIGINT, signal.SIGTERM):
        if signal.getsignal(number) is _raise:
            signal.signal(number, signal.SIG_IGN)


def bound_width() -> None:
    """Bounds the width of the terminal that the environment names, if this process is the command.

    Rich reads it while it is loaded, takes digits of any script, and fills lines of that width.
    """
    columns = os.environ.get("COLUMNS")
    if columns is None or not _is_command():
        return
    if not (columns.isascii() and columns.isdigit()):
        del os.environ["COLUMNS"]
    elif len(columns) > len(str(WIDEST)) or int(columns) > WIDEST:
        os.environ["COLUMNS"] = str(WIDEST)


def _is_command() -> bool:
    """Returns whether this process is the script ``tactid``, or ``python -m tactid``."""
    program = sys.argv[0] if sys.argv else ""
    if program != "-m":
        return os.path.basename(program) in {"tactid", "tactid.exe"}
    # Python looks for the module whose name follows, and its package is imported first.
    following = zip(sys.orig_argv, sys.orig_argv[1:], strict=False)
    return ("-m", "tactid") in following


def _raise(number: int, _frame: FrameType | None) -> None:
    if number == signal.SIGTERM:
        # A second one must not interrupt what the first one cleans up.
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
    _arrived.append(Terminated() if number == signal.SIGTERM else KeyboardInterrupt())
    raise _arrived[-1]


def _exit(_signal: int, _frame: FrameType | None) -> None:
    os.write(2, b"tactid: interrupted\n")
    os._exit(INTERRUPTED)


handle_interruption()
bound_width()
