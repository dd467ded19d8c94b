"""The options of ``tactid excite`` beyond those of an identification.

They are keywords of :func:`tactid.design_excitation`, which documents them.
"""

from tactid._api.excitation import design_excitation
from tactid._options.declaration import declare

OPTIONS = declare(
    design_excitation,
    "design",
    {
        "Motion": {
            "start": "numbers",
            "duration": "number",
            "within": "percentage",
            "longest": "number",
            "seed": "count",
            "rate": "number",
            "criterion": {"choice": ["largest-interval", "volume"]},
            "payload": "body",
            "payload_mass_max": "number",
            "payload_box": "box",
        },
        "Limits": {
            "limit_scale": "number",
            "acceleration": "number",
            "wrench_limit": "wrench",
            "grip": "grip",
            "base_attitude": "degrees",
            "base_position": "number",
            "collisions": "switch",
            "workspace": "box",
            "keep_out": "boxes",
            "least_distance": "number",
        },
        "Sensors": {"sensors": "texts", "sample_rate": "number", "base_noise": "wrench"},
    },
    {
        "start": "Positions at the beginning and the end: one for each joint, or one for each joint"
        " that moves the tip, rad or m. Default: 0, or the middle of a range that excludes it.",
        "within": "Target precision as of tactid identify, in percent with its sign, such as 1%:"
        " the motion is the shortest that reaches it.",
        "payload": "The expected payload: mass, centre of mass in the tip's frame, and inertia"
        " about it. Unit: kg, m, kg m².",
        "grip": "Two flat pads: the point between them, the direction from one to the other, their"
        " distance, the force of each, friction, and the torsion radius. Of the friction, 70 % is"
        " used. Unit: m, N.",
        "base_attitude": "The base floats, and may turn by this angle at most, degrees.",
        "base_position": "The base floats, and its origin may move so far, m.",
        "keep_out": "A box that must not be entered, such as table=-1,-1,-0.5,1,1,0: its name, then"
        " its least and largest corner in the frame of the base, m.",
        "sensors": "Link in which a wrench is measured. Default: the tip.",
    },
)
"""The options by their names, in the order in which they are listed."""

FLAGS = {"start": ("--start", "--from"), "collisions": ("--collisions/--no-collisions",)}
"""Flags that differ from the name of the option."""
