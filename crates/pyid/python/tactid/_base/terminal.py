"""The standard streams of the command line, in whatever state the caller leaves them."""

import codecs
import os
import re
import sys
from contextlib import suppress
from typing import TextIO

ASCII = {
    "±": "+-",
    "²": "2",
    "³": "3",
    "µ": "u",
    "μ": "u",
    "°": "deg",
    "·": ".",
    "×": "x",
    "≤": "<=",
    "≥": ">=",
    "–": "-",
    "—": "-",
    "…": "...",
    "→": "->",
    "√": "sqrt",
    "½": "1/2",
    "─": "-",
    "━": "-",
    "│": "|",
    "•": "*",
}
"""What stands for a character in a terminal that does not have it. Most have the same width, so
that tables stay aligned. Any other character becomes an escape such as ``\\xe9``, so that a name is
not taken for another one."""

BRAILLE = range(0x2800, 0x2900)
"""Code points of the characters of which the sign of ongoing work consists."""


def set_up() -> None:
    """Makes the standard streams usable.

    A closed standard input or error becomes the null device, and a closed standard output a pipe
    that nobody reads; otherwise the next file that is opened would take their place. Characters
    that the encoding of a stream lacks are replaced.
    """
    _open_closed()
    codecs.register_error("tactid-ascii", _replace)
    for stream in (sys.stdout, sys.stderr):
        stream.reconfigure(errors="tactid-ascii")  # type: ignore[union-attr]


def is_utf8(stream: TextIO) -> bool:
    """Returns whether a stream is encoded as UTF-8."""
    return codecs.lookup(stream.encoding).name == "utf-8"


def printable(text: str) -> str:
    r"""Returns a text with escapes such as ``\x1b`` for control characters, but line ends and tabs.

    A name from a file would otherwise control the terminal that shows it.
    """
    return re.sub(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]", lambda found: f"\\x{ord(found[0]):02x}", text)


def report(message: str) -> None:
    """Prints a message of the command as one line on standard error."""
    print("tactid:", printable(" ".join(message.split())), file=sys.stderr)


def flush_output() -> None:
    """Writes what was printed, where somebody reads it."""
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError):
            stream.flush()


def discard_output() -> None:
    """Sends what is still to be written to standard output nowhere, where writing it has failed.

    The interpreter flushes it on exit, which would fail again.
    """
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, sys.stdout.fileno())
    os.close(null)


def _open_closed() -> None:
    for descriptor in range(3):
        if _is_open(descriptor):
            continue
        if descriptor != 1:
            os.dup2(os.open(os.devnull, os.O_RDWR), descriptor)
            continue
        ends = os.pipe()
        os.dup2(ends[1], descriptor)
        for end in {*ends} - {descriptor}:
            os.close(end)
    if sys.stdout is None:
        sys.stdout = os.fdopen(1, "w", encoding="utf-8", closefd=False)
    if sys.stderr is None:
        sys.stderr = os.fdopen(2, "w", encoding="utf-8", closefd=False)


def _is_open(descriptor: int) -> bool:
    try:
        os.fstat(descriptor)
    except OSError:
        return False
    return True


def _replace(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    missing, end = error.object[error.start : error.end], error.end
    # As wide as the two characters that it replaces.
    if missing.endswith("±") and error.object[end : end + 1] == " ":
        end += 1
    return "".join(_ascii(character) for character in missing), end


def _ascii(character: str) -> str:
    if ord(character) in BRAILLE:
        return "*"
    escape = character.encode("ascii", "backslashreplace").decode()
    return ASCII.get(character, escape)
