"""Plays a bag on ROS 2 topics at its times of logging; stamps become those of now.

Usage: ros_player.py BAG SUBSCRIBED..., the topics for whose subscriptions it waits. A line on
standard output says when it begins, and how many messages it has published at the end.
"""

import importlib
import struct
import sys
import time
from typing import Any

import rclpy
from rclpy.qos import DurabilityPolicy, QoSProfile

from tactid import _native


def main() -> None:
    """Plays the bag."""
    rclpy.init()
    node = rclpy.create_node("player")
    messages = _native.LogMessages(sys.argv[1]).read(1_000_000)
    kinds = {name: kind for name, kind, _, _ in messages}
    publishers = {name: _publisher(node, name, kind) for name, kind in kinds.items()}
    first_ns = min(ns for name, _, _, ns in messages if name in sys.argv[2:])
    for name, _, data, _ in messages:
        if name not in sys.argv[2:]:
            publishers[name].publish(data)
    while not all(publishers[name].get_subscription_count() for name in sys.argv[2:]):
        time.sleep(0.1)
    print("begins", flush=True)
    begun_ns, count = time.time_ns() + 500_000_000, 0
    for name, _, data, ns in messages:
        if name not in sys.argv[2:]:
            continue
        due_ns = begun_ns + ns - first_ns
        time.sleep(max(0, due_ns - time.time_ns()) * 1e-9)
        stamp = struct.pack("<iI", *divmod(due_ns, 1_000_000_000))
        publishers[name].publish(data[:4] + stamp + data[12:])
        count += 1
    print(count, flush=True)
    time.sleep(0.5)


def _publisher(node: Any, name: str, kind: str) -> Any:
    package, _, message = kind.split("/")
    quality = QoSProfile(depth=1000)
    if message == "String":
        quality = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    return node.create_publisher(
        getattr(importlib.import_module(f"{package}.msg"), message), name, quality
    )


main()
