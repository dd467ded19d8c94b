"""How a simulation run went: values, and what is printed of them."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from tactid._results.records import ActiveContradiction, ActiveReport, RunReport


def active_text(report: ActiveReport) -> str:
    """Returns sentences on what active excitation has reached."""
    if report.plans == 0 and report.binding is not None:
        return (
            f"The arm did not move: {report.binding} is beyond its limit already at rest, for one"
            " of the payloads that excitation.active allows. Give the payload smaller bounds, the"
            " gripper more grip_force_n, the boxes more room, or the arm another posture."
        )
    motions = "1 motion" if report.plans == 1 else f"{report.plans} motions"
    if report.contradictions:
        found = ", ".join(map(_contradiction_text, report.contradictions))
        return (
            f"The payload contradicts excitation.active: {found}. Planning ended after {motions},"
            " which may have exceeded limits; correct the bounds."
        )
    if report.reached_s is not None:
        return f"All intervals were within their targets after {report.reached_s:.2f} s, {motions}."
    text = f"After {motions} {report.widest} is not known"
    if report.interval_ratio is not None:
        ratio = f"{report.interval_ratio:.2f} times its target"
        text = f"After {motions} the interval of {report.widest} is {ratio}"
    if not report.out_of_reach and (report.interval_ratio or math.inf) <= 1:
        reached = f"After {motions} all intervals are within their targets"
        return f"{reached}, but the arm has not come to rest: give the run more time."
    if not report.out_of_reach:
        return f"{text}: give the run more time."
    binds = "" if report.binding is None else f": {report.binding} binds"
    remedy = "Allow more in excitation.active: a larger `within`, base bound or acceleration."
    return f"{text}, and the last motions did not narrow the intervals{binds}. {remedy}"


def _contradiction_text(found: ActiveContradiction) -> str:
    unit = "kg" if found.field.startswith("mass") else "m"
    return (
        f"{found.field} is {found.bound:g}, but {found.estimate:.4g} {unit} was found"
        f" (± {1.96 * found.std_dev:.2g})"
    )


@dataclass(frozen=True)
class BaseText:
    """How far a floating base moved, in words."""

    sentence: str
    is_exceeded: bool
    """Whether a bound of the base is exceeded."""


def base_text(report: RunReport, active: Mapping[str, Any]) -> BaseText | None:
    """Returns how far a floating base moved; None for a fixed base.

    Args:
        report: The report of the run.
        active: The experiment's table ``excitation.active``, which may have bounds.
    """
    if report.base is None:
        return None
    moved = {
        "turned": (report.base.attitude_deg, "°", active.get("base_attitude_deg")),
        "moved": (1e3 * report.base.position_m, " mm", _thousandfold(active, "base_position_m")),
    }
    parts, is_exceeded = [], False
    for verb, (value, unit, bound) in moved.items():
        limit = ""
        if bound is not None:
            exceeds = value > bound
            is_exceeded |= exceeds
            limit = f" ({'beyond its' if exceeds else 'within its'} bound of {bound:g}{unit})"
        parts.append(f"{verb} by at most {value:.3g}{unit}{limit}")
    return BaseText(f"The base {' and '.join(parts)}.", is_exceeded)


def _thousandfold(fields: Mapping[str, Any], name: str) -> float | None:
    value = fields.get(name)
    return None if value is None else 1e3 * float(value)
