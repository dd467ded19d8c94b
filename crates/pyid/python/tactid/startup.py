"""Ctrl-C while the libraries of the command load, before the command can handle it.

The package imports this module first. In a program other than the command it changes nothing.
"""

import os
import signal
import sys
from types import FrameType

INTERRUPTED = 130
"""Exit code after Ctrl-C: 128 and the number of SIGINT."""


def handle_interruption() -> None:
    """Makes Ctrl-C end the command with one line, if this process is the command.

    A library that is being loaded may turn the exception of Ctrl-C into another one.
    """
    if _is_command() and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _exit)


def leave_interruption_to_command() -> None:
    """Makes Ctrl-C raise ``KeyboardInterrupt`` again, once the libraries are loaded."""
    if signal.getsignal(signal.SIGINT) is _exit:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def _is_command() -> bool:
    """Returns whether this process is the script ``tactid``, or ``python -m tactid``."""
    program = sys.argv[0] if sys.argv else ""
    if program != "-m":
        return os.path.basename(program) in {"tactid", "tactid.exe"}
    # Python looks for the module whose name follows, and its package is imported first.
    following = zip(sys.orig_argv, sys.orig_argv[1:], strict=False)
    return ("-m", "tactid") in following


def _exit(_signal: int, _frame: FrameType | None) -> None:
    os.write(2, b"tactid: interrupted\n")
    os._exit(INTERRUPTED)


handle_interruption()
