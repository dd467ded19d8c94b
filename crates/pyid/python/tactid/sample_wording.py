"""Findings about samples in words: velocities, positions, efforts, and constant channels."""

from collections.abc import Callable, Mapping
from typing import Any

from tactid.naming import Style, listed, option_name

Data = Mapping[str, Any]


def _velocities_contradicted(data: Data, _: Style) -> str:
    causes = {
        "opposite_sign": " They have the opposite sign.",
        "degrees": " They are in degrees per second, but must be in rad/s.",
        "positions_in_degrees": " The positions are in degrees, but must be in rad.",
        "other_joint": f" They are those of {data['other']}: check the order of the joints.",
        None: " Check their units and signs, and the order of the joints.",
    }
    return (
        f"The velocities of {listed(data['joints'])} are not the derivatives of the positions (rms"
        f" difference {_whole_percent(data['relative_difference'])} of the motion)."
        f"{causes[data['cause']]}"
    )


def _positions_beyond_limits(data: Data, _: Style) -> str:
    first, lower, upper = data["joints"][0], data["lower"], data["upper"]
    advice = (
        "They are in degrees, but must be in rad (and the velocities in rad/s)."
        if data["are_degrees"]
        else "Check their units, the order of the joints, and that the URDF is that of this robot."
    )
    return (
        f"The positions of {listed(data['joints'])} are beyond the limits of the URDF: {first}"
        f" reaches {data['position']:.4g}, and its limits are {lower:.4g} and {upper:.4g}. {advice}"
    )


def _efforts_beyond_limits(data: Data, style: Style) -> str:
    placeholders = (
        " The limits of the URDF are all the same, and may be placeholders."
        if data["limits_are_equal"]
        else ""
    )
    gains = "" if style == "online" else f" ({option_name('effort_gain', style)})"
    return (
        f"The efforts of {listed(data['joints'])} are far beyond the limits of the URDF: that of"
        f" {data['joints'][0]} is {data['effort']:.4g} on average, and its limit is"
        f" {data['limit']:.4g}. They must be torques in N m, or forces in N: check their unit and"
        f" the gains{gains}.{placeholders}"
    )


def _twist_contradicted(data: Data, _: Style) -> str:
    causes = {
        "body": " It is in the axes of the moving body, but must be in those of the world; or the"
        " quaternion of the pose is not in the order x, y, z, w.",
        "world": " It is in the axes of the world, but the twist of an odometry message must be in"
        " those of its child frame.",
        None: " Check its units, signs and axes; it may also be zero because it is not measured.",
    }
    return (
        f"{data['source']}: the twist is not the derivative of the pose (rms difference"
        f" {_whole_percent(data['relative_difference'])} of the motion)."
        f"{causes[data['better_axes']]}"
    )


def _constant_channels(data: Data, _: Style) -> str:
    value = "zero" if data["is_zero"] else "constant"
    several = len(data["channels"]) > 1
    return (
        f"{data['source']}: {listed(data['channels'])} in `{data['frame']}`"
        f" {'are' if several else 'is'} exactly {value} in all samples, as of a sensor that does"
        f" not measure {'them' if several else 'it'}. The estimate takes"
        f" {'them' if several else 'it'} for measured."
    )


def _whole_percent(ratio: float) -> str:
    return f"{100 * ratio:.0f} %"


SAMPLE_FINDINGS: dict[str, Callable[[Data, Style], str]] = {
    "velocities_contradicted": _velocities_contradicted,
    "positions_beyond_limits": _positions_beyond_limits,
    "efforts_beyond_limits": _efforts_beyond_limits,
    "twist_contradicted": _twist_contradicted,
    "constant_channels": _constant_channels,
}
"""The sentences of each kind, by the data of a finding and its reader."""
