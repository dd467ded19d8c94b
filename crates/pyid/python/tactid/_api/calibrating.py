"""Calibration of an arm from logs and arrays."""

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from tactid import _native
from tactid._api.calibration import Calibration, from_model
from tactid._base.errors import ArgumentError
from tactid._base.findings import DataFault, Finding
from tactid._base.naming import counted
from tactid._native import Manipulator
from tactid._options.declaration import with_options
from tactid._options.options import OPTIONS, Options, collect
from tactid._results.calibration_data import CalibrationRecording

_Source: TypeAlias = str | os.PathLike[str] | Mapping[str, ArrayLike]
_Sources: TypeAlias = _Source | Sequence[_Source]
_Payload: TypeAlias = tuple[_Source, float, float, list[float] | None, list[list[float]] | None]

OWN = (
    "loaded",
    "payload_mass_kg",
    "payload_mass_std_dev_kg",
    "payload_com",
    "payload_inertia",
    "hold_out",
    "gain_std_dev",
    "robot",
    "options",
    "progress",
)
"""The keywords of :func:`calibrate` that are no options."""

NEEDED = ("time", "q", "effort")
"""The arrays that a recording in arrays must have."""


@with_options(OPTIONS, "calibration")
def calibrate(
    unloaded: _Sources,
    *,
    loaded: _Sources = (),
    payload_mass_kg: float | Sequence[float] | None = None,
    payload_mass_std_dev_kg: float | None = None,
    payload_com: ArrayLike | None = None,
    payload_inertia: ArrayLike | None = None,
    hold_out: _Sources = (),
    gain_std_dev: float | None = None,
    robot: Manipulator | None = None,
    options: Options | None = None,
    progress: Callable[[float], object] | None = None,
    **keywords: Any,
) -> Calibration:
    """Calibrates the joint efforts of an arm from logs, or from arrays.

    Friction, rotor inertias and corrections of the links are found from any motion without a
    payload that moves all joints in both directions; gains of the efforts from recordings with a
    payload of known mass. The arm's base is fixed.

    A recording is the path of a log (the folder of a rosbag2 bag or one of its files, ``.mcap`` or
    ``.db3``), or a dictionary of arrays as :func:`identify` takes them: ``time``, (N,), s, ``q``
    and ``effort``, (N, n), and ``qd``, which is derived from ``q`` where it is left out. Arrays
    need the ``robot`` or a ``urdf``. Messages and :attr:`CalibrationRecording.path` call them by
    their places, such as ``unloaded[0]``.

        arm = tactid.calibrate("bag0/", urdf="arm.urdf", tip="tool0")
        arm.write("arm.toml")
        tactid.identify("bag1/", urdf="arm.urdf", calibration=arm)
        tactid.calibrate({"time": time, "q": q, "effort": effort}, robot=robot)

    Args:
        unloaded: One recording without a payload, or several.
        loaded: Recordings with a payload of known mass.
        payload_mass_kg: Mass that the payload of each loaded recording adds to the unloaded arm,
            kg.
        payload_mass_std_dev_kg: Standard deviation of these masses, kg. Default: 0.
        payload_com: Centre of mass of the payload of each loaded recording in the tip's frame, m,
            (3,) or (L, 3), to a millimetre. Default: not known.
        payload_inertia: Inertia of the payload of each loaded recording about its centre of mass,
            along the axes of the tip's frame, kg m², (3, 3) or (L, 3, 3), to some percent. It needs
            ``payload_com``. Default: not known.
        hold_out: Recordings without a payload that are not used, but compared with the calibrated
            model.
        gain_std_dev: Standard deviation of the gain of each joint before the calibration, as a
            fraction; 0 where efforts are torques. Default: 0.2 with loaded recordings; without any,
            0.05 where ``effort_gain`` is given, else 0.
        robot: For arrays: the arm with its gripper and without the payload, on a fixed base.
        options: Options to start from; keywords replace them.
        progress: Called with the fraction of the recordings that is read, about twenty times a
            second. An exception that it raises stops the work, as Ctrl-C does.
        **keywords: Those fields of :class:`tactid.Options` that apply, as follows.

            <options>

    Raises:
        LogError: A log cannot be read.
        ModelError: The robot cannot be modelled, or has no such link.
        IdentificationError: Something that is needed is missing in a recording.
        CalibrationError: No joint moves, or the recordings are of different robots.
        ArgumentError: An option is unknown, does not apply or is out of range, or a shape is wrong.
    """
    collected = collect(options, keywords, "calibration", ("unloaded", *OWN))
    without, held = _sources("unloaded", unloaded), _sources("hold_out", hold_out)
    gain_std_dev = _number("gain_std_dev", gain_std_dev)
    known = (payload_mass_kg, payload_mass_std_dev_kg, payload_com, payload_inertia)
    payloads = _payloads(_sources("loaded", loaded), *known)
    sources = (*without, *(each[0] for each in payloads), *held)
    _check_robot(robot, sources)
    run = _native.calibrate_arm(
        without, payloads, held, gain_std_dev, collected.plain(), progress, robot
    )
    inputs: dict[str, Any] = {
        f"the log {path}": path for path in sources if not isinstance(path, Mapping)
    }
    if isinstance(collected.urdf, str | os.PathLike):
        inputs |= {} if str(collected.urdf).lstrip().startswith("<") else {"`urdf`": collected.urdf}
    return from_model(
        run["model"],
        gain_prior=run["gain_prior"],
        recordings=[_recording(each) for each in run["recordings"]],
        inputs={words: Path(path).absolute() for words, path in inputs.items()},
    )


