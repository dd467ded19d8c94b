"""A result as plain data: the layout of ``result.json``."""

import json
import math
import os
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

import tactid
from tactid.bodies import principal_moments, why_impossible
from tactid.recording import Found, Recording

Way = Literal["tactile", "effort", "joint-sensing", "combined"]
Filter = Literal["nlms", "rls"]

Values = Sequence[float | None]
"""Mass, kg; centre of mass, m; inertia about it, kg m²: ten, in the order of ``VALUE_NAMES``."""

PATHS = (
    ("mass",),
    *(("com", axis) for axis in ("x", "y", "z")),
    *(("inertia", axes) for axes in ("xx", "xy", "xz", "yy", "yz", "zz")),
)
"""Where each of the ten values stands in a nested result."""

KINDS = (slice(0, 1), slice(1, 4), slice(4, 10))
"""Mass, centre of mass and inertia among the ten."""


Z95 = 1.96
"""Half the width of a 95 % interval, in standard deviations."""

WITHIN = 0.01
"""The part of the largest value of its kind that half of each interval is to reach."""

MOST_POINTS = 2000
"""How many points a time series in JSON has at the most."""

TURN_MORE = (
    "The motion does not turn the payload about enough axes; another posture, or driving other"
    " joints, would.",
)
"""What to do where nothing more particular is known."""


def nested(values: Values) -> dict[str, Any]:
    """Lays ten values out as ``mass``, ``com`` and ``inertia``; None for what is not finite."""
    result: dict[str, Any] = {"com": {}, "inertia": {}}
    for path, value in zip(PATHS, values, strict=True):
        place = result if len(path) == 1 else result[path[0]]
        place[path[-1]] = None if value is None or not math.isfinite(value) else float(value)
    return {"mass": result["mass"], **result}


def flat(record: dict[str, Any]) -> list[float]:
    """The inverse of :func:`nested`."""
    return [float(record[p[0]] if len(p) == 1 else record[p[0]][p[1]]) for p in PATHS]


def values_of(body: tactid.MassProperties) -> list[float]:
    """The ten values of a body."""
    i = body.inertia
    inertia = (i[0, 0], i[0, 1], i[0, 2], i[1, 1], i[1, 2], i[2, 2])
    return [body.mass, *map(float, body.com), *map(float, inertia)]


@dataclass(frozen=True)
class Truth:
    """What only a simulation can know of the payload, in the tool frame."""

    actual: list[float]
    """As it sits in the grasp."""
    nominal: list[float]
    """As it was asked for."""

    @property
    def scales(self) -> list[float]:
        """What an error is a fraction of: the nominal value, or the largest of its kind for 0."""
        scales: list[float] = []
        for kind in KINDS:
            largest = max(abs(value) for value in self.nominal[kind])
            scales += [abs(value) or largest for value in self.nominal[kind]]
        return scales

    def errors_percent(self, values: Values) -> list[float | None]:
        """Error of each value in percent of its scale; None where there is no value."""
        return [
            None if value is None or scale == 0 else 100 * (value - actual) / scale
            for value, actual, scale in zip(values, self.actual, self.scales, strict=True)
        ]

    @property
    def nominal_moments(self) -> list[float]:
        """The principal moments that were asked for, ascending, kg m²."""
        return principal_moments(self.nominal)

    def moment_errors_percent(self, moments: Values) -> list[float | None]:
        """Error of each principal moment in percent of its nominal value; None likewise."""
        actual, nominal = principal_moments(self.actual), self.nominal_moments
        return [
            None if moment is None or scale == 0 else 100 * (moment - true) / scale
            for moment, true, scale in zip(moments, actual, nominal, strict=True)
        ]


def read_truth(info: tactid.LogInfo) -> Truth | None:
    """The truth that a simulated log carries; None for any other log."""
    record = _record(info, "tactid.truth")
    if record is None:
        return None
    try:
        return Truth(actual=flat(record), nominal=flat(record.get("nominal", record)))
    except (KeyError, TypeError, ValueError):
        return None


