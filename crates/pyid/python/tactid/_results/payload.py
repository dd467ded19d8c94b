"""An identified payload: ten values, their intervals, and whether the motion excites them."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from tactid._base.bodies import why_impossible
from tactid._base.field_docs import with_fields
from tactid._base.values import (
    Array,
    Interval,
    Observability,
    half_widths,
    noise_intervals,
    reported_intervals,
    where_reported,
)
from tactid._native import VALUE_NAMES, MassProperties
from tactid._results import records, table
from tactid._results.formats import Formats


class Payload(Formats):
    """What every estimate of a payload offers, whether it has intervals or not."""

    if TYPE_CHECKING:
        frame: str
        values: Array
        observability: Sequence[Observability]
        is_physical: bool
        windows: int
        rejected: int
        gaps: int

    @property
    def body(self) -> MassProperties:
        """The payload alone as a body in :attr:`frame`.

        An unobservable value is meaningless: see :attr:`reported_values`.
        """
        return MassProperties.from_values(self.values)

    @property
    def identifiable(self) -> list[bool]:
        """Whether each of the ten values is identifiable: see :attr:`observability`."""
        return [each == "identifiable" for each in self.observability]

    @property
    def not_identifiable(self) -> list[str]:
        """The names of the values that are uncertain or unobservable."""
        return self._named("uncertain", "unobservable")

    @property
    def uncertain(self) -> list[str]:
        """The names of the values that the motion excites, but that have wide intervals."""
        return self._named("uncertain")

    @property
    def unobservable(self) -> list[str]:
        """The names of the values that the motion does not excite."""
        return self._named("unobservable")

    @property
    def is_reported(self) -> list[bool]:
        """Whether each of the ten values is reported as a number."""
        return self.identifiable

    @property
    def reported_values(self) -> list[float | None]:
        """The ten values; None for each that is unobservable, or uncertain without limits."""
        return where_reported(self.is_reported, self.values)

    @property
    def reported_intervals(self) -> list[Interval | None]:
        """The 95 % interval of each of the ten values; None where there is none."""
        return [None] * len(VALUE_NAMES)

    @property
    def half_widths(self) -> list[float | None]:
        """Distance from each value to the farther limit of its 95 % interval; None without one.

        It is half of the interval, unless the interval is cut at what a body can have.
        """
        return half_widths(self.reported_values, self.reported_intervals)

    @property
    def why_impossible(self) -> str | None:
        """Why no body can have these values; None where one can, or where too few are known."""
        if self.is_physical or not self.is_reported[0]:
            return None
        if self.values[0] <= 0 or all(self.is_reported):
            return why_impossible(self.values.tolist()) or "the estimate has not converged"
        return None

    def __repr__(self) -> str:
        return f"<tactid.{type(self).__name__}: {self.summary}>"

    def __str__(self) -> str:
        return table.plain_text([self._column()], table.heading(self.frame))

    def _repr_html_(self) -> str:
        return table.html_table(self._column(), table.heading(self.frame))

    @property
    def summary(self) -> str:
        """Mass, frame and number of identifiable values, on one line."""
        mass = f"{table.number(self.values[0])} kg" if self.is_reported[0] else "unknown mass"
        found = f"{sum(self.identifiable)} of {len(VALUE_NAMES)} values identifiable"
        return f"{mass} in {self.frame}, {found}"

    def _named(self, *states: Observability) -> list[str]:
        pairs = zip(VALUE_NAMES, self.observability, strict=True)
        return [name for name, each in pairs if each in states]

    def _column(self) -> table.Column:
        return table.Column(
            "value",
            self.reported_values,
            intervals=self.reported_intervals,
            observability=self.observability,
        )


@with_fields
class PayloadEstimate(Payload, records.PayloadEstimate):
    """An identified payload with its uncertainty, expressed in one frame.

    ``print`` shows it as a table; :meth:`to_urdf`, :meth:`to_mujoco` and :meth:`to_controller`
    give it to other programs. A program can construct one, too:

    >>> import numpy as np
    >>> estimate = tactid.PayloadEstimate(
    ...     "tool0",
    ...     values=np.array([1.5, 0, 0, 0.1, 0.02, 0, 0, 0.03, 0, 0.04]),
    ...     std_devs=np.full(10, 1e-3),
    ...     observability=["identifiable"] * 10,
    ...     is_physical=True,
    ... )
    >>> estimate
    <tactid.PayloadEstimate: 1.5000 kg in tool0, 10 of 10 values identifiable>
    """

    def __post_init__(self) -> None:
        """Makes the intervals, where none are given, 1.96 standard deviations to both sides."""
        super().__post_init__()
        if len(self.intervals) == 0:
            found = noise_intervals(self.values, self.std_devs)
            object.__setattr__(self, "intervals", found)

    @property
    def is_reported(self) -> list[bool]:
        """Whether each of the ten values is reported as a number.

        An identifiable value is, and an uncertain one with two finite limits.
        """
        pairs = zip(self.observability, self.intervals.tolist(), strict=True)
        return [
            each == "identifiable" or (each == "uncertain" and all(map(math.isfinite, limits)))
            for each, limits in pairs
        ]

    @property
    def reported_intervals(self) -> list[Interval | None]:
        """The 95 % interval of each of the ten values; None where there is none."""
        return reported_intervals(self.is_reported, self.intervals)


@with_fields
class PaperEstimate(Payload, records.PaperEstimate):
    """A payload as the paper's filter identifies it: ten values without any uncertainty."""
