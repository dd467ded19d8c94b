"""Calibration of an arm from logs and arrays."""

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

from numpy.typing import ArrayLike

from tactid import _native
from tactid._api.calibration import Calibration, from_model
from tactid._base.files import is_urdf_text
from tactid._native import Manipulator
from tactid._options.declaration import with_options
from tactid._options.options import OPTIONS, OWN, Options, collect, take_own
from tactid._read.recordings import opened
from tactid._results.calibration_data import CalibrationRecording

_Source: TypeAlias = str | os.PathLike[str] | Mapping[str, ArrayLike]


@with_options(OPTIONS, "calibration", OWN["calibration"])
def calibrate(  # noqa: D417 - options are documented by their declarations
    unloaded: _Source | Sequence[_Source],
    *,
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
        <own>
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
    keywords["unloaded"] = unloaded
    own = take_own(keywords, "calibration")
    collected = collect(options, keywords, "calibration", ("robot", "options", "progress"))
    given = {role: _listed(own[role]) for role in ROLES if isinstance(own.get(role), _SOURCES)}
    sources = [each for role in given.values() for each in role]
    with opened(sources, collected, progress, method="effort") as (logs, reader):
        remaining = iter(logs)
        own |= {role: [next(remaining) for _ in each] for role, each in given.items()}
        run = _native.calibrate_arm(own, reader.options.plain(), reader.progress, robot)
    paths = [each for role in given.values() for each in role if not isinstance(each, Mapping)]
    inputs: dict[str, Any] = {f"the log {path}": path for path in paths}
    if isinstance(collected.urdf, str | os.PathLike) and not is_urdf_text(collected.urdf):
        inputs["`urdf`"] = collected.urdf
    return from_model(
        run["model"],
        gain_prior=run["gain_prior"],
        recordings=[
            CalibrationRecording(**each | {"path": reader.original(each["path"])})
            for each in run["recordings"]
        ],
        inputs={words: Path(path).absolute() for words, path in inputs.items()},
    )


ROLES = ("unloaded", "loaded", "hold_out")
"""The options that are recordings."""


_SOURCES = (str, os.PathLike, Mapping, list, tuple)
"""Types of what is given for a role; anything else is refused where recordings are read."""


def _listed(given: _Source | Sequence[_Source]) -> Sequence[_Source]:
    """Returns the recordings of one role."""
    return [given] if isinstance(given, str | os.PathLike | Mapping) else given