def read_checks(info: tactid.LogInfo) -> dict[str, Any]:
    """How the run behind a simulated log went; empty for any other log."""
    record = _record(info, "tactid.report")
    if record is None:
        return {}
    checks = {
        "momentum_drift": {
            "linear": record.get("linear_momentum_drift"),
            "angular": record.get("angular_momentum_drift"),
        }
    }
    names = ("grasp_drift_m", "grasp_drift_rad", "newton_residual", "euler_residual")
    return checks | {name: record.get(name) for name in names}


def _record(info: tactid.LogInfo, name: str) -> dict[str, Any] | None:
    try:
        record = json.loads(info.metadata[name]["json"])
    except (KeyError, ValueError):
        return None
    return record if isinstance(record, dict) else None


def estimate_values(found: Found) -> list[float | None]:
    """The ten values as they are told: None where the motion did not determine one."""
    estimate = found.estimate
    pairs = zip(estimate.values, estimate.identifiable, strict=True)
    return [float(value) if known and math.isfinite(value) else None for value, known in pairs]


def half_widths(found: Recording) -> list[float | None]:
    """Half of each value's 95 % interval; None where the value or its interval is unknown."""
    pairs = zip(Z95 * found.deviation, found.estimate.identifiable, strict=True)
    return [float(half) if known and math.isfinite(half) else None for half, known in pairs]


def moments(found: Recording) -> list[float | None]:
    """The principal moments as they are told, ascending: None unless the inertia is known."""
    known = all(found.estimate.identifiable[KINDS[2]])
    pairs = zip(found.principal_moments, found.principal_moment_deviation, strict=True)
    return [_number(value) if known and not math.isinf(around) else None for value, around in pairs]


def moment_half_widths(found: Recording) -> list[float | None]:
    """Half of the 95 % interval of each principal moment; None where it is unknown."""
    pairs = zip(moments(found), Z95 * found.principal_moment_deviation, strict=True)
    return [None if value is None else _number(half) for value, half in pairs]


def outlook(found: Recording, within: float = WITHIN) -> str | None:
    """How much longer this motion must go on; None where the estimator knows of no intervals."""
    remaining = found.remaining(within)
    if np.isnan(remaining).any():
        return None
    worst = float(remaining.max())
    told = f"{100 * within:g} %"
    if worst == 0:
        return f"Every value is within {told}."
    names = np.array(tactid.VALUE_NAMES)
    if math.isinf(worst):
        never = ", ".join(names[np.isinf(remaining)])
        return f"However long this motion goes on, not within {told}: {never}."
    last = names[remaining.argmax()]
    return f"Every value within {told}: another {_duration(worst)} of this motion, for {last}."


def _duration(seconds: float) -> str:
    if seconds < 120:
        return f"{seconds:.0f} s" if seconds >= 10 else f"{seconds:.1f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:,.0f} h"


def record(found: Recording, within: float = WITHIN) -> dict[str, Any]:
    """What a recording told, as JSON has it: all but its time series."""
    remaining = found.remaining(within)
    return {
        "estimate": nested(estimate_values(found)),
        "half_width_95": nested(half_widths(found)),
        "principal_moments": {
            "values": moments(found),
            "half_width_95": moment_half_widths(found),
        },
        "remaining_s": {
            "within": within,
            "all": _number(remaining.max()),
            "each": nested([float(seconds) for seconds in remaining]),
        },
        "frame": found.tool,
        "estimator": found.estimator,
        "diagnostics": recording_diagnostics(found),
        "remarks": recording_remarks(found),
    }


def series(found: Recording) -> dict[str, Any]:
    """What goes with :func:`record` over time: the fit and the history of the ten values."""
    fit = thinned(len(found.fit_time))
    channels = zip(found.channels, found.channel_units, strict=True)
    history = thinned(len(found.history_time))
    values, deviation = known_history(found)
    return {
        "start_ns": int(found.start_ns),
        "fit": {
            "time_s": _numbers(found.fit_time[fit]),
            "held_out": [bool(entry) for entry in found.fit_held_out[fit]],
            "channels": [
                {
                    "name": name,
                    "unit": unit,
                    "measured": _numbers(found.fit_measured[fit, channel]),
                    "predicted": _numbers(found.fit_predicted[fit, channel]),
                    "weight": _numbers(found.fit_weight[fit, channel]),
                }
                for channel, (name, unit) in enumerate(channels)
            ],
        },
        "history": {
            "time_s": _numbers(found.history_time[history]),
            "values": [_numbers(row) for row in values[history]],
            "half_width_95": [_numbers(row) for row in Z95 * deviation[history]],
        },
    }


