"""Findings about the description of a robot in words."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from tactid.naming import Style, abridged, listed

Data = Mapping[str, Any]


def _impossible_inertia(data: Data, _: Style) -> str:
    moments = ", ".join(f"{moment:.3g}" for moment in data["moments"])
    return (
        f"Link `{data['link']}`: no rigid body has its inertia, with the principal moments"
        f" {moments} kg m²: none may be negative, or exceed the sum of the other two. It was used"
        " as the URDF has it."
    )


def _impossible_mass(data: Data, _: Style) -> str:
    what = (
        f"its mass of {data['mass_kg']:g} kg is negative"
        if data["mass_kg"]
        else "it has an inertia, but a mass of zero"
    )
    return f"Link `{data['link']}`: {what}. It was used as the URDF has it."


def _unknown_numbers(data: Data, _: Style) -> str:
    several = len(data["attributes"]) > 1
    return (
        f"Link `{data['link']}`: {listed(data['attributes'])} of <{data['element']}> in its"
        f" <inertial> {'are no finite numbers' if several else 'is no finite number'}, or missing:"
        f" {'each' if several else 'it'} was taken to be zero."
    )


def _massless(data: Data, _: Style) -> str:
    several = len(data["links"]) > 1
    return (
        f"{'Links' if several else 'Link'} {_named(data['links'])} {'move' if several else 'moves'}"
        f" but {'have' if several else 'has'} no mass, and {'were' if several else 'was'} taken to"
        " be massless: right for virtual links, as in a ball joint of three hinges; else give"
        f" {'them' if several else 'it'} an <inertial> in the URDF."
    )


def _joint_taken_as_fixed(data: Data, _: Style) -> str:
    return (
        f"Joint `{data['joint']}` is of type {data['joint_type']}, which has several degrees of"
        " freedom: it was taken to be fixed at zero."
    )


def _mimic_not_followed(data: Data, _: Style) -> str:
    if not data["leader"]:
        return f"Joint `{data['joint']}` mimics no joint by name: it was taken to move by itself."
    reasons = {
        "no_such_joint": "which the robot does not have",
        "leader_is_fixed": "which does not move",
        "circular": "which mimics it in turn",
        "numbers": "but its multiplier or offset is no finite number",
    }
    return (
        f"Joint `{data['joint']}` mimics `{data['leader']}`, {reasons[data['because']]}: it was"
        " taken to move by itself."
    )


def _part_ignored(data: Data, _: Style) -> str:
    name, inside = data["name"], data["inside"]
    parts = {
        "unknown_element": f"The element <{name}> in <{inside}>, which URDF does not have,",
        "repeated_element": f"Every <{name}> in <{inside}> but the first",
        "unknown_attribute": f"The attribute `{name}` of <{inside}>, which URDF does not have,",
    }
    return f"{parts[data['part']]} was ignored: in {_named(data['owners'])}."


def _named(names: Sequence[str]) -> str:
    return abridged([f"`{name}`" for name in names])


MODEL_FINDINGS: dict[str, Callable[[Data, Style], str]] = {
    "impossible_inertia": _impossible_inertia,
    "impossible_mass": _impossible_mass,
    "unknown_numbers": _unknown_numbers,
    "massless": _massless,
    "joint_taken_as_fixed": _joint_taken_as_fixed,
    "mimic_not_followed": _mimic_not_followed,
    "part_ignored": _part_ignored,
}
"""The sentences of each kind of finding, from its data."""
