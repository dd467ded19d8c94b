"""What moves in a log, and which forces act: numbers only, nothing of how it is drawn."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from tactid._base.errors import LogError, ModelError
from tactid._base.naming import abridged
from tactid._base.values import Array
from tactid._native import Manipulator, Samples, info as log_info, read
from tactid._view.robot import Frame, moving_frames, read_urdf, robot_shapes, step
from tactid._view.shapes import Shape, link_names

RATE_HZ = 50.0
"""As often as the eye needs."""
MOST = 20_000
"""Points in time at most, however long the log is."""
ABSURD = 1e6
"""Positions, m and rad, and forces, N, beyond which a sample is faulty and left out."""


@dataclass(frozen=True)
class Force:
    """A measured force."""

    topic: str
    frame: str
    time: Array
    vector: Array
    """(N, 3), N, in the axes of ``frame``."""


@dataclass(frozen=True)
class Scene:
    """What a log shows."""

    start_ns: int
    """The stamp at which times are zero."""
    frames: dict[str, Frame]
    """The links of the robot, or the one frame of the sensor."""
    shapes: dict[str, list[Shape]]
    forces: list[Force]
    is_robot: bool
    stands: bool
    """Whether the robot stands on the ground, as far as the log says."""
    notes: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class _Track:
    """A quantity over time, in order, without what is missing or absurd."""

    time: Array
    values: Array

    @classmethod
    def of(cls, time: Array, values: Array) -> "_Track":
        flat = values.reshape(len(values), -1)
        sound = (np.abs(flat) <= ABSURD).all(axis=1)  # which NaN is not
        order = np.argsort(time[sound], kind="stable")
        return cls(time[sound][order], values[sound][order])

    def at(self, time: Array) -> Array:
        """Between its samples on a straight line; before and after, as at its ends."""
        columns = self.values.reshape(len(self.values), -1).T
        found = [np.interp(time, self.time, column) for column in columns]
        return np.stack(found, axis=-1).reshape(len(time), *self.values.shape[1:])


class _Log:
    """The topics of a log, read at the rate of the eye, over one time."""

    def __init__(self, path: Path) -> None:
        self.path = path
        info = log_info(path)
        self.types = {topic.name: topic.type_name for topic in info.topics if topic.count}
        self.every = max(1 / RATE_HZ, (info.duration or 0.0) / MOST)
        self.notes = [f"{damage}; what could be read is shown" for damage in info.damage]
        self.start_ns: int | None = None

    def read_all(self, type_name: str) -> list[Samples]:
        """The topics of a type that have messages, by name."""
        names = [
            name
            for name, found in sorted(self.types.items())
            if found.replace("/msg/", "/") == type_name
        ]
        topics = [read(self.path, name, every=self.every) for name in names]
        for damage in (damage for topic in topics for damage in topic.damage):
            note = f"{damage}; what could be read is shown"
            if note not in self.notes:
                self.notes.append(note)
        return [topic for topic in topics if len(topic)]

    def time(self, topic: Samples) -> Array:
        """When its messages were measured, s since the scene's start."""
        assert self.start_ns is not None
        return topic.time + (topic.start_ns - self.start_ns) * 1e-9


def read_scene(path: Path, urdf: Path | None, start_ns: int | None) -> Scene:
    """Reads what a log shows.

    Args:
        path: The log.
        urdf: The robot, where it is not the log's ``/robot_description``.
        start_ns: The stamp at which times are zero; the first that is read where left out.
    """
    log = _Log(path)
    description = _description(log, urdf)
    joints = log.read_all("sensor_msgs/JointState")
    odometry = log.read_all("nav_msgs/Odometry")
    wrenches = log.read_all("geometry_msgs/WrenchStamped")
    moving = [*joints, *odometry, *wrenches]
    if not moving or (description is None and not odometry and not wrenches):
        topics = abridged(list(log.types)) if log.types else "no topic with messages"
        what = "joints, but no robot: give its `urdf`" if joints else "nothing to show"
        raise LogError(f"{path} has {what}; it has {topics}", option="urdf" if joints else None)
    log.start_ns = min(topic.start_ns for topic in moving) if start_ns is None else start_ns
    if not _overlaps(log, moving):
        raise LogError(
            f"{path} and the result are of different times: is it the result of this log?"
        )
    if description is None:
        return _sensor_scene(log, odometry, wrenches)
    return _robot_scene(log, description, urdf, joints, odometry, wrenches)


def _overlaps(log: _Log, topics: Sequence[Samples]) -> bool:
    # A filter or a delay may shift a result's start by some samples, but never out of the log.
    return any(log.time(topic).min() < 1.0 < log.time(topic).max() + 2.0 for topic in topics)


