"""Logs whose messages are not CDR: ROS 1 bags, and MCAP files with messages of ROS 1 or in JSON.

Their messages are written to an MCAP file as ROS 2 has them, by the packages rosbags and mcap.
"""

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tactid._base.errors import LogError
from tactid._base.naming import abridged
from tactid._read.packages import package
from tactid._read.tables import Progress

TYPES = (
    "sensor_msgs/msg/JointState",
    "sensor_msgs/msg/Imu",
    "geometry_msgs/msg/WrenchStamped",
    "geometry_msgs/msg/AccelStamped",
    "geometry_msgs/msg/PoseStamped",
    "geometry_msgs/msg/TwistStamped",
    "nav_msgs/msg/Odometry",
    "std_msgs/msg/String",
    "tf2_msgs/msg/TFMessage",
)
"""Types of the messages that are read. Other types, such as images, are not converted."""

BAG_BEGINNING = b"#ROSBAG V2.0"
"""First bytes of a ROS 1 bag."""

ENCODINGS = ("ros1", "ros1msg", "json")
"""Encodings of the messages of an MCAP file that are converted."""

CHECK_EVERY = 1 << 10
"""Messages between two calls of the progress."""


class Message(NamedTuple):
    """A message of a foreign log."""

    topic: str
    type_name: str
    """Full name of the type, as ROS 2 has it."""
    encoding: str
    log_time_ns: int
    data: bytes


def full_name(name: str) -> str:
    """Returns the name of a message type as ROS 2 has it: ``std_msgs/msg/String``."""
    package, _, rest = name.replace("::", "/").replace("/msg/", "/").partition("/")
    return "tf2_msgs/msg/TFMessage" if rest == "tfMessage" else f"{package}/msg/{rest}"


@contextmanager
def bag_messages(path: Path) -> Iterator[tuple[Iterator[Message], int]]:
    """Opens a ROS 1 bag: its messages of the types that are read, and their number.

    Raises:
        LogError: The bag cannot be read.
        ArgumentError: The package rosbags is missing.
    """
    with _bag(path) as reader:
        kept = [each for each in reader.connections if full_name(each.msgtype) in TYPES]
        messages = (
            Message(each.topic, full_name(each.msgtype), "ros1", time, data)
            for each, time, data in (reader.messages(connections=kept) if kept else ())
        )
        yield _read(path, messages), sum(each.msgcount for each in kept)


@dataclass(frozen=True)
class BagTopic:
    """A topic of a ROS 1 bag, as :class:`tactid.Topic` has one."""

    name: str
    type_name: str
    count: int
    frequency: float | None


@dataclass(frozen=True)
class BagInfo:
    """Contents of a ROS 1 bag, as :class:`tactid.LogInfo` has them."""

    topics: list[BagTopic]
    duration: float | None
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    damage: list[str] = field(default_factory=list)


def bag_info(path: Path) -> BagInfo:
    """Returns the contents of a ROS 1 bag."""
    with _bag(path) as reader:
        duration = reader.duration * 1e-9 if reader.message_count else None
        topics = [
            BagTopic(
                name,
                topic.msgtype or "several types",
                topic.msgcount,
                (topic.msgcount - 1) / duration if duration and topic.msgcount > 1 else None,
            )
            for name, topic in sorted(reader.topics.items())
        ]
    return BagInfo(topics, duration)


@contextmanager
def _bag(path: Path) -> Iterator[Any]:
    """Opens a ROS 1 bag."""
    rosbag1 = package("rosbags.rosbag1", f"{path} is a ROS 1 bag")
    with ExitStack() as stack:
        with _errors_of_reading(path):
            reader = stack.enter_context(rosbag1.Reader(path))
        yield reader


@contextmanager
def mcap_messages(path: Path) -> Iterator[tuple[Iterator[Message], int]]:
    """Opens an MCAP file: its messages of the types that are read, and their number.

    Raises:
        LogError: The file cannot be read.
        ArgumentError: The package mcap is missing.
    """
    readers = package("mcap.reader", f"{path} is MCAP with messages that are not of ROS 2")
    with path.open("rb") as file:
        reader = readers.make_reader(file)
        with _errors_of_reading(path):
            summary = reader.get_summary()
        counts = summary.statistics.message_count if summary and summary.statistics else 0
        messages = (
            Message(
                channel.topic,
                full_name(schema.name),
                channel.message_encoding,
                message.log_time,
                message.data,
            )
            for schema, channel, message in reader.iter_messages()
            if schema is not None and full_name(schema.name) in TYPES
        )
        yield _read(path, messages), counts


def _read(path: Path, messages: Iterator[Message]) -> Iterator[Message]:
    """Yields messages; errors of the package that reads them are those of a log."""
    with _errors_of_reading(path):
        yield from messages


@contextmanager
def _errors_of_reading(path: Path) -> Iterator[None]:
    """Makes errors those of a log: of a damaged file, the packages raise any exception."""
    try:
        yield
    except Exception as error:
        reason = str(error) or type(error).__name__
        raise LogError(f"{path} cannot be read as a log: {reason}") from None


