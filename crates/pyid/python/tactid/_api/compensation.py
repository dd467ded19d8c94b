"""Compensation of a recording: the wrench of the contact at each of its samples."""

import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

from tactid import _native
from tactid._base.errors import ArgumentError
from tactid._base.values import listed_fields
from tactid._native import Manipulator
from tactid._options.arrays import FROM_ARRAYS, check_no_arrays, with_arrays
from tactid._options.declaration import with_options
from tactid._options.known_tool import LARGEST_FILE
from tactid._options.options import OPTIONS, Options, collect, option_names
from tactid._read.descriptions import with_urdf
from tactid._read.recordings import LogPath, opened
from tactid._results.compensation import Compensation
from tactid._results.identification import IdentificationData

Progress = Callable[[float], object] | None
Place = tuple[str | None, str | None]
"""The link about whose origin moments are, and that along whose axes wrenches are."""


@with_options(OPTIONS, "compensation")
@with_arrays("recording")
def compensate(  # noqa: D417 - arrays and options are documented by their declarations
    source: LogPath | ArrayLike,
    payload: IdentificationData | LogPath,
    /,
    *,
    point: str | None = None,
    axes: str | None = None,
    robot: Manipulator | None = None,
    q: ArrayLike | None = None,
    qd: ArrayLike | None = None,
    effort: ArrayLike | None = None,
    wrench: ArrayLike | None = None,
    pose: ArrayLike | None = None,
    twist: ArrayLike | None = None,
    acceleration: ArrayLike | None = None,
    sensors: str | Sequence[str] | None = None,
    options: Options | None = None,
    progress: Progress = None,
    **keywords: Any,
) -> Compensation:
    """Returns the wrench of the contact of a recording: measured less offset and load.

    Motion and wrench are read and filtered as :func:`tactid.identify` does, without delay. Options
    that are left open are those that the payload was identified with.

        tactid.compensate("bag/", "result.json").contact
        tactid.compensate(time, result, robot=robot, q=q, qd=qd, wrench=wrench)

    Args:
        source: A recording, as :func:`tactid.identify` takes it: the path of a log, or times, (N,).
        payload: The result of an identification from wrenches by least squares, or the path of its
            JSON file. Its offset is that of the sensor until it is zeroed again.
        point: The link about whose origin the moments are; it moves with the tip. Default: the
            frame of the only sensor, or the tip.
        axes: The link along whose axes the wrenches are, which moves with the tip or is fixed to
            the ground, or "world". Default: that of ``point``.
        robot: For arrays: as :func:`tactid.identify` takes it.
        <arrays>
        sensors: The links of the wrenches, one name or several. Default: the tip.
        options: Options to start from; keywords replace them.
        progress: Called with the fraction done, about twenty times a second. An exception that it
            raises stops the work, as Ctrl-C does.
        **keywords: How the recording is read: fields of :class:`tactid.Options`.

            <options>

    Raises:
        ArgumentError: The payload is that of another tip or sensor or has no offset, or an option
            is wrong.
        LogError: The log cannot be read.
        ModelError: The robot has no such tip or sensor.
        IdentificationError: Something that is needed is missing, such as a wrench.
    """
    given: tuple[Any, ...] = (robot, q, qd, effort, wrench, pose, twist, acceleration, sensors)
    arrays: dict[str, Any] = dict(zip(FROM_ARRAYS, given, strict=True))
    own = (*FROM_ARRAYS, "point", "axes", "options", "progress")
    collected = collect(options, keywords, "compensation", own)
    load = load_of(payload)
    return of_source(source, arrays, load.completed(collected), load, (point, axes), progress)


