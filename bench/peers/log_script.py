"""The payload of a log by NumPy, Pinocchio and rosbags, as one writes it without tactid.

It reads one MCAP file of a robot with a floating base whose joints, base and two finger wrenches
have equal stamps. It trusts the clocks, knows no outliers, and gives no uncertainty. It prints the
ten parameters: mass, its product with the centre of mass, inertia about the frame's origin.
"""

import sys
from collections import defaultdict
from pathlib import Path

import numpy as np
import pinocchio as pin
from rosbags.highlevel import AnyReader

TOOL = "tool0"
FINGERS = ("/finger_left/wrench", "/finger_right/wrench")
TOPICS = ("/robot_description", "/joint_states", "/base/odom", *FINGERS)
WINDOW = 9
"""Samples of a smoothed derivative, on each side."""
MEAN = 20
"""Samples that are averaged to one equation."""
PARAMETERS = [0, 1, 2, 3, 4, 5, 7, 6, 8, 9]
"""Pinocchio has Iyy before Ixz."""

Array = np.ndarray


def main(path: str) -> None:
    """Identifies the payload of a log and prints its parameters."""
    messages = read(path)
    urdf = messages["/robot_description"][0][1].data
    model = pin.buildModelFromXML(urdf, pin.JointModelFreeFlyer())
    time, states = joints_and_base(messages, model)
    wrench = finger_wrenches(messages, model, states[-1, : model.nq])
    rows = regressors(model, time, states)
    count = len(rows) // MEAN * MEAN
    rows = rows[:count].reshape(-1, MEAN, 6, 10).mean(axis=1).reshape(-1, 10)
    targets = wrench[:count].reshape(-1, MEAN, 6).mean(axis=1).ravel()
    print(*np.linalg.lstsq(rows, targets, rcond=None)[0][PARAMETERS])


def read(path: str) -> dict[str, list]:
    """Messages of the topics that are used, each with its header's stamp in s."""
    messages = defaultdict(list)
    with AnyReader([Path(path)]) as reader:
        connections = [each for each in reader.connections if each.topic in TOPICS]
        for connection, logged, data in reader.messages(connections):
            message = reader.deserialize(data, connection.msgtype)
            stamp = getattr(getattr(message, "header", None), "stamp", None)
            seconds = stamp.sec + 1e-9 * stamp.nanosec if stamp else 1e-9 * logged
            messages[connection.topic].append((seconds, message))
    return messages


def joints_and_base(messages: dict[str, list], model: pin.Model) -> tuple[Array, Array]:
    """Times, and positions and velocities in the order of the model, base first."""
    names = messages["/joint_states"][0][1].name
    order = [names.index(name) for name in model.names[2:]]
    time = np.array([stamp for stamp, _ in messages["/joint_states"]])
    joints = np.array([message.position for _, message in messages["/joint_states"]])[:, order]
    base = np.array([pose_and_twist(message) for _, message in messages["/base/odom"]])
    position = np.hstack([base[:, :7], joints])
    velocity = np.hstack([base[:, 7:], derivative(time, joints)])
    return time, np.hstack([position, velocity, derivative(time, velocity)])


def pose_and_twist(message) -> list[float]:
    """Pose and twist of an odometry message; both parts of the twist in the base's axes."""
    pose, twist = message.pose.pose, message.twist.twist
    numbers = [(pose.position, "xyz"), (pose.orientation, "xyzw")]
    numbers += [(twist.linear, "xyz"), (twist.angular, "xyz")]
    return [getattr(part, axis) for part, axes in numbers for axis in axes]


def derivative(time: Array, values: Array) -> Array:
    """Slope of the straight line through the samples around each sample."""
    step = (time[-1] - time[0]) / (len(time) - 1)
    offsets = np.arange(-WINDOW, WINDOW + 1)
    weights = offsets[::-1] / (step * (offsets**2).sum())
    padded = np.pad(values, ((WINDOW, WINDOW), (0, 0)), mode="edge")
    columns = [np.convolve(column, weights, mode="valid") for column in padded.T]
    return np.column_stack(columns)


def finger_wrenches(messages: dict[str, list], model: pin.Model, position: Array) -> Array:
    """Sum of both fingers' wrenches on the payload, in the tool's axes about its origin."""
    data = model.createData()
    pin.framesForwardKinematics(model, data, position)
    tool_from_world = data.oMf[model.getFrameId(TOOL)].inverse()
    total = 0.0
    for topic in FINGERS:
        frame = messages[topic][0][1].header.frame_id
        tool_from_finger = tool_from_world * data.oMf[model.getFrameId(frame)]
        wrenches = np.array([numbers_of(message.wrench) for _, message in messages[topic]])
        total += wrenches @ tool_from_finger.toDualActionMatrix().T
    return total


def numbers_of(wrench) -> list[float]:
    """Force, then moment."""
    return [getattr(part, axis) for part in (wrench.force, wrench.torque) for axis in "xyz"]


def regressors(model: pin.Model, time: Array, states: Array) -> Array:
    """The 6x10 regressor of the payload's wrench at each time, in the tool's frame."""
    data, tool = model.createData(), model.getFrameId(TOOL)
    rows = np.empty((len(time), 6, 10))
    for row, state in zip(rows, states, strict=True):
        position, velocity, acceleration = np.split(state, [model.nq, model.nq + model.nv])
        pin.forwardKinematics(model, data, position, velocity, acceleration)
        moved = pin.getFrameVelocity(model, data, tool)
        row[:] = pin.bodyRegressor(moved, pin.getFrameAcceleration(model, data, tool))
    return rows


if __name__ == "__main__":
    main(sys.argv[1])
