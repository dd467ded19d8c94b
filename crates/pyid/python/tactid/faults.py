"""Faults of a recording's messages in words."""

_SENTENCES = {
    "gap": "{gap} {was} not bridged",
    "out_of_order": "{sample} out of order {was} left out",
    "undecodable": "{message} that cannot be decoded {was} left out",
    "not_finite": "{sample} with a value that is not finite {was} left out",
    "out_of_range": "{sample} with a value out of range (beyond 1e9) {was} left out",
    "partial_joints": "{message} with only some of the publisher's joints {was} left out",
    "position_count": "{message} with another number of positions than of names {was} left out",
    "velocity_not_finite": "{velocity} not finite {was} derived from the positions",
    "no_velocity": "{message} {has} no velocities, which were derived from the positions",
    "no_effort": "{message} without efforts {was} left out",
    "effort_not_finite": "{sample} with an effort of {joint} that is not finite {was} left out",
    "not_unit_quaternion": (
        "{sample} with an orientation that is no unit quaternion {was} left out"
    ),
    "no_stamp": "{message} {has} no stamp: the time of logging is used",
    "far_stamp": "{message} with a stamp far from the time of logging {was} left out",
    "incomplete": "{sample} at which another stream has no value {was} left out",
}

_FORMS = {
    "gap": ("gap", "gaps"),
    "message": ("message", "messages"),
    "velocity": ("velocity that is", "velocities that are"),
    "sample": ("sample", "samples"),
    "was": ("was", "were"),
    "has": ("has", "have"),
}
"""Words in the singular and in the plural; the number stands in front of the nouns."""

_VERBS = ("was", "has")

FAULT_KINDS = tuple(_SENTENCES)
"""Every kind of fault."""


def fault(kind: str, count: int, joint: str | None) -> str:
    """Says how often a kind of fault occurred, and what was done about it."""
    words = {}
    for name, (singular, plural) in _FORMS.items():
        form = singular if count == 1 else plural
        words[name] = form if name in _VERBS else f"{count} {form}"
    return _SENTENCES[kind].format(**words, joint=joint)