def thinned(count: int, most: int = MOST_POINTS) -> NDArray[np.intp]:
    """Which of so many points to show where they are too many: evenly, with first and last."""
    if count <= most:
        return np.arange(count)
    return np.linspace(0, count - 1, most).round().astype(np.intp)


def known_history(found: Recording) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Each value and its deviation over time, NaN for what was not known yet, or never was.

    An infinite deviation is of a value that is not known yet, but where an estimator gives no
    finite one at all: it then tells no deviations, and its values stand without.
    """
    values = np.array(found.history, dtype=float).reshape(-1, len(PATHS))
    deviation = np.array(found.history_deviation, dtype=float).reshape(values.shape)
    told = np.isfinite(deviation)
    known = np.isfinite(values) & (told | ~told.any(axis=0)) & np.array(found.estimate.identifiable)
    values[~known] = np.nan
    deviation[~(known & told)] = np.nan
    return values, deviation


def _numbers(values: Iterable[float]) -> list[float | None]:
    return [_number(value) for value in values]


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _diagnostics(found: Found) -> dict[str, Any]:
    estimate = found.estimate
    return {
        "way": found.way,
        "tool": found.tool,
        "gravity": _numbers(found.gravity),
        "duration_s": _number(found.duration),
        "intervals": estimate.intervals,
        "refused": estimate.refused,
        "gaps": estimate.gaps,
        "not_identifiable": estimate.not_identifiable,
        "is_physical": estimate.is_physical,
        "damage": list(found.damage),
    }


def diagnostics(found: tactid.Identification) -> dict[str, Any]:
    """The reasons to trust an estimate, or not to."""
    estimate = found.estimate
    told = _diagnostics(found) | {
        "average_s": found.average,
        "cutoff_hz": found.cutoff,
        "epochs": found.epochs,
        "singular_values": {
            "mass": [float(value) for value in estimate.mass_singular_values],
            "inertia": [float(value) for value in estimate.inertia_singular_values],
        },
    }
    if estimate.composite is not None:
        told["composite"] = nested(values_of(estimate.composite))
    return told


def recording_diagnostics(found: Recording) -> dict[str, Any]:
    """The reasons to trust what a recording told, or not to."""
    held_out = int(np.count_nonzero(found.fit_held_out))

    def by_channel(values: Iterable[float]) -> dict[str, float | None]:
        return dict(zip(found.channels, _numbers(values), strict=True))

    return _diagnostics(found) | {
        "stride_s": _number(found.stride),
        "cutoff_hz": _number(found.cutoff),
        "clock": found.clock,
        "delay_s": _number(found.delay),
        "delay_estimate_s": found.delay_estimate,
        "delay_deviation_s": found.delay_deviation,
        "known_mass": found.known_mass,
        "known_mass_deviation": found.known_mass_deviation,
        "bounding_box": None if found.bounding_box is None else found.bounding_box.tolist(),
        "offset": {
            name: {"value": value, "half_width_95": around, "unit": unit}
            for name, unit, value, around in offsets(found)
        },
        "dirt": [
            {"topic": topic, "what": what, "count": count, "first_s": _number(first)}
            for topic, what, count, first in found.dirt
        ],
        "windows": len(found.fit_time) - held_out,
        "held_out_windows": held_out,
        "residual_rms": by_channel(found.residual_rms),
        "held_out_rms": by_channel(found.held_out_rms),
        "excitation": _numbers(found.excitation_values),
        "motion_advice": list(found.motion_advice),
    }


def remarks_on(found: Found, advice: Sequence[str] = TURN_MORE) -> list[str]:
    """What a reader must know to trust an identification; the advice is what would tell more."""
    estimate = found.estimate
    remarks = []
    if estimate.not_identifiable:
        names = ", ".join(estimate.not_identifiable)
        remarks.append(" ".join([f"Not identifiable: {names}.", *advice]))
    # An inertia that is partly unknown is no wonder; a mass below zero always is.
    explained = estimate.not_identifiable and not estimate.values[0] <= 0
    if not estimate.is_physical and not explained:
        reason = why_impossible(estimate.values.tolist())
        reason = reason or "the estimate has not converged"
        remarks.append(f"No body can have these parameters: {reason}.")
    if estimate.refused:
        remarks.append(f"{estimate.refused} samples were not finite or out of order, and refused.")
    if estimate.gaps:
        remarks.append(f"{estimate.gaps} gaps in the log were not bridged.")
    return remarks


def recording_remarks(found: Recording) -> list[str]:
    """The same for a recording, and what was noticed on the way from it to the estimate."""
    own = remarks_on(found, found.motion_advice or TURN_MORE)
    dirt = [_dirty(*entry) for entry in found.dirt]
    return list(dict.fromkeys([*own, *found.remarks, *dirt]))


def _dirty(topic: str, what: str, count: int, first: float) -> str:
    since = f", the first at {first:.3f} s" if math.isfinite(first) else ""
    return f"{topic}: {count} × {what}{since}."


def facts(found: tactid.Identification) -> list[str]:
    """What was assumed, and what was chosen from the data: said of every result."""
    gravity = " ".join(f"{entry:g}" for entry in found.gravity)
    told = [f"frame {found.tool}", f"way {found.way}", f"gravity {gravity} m/s²"]
    told.append(f"cutoff {found.cutoff:.3g} Hz")
    if found.delay_estimate is not None and found.delay_deviation is not None:
        used = "corrected" if found.delay else "not significant, not corrected"
        told.append(
            f"delay {found.delay_estimate * 1e3:.2f} ± {1e3 * Z95 * found.delay_deviation:.2g} ms"
            f" ({used})"
        )
    elif found.delay:
        told.append(f"delay {found.delay * 1e3:g} ms (given)")
    told += known(found)
    told += told_offsets(found)
    told.append(f"times from {'header stamps' if found.clock == 'stamps' else 'the log'}")
    return ["; ".join(told) + "."]


def known(found: Recording) -> list[str]:
    """What was given of the payload."""
    told = []
    if found.known_mass is not None:
        around = Z95 * (found.known_mass_deviation or 0.0)
        told.append(f"mass {found.known_mass:g}{f' ± {around:.2g}' if around else ''} kg (given)")
    if found.bounding_box is not None:
        low, high = (" ".join(f"{entry:g}" for entry in corner) for corner in found.bounding_box)
        told.append(f"within a box from {low} to {high} m (given)")
    return told


def offsets(found: Recording) -> list[tuple[str, str, float | None, float | None]]:
    """What channels are off by: name, unit, value, and half of its 95 % interval."""
    values, around = _numbers(found.offset), _numbers(Z95 * found.offset_deviation)
    return list(zip(found.channels, found.channel_units, values, around, strict=False))


def told_offsets(found: Recording) -> list[str]:
    """The same in words, or nothing."""
    told = [
        f"{name} {value:.3g} ± {around:.2g} {unit}"
        for name, unit, value, around in offsets(found)
        if value is not None and around is not None
    ]
    return [f"wrenches off by {', '.join(told)}"] if told else []


@contextmanager
def atomic_path(path: Path) -> Iterator[Path]:
    """A path to write to, whose file is under ``path`` whole afterwards, or not at all."""
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    os.close(handle)
    try:
        yield Path(temporary)
        umask = os.umask(0)
        os.umask(umask)
        os.chmod(temporary, 0o666 & ~umask)  # mkstemp's file is for its owner alone
        os.replace(temporary, path)
    except BaseException:
        os.unlink(temporary)
        raise


def write_atomically(path: Path, content: str | bytes) -> None:
    """Writes a file so that it is there whole or not at all."""
    with atomic_path(path) as temporary:
        temporary.write_bytes(content.encode() if isinstance(content, str) else content)


def to_json(record: dict[str, Any]) -> str:
    """JSON for people, too; never NaN."""
    return json.dumps(record, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
