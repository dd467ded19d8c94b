"""Faults of a recording's messages: counted by topic and kind, and put into words."""

import math
from dataclasses import dataclass

PHRASES = {
    "gap": "gap, not bridged",
    "out_of_order": "message out of order, left out",
    "undecodable": "message that cannot be decoded, left out",
    "not_finite": "message with a value that is not finite, left out",
    "out_of_range": "message with a value out of range (beyond 1e9), left out",
    "partial_joints": "message with only some of its publisher's joints, left out",
    "position_count": "message with another number of positions than of names, left out",
    "velocity_not_finite": "velocity that is not finite, derived from the positions",
    "no_velocity": "message without velocities, derived from the positions",
    "no_effort": "message without efforts, left out",
    "effort_not_finite": "effort of {joint} that is not finite, message left out",
    "not_unit_quaternion": "orientation that is no unit quaternion, message left out",
    "no_stamp": "message without a stamp, the time of logging is used",
    "far_stamp": "message with a stamp far from the time of logging, left out",
    "incomplete": "sample at which another stream has no value, left out",
}
"""Each kind of fault, and what was done about it, in the singular."""


@dataclass(frozen=True)
class DataFault:
    """One kind of fault in the messages of one topic."""

    topic: str
    """Topic of the messages, or ``samples`` for what could not be aligned."""
    kind: str
    """Kind of the fault, such as ``out_of_order``."""
    count: int
    """Number of occurrences."""
    first: float = math.nan
    """Time of the first occurrence on the recording's clock, s; NaN where it is not known."""
    joint: str | None = None
    """Name of the joint, where the fault is that of one joint; else None."""

    @property
    def phrase(self) -> str:
        """Words for the kind of fault, and what was done about it, in the singular."""
        return PHRASES[self.kind].format(joint=self.joint)

    @property
    def sentence(self) -> str:
        """Sentence with the topic, the number of occurrences, the fault and the first time."""
        since = f", the first at {self.first:.3f} s" if math.isfinite(self.first) else ""
        return f"{self.topic}: {self.count} × {self.phrase}{since}."
