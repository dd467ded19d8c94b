"""Findings in words: what a reader of a result should know of the recording.

A sentence that names an option spells it as its reader would write it: see :mod:`tactid.naming`.
Online, what has no option is done to the samples before ``push``.
"""

import math
from collections.abc import Callable, Mapping
from typing import Any

from tactid.calibration_wording import CALIBRATION_CONTRADICTIONS, CALIBRATION_FINDINGS, SHORTAGES
from tactid.model_wording import MODEL_FINDINGS
from tactid.naming import Style, at_most, counted, listed, option_name
from tactid.run_wording import RUN_FINDINGS
from tactid.sample_wording import SAMPLE_FINDINGS
from tactid.values import Z95, digits_of

Data = Mapping[str, Any]

LOADS = {"tactile": "wrench", "joint-sensing": "load", "effort": "effort", "combined": "load"}
"""What each method measures of the payload."""

LARGEST_FRICTION = 0.7
"""Fraction of the load above which a residual is hardly ever friction."""


def finding(kind: str, data: Data, style: Style) -> str:
    """Says what was noticed on the way from the recording to the payload, in sentences."""
    return (_FINDINGS | SHORTAGES | CALIBRATION_CONTRADICTIONS)[kind](data, style)


def _gravity_contradicted(data: Data, style: Style) -> str:
    x, y, z = (entry + 0.0 for entry in data["better"])
    what = "Gravity of the opposite sign" if any(data["better"]) else "No gravity at all"
    return (
        f"{what}, ({x:g}, {y:g}, {z:g}) m/s², explains the {LOADS[data['method']]} far better than"
        f" the given one (its residuals are {_percent(data['residual_ratio'])} as large): check the"
        f" sign of {option_name('gravity', style)} and the axes of the world."
    )


def _nothing_held(data: Data, _: Style) -> str:
    mass = _with_interval(data["mass_kg"], Z95 * data["std_dev_kg"])
    return (
        f"Nothing is held, or too little for this recording: the mass is {mass} kg. If something"
        " is, check the units of the load and the order of its channels."
    )


def _negative_mass(data: Data, style: Style) -> str:
    if data["method"] == "effort":
        return _negative_mass_by_efforts(data, style)
    is_tactile, online = data["method"] == "tactile", style == "online"
    hint = f" ({option_name('wrench_acts_on', style)})" if is_tactile and not online else ""
    remedy = ": negate `wrench` before `push`" if is_tactile and online else ""
    gravity = f", or of gravity ({option_name('gravity', style)})," if data["or_gravity"] else ""
    return (
        f"The identified mass is negative: the opposite sign of the {LOADS[data['method']]}{hint}"
        f"{gravity} would explain the data{remedy}."
    )


def _negative_mass_by_efforts(data: Data, style: Style) -> str:
    """Lists the causes: the torque of the links is in the efforts, so that a sign is only one."""
    sign = "the opposite sign of the effort"
    if style == "online":
        sign += " (negate `effort` before `push`)"
    elif data["or_gravity"]:
        # With a calibration, where the sign of gravity is known, this option is refused.
        sign += f" ({option_name('effort_gain', style)} with a minus sign)"
    if data["or_gravity"]:
        sign += f" or of gravity ({option_name('gravity', style)})"
    return (
        f"The identified mass is negative. Possible causes are {sign}, another order of the joints,"
        " and a body at or below the tip that the URDF has and the robot does not."
    )


def _known_bodies_too_heavy(data: Data, style: Style) -> str:
    # Online there is no known tool.
    tool = "" if style == "online" else f" the mass of {option_name('known_tool', style)},"
    return (
        f"The known bodies weigh {data['known_bodies_kg']:.4g} kg, but the whole load only"
        f" {data['load_kg']:.4g} kg: check{tool} the links below the tip in the URDF, and the gains"
        " of the sensors."
    )


def _offset_suspected(data: Data, style: Style) -> str:
    pairs = zip(data["values"], data["std_devs"], strict=True)
    entries = [_with_interval(value, Z95 * std_dev) for value, std_dev in pairs]
    whose, place = ("pushed", " before `push`") if style == "online" else ("recorded", "")
    return (
        f"The wrenches seem to have a constant offset: force ({', '.join(entries[:3])}) N, moment"
        f" ({', '.join(entries[3:])}) N m, in the frame {data['frame']} and with the sign of the"
        f" {whose} wrenches. Subtract it from the wrenches{place} (tare the sensor), or let"
        f" {option_name('wrench_offset', style)} identify it together with the payload. A frame of"
        " the sensor that is turned or shifted, a joint's zero or a gain that is wrong can look the"
        " same."
    )


def _with_interval(value: float, half_width: float) -> str:
    if not math.isfinite(half_width):
        return "not known"
    digits = digits_of(half_width)
    return f"{value:.{digits}f} ± {half_width:.{digits}f}"