@dataclass(frozen=True)
class Load:
    """What a compensation needs of a result."""

    fields: dict[str, Any]
    """The fields of the result that Rust reads."""
    options: Mapping[str, Any]
    """The options that the payload was identified with."""
    is_contradicted: bool
    """Whether the data of the result contradict it."""

    def completed(self, options: Options) -> Options:
        """Returns options, completed by those that the payload was identified with."""
        names = option_names("compensation")
        # A URDF that was given as text is not in a file, and an episode is that of a recording.
        left = {
            name: value
            for name, value in self.options.items()
            if name in names and name != "episode" and value != "as text"
        }
        return Options(**left | options.given)


def load_of(payload: object) -> Load:
    """Returns what a compensation needs of a result or of the JSON file of one.

    Raises:
        ArgumentError: It is neither.
    """
    if isinstance(payload, str | os.PathLike):
        return _of_file(Path(payload))
    if not isinstance(payload, IdentificationData):
        raise _error(
            f"is of type {type(payload).__name__}: expected the result of least squares for one"
            " recording, or the path of its JSON file"
        )
    load = None if payload.load is None else listed_fields(payload.load)
    setup = listed_fields(payload.setup)
    fields = _fields(load, payload.estimate.frame, setup, listed_fields(payload))
    return Load(fields, payload.given, payload.is_contradicted)


def _of_file(path: Path) -> Load:
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise _error(f"is {path}: the file is too large for a result")
        document = json.loads(path.read_bytes())
        frame, setup = document["estimate"]["frame"], document.get("setup", {})
        is_live = document.get("schema", "").startswith("tactid.live/")
        fields = _fields(document.get("load"), frame, setup, document)
        load = Load(fields, document.get("options", {}), bool(document.get("is_contradicted")))
    except OSError as error:
        raise _error(f"is {path}: {error.strerror}") from None
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        raise _error(f"is {path}: expected the JSON file of an earlier result") from None
    if is_live:
        raise _error(
            f"is {path}, which a live session has saved without an offset: give the result of a"
            " recording"
        )
    return load


def _fields(
    load: Any, frame: str, setup: Mapping[str, Any], result: Mapping[str, Any]
) -> dict[str, Any]:
    """Returns the fields of a result by the names that Rust reads; a document may lack some."""
    return {
        "load": load,
        "frame": frame,
        "beginning": setup.get("beginning", ""),
        "wrench_frames": setup.get("wrench_frames", []),
        "wrench_acts_on": setup.get("wrench_acts_on", "payload"),
        "cutoff_hz": result.get("cutoff_hz", 0.0),
        "delay_s": result.get("delay_s", 0.0),
        "gravity_m_s2": result.get("gravity_m_s2", [0.0, 0.0, 0.0]),
    }


def _error(what: str) -> ArgumentError:
    return ArgumentError(f"`payload` {what}", option="payload")


def of_source(
    source: Any,
    arrays: Mapping[str, Any],
    options: Options,
    load: Load,
    place: Place,
    progress: Progress,
) -> Compensation:
    """Returns the wrenches of a log by its path, or of arrays by their times."""
    if isinstance(source, str | os.PathLike):
        check_no_arrays(arrays, f"{source} is a log")
        with opened([source], options, progress, method="tactile") as ([log], run):
            plain = run.options.plain()
            found = _native.compensate_log(log, plain, (load.fields, *place), run.progress)
    else:
        plain = with_urdf(options).plain()
        given = (load.fields, *place)
        found = _native.compensate_arrays(source, plain, dict(arrays), given, progress)
    return Compensation(**found)


@dataclass(frozen=True)
class Source:
    """The recording that a result comes from, for as long as the result is in memory."""

    source: Any
    arrays: Mapping[str, Any]
    options: Options

    def compensation(
        self, payload: IdentificationData, place: Place, progress: Progress
    ) -> Compensation:
        """Returns the wrenches of the recording with the payload that was identified from it."""
        names = option_names("compensation")
        given = {name: value for name, value in self.options.given.items() if name in names}
        load, options = load_of(payload), Options(**given)
        return of_source(self.source, self.arrays, options, load, place, progress)
