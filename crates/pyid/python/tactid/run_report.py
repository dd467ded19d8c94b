"""How a simulation run went: values, and what is printed of them."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class ActiveContradiction:
    """A bound of the payload that its estimate contradicts.

    The motions were planned for payloads within the bound, so they may have exceeded their limits.
    """

    field: str
    """The field of the experiment's table ``excitation.active``, such as ``mass_kg[1]``."""
    bound: float
    """Value of the bound, kg or m."""
    estimate: float
    """Estimate of what it bounds, kg or m."""
    std_dev: float
    """Standard deviation of that estimate, kg or m."""


@dataclass(frozen=True)
class ActiveReport:
    """What active identification has reached in a simulation run."""

    plans: int
    """Number of motions that were planned."""
    reached: float | None
    """Time at which all ten 95 % intervals were within their targets, s; None where they were
    not."""
    widest: str
    """Value whose 95 % interval is the largest relative to its target at the end."""
    interval_ratio: float | None
    """Ratio of half of that interval to its target; None where the value is not known at all."""
    out_of_reach: bool
    """Whether planning ended early, because several motions in a row did not make the widest
    interval smaller."""
    binding: str | None
    """Limit that binds the last motion, where planning ended early."""
    contradictions: tuple[ActiveContradiction, ...]
    """Bounds of the payload that its estimate contradicts; planning ends with the first."""
    untested_shapes: tuple[str, ...]
    """Shapes of the robot that are not tested for collisions, with the reason; none where
    collisions are not tested at all."""


@dataclass(frozen=True)
class RunReport:
    """Report of a simulation run. Each check is its largest value during the run."""

    linear_momentum_drift: float | None
    """Change of the system's linear momentum, as a fraction of the largest of any single body; None
    for a fixed base, which exchanges momentum with the ground."""
    angular_momentum_drift: float | None
    """Change of the system's angular momentum, as a fraction of the largest of any single body;
    None for a fixed base."""
    grasp_drift: float
    """Displacement of the payload in the grasp, m."""
    grasp_rotation: float
    """Rotation of the payload in the grasp, rad."""
    newton_residual: float
    """Norm of the contact force and the weight less the payload's mass times its acceleration, as a
    fraction of the largest force."""
    euler_residual: float
    """Norm of the contact moment less that of Euler's equation for the payload, as a fraction of
    the largest moment."""
    grip_force: float
    """Force with which each finger pressed when the excitation began, N."""
    steps: int
    """Number of samples in the log."""
    simulated_time: float
    """Simulated time that the log covers, s."""
    wall_time: float
    """Wall-clock time of the run, grasp and log included, s."""
    steps_per_second: float
    """Simulated steps per second of wall-clock time."""
    base_rotation: float | None
    """Largest angle by which a floating base turned from its start, rad; None for a fixed base."""
    base_translation: float | None
    """Largest distance of the floating base's origin from its start, m; None for a fixed base."""
    active: ActiveReport | None
    """What active excitation has reached; None for another kind of excitation."""


def run_report(data: Mapping[str, Any]) -> RunReport:
    """Returns the report with these fields; that of active excitation is a mapping, too."""
    active = data["active"]
    if active is not None:
        found = tuple(ActiveContradiction(**found) for found in active["contradictions"])
        shapes = tuple(active["untested_shapes"])
        active = ActiveReport(**{**active, "contradictions": found, "untested_shapes": shapes})
    return RunReport(**{**data, "active": active})


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
    if report.reached is not None:
        return f"All intervals were within their targets after {report.reached:.2f} s, {motions}."
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
    if report.base_rotation is None or report.base_translation is None:
        return None
    moved = {
        "turned": (math.degrees(report.base_rotation), "°", active.get("base_attitude_deg")),
        "moved": (1e3 * report.base_translation, " mm", _thousandfold(active, "base_position_m")),
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
