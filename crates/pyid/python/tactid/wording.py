"""Findings in words: what a reader of a result should know of the recording.

A sentence that names an option spells it as its reader would write it: see :mod:`tactid.naming`.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from tactid.naming import Style, option_name
from tactid.values import Z95, digits_of

Data = Mapping[str, Any]

CONTRADICTIONS = ("gravity_contradicted", "negative_mass", "known_bodies_too_heavy")
"""Findings that show the result to be wrong, the gravest first."""

DOUBTS = ("mass_contradicted", "inconsistent", "offset_suspected")
"""Findings that show the values to be off by more than their intervals, the gravest first."""


@dataclass(frozen=True)
class Finding:
    """Something that a reader of the result should know; ``print`` shows it as a sentence."""

    kind: str
    """Name of what was noticed, such as ``negative_mass``."""
    data: Mapping[str, Any] = field(default_factory=dict)
    """The numbers and names that belong to the kind."""

    def __str__(self) -> str:
        return finding(self)


LOADS = {"tactile": "wrench", "joint-sensing": "wrench", "effort": "effort", "combined": "load"}
"""What each method measures of the payload."""


def finding(noticed: Finding, style: Style = "keyword") -> str:
    """Says what was noticed on the way from the recording to the payload, in sentences."""
    return _FINDINGS[noticed.kind](noticed.data, style)


def _gravity_contradicted(data: Data, style: Style) -> str:
    x, y, z = (entry + 0.0 for entry in data["better"])
    what = "Gravity of the opposite sign" if any(data["better"]) else "No gravity at all"
    return (
        f"{what}, ({x:g}, {y:g}, {z:g}) m/s², explains the {LOADS[data['method']]} far better than"
        f" the given one (its residuals are {_percent(data['residual_ratio'])} as large): check the"
        f" sign of {option_name('gravity', style)} and the axes of the world."
    )


def _negative_mass(data: Data, style: Style) -> str:
    hints = {
        "tactile": f" ({option_name('wrench_acts_on', style)})",
        "effort": f" ({option_name('effort_gain', style)} with a minus sign)",
    }
    gravity = f", or of gravity ({option_name('gravity', style)})," if data["or_gravity"] else ""
    load = f"{LOADS[data['method']]}{hints.get(data['method'], '')}"
    return (
        f"The identified mass is negative: the opposite sign of the {load}{gravity} would explain"
        " the data."
    )


def _known_bodies_too_heavy(data: Data, style: Style) -> str:
    return (
        f"The known bodies weigh {data['known_kg']:.4g} kg, but the whole load only"
        f" {data['load_kg']:.4g} kg: check the mass of {option_name('known_tool', style)}, the"
        " links below the tip in the URDF, and the gains of the sensors."
    )


def _offset_suspected(data: Data, style: Style) -> str:
    half_width = Z95 * data["std_dev"]
    return (
        f"The wrenches seem to have a constant offset ({data['channel']}: {data['value']:.3f} ±"
        f" {half_width:.3f} {data['unit']}): {option_name('wrench_offset', style)} identifies it"
        " together with the payload."
    )


def _mass_contradicted(data: Data, _: Style) -> str:
    half_width = Z95 * data["std_dev_kg"]
    digits = digits_of(half_width)
    return (
        f"The given mass is {data['known_kg']:g} kg, but the data alone give"
        f" {data['found_kg']:.{digits}f} ± {half_width:.{digits}f} kg,"
        f" {data['distance']:.1f} standard deviations away: check gravity, and the gains and"
        " offsets of the sensors."
    )


def _inconsistent(data: Data, _: Style) -> str:
    within, box = (" within the box", ", the box") if data["within_box"] else ("", "")
    return (
        f"No physically consistent body{within} explains the data within their noise. The result is"
        f" the nearest one, {data['distance']:.1f} standard deviations away: check the frames{box},"
        " gravity and the offsets of the sensors."
    )


def _outliers(data: Data, _: Style) -> str:
    return (
        f"{data['outliers']} of {data['windows']} windows are outliers, as an impact causes them,"
        " and have next to no weight."
    )


def _acceleration_not_used(data: Data, style: Style) -> str:
    why = "explain the wrench better" if data["explains_better"] else "have less noise"
    return (
        f"{data['topic']} is not used: accelerations derived from the velocities {why} (residuals"
        f" {_percent(data['residual_ratio'])} as large, power {_percent(data['power_ratio'])})."
        f" Give {option_name('acceleration_topic', style)} to use it."
    )


def _option_not_used(data: Data, style: Style) -> str:
    option = option_name(data["option"], style)
    return (
        f"The option {option} has no effect: it is about measurements that the {data['method']}"
        " method does not use with this recording."
    )


def _frame_assumed(data: Data, _: Style) -> str:
    return f"{data['topic']} names no frame: its wrenches are taken to be in `{data['frame']}`."


def _wrenches_summed(data: Data, _: Style) -> str:
    return f"The wrenches of {' and '.join(data['topics'])} are summed."


def _unknown_joints(data: Data, _: Style) -> str:
    return f"Joints that the URDF does not have were left out: {', '.join(data['joints'])}."


def _absent_joints(data: Data, _: Style) -> str:
    return (
        "Joints that the log does not have, and that do not move the tool, were taken to be at"
        f" zero: {', '.join(data['joints'])}."
    )


def _late_start(data: Data, _: Style) -> str:
    return (
        f"{data['topic']} begins {data['late_s']:.3f} s after the others: what came before was left"
        " out."
    )


def _early_end(data: Data, _: Style) -> str:
    return (
        f"{data['topic']} ends at {data['end_s']:.3f} s, {data['early_s']:.3f} s before the others:"
        " what came after was left out."
    )


def _no_stamps(_: Data, __: Style) -> str:
    return "The messages have no stamps: their times are those of logging."


def _delay_corrected(data: Data, _: Style) -> str:
    half_width = 1e3 * Z95 * data["std_dev_s"]
    digits = digits_of(half_width)
    order = "later" if data["applied_s"] >= 0 else "earlier"
    return (
        f"The wrenches are stamped {1e3 * abs(data['applied_s']):.{digits}f} ms {order} than the"
        f" motion: this delay was corrected (estimated {1e3 * data['estimated_s']:.{digits}f} ±"
        f" {half_width:.{digits}f} ms)."
    )


def _percent(ratio: float) -> str:
    percent = 100 * ratio
    return f"{percent:.{min(digits_of(percent), 3)}f} %" if percent >= 1e-3 else "under 0.001 %"


_FINDINGS: dict[str, Callable[[Data, Style], str]] = {
    "gravity_contradicted": _gravity_contradicted,
    "negative_mass": _negative_mass,
    "known_bodies_too_heavy": _known_bodies_too_heavy,
    "offset_suspected": _offset_suspected,
    "mass_contradicted": _mass_contradicted,
    "inconsistent": _inconsistent,
    "outliers": _outliers,
    "acceleration_not_used": _acceleration_not_used,
    "option_not_used": _option_not_used,
    "frame_assumed": _frame_assumed,
    "wrenches_summed": _wrenches_summed,
    "unknown_joints": _unknown_joints,
    "absent_joints": _absent_joints,
    "late_start": _late_start,
    "early_end": _early_end,
    "no_stamps": _no_stamps,
    "delay_corrected": _delay_corrected,
}

FINDING_KINDS = tuple(_FINDINGS)
"""Every kind of finding."""
