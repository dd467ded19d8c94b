"""What can go wrong: one tree of exceptions under :class:`TactidError`.

The message of each says what is wrong, where, and what would be right.
"""


class TactidError(Exception):
    """Whatever tactid raises."""


class ArgumentError(TactidError, ValueError):
    """An argument that does not fit: a shape, a number out of range, an unknown choice."""


class ModelError(TactidError):
    """A robot that cannot be modelled: the message names the link or joint."""


class LogError(TactidError):
    """A log that cannot be read or written."""


class ExperimentError(TactidError):
    """An experiment that cannot be run as it is described."""


class SimulationError(TactidError):
    """A run that was given up, because the payload slipped or a check exceeded its bound."""


class IdentificationError(TactidError):
    """A log or a motion from which nothing can be identified."""
