"""The options of an identification: each declared once, for Python and for the command line.

A field of :class:`Options` is a keyword of ``tactid.identify`` and an option of the command
``tactid identify``, and crosses to Rust by its name. All defaults are Rust's: None stands for them.
"""

import difflib
import inspect
import os
import textwrap
from collections.abc import Callable, Iterable, Sequence
from dataclasses import Field, dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Literal, TypeVar

from numpy.typing import ArrayLike

from tactid import option_text
from tactid._native import MassProperties
from tactid.errors import ArgumentError

Method = Literal["tactile", "effort", "joint-sensing", "combined"]
"""Which measurements the payload is identified from."""

Estimator = Literal["least-squares", "nlms"]
"""How equations become parameters."""

ActsOn = Literal["payload", "sensor"]
"""The body on which a measured wrench acts."""

Use = Literal["log", "arrays", "online", "paper filter"]
"""Where an option can apply: to a log, to arrays, to ``Identifier`` or to ``PaperFilter``."""

_LOG: tuple[Use, ...] = ("log",)
_RECORDING: tuple[Use, ...] = ("log", "arrays")
_LEAST_SQUARES: tuple[Use, ...] = ("log", "arrays", "online")
_ALL: tuple[Use, ...] = ("log", "arrays", "online", "paper filter")
_PAPER: tuple[Use, ...] = ("log", "arrays", "paper filter")

ROBOT, TOPICS, SIGNS, SIGNALS = "Robot", "Topics", "Signs", "Signals"
PAYLOAD, PAPER = "Payload, where something is known of it", "Paper's filter"

_KEY = "option"
_Class = TypeVar("_Class", bound=Callable[..., Any])


@dataclass(frozen=True)
class Declaration:
    """What is known of an option besides its name and its type."""

    text: str
    """Documentation in complete sentences, with the unit and the default."""
    panel: str
    """Panel of the command's help."""
    uses: tuple[Use, ...]
    """Where the option applies."""
    unit: str | None
    """Unit of the value; None for what has none."""
    metavar: str | None
    """Placeholder of the value in the command's help."""
    argument: Any
    """Type of the command line's argument; None for that of the field."""
    parse: Callable[[str, Any], Any] | None
    """Turns a flag and the command line's argument into the value; None where they are the same."""

    @classmethod
    def of(cls, one: "Field[Any]") -> "Declaration":
        """Returns the declaration of a field of :class:`Options`."""
        declaration: Declaration = one.metadata[_KEY]
        return declaration


def _option(
    text: str,
    panel: str,
    uses: tuple[Use, ...] = _RECORDING,
    *,
    unit: str | None = None,
    metavar: str | None = None,
    argument: Any = None,
    parse: Callable[[str, Any], Any] | None = None,
) -> Any:
    declaration = Declaration(text, panel, uses, unit, metavar, argument, parse)
    return field(default=None, metadata={_KEY: declaration})


