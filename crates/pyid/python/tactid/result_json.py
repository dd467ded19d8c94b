"""A result as JSON: the layout of ``result.json`` and of ``tactid identify --json``.

The file ``result.schema.json`` in this package describes every key.
"""

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactid import findings_json, reported
from tactid.files import write_atomically
from tactid.fit import Fit
from tactid.identification import IdentificationData
from tactid.naming import Style
from tactid.outlook import WITHIN
from tactid.payload import PayloadEstimate
from tactid.remarks import motion_advice, remarks
from tactid.values import Z95, Interval, all_finite, finite, nested, values_of

SCHEMA = "tactid.result/1"
"""Name and version of the layout: a change that breaks a reader increments the version."""

UNITS = {"mass": "kg", "com": "m", "inertia": "kg m²", "principal_moments": "kg m²", "time": "s"}
"""Units of the values; any other number has its unit in its key, or in the schema's description."""

MOST_POINTS = 2000
"""Largest number of points of a time series in JSON."""


def write(
    result: IdentificationData,
    path: Path,
    within: float = WITHIN,
    style: Style = "keyword",
    checks: Mapping[str, Any] | None = None,
) -> None:
    """Writes a result with its time series; ``checks`` are those of the run of a simulated log."""
    shown = record(result, within, style, checks) | {"series": series(result)}
    write_atomically(path, to_json(shown))


def to_json(record: dict[str, Any]) -> str:
    """Returns JSON that people can read, too; it never contains NaN."""
    return json.dumps(record, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def record(
    result: IdentificationData,
    within: float = WITHIN,
    style: Style = "keyword",
    checks: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Returns the result as JSON has it, but for its time series.

    Args:
        result: The identification.
        within: Target for the remaining time, as :meth:`Identification.remaining` takes it.
        style: Who reads the sentences: it decides how they spell options.
        checks: Further diagnostics: those of the run of a simulated log.
    """
    remaining = result.remaining(within)
    return {
        "schema": SCHEMA,
        "frame": result.estimate.frame,
        "inertia_about": "centre of mass",
        "units": UNITS,
        "estimate": nested(result.estimate.reported_values),
        "half_width_95": nested(result.estimate.half_widths),
        **intervals_and_observability(result.estimate),
        "principal_moments": {
            "values": reported.moments(result),
            "half_width_95": reported.moment_half_widths(result),
            "interval_95": limits(reported.moment_intervals(result)),
        },
        "remaining_s": {
            "within": within,
            "all": finite(remaining.max()),
            "each": nested([float(seconds) for seconds in remaining]),
        },
        "method": result.method,
        "estimator": result.estimator,
        "is_contradicted": result.is_contradicted,
        "diagnostics": diagnostics(result) | dict(checks or {}),
        "findings": findings_json.findings(result.findings, style),
        "remarks": remarks(result, style),
    }


def intervals_and_observability(estimate: PayloadEstimate) -> dict[str, Any]:
    """Returns the limits of the intervals, and whether the motion excites each value."""
    each = limits(estimate.reported_intervals)
    return {
        "interval_95": {side: nested(ends) for side, ends in each.items()},
        "observability": nested(estimate.observability),
    }


def limits(intervals: Iterable[Interval | None]) -> dict[str, list[float | None]]:
    """Returns the lower and the upper limits of intervals; None where there is no interval."""
    pairs = [(None, None) if interval is None else interval for interval in intervals]
    return {"low": [low for low, _ in pairs], "high": [high for _, high in pairs]}


def diagnostics(result: IdentificationData) -> dict[str, Any]:
    """Returns the reasons to trust a result, or not to."""
    estimate, estimated = result.estimate, result.estimated_delay
    mass, box = result.known_mass, result.bounding_box
    record = {
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
        "clock": result.clock,
        "delay_s": finite(result.delay),
        "estimated_delay_s": None if estimated is None else finite(estimated.value),
        "estimated_delay_std_dev_s": None if estimated is None else finite(estimated.std_dev),
        "subtracts_unloaded": result.subtracts_unloaded,
        "calibration": _calibration(result),
        "known_mass_kg": None if mass is None else mass.value,
        "known_mass_std_dev_kg": None if mass is None else mass.std_dev,
        "bounding_box_m": None if box is None else box.tolist(),
        "wrench_offset": _wrench_offset(result),
        "faults": findings_json.faults(result.faults),
        "motion_advice": motion_advice(estimate.not_identifiable),
    }
    if estimate.composite is not None:
        record["composite"] = nested(values_of(estimate.composite))
    if result.fit is not None:
        record |= _of_the_fit(result.fit)
    return record | _of_the_filter(result)


def _calibration(result: IdentificationData) -> dict[str, Any] | None:
    fit = result.calibrated
    if fit is None:
        return None
    path = result.inputs.get("`calibration`")
    misfits = zip(fit.joints, fit.misfit.tolist(), strict=True)
    changes = {"friction_change": fit.friction_change, "gain_change": fit.gain_change}
    return {
        "file": None if path is None else path.name,
        "noise_fraction": nested(fit.noise_fraction.tolist()),
        "misfit": [{"joint": joint, "misfit": finite(misfit)} for joint, misfit in misfits],
        "updated_by_unloaded": fit.updated_by_unloaded,
        **{
            key: None if change is None else dict(zip(fit.joints, change.tolist(), strict=True))
            for key, change in changes.items()
        },
    }


def _wrench_offset(result: IdentificationData) -> dict[str, Any] | None:
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


def _of_the_filter(result: IdentificationData) -> dict[str, Any]:
    """Returns what only the paper's filter has: its settings, and its singular values."""
    settings, excitation = result.paper_settings, result.singular_values
    record: dict[str, Any] = {}
    if settings is not None:
        record |= {
            "alpha": settings.alpha,
            "beta": settings.beta,
            "average_s": settings.average,
            "epochs": settings.epochs,
        }
    if excitation is not None:
        record["singular_values"] = {
            "mass": all_finite(excitation.mass),
            "inertia": all_finite(excitation.inertia),
        }
    return record


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
        "noise_fraction": nested(fit.noise_fraction.tolist()),
    }


def series(result: IdentificationData) -> dict[str, Any]:
    """Returns the time series that belong to :func:`record`: the fit and the history."""
    points = thinned(len(result.history.time))
    values, std_devs = reported.reported_history(result)
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
