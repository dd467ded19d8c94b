"""Units of columns, as their names or an option state them."""

import math
import re
from typing import NamedTuple


class Unit(NamedTuple):
    """A unit of a column."""

    dimension: str
    """What it measures, such as ``"angle"``."""
    factor: float
    """Value of one unit in SI."""


_DEG = math.radians(1.0)

_ANGLES = {"rad": 1.0, "mrad": 1e-3, "deg": _DEG, "degree": _DEG, "degrees": _DEG, "°": _DEG}
_TIMES = {"s": 1.0, "sec": 1.0, "ms": 1e-3, "msec": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9}
_LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
_FORCES = {"n": 1.0, "kn": 1e3, "mn": 1e-3}
_MOMENTS = {"nm": 1.0, "mnm": 1e-3, "nmm": 1e-3, "ncm": 1e-2}
_CURRENTS = {"a": 1.0, "ma": 1e-3}


def _rates(dimension: str, units: dict[str, float]) -> dict[str, Unit]:
    """Returns units of a change in a second, by each of the ways in which they are written."""
    return {
        name: Unit(f"{dimension} rate", factor)
        for unit, factor in units.items()
        for name in (f"{unit}/s", f"{unit}_s", f"{unit}_per_s", f"{unit}ps")
    }


UNITS = {
    **{name: Unit("time", factor) for name, factor in _TIMES.items()},
    **{name: Unit("angle", factor) for name, factor in _ANGLES.items()},
    **{name: Unit("length", factor) for name, factor in _LENGTHS.items()},
    **{name: Unit("force", factor) for name, factor in _FORCES.items()},
    **{name: Unit("moment", factor) for name, factor in _MOMENTS.items()},
    **{name: Unit("current", factor) for name, factor in _CURRENTS.items()},
    **_rates("angle", _ANGLES),
    **_rates("length", _LENGTHS),
}
"""Units by their names in lower case."""

_IN_BRACKETS = re.compile(r"(?P<stem>.*\S)\s*[\[(]\s*(?P<unit>[^\[\]()]*[^\[\]()\d\s])\s*[\])]")


def unit_of(text: str) -> Unit | None:
    """Returns the unit of a name such as ``deg/s``, ``N m`` or ``mm``; None where it is none."""
    return UNITS.get(re.sub(r"[\s·*.]+", "", text.lower()))


def in_brackets(name: str) -> tuple[str, str] | None:
    """Splits ``x [mm]`` or ``x (mm)`` into the name and the unit; None without brackets."""
    found = _IN_BRACKETS.fullmatch(name.strip())
    return None if found is None else (found["stem"], found["unit"])


def readings(name: str) -> list[tuple[str, Unit | None]]:
    """Returns what the name of a column may mean: a stem and its unit, or the whole name."""
    found: list[tuple[str, Unit | None]] = [(name, None)]
    bracketed = in_brackets(name)
    if bracketed is not None and (unit := unit_of(bracketed[1])) is not None:
        return [(bracketed[0], unit)]
    # "deg_s" is a rate, though "s" is a unit, too.
    for rate in (r"_per_s", r"[_/]s", ""):
        suffixed = re.fullmatch(rf"(.+)[_ /]([^\W\d_]+{rate})", name.strip())
        if suffixed is not None and (unit := unit_of(suffixed[2])) is not None:
            return [*found, (suffixed[1], unit)]
    return found
