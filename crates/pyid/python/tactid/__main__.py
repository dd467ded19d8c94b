"""The command ``tactid``: every error is one line, and the exit code is that of its kind.

The codes: 0 success; 1 a result that the data contradict, or that cannot be given in the format
that was asked for; 2 invalid input; 70 an internal error of tactid; 130 interrupted by Ctrl-C; 141
standard output was closed early, and 143 SIGTERM, which are 128 and the number of the signal.
"""

import gc
import os
import sys

from tactid._base import terminal
from tactid._base.errors import InternalError
from tactid._base.startup import (
    ending,
    ignore_interruption,
    interruption,
    leave_interruption_to_command,
)


def main() -> None:
    """Runs the command and exits with its code."""
    code = _run()
    if interruption() is not None:
        # What a signal has stopped halfway in a library need not survive the end of Python.
        gc.collect()
        terminal.flush_output()
        os._exit(code)
    ignore_interruption()
    # Python's end would search all objects for garbage, which the end of the process frees as well.
    gc.freeze()
    sys.exit(code)


GC_THRESHOLD = 50_000
"""New objects after which Python searches for garbage, in the whole command. With Python's own
threshold, 700 or 2000, it searched many times while modules were imported, which was a twentieth of
the time that a log of a minute takes."""


def _run() -> int:
    gc.set_threshold(GC_THRESHOLD)
    terminal.set_up()
    # Only files are drawn, and the name of an unknown backend is an error in matplotlib.
    os.environ["MPLBACKEND"] = "agg"
    try:
        from tactid._cli import cli

        leave_interruption_to_command()
        code = cli.run()
        sys.stdout.flush()
    except KeyboardInterrupt as error:
        return _report(*ending(error))
    except BrokenPipeError:
        terminal.discard_output()
        return 141
    except SystemExit as error:
        # Click and Rich end in this way when a reader has gone away.
        broken = error.__context__
        if not isinstance(broken, BrokenPipeError):
            raise
        if broken.filename is None:
            return 141
        return _report(f"error: cannot use {broken.filename}: {broken.strerror}", 2)
    except InternalError:
        return 70  # a panic of the native part, which its hook has reported
    except Exception as error:
        if (cause := interruption()) is not None:
            return _report(*ending(cause))
        if isinstance(error, OSError) and error.errno is not None and error.filename is None:
            terminal.discard_output()
            return _report(f"error: cannot use standard output: {error.strerror}", 2)
        return _report(f"internal error: {type(error).__name__}: {error}; please report it", 70)
    except BaseException as error:
        if type(error).__name__ == "PanicException":
            return 70  # the panic hook has reported it
        raise
    return code


def _report(message: str, code: int) -> int:
    terminal.report(message)
    return code


if __name__ == "__main__":
    main()