def _load_unexplained(data: Data, style: Style) -> str:
    load_rms = data["load_rms"]
    # A channel that measures nothing at all has no load.
    fraction = data["residual_rms"] / load_rms if load_rms else math.inf
    joint = data["joint"]
    what = "the load" if joint is None else f"the effort of {joint}"
    share = f"{100 * fraction:.0f} % of {what}" if load_rms else f"{what}, which is zero"
    times = data["residual_rms"] / max(data["noise_rms"], 1e-300)
    beyond = f"{times:.0f} times the noise" if times < 1e4 else "far beyond the noise"
    reasons = {
        "effort": _efforts_unexplained(style, has_unloaded=data["has_unloaded"]),
        "tactile": "Check the frame of the sensor and how it is mounted, the tip, gravity and the"
        " pose of the base, and the order, signs and units of the joints.",
        "joint-sensing": "Check the inertias of the links, the frame of the base's motion, and"
        " whether anything outside acts on the robot.",
        "combined": "Identify from each source alone to see which one contradicts the model; with"
        " efforts, friction in the joints is the usual reason.",
    }
    if joint is not None:
        reasons["effort"] = (
            "Check the order of the joints (two joints with large errors are often exchanged),"
            " their signs and units, and that the calibration is of this robot. Friction that has"
            " changed is usually smaller: warm the gears, or calibrate anew."
        )
    elif data["method"] == "effort" and fraction > LARGEST_FRICTION:
        reasons["effort"] = (
            "Friction of a geared arm can be as large as its load. Calibrate the arm with a"
            " recording without payload (`tactid calibrate`), which finds friction and corrects the"
            " links. If that does not help, check the order of the joints, their signs and units,"
            " and the gains of the efforts."
        )
    digits = digits_of(data["residual_rms"])
    residual, load = (f"{data[name]:.{digits}f}" for name in ("residual_rms", "load_rms"))
    return (
        f"The model does not explain {share} (rms {residual} of {load}"
        f" {data['unit']}, {beyond}), and the intervals do not contain this error."
        f" {reasons[data['method']]}"
    )


def _efforts_unexplained(style: Style, *, has_unloaded: bool) -> str:
    if has_unloaded:
        return (
            "The unloaded recording does not remove it: check that both recordings have the same"
            " speed and temperature, and the gains of the efforts."
        )
    remedy = (
        "subtract the efforts of the same motion without the payload before `push`."
        if style == "online"
        else f"use {option_name('unloaded', style)}, a recording of the same motion without the"
        " payload."
    )
    return (
        "Friction in the joints is the usual reason, then wrong inertias of the links or gains of"
        f" the efforts: {remedy}"
    )


THOUSAND = (500.0, 2000.0)
"""Ratio of a given mass to that of the data from which to which it looks like grams."""


def _mass_contradicted(data: Data, _: Style) -> str:
    half_width = Z95 * data["std_dev_kg"]
    digits = digits_of(half_width)
    return (
        f"The given mass is {data['known_mass_kg']:g} kg, but the data alone give"
        f" {data['found_kg']:.{digits}f} ± {half_width:.{digits}f} kg,"
        f" {at_most(data['distance'])} standard deviations away: check the given mass, which is"
        f" in kg{_as_grams(data)}, gravity, and the gains and offsets of the sensors."
    )


def _as_grams(data: Data) -> str:
    """Says that a given mass looks like one in grams."""
    least, most = (factor * data["found_kg"] for factor in THOUSAND)
    if not least < data["known_mass_kg"] < most:
        return ""
    return f" (as grams it would be {data['known_mass_kg'] / 1000:g} kg)"


def _known_mass_not_kept(data: Data, _: Style) -> str:
    within = " within the box" if data["within_box"] else ""
    return (
        f"The given mass is {data['known_mass_kg']:g} kg, but the result has"
        f" {data['estimated_kg']:.4g} kg: no physically consistent body of the given mass{within}"
        " explains the data."
    )


def _no_equations(data: Data, style: Style) -> str:
    samples, rejected, gaps = data["samples"], data["rejected"], data["gaps"]
    nothing = "Nothing is known of the payload"
    if rejected > samples:
        return (
            f"{nothing}: {rejected} of {samples + rejected} samples were rejected, because a value"
            " is not finite or their time is not later than the one before."
        )
    if 2 * gaps > samples:
        return (
            f"{nothing}: of {samples} samples, {gaps} came more than {data['max_gap_s']:g} s after"
            f" the one before, and {option_name('max_gap_s', style)} bridges no more. Times must be"
            " in seconds."
        )
    if data["window_s"] < data["min_samples"] * data["period_s"]:
        return (
            f"{nothing}: there is a sample every {data['period_s'] * 1e3:.3g} ms, which is too"
            f" slow for the cutoff. A window of {data['window_s']:.3g} s needs at least"
            f" {data['min_samples']} samples: push samples at a higher rate, or lower"
            f" {option_name('cutoff_hz', style)}."
        )
    return (
        f"{nothing} after {samples} samples: the first window of {data['window_s']:.3g} s is not"
        " complete."
    )


