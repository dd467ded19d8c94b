"""What was noticed about a recording: findings, and faults of its messages, for a program to match.

The words for them are in :mod:`tactid.wording` and :mod:`tactid.faults`.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from tactid import faults, wording
from tactid.calibration_wording import is_of_another_arm
from tactid.naming import Style

CONTRADICTIONS = (
    "positions_beyond_limits",
    "velocities_contradicted",
    "twist_contradicted",
    "gravity_contradicted",
    "calibration_contradicted",
    "joint_zero_moved",
    "negative_mass",
    "known_bodies_too_heavy",
)
"""Findings that show the measurements or the result to be wrong. Those about the measurements come
first, because wrong measurements cause the others, which guess at another cause."""

DOUBTS = (
    "efforts_beyond_limits",
    "recording_calibrated",
    "nothing_held",
    "load_unexplained",
    "mass_contradicted",
    "known_mass_not_kept",
    "inconsistent",
    "offset_suspected",
    "constant_channels",
)
"""Findings for which no precision is promised, the gravest first: the values may be off by more
than their intervals, or there is no payload to be known."""

LARGEST_UNEXPLAINED = 0.3
"""Fraction of the load from which what the model leaves unexplained shows the result to be wrong:
friction of a geared arm rarely exceeds it."""

LARGEST_OFFSET = 0.05
"""Fraction of the force of the load that an offset of the wrenches may have before it shows the
result to be wrong. An offset changes the mass by up to this fraction (``bench/contradicted.py``).
Gains of 5 %, drifts of 1 N and mountings of 2 degrees look like offsets of up to 4 % there."""

LARGEST_SHIFT_M = 0.01
"""Shift of the centre of mass by the moment of an offset, m, from which the result is wrong. Where
offsets are smaller in both measures, the centre of mass is right to 4 mm in
``bench/contradicted.py``."""

CERTAIN = 5.0
"""Standard deviations by which an offset must exceed its limits: those from which a contradiction
is reported at all."""

LARGEST_DISTANCE_OF_BODY = 25.0
"""Standard deviations from the nearest body that can exist from which the result is wrong. A slim
rod, on the border of what can exist, is 15 away by 0.02 rad of a joint, which leaves mass and
centre of mass right, and 27 by a mounting of the sensor that is turned by 2 degrees
(``bench/contradicted.py``)."""

LARGEST_DISTANCE_OF_MASS = 100.0
"""Standard deviations from which on a given mass is another body's or in another unit: no noise and
no usual error of a sensor is as large."""


@dataclass(frozen=True)
class Finding:
    """Something that a reader of the result should know; ``print`` shows it as a sentence."""

    kind: str
    """Name of what was noticed, such as ``negative_mass``."""
    data: Mapping[str, Any] = field(default_factory=dict)
    """The numbers and names that belong to the kind."""
    style: Style = field(default="keyword", compare=False, repr=False)
    """Who reads the sentence: it decides which options it names."""

    def __str__(self) -> str:
        return self.worded(self.style)

    @property
    def contradicts_result(self) -> bool:
        """Whether the finding shows the result to be wrong."""
        if self.kind == "load_unexplained":
            return bool(self.data["residual_rms"] > LARGEST_UNEXPLAINED * self.data["load_rms"])
        if self.kind == "efforts_beyond_limits":
            return not self.data["limits_are_equal"]
        if self.kind == "mass_contradicted":
            return bool(self.data["distance"] > LARGEST_DISTANCE_OF_MASS)
        if self.kind == "inconsistent":
            return bool(self.data["distance"] > LARGEST_DISTANCE_OF_BODY)
        if self.kind == "offset_suspected":
            return _is_large_offset(self.data)
        if is_of_another_arm(self.kind, self.data):
            return True
        return self.kind in CONTRADICTIONS

    def worded(self, style: Style) -> str:
        """Returns the finding in sentences, with options as the reader would write them."""
        return wording.finding(self.kind, self.data, style)


def _is_large_offset(data: Mapping[str, Any]) -> bool:
    """Whether an offset is certainly so large that a result without it is wrong."""
    pairs = zip(data["values"], data["std_devs"], strict=True)
    # An unknown component has an infinite standard deviation.
    certain = [max(abs(value) - CERTAIN * std_dev, 0.0) for value, std_dev in pairs]
    load = float(data["load_force_rms_n"])
    is_heavy = math.hypot(*certain[:3]) > LARGEST_OFFSET * load
    return is_heavy or math.hypot(*certain[3:]) > LARGEST_SHIFT_M * load


@dataclass(frozen=True)
class DataFault:
    """One kind of fault in the messages of one topic; ``print`` shows it as a sentence."""

    topic: str
    """Topic of the messages or name of the array, or ``samples`` for what could not be aligned."""
    kind: str
    """Kind of the fault, such as ``out_of_order``."""
    count: int
    """Number of occurrences."""
    first: float = math.nan
    """Time of the first occurrence on the recording's clock, s; NaN where it is not known."""
    joint: str | None = None
    """Name of the joint, where the fault is that of one joint; else None."""

    def __str__(self) -> str:
        return f"{self.clause}."

    @property
    def clause(self) -> str:
        """The topic, how often the fault occurred, what was done about it, and the first time."""
        topic = "" if self.topic == "samples" else f"{self.topic}: "
        place = "the first at" if self.count > 1 else "at"
        since = f", {place} {self.first:.3f} s" if math.isfinite(self.first) else ""
        return f"{topic}{faults.fault(self.kind, self.count, self.joint)}{since}"
