"""The spelling of an option: a keyword in Python, ``--option`` on the command line."""

from collections.abc import Sequence
from typing import Literal

Style = Literal["keyword", "command-line"]
"""Who reads a message: a caller of :func:`tactid.identify`, or a user of the command ``tactid``."""


def option_name(option: str, style: Style) -> str:
    """Returns the name of a field of ``tactid.Options`` as the reader would write it."""
    return f"`{option}`" if style == "keyword" else command_line_flag(option)


def command_line_flag(option: str) -> str:
    """Returns the command-line flag of a field of ``tactid.Options``: ``--max-gap``."""
    return f"--{option.replace('_', '-')}"


def listed(words: Sequence[str]) -> str:
    """Lists words as a sentence does: with commas, and ``and`` before the last one."""
    *most, last = words
    return f"{', '.join(most)} and {last}" if most else last
