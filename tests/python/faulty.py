"""What goes wrong in real recordings, one function for each: messages in, faulty ones out.

Each leaves the given list as it is. Where only some messages are hit, they are every n-th one or
those at given times, so that a test can say how many there are.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from recordings import EPOCH_NS, Logged, header, vector

Change = Callable[[Any], Any]


def _on(messages: Sequence[Logged], topic: str) -> list[int]:
    """Returns where the messages of a topic are in the list."""
    found = [k for k, each in enumerate(messages) if each.topic == topic]
    assert found, f"no message on {topic}"
    return found


def _changed(messages: Sequence[Logged], which: Sequence[int], change: Change) -> list[Logged]:
    """Returns the messages, some of them with other contents."""
    out = list(messages)
    for k in which:
        out[k] = replace(out[k], message=change(out[k].message))
    return out


def _seconds(each: Logged) -> float:
    """Returns the time since the start of the recording, by the header."""
    return (each.stamp_ns - EPOCH_NS) * 1e-9


def every(messages: Sequence[Logged], topic: str, step: int) -> list[int]:
    """Returns the indices of every n-th message of a topic, without the first one."""
    return _on(messages, topic)[step // 2 :: step]


def nan_efforts(messages: Sequence[Logged], which: Sequence[int], joint: int = 2) -> list[Logged]:
    """One joint's driver did not answer."""

    def change(message: Any) -> Any:
        effort = message.effort.copy()
        effort[joint] = np.nan
        return replace(message, effort=effort)

    return _changed(messages, which, change)


def nan_wrenches(messages: Sequence[Logged], which: Sequence[int]) -> list[Logged]:
    """The sensor marked what it could not measure."""

    def change(message: Any) -> Any:
        return replace(message, wrench=replace(message.wrench, force=vector([np.nan] * 3)))

    return _changed(messages, which, change)


def out_of_range_wrenches(messages: Sequence[Logged], which: Sequence[int]) -> list[Logged]:
    """Moments are 1e154 N m, as memory that nobody has initialised."""

    def change(message: Any) -> Any:
        huge = vector([1e154, -1e154, 1e154])
        return replace(message, wrench=replace(message.wrench, torque=huge))

    return _changed(messages, which, change)


def out_of_range_positions(messages: Sequence[Logged], which: Sequence[int]) -> list[Logged]:
    """Joint positions are 1e154 rad, as memory that nobody has initialised."""

    def change(message: Any) -> Any:
        position = message.position.copy()
        position[1] = 1e154
        return replace(message, position=position)

    return _changed(messages, which, change)


def without_velocities(messages: Sequence[Logged], topic: str = "/joint_states") -> list[Logged]:
    """Joint states lack velocities, as drivers write that report positions alone."""
    return _changed(
        messages, _on(messages, topic), lambda message: replace(message, velocity=np.empty(0))
    )


def zero_velocities(messages: Sequence[Logged], topic: str = "/joint_states") -> list[Logged]:
    """The driver fills in velocities that nobody measured."""
    return _changed(
        messages,
        _on(messages, topic),
        lambda message: replace(message, velocity=0.0 * message.velocity),
    )


def _picked(message: Any, columns: Sequence[int]) -> Any:
    """Returns a joint state of some of the joints, in that order."""
    arrays = {
        name: values[list(columns)] if len(values := getattr(message, name)) else values
        for name in ("position", "velocity", "effort")
    }
    return replace(message, name=[message.name[c] for c in columns], **arrays)


def in_changing_order(
    messages: Sequence[Logged], topic: str = "/joint_states", seed: int = 11
) -> list[Logged]:
    """Joints are in the order of names, and in another one in each message of the second half."""
    orders = np.random.default_rng(seed)
    which, out = _on(messages, topic), list(messages)
    for number, k in enumerate(which):
        names = out[k].message.name
        order = sorted(range(len(names)), key=names.__getitem__)
        if number > len(which) // 2:
            order = list(orders.permutation(len(names)))
        out[k] = replace(out[k], message=_picked(out[k].message, order))
    return out


def with_a_finger(messages: Sequence[Logged], name: str = "finger_joint") -> list[Logged]:
    """A joint of a gripper that the URDF does not know is among the others."""

    def change(message: Any) -> Any:
        arrays = {
            field: np.insert(values, 3, 0.02) if len(values := getattr(message, field)) else values
            for field in ("position", "velocity", "effort")
        }
        return replace(message, name=[*message.name[:3], name, *message.name[3:]], **arrays)

    return _changed(messages, _on(messages, "/joint_states"), change)


