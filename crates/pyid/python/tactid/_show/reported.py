"""The numbers of a result as they are reported.

None stands where a value is unobservable, or uncertain without limits.
"""

from dataclasses import replace
from typing import Protocol, get_args

import numpy as np

from tactid._base.values import (
    KINDS,
    PATHS,
    Z95,
    Array,
    Interval,
    Observability,
    half_widths,
    reported_intervals,
    where_reported,
)
from tactid._results.identification import IdentificationData
from tactid._results.payload import PayloadEstimate
from tactid._results.records import PrincipalMoments
from tactid._results.table import Column
from tactid._results.truth import Truth


class Payload(Protocol):
    """A result with a payload: that of one recording, or of several."""

    @property
    def estimate(self) -> PayloadEstimate:
        """The payload."""

    @property
    def principal_moments(self) -> PrincipalMoments | None:
        """Its principal moments of inertia; None where its mass is zero."""


def moments(result: Payload) -> list[float | None]:
    """Returns the principal moments, ascending.

    None stands for one unless every entry of the inertia is reported, and its standard deviation is
    finite.
    """
    known = all(result.estimate.is_reported[KINDS[2]])
    found = result.principal_moments
    if found is None:
        return [None] * 3
    return where_reported(known & ~np.isinf(found.std_devs), found.values)


def moment_intervals(result: Payload) -> list[Interval | None]:
    """Returns the 95 % interval of each principal moment; None where it is unknown."""
    known = [value is not None for value in moments(result)]
    found = result.principal_moments
    return [None] * 3 if found is None else reported_intervals(known, found.intervals)


def moment_half_widths(result: Payload) -> list[float | None]:
    """Returns the distance from each principal moment to the farther limit of its interval."""
    return half_widths(moments(result), moment_intervals(result))


def column_of(title: str, result: Payload) -> Column:
    """Returns the column of a payload: the ten values, then the three principal moments."""
    estimate = result.estimate
    # A moment depends on all entries of the inertia.
    of_moments = max(estimate.observability[KINDS[2]], key=get_args(Observability).index)
    return Column(
        title,
        estimate.reported_values + moments(result),
        intervals=estimate.reported_intervals + moment_intervals(result),
        observability=[*estimate.observability, *[of_moments] * 3],
    )


def column(result: IdentificationData, truth: Truth | None = None) -> Column:
    """Returns the column of a recording, with its errors where the truth is known."""
    errors = None
    if truth is not None:
        values, principal = result.estimate.reported_values, moments(result)
        errors = truth.errors_percent(values) + truth.moment_errors_percent(principal)
    found = replace(column_of(result.estimator, result), errors=errors)
    return found if result.fit is not None else replace(found, intervals=None)


def reported_history(result: IdentificationData) -> tuple[Array, Array]:
    """Returns each value and its standard deviation over time, NaN for what was not known.

    A value is not known yet where its standard deviation is infinite, unless the estimator gives no
    finite one at all: then it estimates none, and its values stand without.
    """
    values = np.array(result.history.values, dtype=float).reshape(-1, len(PATHS))
    std_devs = np.array(result.history.std_devs, dtype=float).reshape(values.shape)
    bounded = np.isfinite(std_devs)
    determined = bounded | ~bounded.any(axis=0)
    known = np.isfinite(values) & determined & np.array(result.estimate.is_reported)
    values[~known] = np.nan
    std_devs[~(known & bounded)] = np.nan
    return values, std_devs


def offsets(result: IdentificationData) -> list[tuple[str, str, float, float]]:
    """Returns the channels' offsets: name, unit, value, and half of its 95 % interval."""
    fit = result.fit
    if fit is None or fit.wrench_offset is None:
        return []
    names = [(channel.name, channel.unit) for channel in fit.channels[:6]]
    numbers = zip(fit.wrench_offset.values, Z95 * fit.wrench_offset.std_devs, strict=True)
    pairs = zip(names, numbers, strict=True)
    return [(name, unit, float(value), float(half)) for (name, unit), (value, half) in pairs]
