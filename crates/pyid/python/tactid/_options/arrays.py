"""The arrays of a recording: each declared once, for docstrings and for the documentation."""

import textwrap
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, TypeVar

from tactid._base.errors import ArgumentError
from tactid._options.declaration import write_into_docstring

Caller = Literal["recording", "online"]
"""Who takes an array: :func:`tactid.identify`, or ``push`` of the online solvers."""

FROM_ARRAYS = ("robot", "q", "qd", "effort", "wrench", "pose", "twist", "acceleration", "sensors")
"""Keywords of a recording in arrays, beside its times."""

_Function = TypeVar("_Function", bound=Callable[..., Any])


@dataclass(frozen=True, kw_only=True)
class ArrayDeclaration:
    """What is known of an array."""

    name: str
    """Keyword in Python, and field of Rust's ``tactid_recordings::Arrays``."""
    text: str
    """What it is, with its frame, in complete sentences."""
    shapes: tuple[tuple[str, ...], ...]
    """Shapes of one sample: n stands for the number of joints, S for that of the sensors."""
    unit: str
    recording: str | None = None
    """What holds for recordings alone, in complete sentences."""
    online: str | None = None
    """What holds for ``push`` alone, in complete sentences."""
    sample_field: str
    """Field of Rust's ``tactid_identify::Sample``, or of the ``BaseState`` in it."""

    def shape(self, caller: Caller) -> str:
        """Returns the shapes in words; those of one sample only where samples are pushed."""
        shapes = []
        for one in self.shapes:
            if caller == "online":
                shapes.append(_shape(one))
            shapes.append(_shape(("N", *one)))
        *others, last = shapes
        return f"{', '.join(others)} or {last}" if others else last

    def documentation(self, caller: Caller) -> str:
        """Returns the documentation for Python, with the shape and the unit."""
        own = self.recording if caller == "recording" else self.online
        sentences = [self.text, own, f"Shape: {self.shape(caller)}.", f"Unit: {self.unit}."]
        return " ".join(each for each in sentences if each)


def _shape(entries: tuple[str, ...]) -> str:
    return f"({', '.join(entries)}{',' if len(entries) == 1 else ''})"


ARRAYS = (
    ArrayDeclaration(
        name="time",
        text="Times of the samples, increasing, on one clock with any origin.",
        shapes=((),),
        unit="s",
        sample_field="Sample::time_s",
    ),
    ArrayDeclaration(
        name="q",
        text="Joint positions in the order of the robot's ``joint_names``.",
        shapes=(("n",),),
        unit="rad or m",
        sample_field="Sample::joint_position",
    ),
    ArrayDeclaration(
        name="qd",
        text="Joint velocities. Derived from the positions where left out.",
        shapes=(("n",),),
        unit="rad/s or m/s",
        sample_field="Sample::joint_velocity",
    ),
    ArrayDeclaration(
        name="wrench",
        text="Force, then moment, in the sensor's frame and about that frame's origin.",
        shapes=(("6",), ("S", "6")),
        unit="N and N m",
        recording="``wrench_acts_on`` states the body on which they act.",
        online="They act **on the payload**.",
        sample_field="Sample::wrenches",
    ),
    ArrayDeclaration(
        name="effort",
        text="Efforts that the joints exert, those for gravity and payload included.",
        shapes=(("n",),),
        unit="N m or N",
        sample_field="Sample::joint_effort",
    ),
    ArrayDeclaration(
        name="pose",
        text="Pose in the world of a floating base, or of the sensor where there is no robot: x, y,"
        " z, qx, qy, qz, qw, or a homogeneous matrix.",
        shapes=(("7",), ("4", "4")),
        unit="m",
        recording="A floating base needs it. A sample whose pose has NaN, or a quaternion with a"
        " norm outside 0.9 to 1.1, is left out and counted among the faults.",
        online="A floating base needs it.",
        sample_field="BaseState::pose",
    ),
    ArrayDeclaration(
        name="twist",
        text="Velocity of the origin of what ``pose`` describes, then angular velocity, in world"
        " axes. That of an odometry, as ``tactid.read`` returns it, is in the axes of the"
        " child: turn both vectors by the quaternion of the pose.",
        shapes=(("6",),),
        unit="m/s and rad/s",
        recording="Derived from the poses where left out.",
        online="It is not derived from the poses, so it is given with them.",
        sample_field="BaseState::velocity, BaseState::angular_velocity",
    ),
    ArrayDeclaration(
        name="acceleration",
        text="Classical acceleration of the same origin without gravity, then angular acceleration,"
        " in world axes. Derived from the twists where left out.",
        shapes=(("6",),),
        unit="m/s² and rad/s²",
        sample_field="BaseState::acceleration, BaseState::angular_acceleration",
    ),
)
"""All arrays, in the order in which they are documented."""


def with_arrays(caller: Caller) -> Callable[[_Function], _Function]:
    """Returns a decorator that writes the arrays in place of ``<arrays>`` in a docstring."""
    return lambda function: write_into_docstring(function, "<arrays>", describe(caller))


def describe(caller: Caller) -> str:
    """Lists the arrays with their documentation, as a docstring has them.

    The times of a recording are its source, which :func:`tactid.identify` documents itself.
    """
    listed = [array for array in ARRAYS if caller == "online" or array.name != "time"]
    texts = [f"{array.name}: {array.documentation(caller)}" for array in listed]
    indent = " " * 4
    return "\n".join(
        textwrap.fill(text, 92, subsequent_indent=indent, break_on_hyphens=False) for text in texts
    )


def check_no_arrays(arrays: Mapping[str, Any], because: str) -> None:
    """Checks that the keywords of arrays are left out, where the source says what is read.

    Raises:
        ArgumentError: One is given.
    """
    for name, value in arrays.items():
        if value is not None:
            raise ArgumentError(f"`{name}` belongs to arrays, but {because}")
