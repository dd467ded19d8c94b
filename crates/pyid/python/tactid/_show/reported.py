"""The numbers of a result as they are reported.

None stands where a value is unobservable, or uncertain without limits.
"""

from dataclasses import replace
from typing import TypeAlias, get_args

import numpy as np

from tactid._base.values import (
    KINDS,
    PATHS,
    Z95,
    Array,
    Interval,
    Observability,
    reported_intervals,
    where_reported,
)
from tactid._results.combination import CombinationData
from tactid._results.identification import IdentificationData, Recorded
from tactid._results.records import PrincipalMoments
from tactid._results.table import Column
from tactid._results.truth import Truth

Result: TypeAlias = Recorded | CombinationData
"""A result with a payload: that of one recording, or of several."""


def moments(result: Result) -> list[float | None]:
    """Returns the principal moments, ascending.

    None stands for one unless every entry of the inertia is reported, and its standard deviation is
    finite.
    """
    known = all(result.estimate.is_reported[KINDS[2]])
    found = result.principal_moments
    if found is None:
        return [None] * 3
    if isinstance(found, PrincipalMoments):
        return where_reported(known & ~np.isinf(found.std_devs), found.values)
    return where_reported([known] * 3, found)


def moment_intervals(result: Result) -> list[Interval | None]:
    """Returns the 95 % interval of each principal moment; None where it is unknown."""
    known = [value is not None for value in moments(result)]
    found = result.principal_moments
    if isinstance(found, PrincipalMoments):
        return reported_intervals(known, found.intervals)
    return [None] * 3


def column_of(title: str, result: Result) -> Column:
    """Returns the column of a payload: the ten values, then the three principal moments."""
    estimate = result.estimate
    # A moment depends on all entries of the inertia.
    of_moments = max(estimate.observability[KINDS[2]], key=get_args(Observability).index)
    shape = result.shape if isinstance(result, IdentificationData | CombinationData) else None
    return Column(
        title,
        estimate.reported_values + moments(result),
        intervals=estimate.reported_intervals + moment_intervals(result),
        observability=[*estimate.observability, *[of_moments] * 3],
        shape_fractions=None if shape is None else [*shape.fraction.tolist(), *[None] * 3],
    )


def column(result: Recorded, truth: Truth | None = None) -> Column:
    """Returns the column of a recording, with its errors where the truth is known."""
    errors = None
    if truth is not None:
        values, principal = result.estimate.reported_values, moments(result)
        errors = truth.errors_percent(values) + truth.moment_errors_percent(principal)
    found = replace(column_of(result.estimator, result), errors=errors)
    return found if isinstance(result, IdentificationData) else replace(found, intervals=None)


def reported_history(result: Recorded) -> dict[str, Array]:
    """Returns each value over time, and its standard deviation where the estimator has any.

    NaN stands for what is not known yet: there the standard deviation is infinite.
    """
    values = np.array(result.history.values, dtype=float).reshape(-1, len(PATHS))
    known = np.isfinite(values) & np.array(result.estimate.is_reported)
    found = {"values": values}
    if isinstance(result, IdentificationData):
        found["std_devs"] = np.array(result.history.std_devs, dtype=float).reshape(values.shape)
        known &= np.isfinite(found["std_devs"])
    return {name: np.where(known, array, np.nan) for name, array in found.items()}


def offsets(result: IdentificationData) -> list[tuple[str, str, float, float]]:
    """Returns the channels' offsets: name, unit, value, and half of its 95 % interval."""
    fit = result.fit
    if fit.wrench_offset is None:
        return []
    names = [(channel.name, channel.unit) for channel in fit.channels[:6]]
    numbers = zip(fit.wrench_offset.values, Z95 * fit.wrench_offset.std_devs, strict=True)
    pairs = zip(names, numbers, strict=True)
    return [(name, unit, float(value), float(half)) for (name, unit), (value, half) in pairs]
