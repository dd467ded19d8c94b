"""Subscriptions whose serialised messages are taken a queue at a time, without an executor.

An executor wakes for each message, which costs half of a core at 1 kHz. A queue that is emptied
every few milliseconds costs a tenth of that.
"""

from __future__ import annotations

import importlib
import time
from collections.abc import Iterable, Iterator
from typing import Any

from rclpy.callback_groups import CallbackGroup
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription

from tactid._live.session import Message

DEPTH = 1000
"""Messages that a queue holds: those of a second at 1 kHz, longer than a loaded machine stalls."""

MEASURED = {
    "joint_topic": "sensor_msgs/msg/JointState",
    "wrench_topic": "geometry_msgs/msg/WrenchStamped",
    "odometry_topic": "nav_msgs/msg/Odometry",
    "imu_topic": "sensor_msgs/msg/Imu",
    "acceleration_topic": "geometry_msgs/msg/AccelStamped",
}
"""Types of measurements, by the options that name their topics."""

TACTILE = "sensor_msgs/msg/PointCloud2"
"""Type of tactile arrays: only topics of it that ``wrench_topic`` names are read."""

DESCRIPTIONS = ("std_msgs/msg/String", "robot_description")
"""Type and end of the name of the topics that describe a robot."""

TRANSFORMS = "tf2_msgs/msg/TFMessage"
"""Type of the topics of transforms."""


def _describes(kind: str) -> bool:
    """Returns whether the messages of a type describe the robot, and measure nothing."""
    return kind in (DESCRIPTIONS[0], TRANSFORMS)


class _DrainedGroup(CallbackGroup):
    """Keeps the executor from subscriptions, but not from their events."""

    def can_execute(self, entity: Any) -> bool:
        return not isinstance(entity, Subscription)

    def beginning_execution(self, entity: Any) -> bool:
        return not isinstance(entity, Subscription)

    def ending_execution(self, entity: Any) -> None:
        pass


class Inputs:
    """The topics that a node listens to.

    Args:
        node: The node.
        named: The topics that options name, by the option.
    """

    def __init__(self, node: Any, named: dict[str, list[str]]) -> None:
        self._node = node
        self._named = named
        self._group = _DrainedGroup()
        self._subscriptions: dict[str, tuple[str, Subscription]] = {}
        self._numbers: dict[tuple[str, bytes], int] = {}
        self.lost: dict[str, int] = {}
        """Number of messages that did not arrive, by topic."""
        self.incompatible: set[str] = set()
        """Topics with a publisher whose quality of service does not fit."""
        self.unknown: set[str] = set()
        """Topics whose type is not installed."""

    @property
    def topics(self) -> list[str]:
        """The topics that are listened to."""
        return list(self._subscriptions)

    def update(self, used: Iterable[str]) -> list[tuple[str, str]]:
        """Listens to all topics that may be of use, or to those that are used where there are any.

        Returns:
            All topics of measurements that there are, each with its type.
        """
        used = set(used)
        found = dict(self._found())
        for name, kind in found.items():
            if name not in self._subscriptions and (not used or name in used or _describes(kind)):
                self._subscribe(name, kind)
        for name, (kind, subscription) in list(self._subscriptions.items()):
            if used and name not in used and not _describes(kind):
                self._node.destroy_subscription(subscription)
                del self._subscriptions[name]
        return [(name, kind) for name, kind in found.items() if not _describes(kind)]

    def _found(self) -> Iterator[tuple[str, str]]:
        own = self._node.get_fully_qualified_name() + "/"
        options = {kind: option for option, kind in MEASURED.items()}
        for name, kinds in self._node.get_topic_names_and_types():
            kind = kinds[0]
            if name.startswith(own):
                continue
            if kind in options:
                named = self._named.get(options[kind], [])
                if not named or name in named:
                    yield name, kind
            elif kind == TACTILE:
                if name in self._named.get("wrench_topic", []):
                    yield name, kind
            elif kind == TRANSFORMS or (kind == DESCRIPTIONS[0] and name.endswith(DESCRIPTIONS[1])):
                yield name, kind

    def _subscribe(self, name: str, kind: str) -> None:
        package, _, message = kind.split("/")
        try:
            message_type = getattr(importlib.import_module(f"{package}.msg"), message)
        except (ImportError, AttributeError):
            self.unknown.add(f"{name} ({kind})")
            return
        is_latched = kind == DESCRIPTIONS[0] or name.endswith("tf_static")
        quality = QoSProfile(
            history=HistoryPolicy.KEEP_LAST,
            depth=DEPTH,
            reliability=ReliabilityPolicy.RELIABLE if is_latched else ReliabilityPolicy.BEST_EFFORT,
            durability=DurabilityPolicy.TRANSIENT_LOCAL
            if is_latched
            else DurabilityPolicy.VOLATILE,
        )
        events = SubscriptionEventCallbacks(
            incompatible_qos=lambda _: self.incompatible.add(name),
            use_default_callbacks=False,
        )
        subscription = self._node.create_subscription(
            message_type,
            name,
            lambda _: None,
            quality,
            callback_group=self._group,
            event_callbacks=events,
            raw=True,
        )
        self._subscriptions[name] = kind, subscription

    def _count_lost(self, name: str, info: dict[str, Any]) -> None:
        """Counts the messages before one that did not arrive, by the numbers of its publisher."""
        number = info.get("publication_sequence_number")
        if number is None:  # the middleware does not number messages
            return
        publisher = name, bytes(info["publisher_gid"]["data"])
        missing = number - self._numbers.get(publisher, number - 1) - 1
        self._numbers[publisher] = number
        if missing > 0:
            self.lost[name] = self.lost.get(name, 0) + missing

    def take(self) -> list[Message]:
        """Takes all messages that have arrived, in the order of their arrival."""
        taken: list[Message] = []
        for name, (kind, subscription) in self._subscriptions.items():
            with subscription.handle:
                while found := subscription.handle.take_message(subscription.msg_type, True):
                    data, info = found
                    self._count_lost(name, info)
                    received_ns = info.get("received_timestamp") or time.time_ns()
                    taken.append((name, kind, data, received_ns))
        taken.sort(key=lambda message: message[3])
        return taken