@dataclass(frozen=True, kw_only=True)
class Options:
    """What to identify from a recording, and how: every option once, each optional.

    <options>
    """

    urdf: str | None = _option(
        "The robot's URDF as text; on the command line, the path of its file. Default: the robot"
        " description in the log.",
        ROBOT,
        _LOG,
        argument=Path,
        parse=option_text.file_content,
    )
    tip: str | None = _option(
        "End-effector frame, a link of the robot. Default: tool0, or the frame of the sensor where"
        " there is no robot.",
        ROBOT,
        _ALL,
        metavar="LINK",
    )
    sensor_frame: Sequence[Any] | None = _option(
        "Frame of the only wrench sensor, where it is no link of the robot or to replace it: the"
        " link that it is fixed to, then its origin x, y, z and its quaternion qx, qy, qz, qw in"
        " the frame of this link. Default: the frame that the messages name; for arrays, the"
        " sensors' links.",
        ROBOT,
        unit="m",
        metavar="LINK,X,Y,Z,QX,QY,QZ,QW",
        argument=str,
        parse=option_text.frame,
    )
    method: Method | None = _option(
        "Measurements that the payload is identified from: wrenches (tactile); joint efforts beyond"
        " those that the arm itself needs (effort); the motion of a free-floating base, from which"
        " the known gripper is subtracted (joint-sensing); or all that is measured, each channel"
        " weighted by its own residuals (combined). Default: tactile where there are wrenches, else"
        " effort.",
        ROBOT,
        _ALL,
    )
    unloaded: str | os.PathLike[str] | None = _option(
        "An unloaded recording of the same motion: its joint efforts are subtracted.",
        ROBOT,
        _LOG,
        argument=Path,
    )
    effort_gain: Sequence[float] | None = _option(
        "Effort of each joint for one unit of the recorded value, in the robot's order. Default:"
        " 1.",
        ROBOT,
        unit="N m (N) per unit",
        metavar="G,G,...",
        argument=str,
        parse=option_text.numbers,
    )
    joint_topic: str | Sequence[str] | None = _option(
        "Topic of joint states; several where each has some of the joints. Default: found by its"
        " type.",
        TOPICS,
        _LOG,
        argument=list[str],
    )
    wrench_topic: str | Sequence[str] | None = _option(
        "Topic of wrenches; the sum of several acts on the payload. Default: found by its type;"
        " several only where each is of another finger, a link that joints beyond the tip move.",
        TOPICS,
        _LOG,
        argument=list[str],
    )
    odometry_topic: str | None = _option(
        "Topic of the odometry of the base, or of the sensor itself where there are no joints.",
        TOPICS,
        _LOG,
    )
    imu_topic: str | None = _option(
        "Topic of an inertial unit: on the tool where there are neither joints nor odometry, or on"
        " a moving base, in its frame.",
        TOPICS,
        _LOG,
    )
    acceleration_topic: str | None = _option(
        "Topic of the accelerations of the body that the odometry moves.",
        TOPICS,
        _LOG,
    )
    gravity: ArrayLike | None = _option(
        "Gravitational acceleration in world axes, (3,), pointing down. Default: zero for a"
        " floating base, 0 0 -9.81 for a fixed one and for a sensor without a robot.",
        SIGNS,
        _ALL,
        unit="m/s²",
        argument=tuple[float, float, float],
    )
    wrench_acts_on: ActsOn | None = _option(
        "Body on which the measured wrenches act. Most force-torque sensors report the wrench on"
        " the sensor. Default: payload.",
        SIGNS,
    )
    known_tool: MassProperties | None = _option(
        "A known body that the measured load contains besides the payload, in the tip's frame: it"
        " is subtracted. On the command line: mass, centre of mass, and inertia about it.",
        SIGNS,
        unit="kg, m, kg m²",
        metavar="M,X,Y,Z,XX,XY,XZ,YY,YZ,ZZ",
        argument=str,
        parse=option_text.body,
    )
    known_mass: float | None = _option(
        "Mass of the payload from a scale: it improves the other values, too.",
        PAYLOAD,
        unit="kg",
    )
    known_mass_std_dev: float | None = _option(
        "Standard deviation of the known mass. Default: 0, an exact mass.",
        PAYLOAD,
        unit="kg",
    )
    bounding_box: ArrayLike | None = _option(
        "Least and largest corner of a box that contains the whole payload, in the tip's frame,"
        " (2, 3): the result is a body that fits into it.",
        PAYLOAD,
        unit="m",
        metavar="X,Y,Z,X,Y,Z",
        argument=str,
        parse=option_text.box,
    )
    delay: float | None = _option(
        "Delay of the wrenches' stamps relative to the motion. Default: estimated by the tactile"
        " method with least squares, and corrected where it is significant; else 0.",
        SIGNALS,
        unit="s",
    )
    cutoff: float | None = _option(
        "Cutoff of the low-pass on both sides of the equations (-3 dB). Default: chosen from the"
        " data of a recording; 10 online and for the paper's filter.",
        SIGNALS,
        _ALL,
        unit="Hz",
    )
    max_gap: float | None = _option(
        "Longest time between two samples that is bridged. Default: five periods of the slowest"
        " stream; 0.1 online and for the paper's filter.",
        SIGNALS,
        _ALL,
        unit="s",
    )
    wrench_offset: bool | None = _option(
        "Whether the sum of the wrenches may have an unknown constant offset, a sensor zero that"
        " was not set: six more unknowns. Default: false.",
        SIGNALS,
        _LEAST_SQUARES,
    )
    wrench_noise: ArrayLike | None = _option(
        "Standard deviations of the white noise of one wrench, (6,), or (S, 6) for S sensors; on"
        " the command line, once for all sensors or once for each. Default: estimated from the"
        " residuals.",
        SIGNALS,
        _LEAST_SQUARES,
        unit="N and N m",
        metavar="FX,FY,FZ,MX,MY,MZ",
        argument=list[str],
        parse=option_text.wrenches,
    )
    effort_noise: ArrayLike | None = _option(
        "Standard deviation of the white noise of one joint effort, for all joints or for each."
        " Default: estimated from the residuals.",
        SIGNALS,
        _LEAST_SQUARES,
        unit="N m or N",
        metavar="S,S,...",
        argument=str,
        parse=option_text.numbers,
    )
    estimator: Estimator | None = _option(
        "Robust least squares over the whole recording, or the paper's filter (nlms). Default:"
        " least-squares.",
        SIGNALS,
    )
    alpha: float | None = _option(
        "Step size of the paper's filter, in (0, 2). Default: 1.8, as in the paper.",
        PAPER,
        _PAPER,
    )
    beta: float | None = _option(
        "Regularisation of the paper's filter, in (0, 1). Default: 0.9, as in the paper.",
        PAPER,
        _PAPER,
    )
    average: float | None = _option(
        "The estimate of the paper's filter is the mean over this last time, or the latest value"
        " for 0. Default: 10, as in the paper.",
        PAPER,
        _PAPER,
        unit="s",
    )
    epochs: int | None = _option(
        "Number of times that the recording is presented to the paper's filter. Default: 2.",
        PAPER,
    )


