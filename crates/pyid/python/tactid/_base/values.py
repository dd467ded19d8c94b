"""The ten values of a payload: their order, their nested layout in JSON, and their kinds."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import Any, Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

Observability = Literal["identifiable", "uncertain", "unobservable"]
"""Whether the motion excites a value, and whether the noise leaves enough of it."""

Values = Sequence[float | None]
"""Mass, kg; centre of mass, m; inertia about it, kg m²: ten, in the order of ``VALUE_NAMES``."""

PATHS = (
    ("mass",),
    *(("com", axis) for axis in ("x", "y", "z")),
    *(("inertia", axes) for axes in ("xx", "xy", "xz", "yy", "yz", "zz")),
)
"""Where each of the ten values stands in a nested result."""

UNITS = ("kg", *["m"] * 3, *["kg m²"] * 6)
"""Units of the ten values."""

MOMENT_NAMES = ("moment 1", "moment 2", "moment 3")
"""Names of the principal moments of inertia, ascending."""

MOMENT_UNIT = "kg m²"
"""Unit of the principal moments of inertia."""

KINDS = (slice(0, 1), slice(1, 4), slice(4, 10))
"""Mass, centre of mass and inertia among the ten values."""

KIND_NAMES = ("mass", "centre of mass", "inertia")
"""Names of the kinds, in the order of :data:`KINDS`."""

Z95 = 1.96
"""Half the width of a 95 % interval, in standard deviations."""


CUT = 1e-6
"""Relative difference of the two sides of an interval from which on it is cut: above rounding."""


def nested(values: Sequence[Any]) -> dict[str, Any]:
    """Lays ten entries out as ``mass``, ``com`` and ``inertia``; None for what is not finite."""
    result: dict[str, Any] = {"com": {}, "inertia": {}}
    for path, value in zip(PATHS, values, strict=True):
        place = result if len(path) == 1 else result[path[0]]
        place[path[-1]] = finite(value) if isinstance(value, (int, float)) else value
    return {"mass": result["mass"], **result}


def entries(record: Mapping[str, Any]) -> list[Any]:
    """Returns the ten entries of a nested layout: the inverse of :func:`nested`."""
    return [record[p[0]] if len(p) == 1 else record[p[0]][p[1]] for p in PATHS]


def flat(record: Mapping[str, Any]) -> list[float]:
    """Returns the ten values of a nested layout, all of which are numbers."""
    return [float(entry) for entry in entries(record)]


class Body(Protocol):
    """The ten values of a body, as :class:`tactid.MassProperties` has them."""

    @property
    def mass(self) -> float:
        """Mass, kg."""

    @property
    def com(self) -> NDArray[np.float64]:
        """Centre of mass, (3,), m."""

    @property
    def inertia(self) -> NDArray[np.float64]:
        """Inertia about the centre of mass, (3, 3), kg m²."""


def values_of(body: Body) -> list[float]:
    """Returns the ten values of a body."""
    i = body.inertia
    inertia = (i[0, 0], i[0, 1], i[0, 2], i[1, 1], i[1, 2], i[2, 2])
    return [body.mass, *map(float, body.com), *map(float, inertia)]


class Interval(NamedTuple):
    """A 95 % interval: as far to each side as the noise makes it, but cut where no body can be."""

    low: float
    """Lower limit."""
    high: float
    """Upper limit."""

    def half_width(self, value: float) -> float:
        """Returns the distance from an estimate inside to the farther limit."""
        return max(value - self.low, self.high - value)

    def is_cut(self, value: float) -> bool:
        """Whether one limit is nearer to the estimate than the other."""
        below, above = value - self.low, self.high - value
        return abs(above - below) > CUT * (above + below)


def half_widths(values: Values, intervals: Sequence[Interval | None]) -> list[float | None]:
    """Returns the distance from each value to the farther limit; None without a value or limits."""
    pairs = zip(values, intervals, strict=True)
    return [
        None if value is None or interval is None else interval.half_width(value)
        for value, interval in pairs
    ]


def reported_intervals(known: Iterable[bool], limits: NDArray[np.float64]) -> list[Interval | None]:
    """Returns the intervals with these limits, (N, 2); None where not known or not finite."""
    return [
        Interval(float(low), float(high)) if yes and np.isfinite([low, high]).all() else None
        for yes, (low, high) in zip(known, limits, strict=True)
    ]


def noise_intervals(
    values: NDArray[np.float64], std_devs: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Returns limits 1.96 standard deviations to each side of each value, (N, 2)."""
    limits: NDArray[np.float64] = values[:, None] + np.outer(std_devs, [-Z95, Z95])
    return limits


def listed_fields(data: object) -> dict[str, Any]:
    """Returns the fields of a dataclass by their names, with lists in place of arrays."""

    def listed(value: Any) -> Any:
        if is_dataclass(value):
            return listed_fields(value)
        return value.tolist() if isinstance(value, np.ndarray) else value

    return {each.name: listed(getattr(data, each.name)) for each in fields(data)}  # type: ignore[arg-type]


def where_reported(known: Iterable[bool], values: Iterable[float]) -> list[float | None]:
    """Returns each number that is known and finite, and None for the others."""
    return [finite(value) if yes else None for value, yes in zip(values, known, strict=True)]


def finite(value: float) -> float | None:
    """Returns the number, or None where it is infinite or NaN, which JSON does not have."""
    return float(value) if math.isfinite(value) else None


def digits_of(half_width: float, most: int = 9) -> int:
    """Returns the number of decimals that show two figures of a half width, ``most`` at most."""
    return min(max(1 - math.floor(math.log10(half_width)), 0), most) if half_width > 0 else most