def _sources(name: str, given: _Sources) -> list[_Source]:
    """Returns the recordings of one role as a list, once it is clear that each can be one."""
    if isinstance(given, str | os.PathLike | Mapping):
        given = [given]
    is_list = isinstance(given, list | tuple)
    if not is_list or not all(isinstance(one, str | os.PathLike | Mapping) for one in given):
        raise ArgumentError(
            f"`{name}` is {given!r}: expected the path of a log, arrays by their names, or a list"
            " of these",
            option=name,
        )
    for index, one in enumerate(given):
        if isinstance(one, Mapping):
            _check_names(f"`{name}[{index}]`", one)
    return list(given)


def _check_names(what: str, arrays: Mapping[str, ArrayLike]) -> None:
    expected = "arrays are `time`, `q`, `effort` and, if measured, `qd`"
    for missing in (name for name in NEEDED if arrays.get(name) is None):
        raise ArgumentError(f"{what} has no `{missing}`: {expected}")
    for unknown in (name for name in arrays if name not in (*NEEDED, "qd")):
        raise ArgumentError(f"{what} has `{unknown}`: {expected}")


def _check_robot(robot: Manipulator | None, sources: Sequence[_Source]) -> None:
    if robot is not None and not any(isinstance(source, Mapping) for source in sources):
        raise ArgumentError("`robot` belongs to arrays, but all recordings are logs: give `urdf`")


def _number(name: str, given: float | None) -> float | None:
    """Returns one number, or None."""
    if given is not None and (isinstance(given, str) or np.ndim(given) != 0):
        raise ArgumentError(f"`{name}` is {given!r}: expected one number", option=name)
    return None if given is None else float(given)


def _payloads(
    sources: list[_Source],
    masses: float | Sequence[float] | None,
    std_dev: float | None,
    coms: ArrayLike | None,
    inertias: ArrayLike | None,
) -> list[_Payload]:
    """Returns each loaded recording with what is known of its payload."""
    if not sources:
        given = {
            "payload_mass_kg": masses,
            "payload_mass_std_dev_kg": std_dev,
            "payload_com": coms,
            "payload_inertia": inertias,
        }
        for name in (name for name, value in given.items() if value is not None):
            raise ArgumentError(f"`{name}` is given, but no loaded recording", option=name)
        return []
    if masses is None:
        raise ArgumentError(
            "`payload_mass_kg` is missing: give the mass of each loaded recording's payload",
            option="payload_mass_kg",
        )
    if isinstance(masses, str) or np.ndim(masses) > 1:
        raise ArgumentError(
            f"`payload_mass_kg` is {masses!r}: expected a number for each loaded recording",
            option="payload_mass_kg",
        )
    each = np.atleast_1d(np.asarray(masses, dtype=float)).tolist()
    if len(each) != len(sources):
        loaded = counted(len(sources), "loaded recording")
        counts = f"{counted(len(each), 'mass', 'masses')} for {loaded}"
        raise ArgumentError(
            f"`payload_mass_kg` has {counts}: give one for each", option="payload_mass_kg"
        )
    if inertias is not None and coms is None:
        raise ArgumentError(
            "`payload_inertia` is about the centre of mass, which is not given",
            option="payload_inertia",
        )
    centers = _for_each(len(sources), "payload_com", coms, (3,))
    about = _for_each(len(sources), "payload_inertia", inertias, (3, 3))
    std_devs = [_number("payload_mass_std_dev_kg", std_dev) or 0.0] * len(sources)
    return list(zip(sources, each, std_devs, centers, about, strict=True))


def _for_each(count: int, name: str, given: ArrayLike | None, shape: tuple[int, ...]) -> list[Any]:
    """Returns what is given once for all recordings, or once for each, as a list for each."""
    if given is None:
        return [None] * count
    values = np.asarray(given, dtype=float)
    if values.shape not in {shape, (count, *shape)}:
        raise ArgumentError(
            f"`{name}` has the shape {values.shape}: expected {shape} or {(count, *shape)}",
            option=name,
        )
    found: list[Any] = np.broadcast_to(values, (count, *shape)).tolist()
    return found


def _recording(data: dict[str, Any]) -> CalibrationRecording:
    faults = [DataFault(**fault) for fault in data["faults"]]
    findings = [Finding(kind, found) for kind, found in data["findings"]]
    return CalibrationRecording(**data | {"faults": faults, "findings": findings})
