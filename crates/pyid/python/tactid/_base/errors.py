"""The exceptions of tactid: one tree under :class:`TactidError`.

The message of each says what is wrong, where, and what would be right.
"""

import re
from collections.abc import Sequence

from tactid import _native
from tactid._base.findings import DataFault
from tactid._base.naming import Style, option_choice, option_name


class TactidError(Exception):
    """Base class of every exception that tactid raises on purpose.

    Args:
        message: What is wrong. It names an option that resolves the error; the name of one that
            causes it is put in front unless the message has it.
        option: The field of ``tactid.Options`` that causes or resolves the error; None where there
            is none.
    """

    def __init__(self, message: str = "", option: str | None = None) -> None:
        super().__init__(message, option)
        self.message = message
        self.option = option

    def __str__(self) -> str:
        return self.worded("keyword")

    def worded(self, style: Style) -> str:
        """Returns the message with names of options as the reader would write them."""
        stated = _with_choices(self.message, style)
        if self.option is None:
            return stated
        message = stated if style == "keyword" else _with_flags(stated)
        keyword, name = option_name(self.option, "keyword"), option_name(self.option, style)
        if option_choice(self.option, "false", style) in message:
            return message
        if keyword in message:
            return message.replace(keyword, name)
        return message if name in message else f"{name}: {message}"


def _names() -> set[str]:
    """Returns the names of all options."""
    return {option["name"] for options in _native.options() for option in options}


def _with_choices(message: str, style: Style) -> str:
    """Writes options with a value, as a crate states them, in the words of the reader."""
    names = {*_names(), "base"}
    return re.sub(
        r"`([a-z_]+)` \((\w+)\)",
        lambda found: option_choice(found[1], found[2], style) if found[1] in names else found[0],
        message,
    )


def _with_flags(message: str) -> str:
    """Writes the options of several words that a message names as flags.

    A single word may also be the name of an array or of a link.
    """
    names = _names()
    return re.sub(
        "`([a-z]+_[a-z_]+)`",
        lambda found: option_name(found[1], "command-line") if found[1] in names else found[0],
        message,
    )


class ArgumentError(TactidError, ValueError):
    """An argument that does not fit: a shape, a number out of range, an unknown choice."""


class ModelError(TactidError):
    """A robot that cannot be modelled: the message names the link or joint."""


class LogError(TactidError):
    """A log that cannot be read or written."""


class ExperimentError(TactidError):
    """An experiment that cannot be run as it is described."""


class SimulationError(TactidError):
    """A simulation that was stopped.

    The payload slipped, a check exceeded its bound, or no further motion could be planned.
    """


class CalibrationError(TactidError):
    """A calibration that recordings do not allow, whose file is wrong, or of another robot."""


class ExcitationError(TactidError):
    """A motion that cannot be designed: the message names the limit that makes it impossible."""


class InternalError(TactidError):
    """A fault of tactid itself.

    Please report it with the line that it printed on standard error.
    """


class IdentificationError(TactidError):
    """A recording from which the payload cannot be identified.

    Args:
        message: What is wrong, as for every :class:`TactidError`.
        option: The field of ``tactid.Options`` that causes or resolves the error.
        faults: What is wrong with the recording's messages: each is a ``DataFault``.
    """

    def __init__(
        self,
        message: str = "",
        option: str | None = None,
        faults: Sequence[DataFault] = (),
    ) -> None:
        self.faults = list(faults)
        super().__init__("; ".join([message, *(fault.clause for fault in self.faults)]), option)


for _error in (TactidError, *TactidError.__subclasses__()):
    _error.__module__ = "tactid"  # a traceback names no internal module
