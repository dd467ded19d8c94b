"""Wording that messages share: names of options, counts and lists."""

from collections.abc import Sequence
from typing import Literal

Style = Literal["keyword", "command-line", "online"]
"""Who reads a message: a caller of :func:`tactid.identify`, a user of the command ``tactid``, or a
caller of ``push`` of :class:`tactid.Identifier`, which has fewer options."""


def option_name(option: str, style: Style) -> str:
    """Returns the name of a field of ``tactid.Options`` as the reader would write it."""
    return command_line_flag(option) if style == "command-line" else f"`{option}`"


def switched_off(option: str, style: Style) -> str:
    """Returns how the reader would switch an option off: ``--no-collisions``."""
    return command_line_flag(f"no_{option}") if style == "command-line" else f"`{option}=False`"


def option_choice(option: str, value: str, style: Style) -> str:
    """Returns an option with a value as the reader would write both: ``--base floating``."""
    if value == "false":
        return switched_off(option, style)
    name = option_name(option, style)
    return f"{name} {value}" if style == "command-line" else f'`{option}="{value}"`'


def command_line_flag(option: str) -> str:
    """Returns the command-line flag of a field of ``tactid.Options``: ``--max-gap-s``."""
    return f"--{option.replace('_', '-')}"


def counted(count: int, singular: str, plural: str | None = None) -> str:
    """Returns a number with its noun, whose plural ends in ``s`` unless it is given."""
    return f"{count} {singular if count == 1 else plural or singular + 's'}"


def listed(words: Sequence[str]) -> str:
    """Lists words as a sentence does: with commas, and ``and`` before the last one."""
    *most, last = words
    return f"{', '.join(most)} and {last}" if most else last


MOST_NAMES = 6
"""Names that a sentence lists; of more it lists one less, and counts the rest."""

LONGEST_NAME = 200
"""Largest number of characters of a name in a sentence."""


def shortened(word: str) -> str:
    """Returns a word, cut off after :data:`LONGEST_NAME` characters."""
    return word if len(word) <= LONGEST_NAME else word[:LONGEST_NAME] + "…"


def abridged(words: Sequence[str], most: int = MOST_NAMES) -> str:
    """Lists words as :func:`listed` does, the first of more than ``most`` alone.

    A long word is cut off.
    """
    shown = words if len(words) <= most else words[: most - 1]
    short = [shortened(word) for word in shown]
    if len(words) <= most:
        return listed(short)
    return f"{', '.join(short)} and {len(words) - len(shown)} more"


def duration(seconds: float) -> str:
    """Says a time in s, min or h, to two figures at least."""
    if seconds < 120:
        return f"{seconds:.0f} s" if seconds >= 10 else f"{seconds:.1f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:,.0f} h"