def convert(
    path: Path, messages: Iterator[Message], count: int, to: Path, progress: Progress
) -> None:
    """Writes messages as ROS 2 has them to a new folder.

    Raises:
        LogError: None of the messages is of a type that is read, or one cannot be decoded.
        ArgumentError: The package rosbags is missing.
    """
    what = f"{path} has messages of ROS 1 or in JSON"
    rosbag2, typesys = package("rosbags.rosbag2", what), package("rosbags.typesys", what)
    errors = package("rosbags.serde", what)
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    connections: dict[tuple[str, str], Any] = {}
    with rosbag2.Writer(to, version=9, storage_plugin=rosbag2.StoragePlugin.MCAP) as writer:
        for done, message in enumerate(messages):
            if progress is not None and done % CHECK_EVERY == 0:
                progress(min(done / max(count, 1), 1.0))
            key = (message.topic, message.type_name)
            if key not in connections:
                connections[key] = writer.add_connection(*key, typestore=store)
            try:
                data = _as_cdr(store, message)
            except (errors.SerdeError, KeyError, TypeError, ValueError, IndexError) as error:
                raise LogError(
                    f"{path}: message {done + 1} on {message.topic} is no {message.type_name} in"
                    f" {message.encoding}: {error}"
                ) from None
            writer.write(connections[key], message.log_time_ns, data)
    if not connections:
        names = abridged([name.replace("/msg/", "/") for name in TYPES], len(TYPES))
        raise LogError(f"{path} has no message of a type that is read: {names}")


def _as_cdr(store: Any, message: Message) -> Any:
    """Returns the bytes of a message as ROS 2 has them."""
    if message.encoding == "cdr":
        return message.data
    if message.encoding == "json":
        fields = json.loads(message.data)
        return store.serialize_cdr(_built(store, message.type_name, fields), message.type_name)
    if message.encoding in ENCODINGS:
        return store.ros1_to_cdr(message.data, message.type_name)
    raise ValueError(f"the encoding is {message.encoding!r}, which is not read")


_OTHER_NAMES = {"nanosec": ("nanosec", "nsec", "nsecs"), "sec": ("sec", "secs")}
"""Fields that have other names in other programs."""


def _built(store: Any, type_name: str, fields: Any) -> Any:
    """Returns a message with fields as JSON has them; those that are missing are zero or empty."""
    if not isinstance(fields, Mapping):
        raise ValueError(f"{type_name} is {fields!r}: expected an object")
    values = []
    for name, (kind, about) in store.fielddefs[type_name][1]:
        given = next(
            (fields[each] for each in _OTHER_NAMES.get(name, (name,)) if each in fields), None
        )
        values.append(_value(store, kind.name, about, given))
    return store.types[type_name](*values)


def _value(store: Any, kind: str, about: Any, given: Any) -> Any:
    """Returns the value of a field of a kind that rosbags has a name for."""
    if kind == "NAME":
        return _built(store, about, {} if given is None else given)
    if kind == "BASE":
        base = about[0]
        if base == "string":
            return "" if given is None else str(given)
        return np.dtype(_DTYPES.get(base, base)).type(0 if given is None else _number(given))
    (inner, of), length = about
    items = [] if given is None else list(given)
    if inner.name == "BASE" and of[0] != "string":
        numbers = [_number(item) for item in items] or [0] * (length or 0)
        return np.array(numbers, dtype=_DTYPES.get(of[0], of[0]))
    return [_value(store, inner.name, of, item) for item in items]


_DTYPES = {"char": "uint8", "octet": "uint8"}


def _number(given: Any) -> float | int:
    """Returns a number; JSON has none that is not finite, for which programs write null or text."""
    return float("nan") if given is None else float(given) if isinstance(given, str) else given


Opener = Callable[[Path], Any]
"""Opens the messages of a foreign log."""


def opener_of(path: Path, encodings: Callable[[Path], set[str]]) -> Opener | None:
    """Returns what opens a foreign log; None for a log of ROS 2, and for other files.

    Args:
        path: The file.
        encodings: Returns the encodings of the messages of an MCAP file.
    """
    if is_bag(path):
        return bag_messages
    # An MCAP file begins with its magic, and with a header that begins with the profile.
    beginning = _beginning(path)
    if beginning.startswith(b"\x89MCAP0\r\n\x01") and beginning[17:25] != b"\4\0\0\0ros2":
        return mcap_messages if encodings(path) & set(ENCODINGS) else None
    return None


def is_bag(path: Path) -> bool:
    """Returns whether a file is a ROS 1 bag, which its first bytes show."""
    return _beginning(path).startswith(BAG_BEGINNING)


def _beginning(path: Path) -> bytes:
    if not path.is_file():  # a pipe would lose the bytes that are read
        return b""
    with path.open("rb") as file:
        return file.read(64)
