"""The numbers of a result as they are reported: None where the motion did not determine a value."""

from typing import Protocol

import numpy as np

from tactid.fit import Array
from tactid.identification import IdentificationData, PayloadEstimate, PrincipalMoments
from tactid.table import Column
from tactid.truth import Truth
from tactid.values import KINDS, PATHS, Z95, where_known


class Payload(Protocol):
    """A result with a payload: that of one recording, or of several."""

    @property
    def estimate(self) -> PayloadEstimate:
        """The payload."""

    @property
    def principal_moments(self) -> PrincipalMoments:
        """Its principal moments of inertia."""


def moments(result: Payload) -> list[float | None]:
    """Returns the principal moments, ascending: None unless the whole inertia is known."""
    known = all(result.estimate.identifiable[KINDS[2]])
    bounded = ~np.isinf(result.principal_moments.std_devs)
    return where_known(known & bounded, result.principal_moments.values)


def moment_half_widths(result: Payload) -> list[float | None]:
    """Returns half of the 95 % interval of each principal moment; None where it is unknown."""
    known = [value is not None for value in moments(result)]
    return where_known(known, Z95 * result.principal_moments.std_devs)


def column(result: IdentificationData, truth: Truth | None = None) -> Column:
    """Returns the column of a recording: the ten values, then the three principal moments."""
    values, principal = result.estimate.known_values, moments(result)
    errors = None
    if truth is not None:
        errors = truth.errors_percent(values) + truth.moment_errors_percent(principal)
    half_widths = None
    if result.fit is not None:
        half_widths = result.estimate.half_widths + moment_half_widths(result)
    return Column(result.estimator, values + principal, errors, half_widths)


def known_history(result: IdentificationData) -> tuple[Array, Array]:
    """Returns each value and its standard deviation over time, NaN for what was not known.

    A value is not known yet where its standard deviation is infinite, unless the estimator gives no
    finite one at all: then it estimates none, and its values stand without.
    """
    values = np.array(result.history.values, dtype=float).reshape(-1, len(PATHS))
    std_devs = np.array(result.history.std_devs, dtype=float).reshape(values.shape)
    bounded = np.isfinite(std_devs)
    determined = bounded | ~bounded.any(axis=0)
    known = np.isfinite(values) & determined & np.array(result.estimate.identifiable)
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
