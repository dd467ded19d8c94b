"""Identification from a whole recording: a log, or arrays."""

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Literal, TypeGuard, cast, overload

from numpy.typing import ArrayLike

from tactid import _native
from tactid._api.combined import Combination, combine
from tactid._api.compensation import Source
from tactid._api.result import Identification, PaperIdentification
from tactid._base.files import is_urdf_text
from tactid._native import Manipulator
from tactid._options.arrays import FROM_ARRAYS, check_no_arrays, with_arrays
from tactid._options.declaration import with_options
from tactid._options.options import OPTIONS, Options, collect
from tactid._read.descriptions import with_urdf
from tactid._read.recordings import LogPath, opened
from tactid._results.provenance import given_options, hashed_beside, hashes


@overload
def identify(
    source: LogPath | ArrayLike,
    /,
    *,
    estimator: Literal["nlms"],
    options: Options | None = None,
    progress: Callable[[float], object] | None = None,
    **keywords: Any,
) -> PaperIdentification: ...
@overload
def identify(
    source: LogPath,
    /,
    *,
    options: Options | None = None,
    progress: Callable[[float], object] | None = None,
    **keywords: Any,
) -> Identification: ...
@overload
def identify(
    source: list[str] | list[Path] | tuple[LogPath, ...],
    /,
    *,
    options: Options | None = None,
    progress: Callable[[float], object] | None = None,
    **keywords: Any,
) -> Identification | Combination: ...
@overload
def identify(
    source: ArrayLike,
    /,
    *,
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
    progress: Callable[[float], object] | None = None,
    **keywords: Any,
) -> Identification: ...
@with_options(OPTIONS, "log")
@with_arrays("recording")
def identify(  # noqa: D417 - arrays and options are documented by their declarations
    source: LogPath | Sequence[LogPath] | ArrayLike,
    /,
    *,
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
    progress: Callable[[float], object] | None = None,
    **keywords: Any,
) -> Identification | PaperIdentification | Combination:
    """Identifies the payload from a log, from several logs, or from arrays.

    A log is the folder of a rosbag2 bag or one of its files, ``.mcap`` or ``.db3``, compressed or
    not; its topics are found by their types. Tables (``.csv``, ``.npz``, ``.parquet``), data sets
    of LeRobot and ROS 1 bags are read as logs, too.
    The motion is that of joints and a URDF, on a base that odometry moves if there is any; without
    joints, it is that of the sensor itself, by odometry or by an inertial unit. Memory is bounded.

    A list of several logs of one payload gives one estimate from all, a :class:`Combination`, which
    says whether they agree (see :func:`tactid.combine`); a list of one log gives the same as the
    log. The options hold for each log, and an ``unloaded`` reference is that of all. For other
    options or another reference for each, and for arrays, combine the results.

    Arrays have N samples of n joints and S sensors; an array without the axis of the samples holds
    for all of them. With a ``robot`` or a ``urdf``, ``pose``, ``twist`` and ``acceleration`` are
    those of its base, which is fixed where none of them is given; without either, they are those of
    the sensor itself.

        tactid.identify("bag/", urdf="arm.urdf", tip="tool0")
        tactid.identify(["bag1/", "bag2/", "bag3/"], urdf="arm.urdf", tip="tool0")
        tactid.identify(time, urdf="arm.urdf", q=q, qd=qd, wrench=wrench)
        tactid.identify(time, pose=pose, wrench=wrench, wrench_acts_on="sensor")

    Args:
        source: The log's path, a list of paths, or the times of the samples, (N,), s, which
            messages call ``time``.
        robot: For arrays: the robot with its gripper and without the payload. The motion of its
            base is given only where the robot was read with ``base="floating"``.
        <arrays>
        sensors: The links of the wrenches, one name or several. Default: the tip.
        options: Options to start from; keywords replace them.
        progress: Called with the fraction done, about twenty times a second. An exception that it
            raises stops the work, as Ctrl-C does.
        **keywords: The fields of :class:`tactid.Options`, as follows. The topics are those of a
            log.

            <options>

    Raises:
        LogError: The log cannot be read. Of several logs, each error names the one it is about.
        ModelError: The robot cannot be modelled, or has no such link.
        IdentificationError: Something that is needed is missing.
        CalibrationError: The calibration cannot be read, or is of another robot.
        ArgumentError: An option is unknown, does not apply or is out of range, or a shape is wrong.
    """
    given: tuple[Any, ...] = (robot, q, qd, effort, wrench, pose, twist, acceleration, sensors)
    arrays: dict[str, Any] = dict(zip(FROM_ARRAYS, given, strict=True))
    own = (*FROM_ARRAYS, "options", "progress")
    if isinstance(source, str | os.PathLike):
        collected = collect(options, keywords, "log", own)
        check_no_arrays(arrays, f"{source} is a log")
        files = inputs(source, collected)
        with opened([source], collected, progress) as ([log], run), hashed_beside([files]):
            found = _native.identify_log(log, run.options.plain(), run.progress)
        found |= provenance(files, collected)
        return identification(found, Source(source, {}, collected))
    if _are_logs(source):
        collected = collect(options, keywords, "log", own)
        check_no_arrays(arrays, "the source is a list of logs")
        return _from_logs(source, collected, progress)
    collected = collect(options, keywords, "arrays", own)
    times, plain = cast(ArrayLike, source), with_urdf(collected).plain()
    found = _native.identify_arrays(times, plain, arrays, progress)
    found |= provenance(inputs(None, collected), collected)
    return identification(found, Source(times, arrays, collected))


def _are_logs(source: object) -> TypeGuard[Sequence[LogPath]]:
    """Returns whether a source is a list of paths, which an array of times cannot be."""
    if not isinstance(source, list | tuple) or not source:
        return False
    return all(isinstance(entry, str | os.PathLike) for entry in source)


def _from_logs(
    logs: Sequence[LogPath], options: Options, progress: Callable[[float], object] | None
) -> Identification | PaperIdentification | Combination:
    if len(logs) == 1:
        return identify(logs[0], options=options, progress=progress)
    files = [inputs(log, options) for log in logs]
    with opened(logs, options, progress) as (each, run), hashed_beside(files):
        found = _native.identify_logs(each, run.options.plain(), run.progress)
    return combine(
        [
            identification(data | provenance(read, options), Source(log, {}, options))
            for log, read, data in zip(logs, files, found, strict=True)
        ]
    )


def provenance(inputs: dict[str, Path], options: Options) -> dict[str, Any]:
    """Returns the fields that say where a result comes from, besides those that Rust hands over."""
    return {
        "inputs": inputs,
        "hashes": hashes(inputs),
        "given": given_options(options.given),
    }


def inputs(source: str | os.PathLike[str] | None, options: Options) -> dict[str, Path]:
    """Returns the files and folders that are read, by the words that name them."""
    named = {
        "the log": source,
        "`urdf`": options.urdf,
        "`unloaded`": options.unloaded,
        "`calibration`": options.calibration,
        "`known_tool`": options.known_tool,
        "`shape`": options.shape,
    }
    return {
        words: Path(path).absolute()
        for words, path in named.items()
        if isinstance(path, str | os.PathLike) and not is_urdf_text(path)
    }


def identification(
    data: dict[str, Any], source: Source | None = None
) -> Identification | PaperIdentification:
    """Builds the result of a recording from the fields that the native part hands over."""
    if data["estimator"] == "nlms":
        return PaperIdentification(**data)
    result = Identification(**data)
    return result if source is None else result.of_source(source)