def _description(log: _Log, urdf: Path | None) -> str | None:
    if urdf is not None:
        return read_urdf(urdf)
    texts = [topic.text[0] for topic in log.read_all("std_msgs/String")]
    return next((text for text in texts if "<robot" in text), None)


def _robot_scene(
    log: _Log,
    urdf: str,
    path: Path | None,
    joints: list[Samples],
    odometry: list[Samples],
    wrenches: list[Samples],
) -> Scene:
    links = _link_names(urdf, path)
    base = next((topic for topic in odometry if topic.child_frame_id in links), None)
    robot = Manipulator.from_urdf(
        urdf,
        "fixed" if base is None else "floating",
        base_link=None if base is None else base.child_frame_id,
    )
    tracks: dict[str, _Track] = {}
    for topic in joints:
        for column, name in enumerate(topic.names):
            track = _Track.of(log.time(topic), topic["position"][:, column])
            if name not in tracks and len(track.time):
                tracks[name] = track
    absent = [name for name in robot.joint_names if name not in tracks]
    if absent:
        log.notes.append(f"Not in the log, shown at zero: {abridged(absent)}.")
    known = [tracks[name].time for name in robot.joint_names if name in tracks]
    if not known:
        known = [np.zeros(1) if base is None else log.time(base)]
    time = max(known, key=len)
    time = time[:: step(robot, len(time))]
    q = np.zeros((len(time), robot.dof))
    for column, name in enumerate(robot.joint_names):
        if name in tracks:
            q[:, column] = tracks[name].at(time)
    pose = np.eye(4) if base is None else _poses(log.time(base), base["pose"]).at(time)
    frames, of_frames = moving_frames(robot, time, q, pose)
    shapes, of_shapes = robot_shapes(urdf, path, frames)
    log.notes += of_frames + of_shapes
    return Scene(
        start_ns=log.start_ns or 0,
        frames=frames,
        shapes=shapes,
        forces=_forces(log, wrenches, frames),
        is_robot=True,
        stands=base is None,
        notes=log.notes,
    )


def _link_names(urdf: str, path: Path | None) -> list[str]:
    """The links of a URDF; an error names its file, if it has one."""
    try:
        return link_names(urdf)
    except ModelError as error:
        if path is None:
            raise
        raise ModelError(f"{path} is not a URDF: {error}", option="urdf") from None


def _sensor_scene(log: _Log, odometry: list[Samples], wrenches: list[Samples]) -> Scene:
    """A sensor that moves by itself, or is taken to be at rest."""
    name = wrenches[0].frame_id if wrenches else odometry[0].child_frame_id
    name = name or "sensor"
    # The sensor's own odometry, or else the only one.
    own = [topic for topic in odometry if topic.child_frame_id == name] or odometry[:1]
    if own:
        track = _poses(log.time(own[0]), own[0]["pose"])
        frame = Frame(track.time, track.values[:, :3], track.values[:, 3:])
    else:
        log.notes.append("The log does not contain how the sensor moves: it is shown at rest.")
        frame = Frame(np.zeros(1), np.zeros((1, 3)), np.array([[0.0, 0, 0, 1]]))
    frames = {name: frame}
    return Scene(
        start_ns=log.start_ns or 0,
        frames=frames,
        shapes={},
        forces=_forces(log, wrenches, frames),
        is_robot=False,
        stands=False,
        notes=log.notes,
    )


def _forces(log: _Log, wrenches: list[Samples], frames: dict[str, Frame]) -> list[Force]:
    forces = []
    for topic in wrenches:
        # A sensor that names no frame can only be meant where there is one.
        frame = topic.frame_id or (next(iter(frames)) if len(frames) == 1 else "")
        if frame not in frames:
            log.notes.append(
                f"Not shown: {topic.topic}, whose frame `{frame}` is none of the robot."
            )
            continue
        track = _Track.of(log.time(topic), topic["wrench"][:, :3])
        forces.append(Force(topic.topic, frame, track.time, track.values))
    return forces


def _poses(time: Array, poses: Array) -> _Track:
    """Poses (N, 7) whose quaternions have length one, and do not jump to their negatives."""
    track = _Track.of(time, poses)
    length = np.linalg.norm(track.values[:, 3:], axis=1)
    sound = length > 1e-3
    time, values = track.time[sound], track.values[sound].copy()
    if not len(time):
        return _Track(np.zeros(1), np.array([[0.0, 0, 0, 0, 0, 0, 1]]))
    values[:, 3:] /= length[sound, None]
    turned = np.einsum("ij,ij->i", values[1:, 3:], values[:-1, 3:]) < 0
    values[1:, 3:] *= np.where(np.cumsum(turned) % 2, -1.0, 1.0)[:, None]
    return _Track(time, values)
