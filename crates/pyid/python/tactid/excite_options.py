"""The options of ``tactid excite`` beyond those of an identification: each declared once."""

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import typer

from tactid import option_text
from tactid.excitation_arguments import Grip
from tactid.naming import command_line_flag

MOTION, LIMITS, SENSORS = "Motion", "Limits", "Sensors"


@dataclass(frozen=True)
class _Argument:
    """An option of the command that is a keyword of :func:`tactid.design_excitation`."""

    name: str
    kind: Any
    panel: str
    text: str
    metavar: str | None = None
    flags: tuple[str, ...] = ()
    parse: Callable[[str, Any], Any] | None = None

    @property
    def parameter(self) -> inspect.Parameter:
        """The parameter that typer reads."""
        flags = self.flags or (command_line_flag(self.name),)
        declaration = typer.Option(
            *flags,
            help=self.text,
            metavar=self.metavar,
            rich_help_panel=self.panel,
            show_default=False,
        )
        return inspect.Parameter(
            self.name,
            inspect.Parameter.KEYWORD_ONLY,
            default=None,
            annotation=Annotated[self.kind | None, declaration],
        )


def _six(flag: str, text: str) -> list[float]:
    return option_text.numbers(flag, text, 6)


def _grip(flag: str, text: str) -> Grip:
    numbers = option_text.numbers(flag, text, 10)
    return Grip(numbers[:3], numbers[3:6], *numbers[6:])


def _radians(_: str, degrees: float) -> float:
    return float(np.radians(degrees))


_ARGUMENTS = (
    _Argument(
        "start",
        str,
        MOTION,
        "Positions of the joints that move the tip, or of all joints, at the "
        "beginning and the end. Default: 0, or the middle of a range without it. "
        "Unit: rad (m).",
        metavar="Q,Q,...",
        flags=("--start", "--from"),
        parse=option_text.numbers,
    ),
    _Argument(
        "duration",
        float,
        MOTION,
        "Duration. Default: 10. Unit: s.",
    ),
    _Argument(
        "within",
        str,
        MOTION,
        "Target precision as of tactid identify, in percent with its sign, such as 1%: "
        "the motion is the shortest that reaches it.",
        parse=option_text.fraction,
    ),
    _Argument(
        "longest",
        float,
        MOTION,
        "Longest duration that is tried for --within. Default: 60. Unit: s.",
    ),
    _Argument(
        "seed",
        int,
        MOTION,
        "Seed of the search. Default: 0.",
    ),
    _Argument(
        "rate",
        float,
        MOTION,
        "Samples of the motion a second. Default: 1000.",
    ),
    _Argument(
        "criterion",
        str,
        MOTION,
        "What is minimised: largest-interval (the default) or volume.",
    ),
    _Argument(
        "payload",
        str,
        MOTION,
        "The expected payload: mass, centre of mass in the tip's frame, and "
        "inertia about it. Unit: kg, m, kg m².",
        metavar="M,X,Y,Z,XX,XY,XZ,YY,YZ,ZZ",
        parse=option_text.body,
    ),
    _Argument(
        "payload_mass_max",
        float,
        MOTION,
        "Largest mass of an unknown payload. Unit: kg.",
    ),
    _Argument(
        "payload_box",
        str,
        MOTION,
        "Least and largest corner of a box that contains the payload, in the tip's frame. Unit: m.",
        metavar="X,Y,Z,X,Y,Z",
        parse=option_text.box,
    ),
    _Argument(
        "limit_scale",
        float,
        LIMITS,
        "Factor on velocities and accelerations, at most 1, which is the velocity limit of the "
        "URDF. Default: 1.",
    ),
    _Argument(
        "acceleration",
        float,
        LIMITS,
        "Largest acceleration of a joint. Default: 2. Unit: rad/s² (m/s²).",
    ),
    _Argument(
        "wrench_limit",
        str,
        LIMITS,
        "Largest magnitudes of the wrench on the payload in the tip's frame. Unit: N, N m.",
        metavar="FX,FY,FZ,MX,MY,MZ",
        parse=_six,
    ),
    _Argument(
        "grip",
        str,
        LIMITS,
        "Two flat pads: the point between them, the direction from one to the "
        "other, their distance, the force of each, friction, and the torsion "
        "radius. Of the friction, 70 % is used. Unit: m, N.",
        metavar="X,Y,Z,NX,NY,NZ,DISTANCE,FORCE,FRICTION,RADIUS",
        parse=_grip,
    ),
    _Argument(
        "base_attitude",
        float,
        LIMITS,
        "The base floats, and may turn by this angle at most. Unit: degrees.",
        parse=_radians,
    ),
    _Argument(
        "base_position",
        float,
        LIMITS,
        "The base floats, and its origin may move so far. Unit: m.",
    ),
    _Argument(
        "collisions",
        bool,
        LIMITS,
        "Whether to keep the robot from touching itself, the payload's box and the keep-out boxes. "
        "--no-collisions accepts a motion that may run the robot through itself. "
        "Default: --collisions.",
        flags=("--collisions/--no-collisions",),
    ),
    _Argument(
        "workspace",
        str,
        LIMITS,
        "Least and largest corner of a box that the tip and the payload's box must stay in, in "
        "the frame of the base. Unit: m.",
        metavar="X,Y,Z,X,Y,Z",
        parse=option_text.box,
    ),
    _Argument(
        "keep_out",
        list[str],
        LIMITS,
        "A box that must not be entered, such as table=-1,-1,-0.5,1,1,0: its name, then the "
        "least and the largest corner in the frame of the base. Unit: m.",
        metavar="NAME=BOX",
        parse=option_text.named_boxes,
    ),
    _Argument(
        "least_distance",
        float,
        LIMITS,
        "Least distance of links, payload and keep-out boxes, at most 0.06; a pair that is closer "
        "at the start keeps half of that, and is listed. Default: 0.01. Unit: m.",
    ),
    _Argument(
        "sensors",
        list[str],
        SENSORS,
        "Link in which a wrench is measured. Default: the tip.",
    ),
    _Argument(
        "sample_rate",
        float,
        SENSORS,
        "Samples of the sensors. Default: --rate. Unit: Hz.",
    ),
    _Argument(
        "base_noise",
        str,
        SENSORS,
        "Standard deviations of the wrench that follows from the motion of the "
        "base, for the methods joint-sensing and combined. Unit: N, N m.",
        metavar="FX,FY,FZ,MX,MY,MZ",
        parse=_six,
    ),
)


def parameters() -> list[inspect.Parameter]:
    """Returns a parameter for each option."""
    return [argument.parameter for argument in _ARGUMENTS]


def read(given: dict[str, Any]) -> dict[str, Any]:
    """Returns the keywords of a design that the command line gives."""
    keywords = {}
    for argument in _ARGUMENTS:
        value = given[argument.name]
        if value is not None and value != []:
            flag = command_line_flag(argument.name)
            parse = argument.parse
            keywords[argument.name] = value if parse is None else parse(flag, value)
    return keywords
