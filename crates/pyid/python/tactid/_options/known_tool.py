"""A known tool as Python gives it: a body, ten numbers, a result, or the JSON file of one."""

import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tactid._base.errors import ArgumentError
from tactid._base.values import Values, entries, finite, values_of
from tactid._native import VALUE_NAMES, MassProperties

LARGEST_FILE = 512 * 1024 * 1024
"""Largest JSON file that is read, bytes: results with all time series have a few megabytes."""


def plain_tool(given: object) -> object:
    """Returns a known tool as Rust reads it; anything else is returned as it is, for its error.

    Raises:
        ArgumentError: The file is not that of a result, or the data contradict the result.
    """
    if isinstance(given, MassProperties):
        return _tool(values_of(given))
    if isinstance(given, str | os.PathLike):
        return _of_file(Path(given))
    if isinstance(given, Sequence | np.ndarray) and np.shape(given) == (len(VALUE_NAMES),):
        return _tool([float(value) for value in given])
    if getattr(given, "is_contradicted", False):
        raise _error("is a result that its data contradict: identify the tool again")
    estimate: Any = getattr(given, "estimate", given)
    if not hasattr(estimate, "reported_values"):
        return given
    std_devs, covariance = (getattr(estimate, name, None) for name in ("std_devs", "covariance"))
    return _tool(
        estimate.reported_values,
        frame=estimate.frame,
        std_devs=None if std_devs is None else [finite(each) for each in std_devs],
        covariance=None if covariance is None else covariance.tolist(),
    )


def _tool(values: Values, **uncertainty: Any) -> dict[str, Any]:
    """Returns ten values and their uncertainty by the names that Rust reads."""
    mass, *rest = values
    com, inertia = rest[:3], rest[3:]
    if mass is None:
        raise _error("has no mass: the motion of its recording does not determine it")
    tool: dict[str, Any] = {"mass_kg": mass}
    if None not in com:
        tool["center_of_mass"] = com
    if None not in inertia:
        xx, xy, xz, yy, yz, zz = inertia
        tool["inertia"] = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
    return tool | {name: value for name, value in uncertainty.items() if value is not None}


def _of_file(path: Path) -> dict[str, Any]:
    """Reads the tool from the JSON file of a result."""
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise _error(f"is {path}: the file is too large for a result")
        document = json.loads(path.read_bytes())
        estimate = document["estimate"]
        values = entries(estimate["values"])
    except OSError as error:
        raise _error(f"is {path}: {error.strerror}") from None
    except (ValueError, KeyError, TypeError, RecursionError):
        raise _error(f"is {path}: expected the JSON file of an earlier result") from None
    if document.get("is_contradicted"):
        raise _error(f"is {path}, a result that its data contradict: identify the tool again")
    std_devs = estimate.get("std_devs")
    return _tool(
        values,
        frame=estimate.get("frame"),
        std_devs=None if std_devs is None else entries(std_devs),
        covariance=estimate.get("covariance"),
    )


def _error(what: str) -> ArgumentError:
    return ArgumentError(f"`known_tool` {what}", option="known_tool")
