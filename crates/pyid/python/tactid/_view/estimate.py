"""A result that ``tactid identify --result`` wrote, read back."""

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tactid._base.errors import ArgumentError
from tactid._base.values import PATHS, Z95, Array
from tactid._native import MassProperties

BORDER = 0.01
"""By which a largest moment of inertia may exceed the sum of the two others, times itself: a flat
plate lies on that border, and half of its good estimates beyond."""


@dataclass(frozen=True)
class Channel:
    """A measured signal, and what the estimate predicts for it."""

    name: str
    unit: str
    measured: Array
    predicted: Array


@dataclass(frozen=True)
class Estimate:
    """What a result says; NaN for what is unknown."""

    values: Array
    """(10,), in the order of ``VALUE_NAMES``: kg, m, and kg m² about the centre of mass."""
    half_width: Array
    """(10,): with 95 % confidence, the values are off by no more than this."""
    frame: str | None
    """The link in whose frame the values are."""
    remarks: list[str]
    start_ns: int | None
    """The stamp at which the times below are zero."""
    history_time: Array
    history: Array
    """(H, 10)."""
    history_half_width: Array
    fit_time: Array
    channels: list[Channel]

    @classmethod
    def read(cls, path: Path) -> "Estimate":
        """Reads a result; the error for any other file says what is wrong in it."""
        try:
            record = json.loads(path.read_bytes())
        except ValueError as error:
            said = "" if isinstance(error, UnicodeDecodeError) else f" ({error})"
            expected = "expected the file that tactid identify writes as its result"
            raise ArgumentError(f"{path} is not JSON{said}: {expected}", option="result") from None
        try:
            return cls._of(record)
        except _WrongError as error:
            raise ArgumentError(f"{path} is not a result of tactid identify: {error}") from None

    @classmethod
    def _of(cls, record: Any) -> "Estimate":
        estimate = _get(record, "estimate", dict)
        fit = _get(record, "fit", dict, {})
        history = _get(record, "history", dict, {})
        fit_time = _array(fit, "times_s", (-1,))
        history_time = _array(history, "times_s", (-1,))
        points, channels = len(history_time), _get(fit, "channels", list, [])
        shape = (len(fit_time), len(channels))
        measured, predicted = (_array(fit, name, shape) for name in ("measured", "predicted"))
        values = _ten(_get(estimate, "values", dict), "values")
        limits = _get(estimate, "intervals", dict, {})
        low, high = (_ten(limits, "intervals", side) for side in (0, 1))
        return cls(
            values=values,
            half_width=np.maximum(values - low, high - values),
            frame=_get(estimate, "frame", str, ""),
            remarks=[str(remark) for remark in _get(record, "remarks", list, [])],
            start_ns=_get(record, "start_ns", int) if history else None,
            history_time=history_time,
            history=_array(history, "values", (points, 10)),
            history_half_width=Z95 * _array(history, "std_devs", (points, 10)),
            fit_time=fit_time,
            channels=[
                Channel(
                    name=_get(channel, "name", str),
                    unit=_get(channel, "unit", str),
                    measured=measured[:, k],
                    predicted=predicted[:, k],
                )
                for k, channel in enumerate(channels)
            ],
        )

    @property
    def com(self) -> Array:
        """Centre of mass, m."""
        return self.values[1:4]

    def ellipsoid(self) -> tuple[Array, Array] | None:
        """The ellipsoid of uniform density that has this mass and inertia.

        Returns:
            Its semi-axes, m, and as columns their directions in :attr:`frame`; None where something
            is unknown, or no body has this mass and inertia.
        """
        if not np.isfinite(self.values).all():
            return None
        xx, xy, xz, yy, yz, zz = self.values[4:]
        inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        mass = float(self.values[0])
        if not MassProperties(mass, self.com, inertia).is_physical_within(BORDER):
            return None
        moments, axes = np.linalg.eigh(inertia)
        # A body's moment about an axis is m/5 (b² + c²) of the two other semi-axes.
        squares = 5 / (2 * mass) * (moments.sum() - 2 * moments)
        axes[:, 2] *= np.linalg.det(axes)  # a rotation, not a reflection
        return np.sqrt(np.maximum(squares, 0.0)), axes


class _WrongError(Exception):
    """What is wrong in a record."""


def _get(record: Any, key: str, kind: type, default: Any = None) -> Any:
    """The entry of a record; ``default`` where there is none, unless that is None."""
    if not isinstance(record, dict):
        raise _WrongError(f"expected an object with {key!r}, found {_brief(record)}")
    value = record.get(key, default)
    if value is None:
        raise _WrongError(f"{key!r} is missing")
    if not isinstance(value, kind):
        raise _WrongError(f"{key!r} is {_brief(value)}")
    return value


def _ten(record: dict[str, Any], name: str, side: int | None = None) -> Array:
    """Ten values, or a side of ten pairs, from their nested layout; NaN for null and no entry."""
    values: list[Any] = []
    for path in PATHS:
        place: Any = record
        for key in path:
            place = place.get(key) if isinstance(place, dict) else None
        if side is not None and isinstance(place, list):
            place = place[side] if len(place) == 2 else None
        values.append(place)
    if name == "values" and all(value is None for value in values):
        raise _WrongError("'values' has none of mass, com and inertia")
    return _numbers(values, name)


def _array(record: dict[str, Any], key: str, shape: tuple[int, ...]) -> Array:
    """An array of a shape; of NaN, or empty, where there is none."""
    if record.get(key) is None:
        return np.full([max(length, 0) for length in shape], np.nan)
    rows = _get(record, key, list)
    wide = len(shape) == 2
    if wide and not all(isinstance(row, list) and len(row) == shape[1] for row in rows):
        raise _WrongError(f"{key!r} is not a list of rows of {shape[1]} numbers")
    array = _numbers([entry for row in rows for entry in row] if wide else rows, key)
    if shape[0] not in (-1, len(rows)):
        raise _WrongError(f"{key!r} has {len(rows)} entries for {shape[0]} times")
    return array.reshape(len(rows), *shape[1:])


def _numbers(values: list[Any], name: str) -> Array:
    for value in values:
        # To Python a boolean is a number, too.
        if value is not None and (isinstance(value, bool) or not isinstance(value, int | float)):
            raise _WrongError(f"{name!r} holds {_brief(value)} in place of a number")
    return np.array([math.nan if value is None else float(value) for value in values])


def _brief(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= 40 else f"{text[:37]}..."