def without_joint(messages: Sequence[Logged], joint: int) -> list[Logged]:
    """Nobody publishes a joint of the URDF."""

    def change(message: Any) -> Any:
        return _picked(message, [c for c in range(len(message.name)) if c != joint])

    return _changed(messages, _on(messages, "/joint_states"), change)


def stopped(messages: Sequence[Logged], topic: str, after_s: float) -> list[Logged]:
    """A driver died on the way."""
    return [each for each in messages if each.topic != topic or _seconds(each) < after_s]


def with_gap(
    messages: Sequence[Logged], topic: str, start_s: float, length_s: float
) -> list[Logged]:
    """A driver was away for a while."""
    return [
        each
        for each in messages
        if each.topic != topic or not start_s <= _seconds(each) < start_s + length_s
    ]


def with_impacts(
    messages: Sequence[Logged],
    at_s: Sequence[float],
    *,
    force: float = 200.0,
    length_s: float = 0.02,
    topic: str = "/wrench",
) -> list[Logged]:
    """Half sines of a force act across the tip, as from a tool that was bumped into something."""
    out = list(messages)
    for k in _on(messages, topic):
        since = _seconds(out[k]) - np.array(at_s)
        hit = (since >= 0) & (since < length_s)
        if not hit.any():
            continue
        push = force * np.sin(np.pi * since[hit][0] / length_s)
        wrench = out[k].message.wrench
        there = wrench.force
        pushed = vector([there.x + push, there.y - 0.5 * push, there.z])
        out[k] = replace(
            out[k], message=replace(out[k].message, wrench=replace(wrench, force=pushed))
        )
    return out


def without_stamps(messages: Sequence[Logged], topic: str) -> list[Logged]:
    """Nobody filled the headers; the recorder's own time is then all there is."""
    out = list(messages)
    for k in _on(messages, topic):
        blank = header(0, out[k].message.header.frame_id)
        out[k] = replace(
            out[k], log_ns=out[k].stamp_ns, message=replace(out[k].message, header=blank)
        )
    return out


def out_of_order(messages: Sequence[Logged], which: Sequence[int], late_s: float) -> list[Logged]:
    """Messages reached the recorder late, behind others that were stamped after them."""
    out = list(messages)
    for k in which:
        out[k] = replace(out[k], log_ns=out[k].log_ns + round(late_s * 1e9))
    return out


def shifted_stamps(
    messages: Sequence[Logged], topic: str, shift_s: float, from_s: float = 0.0
) -> list[Logged]:
    """The clock of a topic's stamps is another one, or was set at a time."""
    out = list(messages)
    for k in _on(messages, topic):
        if _seconds(out[k]) >= from_s:
            stamp_ns = out[k].stamp_ns + round(shift_s * 1e9)
            stamped = header(stamp_ns, out[k].message.header.frame_id)
            out[k] = replace(out[k], message=replace(out[k].message, header=stamped))
    return out


def noisy(
    messages: Sequence[Logged],
    *,
    force: float,
    moment: float,
    topic: str = "/wrench",
    seed: int = 5,
) -> list[Logged]:
    """The wrench has white noise."""
    rng, out = np.random.default_rng(seed), list(messages)
    for k in _on(messages, topic):
        wrench = out[k].message.wrench
        f, n = wrench.force, wrench.torque
        pushed = vector(np.array([f.x, f.y, f.z]) + rng.normal(0, force, 3))
        turned = vector(np.array([n.x, n.y, n.z]) + rng.normal(0, moment, 3))
        noised = replace(wrench, force=pushed, torque=turned)
        out[k] = replace(out[k], message=replace(out[k].message, wrench=noised))
    return out


def offset(messages: Sequence[Logged], values: np.ndarray, topic: str = "/wrench") -> list[Logged]:
    """The zero of a sensor was not set: every wrench has a constant force and moment more."""

    def change(message: Any) -> Any:
        f, n = message.wrench.force, message.wrench.torque
        force = vector(np.array([f.x, f.y, f.z]) + values[:3])
        torque = vector(np.array([n.x, n.y, n.z]) + values[3:])
        return replace(message, wrench=replace(message.wrench, force=force, torque=torque))

    return _changed(messages, _on(messages, topic), change)


def truncate(bag: Path, part: float) -> Path:
    """Cuts the bag's only file as a full disk does; ``metadata.yaml`` still lists the whole."""
    (file,) = bag.glob("*.mcap")
    whole = file.read_bytes()
    file.write_bytes(whole[: int(part * len(whole))])
    return bag
