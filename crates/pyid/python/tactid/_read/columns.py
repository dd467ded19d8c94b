"""Which columns of a table are which array: by their names, or as an option says."""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tactid._base.errors import ArgumentError
from tactid._base.naming import listed
from tactid._base.values import Array
from tactid._read.tables import Progress, Table
from tactid._read.units import Unit, in_brackets, readings, unit_of

DIMENSIONS = {
    "time": ("time",),
    "q": ("angle", "length"),
    "qd": ("angle rate", "length rate"),
    "effort": ("moment", "force", "current"),
    "wrench": ("force", "moment"),
    "pose": ("length", "angle"),
}
"""The arrays of a recording that a table may have, and what their units may measure."""


@dataclass(frozen=True)
class Quantity:
    """The columns that make up an array, in its order."""

    array: str
    """Keyword of the array."""
    columns: tuple[str | None, ...]
    """Names of columns; None for a component that is not measured."""
    units: tuple[Unit | None, ...]
    """Their units as far as they are stated."""

    @property
    def words(self) -> str:
        """The columns as a message names them."""
        named = [f"`{name}`" for name in self.columns if name is not None]
        is_row = len(named) > 3 and None not in self.columns
        return f"{named[0]} ... {named[-1]}" if is_row else listed(named)

    def read(self, table: Table, progress: Progress = None) -> Array:
        """Reads the array, (N, k), in SI; NaN stands for what is not measured."""
        names = list(dict.fromkeys(name for name in self.columns if name is not None))
        return self.of(table.read(names, progress))

    def of(self, values: Mapping[str, Array]) -> Array:
        """Returns the array of columns that are read, (N, k), in SI."""
        rows = len(next(iter(values.values())))
        parts = []
        for name, unit in zip(self.columns, self.units, strict=True):
            part = np.full(rows, np.nan) if name is None else values[name]
            parts.append(part.reshape(rows, -1) * (1.0 if unit is None else unit.factor))
        return np.hstack(parts)


NOT_MEASURED = {
    *("target", "desired", "command", "commanded", "cmd", "action", "goal", "reference", "ref"),
    *("setpoint", "des", "d", "std", "error", "err", "next"),
}
"""Words of columns that are no measurements."""

_VECTORS: dict[str, tuple[str, ...]] = {
    "time": ("time", "timestamp", "t", "stamp", "times", "time_stamp", "elapsed", "robot_time"),
    "q": (
        *("q", "actual_q", "joint_position", "joint_positions", "joint_pos", "joint_angle"),
        *("joint_angles", "observation_state", "observation_state_joint_position"),
        *("observation_joint_position", "observation_joint_positions", "position", "positions"),
        *("pos", "angle", "angles", "theta", "joint_state", "joint", "joints", "j"),
    ),
    "qd": (
        *("qd", "dq", "actual_qd", "joint_velocity", "joint_velocities", "joint_vel"),
        *("observation_velocity", "observation_joint_velocity", "observation_joint_velocities"),
        *("velocity", "velocities", "vel"),
    ),
    "effort": (
        *("effort", "efforts", "tau", "tau_j", "joint_effort", "joint_efforts", "joint_torque"),
        *("joint_torques", "observation_effort", "observation_joint_effort", "torque", "torques"),
        *("observation_torque", "actual_current", "joint_current", "current", "currents"),
        *("tau_ext_hat_filtered", "actual_jts", "actual_ejt"),
    ),
    "wrench": (
        *("wrench", "ft_raw_wrench", "observation_wrench", "observation_force_torque", "ft"),
        *("force_torque", "ft_wrench", "observation_ft", "ft_sensor", "actual_tcp_force"),
        *("tcp_force", "external_wrench"),
    ),
    "pose": ("pose", "tcp_pose", "actual_tcp_pose", "tool_pose", "observation_pose"),
}
"""Names of whole arrays, or of their columns without the number; the first is preferred."""

_AXES = {
    "wrench": (
        re.compile(
            r"(?:(?P<of>.*)_)?(?P<kind>forces?|f|torques?|moments?|tau|t|m)_?(?P<axis>[xyz])"
        ),
        ("fx", "fy", "fz", "tx", "ty", "tz"),
    ),
    "pose": (
        re.compile(
            r"(?:(?P<of>.*)_)?(?P<kind>positions?_|pos_|p_|orientations?_|rotation_|quat_|q|r|)"
            r"(?P<axis>[xyzw]|roll|pitch|yaw)"
        ),
        ("x", "y", "z", "qx", "qy", "qz", "qw"),
    ),
}
"""Names of single components: what they may be called, and the components in order."""

