"""A result as JSON: the layout of ``result.json`` and of ``tactid identify --json``."""

import json
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactid import reported
from tactid.identification import Fit, Identification
from tactid.naming import Style
from tactid.outlook import WITHIN
from tactid.values import Z95, all_finite, finite, nested, values_of
from tactid.wording import finding, motion_advice, remarks

MOST_POINTS = 2000
"""Largest number of points of a time series in JSON."""


def to_json(record: dict[str, Any]) -> str:
    """Returns JSON that people can read, too; it never contains NaN."""
    return json.dumps(record, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def record(
    result: Identification, within: float = WITHIN, style: Style = "keyword"
) -> dict[str, Any]:
    """Returns the result as JSON has it, but for its time series.

    Args:
        result: The identification.
        within: Target for the remaining time, as :meth:`Identification.remaining` takes it.
        style: Who reads the sentences: it decides how they spell options.
    """
    remaining = result.remaining(within)
    return {
        "estimate": nested(reported.estimate_values(result)),
        "half_width_95": nested(reported.half_widths(result)),
        "principal_moments": {
            "values": reported.moments(result),
            "half_width_95": reported.moment_half_widths(result),
        },
        "remaining_s": {
            "within": within,
            "all": finite(remaining.max()),
            "each": nested([float(seconds) for seconds in remaining]),
        },
        "frame": result.estimate.frame,
        "method": result.method,
        "estimator": result.estimator,
        "diagnostics": diagnostics(result),
        "findings": [
            {"kind": noticed.kind, **_plain(noticed.data), "text": finding(noticed, style)}
            for noticed in result.findings
        ],
        "remarks": remarks(result, style),
    }


def diagnostics(result: Identification) -> dict[str, Any]:
    """Returns the reasons to trust a result, or not to."""
    estimated, mass, box = result.estimated_delay, result.known_mass, result.bounding_box
    return (
        _of_every_estimator(result)
        | {
            "clock": result.clock,
            "delay_s": finite(result.delay),
            "estimated_delay_s": None if estimated is None else finite(estimated.value),
            "estimated_delay_std_dev_s": None if estimated is None else finite(estimated.std_dev),
            "known_mass_kg": None if mass is None else mass.value,
            "known_mass_std_dev_kg": None if mass is None else mass.std_dev,
            "bounding_box_m": None if box is None else box.tolist(),
            "wrench_offset": _wrench_offset(result),
            "faults": [
                {
                    "topic": fault.topic,
                    "kind": fault.kind,
                    "text": fault.phrase,
                    "count": fault.count,
                    "first_s": finite(fault.first),
                }
                for fault in result.faults
            ],
            "motion_advice": motion_advice(result.estimate.not_identifiable),
        }
        | ({} if result.fit is None else _of_the_fit(result.fit))
    )


def _wrench_offset(result: Identification) -> dict[str, Any] | None:
    """Returns the offset of the wrenches and its frame; None where it is not an unknown."""
    if result.fit is None or result.fit.wrench_offset is None:
        return None
    return {
        "frame": result.fit.wrench_offset.frame,
        "components": {
            name: {"value": finite(value), "half_width_95": finite(half_width), "unit": unit}
            for name, unit, value, half_width in reported.offsets(result)
        },
    }


def paper_diagnostics(result: Identification) -> dict[str, Any]:
    """Returns the reasons to trust a result of the paper's experiment, or not to."""
    settings, excitation = result.paper_settings, result.singular_values
    record = _of_every_estimator(result)
    if settings is not None:
        record |= {"average_s": settings.average, "epochs": settings.epochs}
    if excitation is not None:
        record["singular_values"] = {
            "mass": all_finite(excitation.mass),
            "inertia": all_finite(excitation.inertia),
        }
    if result.estimate.composite is not None:
        record["composite"] = nested(values_of(result.estimate.composite))
    return record


def _of_every_estimator(result: Identification) -> dict[str, Any]:
    estimate = result.estimate
    return {
        "method": result.method,
        "gravity_m_s2": all_finite(result.gravity),
        "cutoff_hz": finite(result.cutoff),
        "max_gap_s": finite(result.max_gap),
        "duration_s": finite(result.duration),
        "windows": estimate.windows,
        "rejected": estimate.rejected,
        "gaps": estimate.gaps,
        "not_identifiable": estimate.not_identifiable,
        "is_physical": estimate.is_physical,
        "interrupted": result.interrupted,
        "damage": list(result.damage),
    }


def _of_the_fit(fit: Fit) -> dict[str, Any]:
    held_out = int(np.count_nonzero(fit.held_out))
    names = [channel.name for channel in fit.channels]
    return {
        "stride_s": finite(fit.stride),
        "fit_windows": len(fit.time) - held_out,
        "held_out_windows": held_out,
        "residual_rms": dict(zip(names, all_finite(fit.residual_rms), strict=True)),
        "held_out_rms": dict(zip(names, all_finite(fit.held_out_rms), strict=True)),
        "excitation": all_finite(fit.excitation),
    }


def series(result: Identification) -> dict[str, Any]:
    """Returns the time series that belong to :func:`record`: the fit and the history."""
    points = thinned(len(result.history.time))
    values, std_devs = reported.known_history(result)
    return {
        "start_ns": int(result.start_ns),
        **({} if result.fit is None else {"fit": _fit_series(result.fit)}),
        "history": {
            "time_s": all_finite(result.history.time[points]),
            "values": [all_finite(row) for row in values[points]],
            "half_width_95": [all_finite(row) for row in Z95 * std_devs[points]],
        },
    }


def _fit_series(fit: Fit) -> dict[str, Any]:
    points = thinned(len(fit.time))
    return {
        "time_s": all_finite(fit.time[points]),
        "held_out": [bool(entry) for entry in fit.held_out[points]],
        "channels": [
            {
                "name": channel.name,
                "unit": channel.unit,
                "measured": all_finite(fit.measured[points, k]),
                "predicted": all_finite(fit.predicted[points, k]),
                "weight": all_finite(fit.weights[points, k]),
            }
            for k, channel in enumerate(fit.channels)
        ],
    }


def thinned(count: int, most: int = MOST_POINTS) -> NDArray[np.intp]:
    """Returns which of so many points to show: evenly spaced, with the first and the last."""
    if count <= most:
        return np.arange(count)
    return np.linspace(0, count - 1, most).round().astype(np.intp)


def _plain(data: Any) -> dict[str, Any]:
    """Returns the data of a finding with numbers that JSON has."""

    def plain(value: Any) -> Any:
        if isinstance(value, float):
            return finite(value)
        if isinstance(value, Iterable) and not isinstance(value, str):
            return [plain(entry) for entry in value]
        return value

    return {name: plain(value) for name, value in data.items()}
