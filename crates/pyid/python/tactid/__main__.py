"""The command ``tactid``: every error is one line, and the exit code is that of its kind.

0 done; 1 nobody reads the output any more; 2 something given is wrong; 70 a fault of tactid itself;
130 interrupted by Ctrl-C.
"""

import os
import sys


def main() -> None:
    """Runs the command and exits with its code."""
    sys.exit(_run())


def _run() -> int:
    try:
        # Imported here, so that Ctrl-C while libraries load is met, too.
        from tactid import cli

        code = cli.run()
        sys.stdout.flush()
    except KeyboardInterrupt:
        return _say("interrupted", 130)
    except BrokenPipeError:
        # The interpreter flushes on exit: let that go nowhere.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except Exception as error:
        return _say(f"internal error: {type(error).__name__}: {error}; please report it", 70)
    except BaseException as error:
        if type(error).__name__ == "PanicException":
            return 70  # the native part has said where
        raise
    return code


def _say(message: str, code: int) -> int:
    print("tactid:", " ".join(message.split()), file=sys.stderr)
    return code


if __name__ == "__main__":
    main()