_ROTATIONS = (("rx", "ry", "rz"), ("roll", "pitch", "yaw"))
"""Other components of a rotation than those of a quaternion."""


def find(
    table: Table,
    arrays: Sequence[str],
    given: Mapping[str, str | Sequence[str]] | None = None,
    own: Callable[[str], Quantity | None] = lambda _: None,
) -> dict[str, Quantity]:
    """Returns the columns of arrays, those that an option gives and those known by name.

    Args:
        table: The table.
        arrays: Names of the arrays that may be there.
        given: The columns of some arrays: names, with ``*`` for any text, and each with its unit in
            brackets behind it where it is not SI.
        own: Returns the columns of an array that are known otherwise, such as by names of joints.

    Raises:
        ArgumentError: A given column is not there, or columns of two groups may be the same array.
    """
    found = {}
    for array, columns in (given or {}).items():
        if array not in arrays:
            raise ArgumentError(
                f"`columns` names `{array}`: expected {listed(arrays)}", option="columns"
            )
        found[array] = _given(table, array, [columns] if isinstance(columns, str) else columns)
    for array in arrays:
        if array not in found and (quantity := own(array) or _known(table, array)) is not None:
            found[array] = quantity
    return found


def _given(table: Table, array: str, columns: Sequence[str]) -> Quantity:
    """Returns the columns that an option gives."""
    names: list[str] = []
    units: list[Unit | None] = []
    for text in columns:
        for name, unit in _matching(table, array, text):
            names.append(name)
            units.append(unit)
    return Quantity(array, tuple(names), tuple(units))


def _matching(table: Table, array: str, text: str) -> Iterator[tuple[str, Unit | None]]:
    """Yields the columns that a text of the option means, with their units."""
    stem, stated = text, None
    if text not in table.names and (bracketed := in_brackets(text)) is not None:
        stem = bracketed[0]
        stated = _checked(array, unit_of(bracketed[1]), text)
    pattern = re.compile(".*".join(map(re.escape, stem.split("*"))))
    matching = [name for name in table.names if pattern.fullmatch(name)]
    if not matching:
        raise table.unknown(stem)
    for name in matching:
        own = [unit for _, unit in readings(name) if unit and unit.dimension in DIMENSIONS[array]]
        yield name, stated or next(iter(own), None)


def _checked(array: str, unit: Unit | None, text: str) -> Unit:
    """Returns a unit that an option states, once it fits the array."""
    if unit is None or unit.dimension not in DIMENSIONS[array]:
        raise ArgumentError(
            f"`columns` gives {text!r} for `{array}`: expected a unit of"
            f" {' or '.join(DIMENSIONS[array])}, such as [{_EXAMPLES[array]}]",
            option="columns",
        )
    return unit


_EXAMPLES = {"time": "ms", "q": "deg", "qd": "deg/s", "effort": "Nm", "wrench": "N", "pose": "mm"}


def _known(table: Table, array: str) -> Quantity | None:
    """Returns the columns that are known by their names; None where there are none."""
    numbered, by_axis = _by_number(table, array), _by_axis(table, array)
    if array == "pose" and by_axis:
        # A single column beside components is the number of the pose.
        numbered = {key: each for key, each in numbered.items() if len(each[1].columns) > 1}
    groups = {**numbered, **by_axis}
    if not groups:
        return None
    best = min(rank for rank, _ in groups.values())
    first, *others = (quantity for rank, quantity in groups.values() if rank == best)
    if others:
        raise ArgumentError(
            f"{table.path}: {first.words} and {others[0].words} may both be `{array}`: name the"
            " columns in `columns`",
            option="columns",
        )
    return first


_Groups = dict[str, tuple[tuple[int, int], Quantity]]
"""Columns that may be an array, by what their names share, with a rank; the least is the best."""

_NUMBERED = re.compile(r"(.*?)_?(\d+)_?(\D*)")


