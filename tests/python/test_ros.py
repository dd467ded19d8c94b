"""The ROS 2 node beside publishers in other processes; needs the extra ``ros-test``."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tactid
from moving_arm import record
from tactid._base.values import entries
from tactid._live.replay import played
from tactid._live.session import Session

rclpy = pytest.importorskip(
    "rclpy", reason="needs ROS 2: pip install '.[ros-test]', with Python 3.11"
)
# rclpy warns of itself.
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")

WAIT_S = 30.0
MEASURED = ("/joint_states", "/wrench")
OPTIONS = {"tip": "tool0", "cutoff_hz": 10.0, "delay_s": 0.0, "wrench_offset": "no"}
# A domain of its own, so that parallel tests and other nodes do not meet.
DOMAIN = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", "ROS_DOMAIN_ID": str(os.getpid() % 100)}


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("arm") / "bag", duration=8.0, joint_hz=400)


@contextmanager
def _running(*arguments: str) -> Iterator[None]:
    """Runs a command of tactid, and interrupts it at the end."""
    command = [sys.executable, "-m", "tactid", *arguments]
    with subprocess.Popen(command, env=os.environ | DOMAIN) as process:
        try:
            yield
            process.send_signal(signal.SIGTERM)
            assert process.wait(timeout=WAIT_S) == 143
        finally:
            process.kill()


@pytest.fixture
def node(tmp_path: Path) -> Iterator[None]:
    """The node, with two of its options as parameters."""
    given = ["--tip", "tool0", "--cutoff-hz", "10", "--delay-s", "0", "--ros-args"]
    parameters = ["-p", "wrench_offset:=no", "-p", f"save_to:={tmp_path / 'payload.json'}"]
    with _running("live", *given, *parameters):
        yield


class Listener:
    """Hears what the node publishes."""

    def __init__(self) -> None:
        from diagnostic_msgs.msg import DiagnosticArray
        from geometry_msgs.msg import InertiaStamped, WrenchStamped
        from std_srvs.srv import SetBool, Trigger

        os.environ.update(DOMAIN)
        rclpy.init()
        self.node = rclpy.create_node("listener")
        self.masses: list[float] = []
        self.contacts: list[Any] = []
        self.reports: dict[str, Any] = {}
        diagnostics = "/tactid/diagnostics"
        self.node.create_subscription(InertiaStamped, "/tactid/payload", self._payload, 10)
        self.node.create_subscription(DiagnosticArray, diagnostics, self._report, 10)
        contact = "/tactid/contact_wrench"
        self.node.create_subscription(WrenchStamped, contact, self.contacts.append, 100)
        self.trigger, self.set_bool = Trigger, SetBool

    def _payload(self, message: Any) -> None:
        self.masses.append(message.inertia.m)

    def _report(self, message: Any) -> None:
        self.reports = {each.name.removeprefix("tactid: "): each for each in message.status}

    def wait(self, for_what: Callable[[], object]) -> None:
        """Listens until something is there."""
        until = time.monotonic() + WAIT_S
        while not for_what():
            assert time.monotonic() < until, self.reports
            rclpy.spin_once(self.node, timeout_sec=0.1)

    def facts(self) -> dict[str, str]:
        """The numbers of the status."""
        status = self.reports.get("status")
        return {each.key: each.value for each in status.values} if status else {}

    def call(self, service: str, **request: bool) -> Any:
        """Calls a service of the node."""
        kind = self.set_bool if request else self.trigger
        client = self.node.create_client(kind, f"/tactid/{service}")
        assert client.wait_for_service(WAIT_S)
        answer = client.call_async(kind.Request(**request))
        self.wait(answer.done)
        return answer.result()


@pytest.fixture
def listener() -> Iterator[Listener]:
    found = Listener()
    yield found
    found.node.destroy_node()
    rclpy.shutdown()


def _from_log(bag: Path) -> Any:
    """Returns the values that the same messages give when they are read from the log."""
    session = Session(tactid.Options(**OPTIONS), in_background=False)
    for batch in played(bag, rate=None):
        session.push(batch)
    session.finish()
    estimate = session.estimate()
    assert estimate is not None
    return estimate.values


def _ns(message: Any) -> int:
    """Returns the stamp of a message, ns."""
    stamp = message.header.stamp
    return int(stamp.sec * 10**9 + stamp.nanosec)


def _check_contacts(listener: Listener, facts: dict[str, str]) -> None:
    """Nothing touches the payload; each wrench has the frame and the time that it belongs to."""
    contacts = listener.contacts
    assert np.all(np.diff([_ns(each) for each in contacts]) > 0)
    assert {each.header.frame_id for each in contacts} == {"tool0"} == {facts["contact_frame"]}
    assert 0.02 < float(facts["contact_latency_s"]) < 0.06
    # The status has the standard deviations of the last one alone.
    std_devs = [float(text) for text in facts["contact_std_devs"].split(", ")]
    force = [getattr(contacts[-1].wrench.force, axis) for axis in "xyz"]
    assert facts["contact_or_payload_change"] == "False"
    assert max(std_devs[:3]) < 0.5
    assert np.all(np.abs(force) < 6 * np.array(std_devs[:3]))


@pytest.mark.usefixtures("node")
def test_the_node_identifies_what_is_published(
    bag: Path, listener: Listener, tmp_path: Path
) -> None:
    """No message is lost, the payload is that of the recording, and what ends or comes is named."""
    player = Path(__file__).with_name("ros_player.py")
    command = [sys.executable, str(player), str(bag), *MEASURED]
    environment = os.environ | DOMAIN
    done = subprocess.run(
        command, env=environment, stdout=subprocess.PIPE, text=True, timeout=90, check=True
    )
    published = int(done.stdout.split()[-1])
    # A loaded machine may still be planning, and reports wait in queues.
    listener.wait(lambda: "contact_frame" in listener.facts() and listener.contacts)
    listener.wait(lambda: "topic_silent" in listener.reports)
    listener.wait(lambda: int(listener.facts()["messages"]) == published + 1)
    facts = listener.facts()
    assert facts["topics"] == ", ".join(MEASURED)
    assert not any("lost" in name for name in listener.reports)
    offline = tactid.identify(bag, **OPTIONS).estimate
    answer = listener.call("save")
    assert answer.success, answer.message
    saved = json.loads((tmp_path / "payload.json").read_text())
    values = np.array(entries(saved["estimate"]["values"]))
    assert np.all(np.abs(values - offline.values) < 1.96 * offline.std_devs)
    assert np.all(np.abs(values - _from_log(bag)) < 1e-3 * offline.std_devs)
    listener.wait(lambda: listener.masses[-1] == pytest.approx(values[0], rel=1e-9))

    _check_contacts(listener, facts)
    for is_held in (True, False):
        answer = listener.call("hold", data=is_held)
        assert answer.success, answer.message
        listener.wait(lambda held=str(is_held): listener.facts()["payload_held"] == held)
    answer = listener.call("tare")
    assert (answer.success, "`wrench_offset`" in answer.message) == (False, True)

    from geometry_msgs.msg import WrenchStamped

    listener.node.create_publisher(WrenchStamped, "/another/wrench", 10)
    listener.wait(lambda: "topics_not_used" in listener.reports)
    assert "/another/wrench" in listener.reports["topics_not_used"].message


def test_a_simulated_arm_is_published(listener: Listener) -> None:
    """Description, joint states and wrenches come as those of a robot, at real time."""
    from geometry_msgs.msg import WrenchStamped
    from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
    from sensor_msgs.msg import JointState
    from std_msgs.msg import String

    joints_ns: list[int] = []
    wrenches_ns: list[int] = []
    late_ns: list[int] = []
    descriptions: list[Any] = []

    def heard(message: Any) -> None:
        joints_ns.append(_ns(message))
        late_ns.append(time.time_ns() - joints_ns[-1])

    def felt(message: Any) -> None:
        assert message.header.frame_id == "tool0"
        wrenches_ns.append(_ns(message))

    node, sensor = listener.node, qos_profile_sensor_data
    once = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    node.create_subscription(JointState, "/joint_states", heard, sensor)
    node.create_subscription(WrenchStamped, "/ft_sensor/wrench", felt, sensor)
    node.create_subscription(String, "/robot_description", descriptions.append, once)
    with _running("simulate", "--publish"):
        listener.wait(lambda: min(len(joints_ns), len(wrenches_ns)) > 300 and descriptions)
    assert len(tactid.Manipulator.from_urdf(descriptions[0].data).joint_names) == 6
    assert 0 <= min(late_ns) < 5 * 10**9
    for times_ns, period_ns in ((joints_ns, 2_000_000), (wrenches_ns, 1_000_000)):
        steps_ns = np.diff(times_ns)
        assert np.all(steps_ns > 0)
        assert np.median(steps_ns) == period_ns
        assert np.all(steps_ns % period_ns == 0)
