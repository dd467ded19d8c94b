"""Results in words: findings, remarks, and the motion that would determine more.

A sentence that names an option spells it as its reader would write it: see :mod:`tactid.naming`.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from tactid.bodies import why_impossible
from tactid.identification import Finding, Identification
from tactid.naming import Style, option_name
from tactid.reported import offsets
from tactid.values import Z95

Data = Mapping[str, Any]

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
        f" the given one (ratio of the residuals {data['residual_ratio']:.2e}): check the sign of"
        f" {option_name('gravity', style)} and the axes of the world."
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


def _known_mass_not_kept(data: Data, _: Style) -> str:
    within = " within the box" if data["within_box"] else ""
    return (
        f"The given mass is {data['known_kg']:g} kg, but the result has"
        f" {data['estimated_kg']:.4g} kg: no physically consistent body of the given mass{within}"
        " explains the data."
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
        f"{data['topic']} is not used: accelerations derived from the velocities {why} (ratio of"
        f" the residuals {data['residual_ratio']:.2f}, of the powers {data['power_ratio']:.2f})."
        f" Give {option_name('acceleration_topic', style)} to use it."
    )


def _option_not_used(data: Data, style: Style) -> str:
    reasons = {
        "method": f"it is about measurements that the {data['method']} method does not use with"
        " this recording",
        "other_motion": "the motion is measured by another topic",
        "gravity_is_measured": "the accelerations of the inertial unit contain gravity",
    }
    option = option_name(data["option"], style)
    return f"The option {option} has no effect: {reasons[data['because']]}."


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


def _velocities_contradicted(data: Data, _: Style) -> str:
    causes = {
        "opposite_sign": " They have the opposite sign.",
        "degrees": " They are in degrees per second, but must be in rad/s.",
        "positions_in_degrees": " The positions are in degrees, but must be in rad.",
        "other_joint": f" They are those of {data['other']}: check the order of the joints.",
        None: " Check their units and signs, and the order of the joints.",
    }
    return (
        f"The velocities of {_listed(data['joints'])} are not the derivatives of the positions (rms"
        f" difference {data['relative_difference']:.0%} of the motion).{causes[data['cause']]}"
    )


def _twist_contradicted(data: Data, _: Style) -> str:
    causes = {
        "body": " It is in the axes of the moving body, but must be in those of the world.",
        "world": " It is in the axes of the world, but the twist of an odometry message must be in"
        " those of its child frame.",
        None: " Check its units, signs and axes; it may also be zero because it is not measured.",
    }
    return (
        f"{data['source']}: the twist is not the derivative of the pose (rms difference"
        f" {data['relative_difference']:.0%} of the motion).{causes[data['better_axes']]}"
    )


def _constant_channels(data: Data, _: Style) -> str:
    value = "zero" if data["is_zero"] else "constant"
    several = len(data["channels"]) > 1
    return (
        f"{data['source']}: {_listed(data['channels'])} in `{data['frame']}`"
        f" {'are' if several else 'is'} exactly {value} in all samples, as of a sensor that does"
        f" not measure {'them' if several else 'it'}. The estimate takes"
        f" {'them' if several else 'it'} for measured."
    )


def _delay_doubtful(data: Data, style: Style) -> str:
    why = (
        "but it is as long as any that is searched for"
        if data["is_at_end"]
        else f"but only a little (ratio of the residuals {math.sqrt(data['residual_ratio']):.2f})"
    )
    return (
        f"Wrenches stamped {1e3 * data['delay_s']:.0f} ms later than the motion would fit better,"
        f" {why}: this delay was not corrected. Check whether all sensors of the payload were"
        f" recorded, and the frames and signs; {option_name('delay', style)} sets a delay."
    )


def _no_stamps(_: Data, __: Style) -> str:
    return "The messages have no stamps: their times are those of logging."


def _delay_corrected(data: Data, _: Style) -> str:
    half_width = Z95 * data["std_dev_s"]
    return (
        f"The wrenches are stamped {1e3 * data['applied_s']:.2f} ms later than the motion: this"
        f" delay was corrected (estimated {1e3 * data['estimated_s']:.2f} ±"
        f" {1e3 * half_width:.2f} ms)."
    )


_FINDINGS: dict[str, Callable[[Data, Style], str]] = {
    "gravity_contradicted": _gravity_contradicted,
    "negative_mass": _negative_mass,
    "known_bodies_too_heavy": _known_bodies_too_heavy,
    "offset_suspected": _offset_suspected,
    "mass_contradicted": _mass_contradicted,
    "known_mass_not_kept": _known_mass_not_kept,
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
    "velocities_contradicted": _velocities_contradicted,
    "twist_contradicted": _twist_contradicted,
    "constant_channels": _constant_channels,
    "no_stamps": _no_stamps,
    "delay_corrected": _delay_corrected,
    "delay_doubtful": _delay_doubtful,
}

FINDING_KINDS = tuple(_FINDINGS)
"""Every kind of finding."""


def digits_of(half_width: float) -> int:
    """Number of decimals that show two figures of a half width."""
    return min(max(1 - math.floor(math.log10(half_width)), 0), 9) if half_width > 0 else 9


def motion_advice(names: Sequence[str]) -> list[str]:
    """Says which motion determines these values: a sentence for each kind.

    By the structure of the regressor, forces determine the mass by any acceleration against gravity
    and the first moments by rotation; moments determine the inertia by angular accelerations, (45).

    Args:
        names: Names of values that are not determined, as in ``VALUE_NAMES``.
    """
    advice = []
    if "mass" in names:
        advice.append("Accelerate the tool, or hold it still under gravity, for the mass.")
    for axis, others in (("x", "y or z"), ("y", "x or z"), ("z", "x or y")):
        if f"com.{axis}" in names:
            advice.append(
                f"Rotate the tool about its {others} axis, or tilt its {axis} axis away from the"
                f" vertical, for com.{axis}."
            )
    inertia = [name for name in names if name.startswith("I")]
    if inertia:
        axes = sorted({name[1] for name in inertia if name[1] == name[2]})
        # A product of inertia is determined by rotation about either of its two axes.
        either = [f"{n[1]} or {n[2]}" for n in inertia if n[1] != n[2] and not {*n[1:]} & {*axes}]
        about = [*axes, *either]
        several = "axes" if len(about) > 1 else "axis"
        advice.append(
            f"Rotate the tool faster about its {_listed(about)} {several}, for {_listed(inertia)}."
        )
    return advice


def remarks(result: Identification, style: Style = "keyword") -> list[str]:
    """Says what a reader must know to trust a result, in sentences; there may be none."""
    findings = [finding(noticed, style) for noticed in result.findings]
    faults = [fault.sentence for fault in result.faults]
    return list(dict.fromkeys([*_of_the_estimate(result), *findings, *faults]))


def _of_the_estimate(result: Identification) -> list[str]:
    estimate = result.estimate
    sentences = []
    unknown = estimate.not_identifiable
    if unknown:
        sentences.append(
            " ".join([f"Not identifiable: {', '.join(unknown)}.", *motion_advice(unknown)])
        )
    # An inertia that is partly unknown is often impossible; a mass below zero needs a reason.
    explained = unknown and not estimate.values[0] <= 0
    if not estimate.is_physical and not explained:
        reason = why_impossible(estimate.values.tolist()) or "the estimate has not converged"
        sentences.append(f"No body can have these parameters: {reason}.")
    if estimate.rejected:
        sentences.append(f"{estimate.rejected} samples were rejected: not finite, or out of order.")
    if estimate.gaps:
        sentences.append(f"{estimate.gaps} gaps in the recording were not bridged.")
    return sentences


def assumptions(result: Identification) -> str:
    """Says what was assumed, and what was chosen from the data: a line for every result."""
    gravity = " ".join(f"{entry:g}" for entry in result.gravity)
    parts = [f"frame {result.estimate.frame}", f"method {result.method}", f"gravity {gravity} m/s²"]
    parts.append(f"cutoff {result.cutoff:.3g} Hz")
    estimated = result.estimated_delay
    if estimated is not None:
        used = "corrected" if result.delay else "not significant, not corrected"
        half_width = Z95 * estimated.std_dev
        parts.append(f"delay {1e3 * estimated.value:.2f} ± {1e3 * half_width:.2g} ms ({used})")
    elif result.delay:
        parts.append(f"delay {1e3 * result.delay:g} ms (given)")
    parts += knowledge(result)
    if offsets(result):
        parts.append(f"wrench offset {wrench_offset(result)}")
    parts.append(f"times from {'header stamps' if result.clock == 'stamps' else 'the log'}")
    return "; ".join(parts) + "."


def knowledge(result: Identification) -> list[str]:
    """Says what was given of the payload."""
    parts = []
    mass = result.known_mass
    if mass is not None:
        around = f" ± {Z95 * mass.std_dev:.2g}" if mass.std_dev else ""
        parts.append(f"mass {mass.value:g}{around} kg (given)")
    if result.bounding_box is not None:
        low, high = (" ".join(f"{entry:g}" for entry in corner) for corner in result.bounding_box)
        parts.append(f"within a box from {low} to {high} m (given)")
    return parts


def wrench_offset(result: Identification) -> str:
    """Says the offset of the wrenches with its 95 % intervals; empty where it is not known."""
    return ", ".join(
        f"{name} {value:.3g} ± {half_width:.2g} {unit}"
        for name, unit, value, half_width in offsets(result)
        if math.isfinite(value) and math.isfinite(half_width)
    )


def _listed(words: Sequence[str]) -> str:
    *most, last = words
    return f"{', '.join(most)} and {last}" if most else last
