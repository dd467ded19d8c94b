"""What the results of a recording are made from.

``tactid.Identification`` is one :class:`Recording`; forms, JSON and report ask for no more than
this, so that they can be shown any other. N windows of C channels, H points of history; SI.
"""

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Estimate(Protocol):
    """The ten values, and what may be believed of them."""

    @property
    def values(self) -> Array:
        """In the order of ``VALUE_NAMES``, (10,)."""

    @property
    def identifiable(self) -> Sequence[bool]:
        """Whether the motion determined each of them."""

    @property
    def not_identifiable(self) -> list[str]:
        """The names of those that it did not."""

    @property
    def is_physical(self) -> bool:
        """Whether a body can have them, up to noise."""

    @property
    def intervals(self) -> int:
        """How many stretches of the log went into the estimate."""

    @property
    def refused(self) -> int:
        """How many samples did not."""

    @property
    def gaps(self) -> int:
        """How often the log fell silent for too long."""


class Found(Protocol):
    """What any log tells."""

    @property
    def estimate(self) -> Estimate:
        """Of the payload, in the frame ``tool``."""

    @property
    def tool(self) -> str:
        """The frame."""

    @property
    def way(self) -> str:
        """What was measured: wrenches, efforts, or joints and base."""

    @property
    def estimator(self) -> str:
        """How rows became parameters."""

    @property
    def gravity(self) -> Array:
        """Acceleration of gravity in the world, (3,)."""

    @property
    def duration(self) -> float:
        """Of the log."""

    @property
    def damage(self) -> list[str]:
        """What of the log could not be read."""


class Recording(Found, Protocol):
    """What a recording tells: with its uncertainty, and how well it fits."""

    @property
    def deviation(self) -> Array:
        """Standard deviation of each of the ten values, infinite where unknown, (10,)."""

    @property
    def principal_moments(self) -> Array:
        """Of inertia about the centre of mass, ascending, (3,)."""

    @property
    def principal_moment_deviation(self) -> Array:
        """Their standard deviations, infinite where unknown, (3,)."""

    def remaining(self, within: float) -> Array:
        """How much longer the motion must go on for each of the ten values, s, (10,)."""

    @property
    def start_ns(self) -> int:
        """The stamp of time 0, ns."""

    @property
    def history_time(self) -> Array:
        """(H,)."""

    @property
    def history(self) -> Array:
        """The ten values over time, (H, 10)."""

    @property
    def history_deviation(self) -> Array:
        """Their standard deviations, (H, 10)."""

    @property
    def fit_time(self) -> Array:
        """The middle of each window, (N,)."""

    @property
    def fit_measured(self) -> Array:
        """(N, C)."""

    @property
    def fit_predicted(self) -> Array:
        """What the estimate says should have been measured, (N, C)."""

    @property
    def fit_weight(self) -> Array:
        """How much each counted: 1 in full, 0 not at all, (N, C)."""

    @property
    def fit_held_out(self) -> NDArray[np.bool_]:
        """The windows that the estimate has not seen, (N,)."""

    @property
    def channels(self) -> list[str]:
        """The names of the C channels: ``force x``."""

    @property
    def channel_units(self) -> list[str]:
        """Their units."""

    @property
    def residual_rms(self) -> Array:
        """Of measured less predicted where the fit was made, (C,)."""

    @property
    def held_out_rms(self) -> Array:
        """The same on the windows held out, (C,)."""

    @property
    def stride(self) -> float:
        """From one window to the next, s."""

    @property
    def cutoff(self) -> float:
        """Above it measurements were smoothed away, Hz."""

    @property
    def delay(self) -> float:
        """By how much the stamps of what is felt are later than those of the motion, s."""

    @property
    def delay_estimate(self) -> float | None:
        """The same as estimated, s, corrected or not; None where it was not estimated."""

    @property
    def delay_deviation(self) -> float | None:
        """Its standard deviation, s."""

    @property
    def known_mass(self) -> float | None:
        """The payload's mass as it was given, kg; None where it was not."""

    @property
    def known_mass_deviation(self) -> float | None:
        """Its standard deviation, kg."""

    @property
    def bounding_box(self) -> Array | None:
        """Least and largest corner of the box that was given, (2, 3); None where it was not."""

    @property
    def offset(self) -> Array:
        """What the first channels are off by, in their units; empty where that was not asked."""

    @property
    def offset_deviation(self) -> Array:
        """Its standard deviations, likewise."""

    @property
    def clock(self) -> str:
        """Where times came from."""

    @property
    def dirt(self) -> Sequence[tuple[str, str, int, float]]:
        """What could not be used: topic, what was wrong, how many, and when first, s."""

    @property
    def excitation_values(self) -> Array:
        """How strongly the motion excites each direction, the strongest first, (10,)."""

    @property
    def excitation_directions(self) -> Array:
        """Those directions, a row each, in mass, its first moment, and inertia about the origin.

        All ten are scaled to compare, (10, 10).
        """

    @property
    def motion_advice(self) -> list[str]:
        """Which motion would excite the weak directions."""

    @property
    def remarks(self) -> list[str]:
        """What was noticed on the way from the log to the estimate."""