def _by_number(table: Table, array: str) -> _Groups:
    """Finds arrays that are one column, or columns with numbers in their names."""
    found: dict[str, list[tuple[int, str, Unit | None]]] = {}
    for name in table.names:
        for stem, unit in _fitting(name, array):
            numbered = _NUMBERED.fullmatch(stem)
            whole, number = stem, -1
            if numbered is not None and array != "time":
                whole = "_".join(filter(None, (numbered[1], numbered[3])))
                number = int(numbered[2])
            if _rank(whole, array) is not None:
                found.setdefault(f"{whole} {number < 0}", []).append((number, name, unit))
                break
    groups: _Groups = {}
    for key, columns in found.items():
        columns.sort(key=lambda column: column[0])
        rank = _rank(key.split()[0], array)
        assert rank is not None
        if len(columns) > 1 and array == "time":
            continue
        names = tuple(name for _, name, _ in columns)
        units = tuple(unit for _, _, unit in columns)
        groups[key] = (rank, Quantity(array, names, units))
    return groups


def _rank(stem: str, array: str) -> tuple[int, int] | None:
    """Returns the place of a name among those of an array; None where it is none of them.

    A name may follow that of a topic or a robot, such as ``joint_states_position``.
    """
    known = _VECTORS[array]
    if stem in known:
        return 0, known.index(stem)
    words = stem.split("_")
    if NOT_MEASURED.intersection(words):
        return None
    for place, name in enumerate(known):
        if len(name) > len("joint") and stem.endswith(f"_{name}"):
            return 1, place
    return None


def _by_axis(table: Table, array: str) -> _Groups:
    """Finds arrays whose components are columns that name an axis."""
    if array not in _AXES:
        return {}
    pattern, components = _AXES[array]
    found: dict[str, dict[str, tuple[str, Unit | None]]] = {}
    for name in table.names:
        for stem, unit in _fitting(name, array):
            axis = pattern.fullmatch(stem)
            if axis is None or NOT_MEASURED.intersection((axis["of"] or "").split("_")):
                continue
            component = _component(array, axis["kind"], axis["axis"])
            found.setdefault(axis["of"] or "", {})[component] = (name, unit)
            break
    groups: _Groups = {}
    for prefix, columns in found.items():
        order = _components_of(array, columns, components)
        if order is None:
            continue
        of: list[tuple[str | None, Unit | None]] = [
            columns.get(component, (None, None)) for component in order
        ]
        missing = sum(name is None for name, _ in of)
        names, units = tuple(name for name, _ in of), tuple(unit for _, unit in of)
        groups[f"{prefix} by axis"] = ((0, missing), Quantity(array, names, units))
    return groups


def _component(array: str, kind: str, axis: str) -> str:
    """Returns the component that the name of a column means."""
    if array == "wrench":
        return ("f" if kind[0] == "f" else "t") + axis
    if kind.startswith(("ori", "quat", "q", "rot")):
        return f"q{axis}"
    return axis if kind != "r" else f"r{axis}"


def _components_of(
    array: str, columns: Mapping[str, object], components: Sequence[str]
) -> Sequence[str] | None:
    """Returns the components of an array in order; None where those that matter are missing."""
    if array == "wrench":
        return components if any(name[0] == "f" for name in columns) else None
    for rotation in (components[3:], *_ROTATIONS):
        if all(component in columns for component in rotation):
            return (*components[:3], *rotation)
    return None


def _fitting(name: str, array: str) -> Iterator[tuple[str, Unit | None]]:
    """Yields what the name of a column may mean for an array, in small letters and digits."""
    for stem, unit in readings(name):
        if unit is None or unit.dimension in DIMENSIONS[array]:
            yield re.sub(r"[\W_]+", "_", stem).strip("_").lower(), unit


def missing(table: Table, array: str, example: str, *others: str) -> ArgumentError:
    """Returns the error of an array whose columns are not found, and neither are those of others.

    Args:
        table: The table.
        array: The array.
        example: How its columns may be named.
        others: Arrays that would do instead.
    """
    names = " or ".join(f"`{name}`" for name in (array, *others))
    return ArgumentError(
        f"{table.path} has no columns that are known as {names}: name them in `columns`, such as"
        f" {array}={example}; {table.listed}",
        option="columns",
    )