def option_names(use: Use | None = None) -> list[str]:
    """Returns the names of all options, or of those that apply to one use, in order."""
    every = fields(Options)
    return [one.name for one in every if use is None or use in Declaration.of(one).uses]


def collect(options: Options | None, keywords: dict[str, Any], use: Use) -> Options:
    """Merges keywords into options, and checks that all of them exist and apply.

    Args:
        options: Options to start from; none of them is set where it is None.
        keywords: Further options by name, which replace those of ``options``.
        use: Where the options are to apply.

    Raises:
        ArgumentError: A keyword is no option, or an option does not apply.
    """
    every, allowed = option_names(), option_names(use)
    for name in keywords:
        if name not in every:
            raise ArgumentError(_unknown(name, allowed))
    collected = replace(options or Options(), **keywords)
    for name in every:
        if getattr(collected, name) is not None and name not in allowed:
            raise ArgumentError(f"`{name}` does not apply to {_NAMES[use]}", option=name)
    return collected


_NAMES: dict[Use, str] = {
    "log": "a log",
    "arrays": "arrays",
    "online": "Identifier",
    "paper filter": "PaperFilter",
}


def _unknown(name: str, allowed: Sequence[str]) -> str:
    nearest = difflib.get_close_matches(name, allowed, n=1)
    hint = f"; did you mean `{nearest[0]}`?" if nearest else ";"
    return f"there is no option `{name}`{hint} The options are {', '.join(allowed)}."


def describe(use: Use | None = None) -> str:
    """Lists the options with their documentation, a paragraph each, as a docstring has them."""
    entries = []
    for one in fields(Options):
        declaration = Declaration.of(one)
        if use is None or use in declaration.uses:
            unit = f" Unit: {declaration.unit}." if declaration.unit else ""
            text = f"{one.name}: {declaration.text}{unit}"
            entries.append(textwrap.fill(text, 92, subsequent_indent="    "))
    return "\n".join(entries)


def documented(use: Use | None = None) -> Callable[[_Class], _Class]:
    """Returns a decorator that writes the options in place of ``<options>`` in a docstring."""

    def fill(thing: _Class) -> _Class:
        if thing.__doc__:  # python -OO has none
            lines = inspect.cleandoc(thing.__doc__).splitlines()
            thing.__doc__ = "\n".join(_filled(lines, describe(use)))
        return thing

    return fill


def _filled(lines: Iterable[str], text: str) -> Iterable[str]:
    for line in lines:
        if line.strip() == "<options>":
            yield textwrap.indent(text, line[: len(line) - len(line.lstrip())])
        else:
            yield line


def with_options(use: Use) -> Callable[[_Class], _Class]:
    """Returns a decorator that shows the options in a function's docstring and signature."""

    def show(function: _Class) -> _Class:
        signature = inspect.signature(function)
        given = [p for p in signature.parameters.values() if p.kind is not p.VAR_KEYWORD]
        names = {parameter.name for parameter in given}
        own = [
            inspect.Parameter(one.name, inspect.Parameter.KEYWORD_ONLY, default=None)
            for one in fields(Options)
            if use in Declaration.of(one).uses and one.name not in names
        ]
        function.__signature__ = signature.replace(  # type: ignore[attr-defined]
            parameters=[*given, *own]
        )
        return documented(use)(function)

    return show


documented()(Options)