def _inconsistent(data: Data, style: Style) -> str:
    within, box = (" within the box", ", the box") if data["within_box"] else ("", "")
    widened = "" if style == "online" else ", and the intervals are widened until it is plausible"
    return (
        f"No physically consistent body{within} explains the data within their noise. The result is"
        f" the nearest one, {at_most(data['distance'])} standard deviations away{widened}: check"
        f" the frames{box}, gravity and the offsets of the sensors."
    )


def _outliers(data: Data, _: Style) -> str:
    one = data["outliers"] == 1
    return (
        f"{data['outliers']} of {counted(data['windows'], 'window')}"
        f" {'is an outlier' if one else 'are outliers'}, as an impact causes"
        f" {'it, and has' if one else 'them, and have'} next to no weight."
    )


def _acceleration_not_used(data: Data, style: Style) -> str:
    why = "explain the wrench better" if data["explains_better"] else "have less noise"
    return (
        f"{data['topic']} is not used: accelerations derived from the velocities {why} (residuals"
        f" {_percent(data['residual_ratio'])} as large, power {_percent(data['power_ratio'])})."
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


def _joints_renamed(data: Data, style: Style) -> str:
    pairs = listed([f"{recorded} is {joint}" for recorded, joint in data["names"]])
    return (
        "No joint in the log has the name of one in the URDF, so joints were matched behind their"
        f" prefixes: {pairs}; {option_name('rename_joints', style)} names them."
    )


def _unknown_joints(data: Data, _: Style) -> str:
    return (
        "Joints that the URDF does not have, or that do not move in it, were left out:"
        f" {', '.join(data['joints'])}."
    )


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


def _delay_doubtful(data: Data, style: Style) -> str:
    why = (
        "but it is as long as any that is searched for"
        if data["is_at_end"]
        else f"but only a little (its residuals are {_percent(data['residual_ratio'])} as large)"
    )
    return (
        f"A delay of the wrenches, stamped {_shift(data['delay_s'], 0)} than the motion, would fit"
        f" better, {why}: it was not corrected. Check whether all sensors of the payload were"
        f" recorded, and the frames and signs; {option_name('delay_s', style)} sets a delay."
    )


def _no_stamps(_: Data, __: Style) -> str:
    return "The messages have no stamps: their times are those of logging."


def _delay_corrected(data: Data, _: Style) -> str:
    half_width = 1e3 * Z95 * data["std_dev_s"]
    digits = digits_of(half_width)
    return (
        f"The wrenches are stamped {_shift(data['applied_s'], digits)} than the motion: this delay"
        f" was corrected (estimated {1e3 * data['estimated_s']:.{digits}f}"
        f" ± {half_width:.{digits}f} ms)."
    )


def _shift(delay_s: float, digits: int) -> str:
    """Says by how much stamps are later than the motion, or earlier."""
    return f"{1e3 * abs(delay_s):.{digits}f} ms {'later' if delay_s >= 0 else 'earlier'}"


def _percent(ratio: float) -> str:
    percent = 100 * ratio
    return f"{percent:.{min(digits_of(percent), 3)}f} %" if percent >= 1e-3 else "under 0.001 %"


_FINDINGS: dict[str, Callable[[Data, Style], str]] = {
    "gravity_contradicted": _gravity_contradicted,
    "nothing_held": _nothing_held,
    "negative_mass": _negative_mass,
    "known_bodies_too_heavy": _known_bodies_too_heavy,
    "offset_suspected": _offset_suspected,
    "load_unexplained": _load_unexplained,
    "mass_contradicted": _mass_contradicted,
    "known_mass_not_kept": _known_mass_not_kept,
    "inconsistent": _inconsistent,
    "outliers": _outliers,
    "acceleration_not_used": _acceleration_not_used,
    "option_not_used": _option_not_used,
    "frame_assumed": _frame_assumed,
    "wrenches_summed": _wrenches_summed,
    "joints_renamed": _joints_renamed,
    "unknown_joints": _unknown_joints,
    "absent_joints": _absent_joints,
    "late_start": _late_start,
    "early_end": _early_end,
    "no_equations": _no_equations,
    "no_stamps": _no_stamps,
    "delay_corrected": _delay_corrected,
    "delay_doubtful": _delay_doubtful,
    **CALIBRATION_FINDINGS,
    **RUN_FINDINGS,
    **SAMPLE_FINDINGS,
    **MODEL_FINDINGS,
}

FINDING_KINDS = tuple(_FINDINGS)
"""Every kind of finding about the recording of an identification."""

CONTRADICTION_KINDS = tuple(CALIBRATION_CONTRADICTIONS)
"""Every kind of finding about an assumption that the recordings of a calibration contradict."""

SHORTAGE_KINDS = tuple(SHORTAGES)
"""Every kind of finding about what the motion of a calibration does not determine."""
