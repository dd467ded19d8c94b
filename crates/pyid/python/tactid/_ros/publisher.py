"""The simulated arm on ROS 2 topics, at real time."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import rclpy
from geometry_msgs.msg import Vector3, WrenchStamped
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from rclpy.signals import SignalHandlerOptions
from rclpy.time import Time
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from tactid._live.simulated_arm import RATE_HZ, TIP, SimulatedArm

WRENCHES_PER_JOINT_STATE = 2
"""Wrenches that are published at once, with one joint state."""
SAMPLES_PER_BATCH = 100
"""Samples that are computed at once."""


class Publisher(Node):
    """Publishes the simulated arm on the topics that a robot would have."""

    def __init__(self) -> None:
        super().__init__("simulated_arm")
        self._arm = SimulatedArm()
        once = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        description = self.create_publisher(String, "/robot_description", once)
        description.publish(String(data=self._arm.urdf))
        self._joints = self.create_publisher(JointState, "/joint_states", qos_profile_sensor_data)
        sensor = "/ft_sensor/wrench"
        self._wrenches = self.create_publisher(WrenchStamped, sensor, qos_profile_sensor_data)
        self._names = self._arm.joint_names

    def run(self) -> None:
        """Publishes until the context is shut down."""
        begun_ns, first = time.time_ns(), 0
        while rclpy.ok(context=self.context):
            numbers = np.arange(first, first + SAMPLES_PER_BATCH)
            rows = [part.tolist() for part in self._arm.samples(numbers / RATE_HZ)]
            for k in range(0, SAMPLES_PER_BATCH, WRENCHES_PER_JOINT_STATE):
                newest = k + WRENCHES_PER_JOINT_STATE - 1
                stamps_ns = [begun_ns + (first + j) * 10**9 // RATE_HZ for j in (k, newest)]
                time.sleep(max(0, stamps_ns[-1] - time.time_ns()) * 1e-9)
                self._publish(stamps_ns, [[part[j] for part in rows] for j in (k, newest)])
            first += SAMPLES_PER_BATCH

    def _publish(self, stamps_ns: list[int], samples: list[Any]) -> None:
        """Publishes the wrenches of some samples, and the joints of the first."""
        for stamp_ns, (*_, (fx, fy, fz, mx, my, mz)) in zip(stamps_ns, samples, strict=True):
            message = WrenchStamped()
            message.header.stamp = Time(nanoseconds=stamp_ns).to_msg()
            message.header.frame_id = TIP
            message.wrench.force = Vector3(x=fx, y=fy, z=fz)
            message.wrench.torque = Vector3(x=mx, y=my, z=mz)
            self._wrenches.publish(message)
        position, velocity, _ = samples[0]
        joints = JointState(name=self._names, position=position, velocity=velocity)
        joints.header.stamp = Time(nanoseconds=stamps_ns[0]).to_msg()
        self._joints.publish(joints)


def run() -> None:
    """Publishes until it is interrupted."""
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = Publisher()
        try:
            node.run()
        finally:
            node.destroy_node()
    finally:
        rclpy.try_shutdown()
