"""Findings about calibrations in words: what their motion lacks, and what has changed since."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from tactid.naming import Style, at_most, listed, option_name
from tactid.values import Z95

Data = Mapping[str, Any]

LARGEST_CHANGE_OF_A_GAIN = 0.15
"""Largest change of a joint's gain, a fraction, that may have its cause in the arm itself:
temperature changes gains by a few percent."""

LARGEST_CHANGE_OF_FRICTION = 0.6
"""Largest rms change of the friction, a fraction, that temperature and wear explain: a cold gear
has about half as much again as a warm one."""


def is_of_another_arm(kind: str, data: Data) -> bool:
    """Whether friction or gains differ from the calibration by more than those of an arm change."""
    if kind == "gains_changed":
        return bool(abs(data["joint_change"]) > LARGEST_CHANGE_OF_A_GAIN)
    return kind == "friction_changed" and bool(data["change"] > LARGEST_CHANGE_OF_FRICTION)


def _effort_noisier(data: Data, _: Style) -> str:
    return efforts_noisier([data])


def efforts_noisier(joints: Sequence[Data]) -> str:
    """Says which efforts are noisier than at the calibration: one sentence for all joints."""
    names = listed([data["joint"] for data in joints])
    ratios = listed([_ratio(data["noise_ratio"]) for data in joints])
    one = len(joints) == 1
    subject, count = (
        (f"The effort of {names} is", "counts") if one else (f"The efforts of {names} are", "count")
    )
    return (
        f"{subject} {ratios} times as noisy as at the calibration, and {count} less; what the model"
        " does not explain may make the values wrong by more than their intervals. Check"
        " temperature, wear and what else has changed, and calibrate anew."
    )


def _ratio(ratio: float) -> str:
    return at_most(ratio, 1 if ratio < 10 else 0)


def _joint_uncalibrated(data: Data, _: Style) -> str:
    return (
        f"{data['joint']} moves, but did not move when the arm was calibrated: its friction is not"
        " known, and its effort counts little. Record a motion of this joint in both directions,"
        " and calibrate anew."
    )


def _joint_still(data: Data, _: Style) -> str:
    return (
        f"{data['joint']} does not move (at most {data['max_velocity']:.2g} rad/s or m/s): its"
        " friction is not known. Record a motion of this joint in both directions."
    )


def _joint_one_direction(data: Data, _: Style) -> str:
    direction = "positive" if data["is_positive"] else "negative"
    return (
        f"{data['joint']} moves in the {direction} direction only: its offset and its Coulomb"
        " friction cannot be distinguished. Record a motion in both directions."
    )


def _gain_uncertain(data: Data, _: Style) -> str:
    return (
        f"The gain of {data['joint']} stays uncertain, ± {100 * Z95 * data['std_dev']:.2g} %:"
        " record a heavier payload of known mass, in postures in which this joint carries it."
    )


def _friction_changed(data: Data, _: Style) -> str:
    cause = "Temperature and wear do that."
    if is_of_another_arm("friction_changed", data):
        cause = (
            "Neither temperature nor wear does that: check that the calibration is of this robot,"
            " and the order, signs and units of the joints; the intervals do not contain such an"
            " error."
        )
    return _arm_changed("Friction differs", data, cause)


def _gains_changed(data: Data, _: Style) -> str:
    cause = (
        "Temperature changes gains by a few percent; the zero of a joint that has moved, and the"
        " calibration of another robot, look the same."
    )
    if is_of_another_arm("gains_changed", data):
        cause = (
            "No temperature does that: check that the calibration is of this very robot, not of"
            " another one of its type, and gravity, the mounting, the zeros and the order of the"
            " joints and the units; the intervals do not contain such an error."
        )
    return _arm_changed("The gains of the efforts differ", data, cause)


def _arm_changed(subject: str, data: Data, cause: str) -> str:
    """Says how much has changed, and what makes the result better."""
    change, of_joint = data["change"], data["joint_change"]
    # Beyond 100 % the number only shows that the model does not hold.
    size = "more than 100 %" if change > 1 else f"about {two_figures(100 * change)} %"
    most = f"most at {data['joint']}"
    if abs(of_joint) <= 1:
        most += f", {'-' if of_joint < 0 else '+'}{two_figures(100 * abs(of_joint))} %"
    updated = "The unloaded recording has updated the calibration."
    if data["has_unloaded"] and cause.startswith("No"):
        updated += " Check that it is of this robot, and identify without it."
    advice = (
        updated
        if data["has_unloaded"]
        else "Record an unloaded motion of the same day, or calibrate anew."
    )
    return f"{subject} from the calibration by {size} ({most}). {cause} {advice}"


def _gravity_tilted(data: Data, style: Style) -> str:
    return _contradicted(
        f"with gravity tilted by {_degrees(data)}{_shown(data, 'm/s²')}{_most(data)}",
        f"Check {option_name('gravity', style)}, and how the arm is mounted",
    )


def _joint_zero_off(data: Data, style: Style) -> str:
    return _contradicted(
        f"with positions of {data['joint']} that are"
        f" {'larger' if data['size'] > 0 else 'smaller'} by {_degrees(data)}",
        "Check the zero of this joint, the origin of the joint in the URDF, the order of the joints"
        f" and {option_name('payload_com', style)}, of which a wrong one can look the same",
    )


def _gain_contradicted(data: Data, style: Style) -> str:
    if data["size"] <= -1:
        return _contradicted(
            f"with a gain of {data['joint']} that is negative, which no gain is",
            "Usual causes are an unloaded recording that holds a payload, exchanged joints, and the"
            " URDF of another robot. Check these",
        )
    sign = "-" if data["size"] < 0 else "+"
    size = f"{sign}{_interval(abs(data['size']), data['std_dev'], 100)} %"
    options = f"{option_name('loaded', style)} and {option_name('payload_mass_kg', style)}"
    what = f"with other gains, most at {data['joint']} ({size})"
    return _contradicted(what, f"Find the gains with {options}")


def _payload_com_contradicted(data: Data, style: Style) -> str:
    size = f"{_interval(data['size'], data['std_dev'], 1e3)} mm"
    which = f"of the payload of loaded recording {data['payload'] + 1}"
    distance = f"{size} from the given one{_shown(data, 'm')}"
    return _contradicted(
        f"with the centre of mass {which} {distance}{_most(data)}",
        f"Check {option_name('payload_com', style)} and the zeros of the joints",
    )


def _gain_improbable(data: Data, style: Style) -> str:
    gain, prior = 1 + data["size"], data["prior_std_dev"]
    # As far from one as its inverse is, whichever is farther.
    distance = max(abs(data["size"]), abs(1 / gain - 1)) / prior
    return (
        f"The gain of {data['joint']} is {two_figures(gain)} times the given one, which is"
        f" {distance:.1f} standard deviations away ({option_name('gain_std_dev', style)}"
        f" {two_figures(100 * prior)} %). Usual causes are the URDF of another robot, efforts in"
        f" another unit, and a wrong {option_name('payload_mass_kg', style)}. The intervals of the"
        " calibration do not contain such an error. Check these, and calibrate anew."
    )


def _calibration_contradicted(data: Data, style: Style) -> str:
    of_calibration = CALIBRATION_CONTRADICTIONS[data["assumption"]](data, style)
    return f"The calibration is contradicted by its own recordings. {of_calibration}"


def _joint_zero_moved(data: Data, _: Style) -> str:
    size = f"{abs(data['size']):.2g} ± {two_figures(Z95 * data['std_dev'])} rad"
    direction = "more" if data["size"] > 0 else "less"
    return (
        f"The data fit better if the zero of {data['joint']} has moved since the calibration: with"
        f" positions of {size} {direction},"
        f" {at_most(abs(data['size']) / data['std_dev'], 1)} standard deviations from none. The"
        " intervals do not contain such an error. Check the order of the joints and the zero of"
        " this one: set it as it was, or calibrate anew."
    )


def _unloaded_left_out(data: Data, style: Style) -> str:
    return (
        f"The unloaded recording was left out: with it the efforts would fit"
        f" {_ratio(data['noise_ratio'])} times worse. Friction differs between the two recordings,"
        " or they are of different robots. Record the unloaded motion at the same temperature, or"
        f" identify without {option_name('unloaded', style)}."
    )


def _recording_calibrated(data: Data, _: Style) -> str:
    held = "with the payload that was given for it" if data["is_loaded"] else "without a payload"
    return (
        f"This recording calibrated the arm {held}: the result repeats what was given, and is no"
        " check of it. Identify another recording."
    )


def _contradicted(what: str, advice: str) -> str:
    return (
        f"The efforts fit far better {what}. The error is in the"
        f" calibration, and its intervals do not contain it. {advice}, and calibrate anew."
    )


def _shown(data: Data, unit: str) -> str:
    """Says what the efforts show instead, as the option takes it; a file may lack it."""
    vector = data.get("shown")
    if vector is None:
        return ""
    return f", at {' '.join(f'{entry:.3g}' for entry in vector)} {unit}"


def _most(data: Data) -> str:
    return f", which the efforts of {data['joint']} show most"


def _degrees(data: Data) -> str:
    return f"{_interval(abs(data['size']), data['std_dev'], math.degrees(1))} degrees"


def _interval(size: float, std_dev: float, unit: float) -> str:
    return f"{two_figures(unit * size)} ± {two_figures(unit * Z95 * std_dev)}"


def two_figures(number: float) -> str:
    """Formats a number with two significant figures and without an exponent."""
    return f"{float(f'{number:.2g}'):.15g}"


CALIBRATION_FINDINGS: dict[str, Callable[[Data, Style], str]] = {
    "effort_noisier": _effort_noisier,
    "joint_uncalibrated": _joint_uncalibrated,
    "calibration_contradicted": _calibration_contradicted,
    "joint_zero_moved": _joint_zero_moved,
    "unloaded_left_out": _unloaded_left_out,
    "recording_calibrated": _recording_calibrated,
    "friction_changed": _friction_changed,
    "gains_changed": _gains_changed,
}
"""Sentences about a recording that is identified with a calibration."""

SHORTAGES: dict[str, Callable[[Data, Style], str]] = {
    "joint_still": _joint_still,
    "joint_one_direction": _joint_one_direction,
    "gain_uncertain": _gain_uncertain,
}
"""Sentences about what the motion of a calibration does not determine."""

CALIBRATION_CONTRADICTIONS: dict[str, Callable[[Data, Style], str]] = {
    "gravity_tilted": _gravity_tilted,
    "joint_zero_off": _joint_zero_off,
    "gain_contradicted": _gain_contradicted,
    "payload_com_contradicted": _payload_com_contradicted,
    "gain_improbable": _gain_improbable,
}
"""Sentences about an assumption that the recordings of a calibration contradict."""
