"""The command ``tactid``: every error is one line, and the exit code is that of its kind.

The codes: 0 success; 1 a result that the data contradict, or that cannot be given in the format
that was asked for; 2 invalid input; 70 an internal error of tactid; 130 interrupted by Ctrl-C; 141
standard output was closed early, which is 128 and the number of SIGPIPE.
"""

import os
import sys

from tactid.startup import INTERRUPTED, leave_interruption_to_command


def main() -> None:
    """Runs the command and exits with its code."""
    sys.exit(_run())


def _run() -> int:
    try:
        from tactid import cli

        leave_interruption_to_command()
        code = cli.run()
        sys.stdout.flush()
    except KeyboardInterrupt:
        return _report("interrupted", INTERRUPTED)
    except BrokenPipeError:
        # The interpreter flushes standard output on exit, which would fail again.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 141
    except Exception as error:
        return _report(f"internal error: {type(error).__name__}: {error}; please report it", 70)
    except BaseException as error:
        if type(error).__name__ == "PanicException":
            return 70  # the panic hook has reported it
        raise
    return code


def _report(message: str, code: int) -> int:
    print("tactid:", " ".join(message.split()), file=sys.stderr)
    return code


if __name__ == "__main__":
    main()
