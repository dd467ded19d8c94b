"""The ROS 2 node: topics in; the payload, diagnostics and services out."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import InertiaStamped, Vector3, WrenchStamped
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.time import Time
from std_srvs.srv import SetBool, Trigger

from tactid._base.errors import TactidError
from tactid._base.files import write_atomically
from tactid._base.values import nested
from tactid._live.session import LiveContact, Session
from tactid._options.options import Options, options_for
from tactid._results.payload import PayloadEstimate
from tactid._results.records import LiveStatus
from tactid._ros.inputs import MEASURED, Inputs

TAKEN_EVERY_S = 0.002
"""Time between two looks into the queues, s."""
SPUN_EVERY = 10
"""Looks after which services, events and what another thread has chosen have their turn."""
PUBLISHED_EVERY_S = 0.05
"""Time between two estimates, s."""
REPORTED_EVERY_S = 1.0
"""Time between two diagnostics, and between two looks for new topics, s."""

SAVED = "tactid-payload.json"
"""Default of the parameter ``save_to``."""

_LEVELS = {"contradicts": DiagnosticStatus.ERROR, "doubts": DiagnosticStatus.WARN}
"""Levels of diagnostics by the severity of a finding; others are OK."""

_FIXED = ParameterDescriptor(
    dynamic_typing=True,
    read_only=True,
    description="An option of the identification; it is read when the node starts.",
)
"""What a parameter is that the session takes once."""


class LiveNode(Node):
    """Identifies the payload from the topics of a robot.

    Args:
        given: The options that the command line gives, which parameters of the node replace.
        read: Turns parameters into options, where these are written as on the command line.
    """

    def __init__(self, given: Options, read: Callable[[Mapping[str, Any]], Options]) -> None:
        super().__init__("tactid")
        self._options = self._with_parameters(given, read)
        self.declare_parameter("save_to", SAVED, ParameterDescriptor(dynamic_typing=True))
        contact_frame = self.declare_parameter("contact_frame", None, _FIXED).value
        self._session = Session(self._options, in_background=True, contact_frame=contact_frame)
        self._inputs = Inputs(self, _named_topics(self._options))
        self._payload = self.create_publisher(InertiaStamped, "~/payload", 10)
        self._contact = self.create_publisher(WrenchStamped, "~/contact_wrench", 10)
        self._diagnostics = self.create_publisher(DiagnosticArray, "~/diagnostics", 10)
        self._status = self.create_publisher(DiagnosticStatus, "~/status", 10)
        self.create_service(Trigger, "~/reset", self._on_reset)
        self.create_service(Trigger, "~/save", self._on_save)
        self.create_service(Trigger, "~/tare", self._on_tare)
        self.create_service(SetBool, "~/hold", self._on_hold)
        self._contact_ns = 0
        self._payload_ns = 0
        self._changes = 0
        self._level = DiagnosticStatus.OK
        self._contradiction: str | None = None
        self._logged: str | None = None
        self._reporting: threading.Thread | None = None

    def run(self, executor: SingleThreadedExecutor) -> None:
        """Takes messages and publishes until the context is shut down."""
        executor.add_node(self)
        looks, published_s, reported_s = 0, 0.0, 0.0
        while rclpy.ok(context=self.context):
            begun_s = time.monotonic()
            messages, looks = self._inputs.take(), looks + 1
            has_turn = looks % SPUN_EVERY == 0
            if messages or has_turn:
                self._session.push(messages)
                self._publish_newest()
            if has_turn:
                executor.spin_once(timeout_sec=0.0)
            if begun_s - published_s >= PUBLISHED_EVERY_S:
                self._publish()
                published_s = begun_s
            if begun_s - reported_s >= REPORTED_EVERY_S:
                self._look_around()
                reported_s = begun_s
            time.sleep(max(0.0, begun_s + TAKEN_EVERY_S - time.monotonic()))

    def _with_parameters(
        self, given: Options, read: Callable[[Mapping[str, Any]], Options]
    ) -> Options:
        """Returns options with the parameters of the node in place of some."""
        parameters = {}
        for option in options_for("live"):
            value = self.declare_parameter(option.name, None, _FIXED).value
            if value is not None:
                parameters[option.name] = value
        return given.replace(**read(parameters).given)

    def _publish_newest(self) -> None:
        """Publishes the wrench of a contact after a sample, and a payload change at once."""
        contact = self._session.contact_wrench()
        if contact is not None and contact.time_ns != self._contact_ns:
            self._contact_ns = contact.time_ns
            self._contact.publish(_wrench(contact))
        changes = self._session.payload_changes()
        if changes != self._changes:
            self._changes = changes
            self._publish()
            self._status.publish(self._own_status(self._session.status()))

    def _publish(self) -> None:
        """Publishes the payload after a sample, unless the data contradict it."""
        estimate, last_ns = self._session.estimate(), self._session.status().last_ns
        if estimate is None or self._contradiction is not None or last_ns == self._payload_ns:
            return
        self._payload_ns = last_ns
        message = InertiaStamped()
        message.header.stamp = _stamp(last_ns)
        message.header.frame_id = estimate.frame
        values = [float("nan") if value is None else value for value in estimate.reported_values]
        inertia = message.inertia
        inertia.m = values[0]
        inertia.com.x, inertia.com.y, inertia.com.z = values[1:4]
        inertia.ixx, inertia.ixy, inertia.ixz, inertia.iyy, inertia.iyz, inertia.izz = values[4:]
        self._payload.publish(message)

    def _look_around(self) -> None:
        """Looks for topics and publishes the status; findings take their time in another thread."""
        status = self._session.status()
        is_settled = status.is_running and status.problem is None
        self._session.announce(self._inputs.update(status.topics if is_settled else []))
        own = self._own_status(status)
        self._status.publish(own)
        self._log(own.level, self._contradiction or status.problem)
        if self._reporting is None or not self._reporting.is_alive():
            of_inputs = self._of_inputs()
            self._reporting = threading.Thread(target=self._report, args=(of_inputs,), daemon=True)
            self._reporting.start()

    def _log(self, level: bytes, words: str | None) -> None:
        """Says on the terminal what is wrong, once."""
        if words != self._logged and words is not None:
            log = self.get_logger()
            (log.error if level == DiagnosticStatus.ERROR else log.warning)(words)
        self._logged = words

    def _report(self, of_inputs: list[DiagnosticStatus]) -> None:
        findings, faults = self._session.notices()
        contradictions = (str(finding) for finding in findings if finding.contradicts_result)
        self._contradiction = next(contradictions, None)
        array = DiagnosticArray()
        array.header.stamp = self.get_clock().now().to_msg()
        of_findings = [
            _diagnostic(finding.kind, _LEVELS.get(finding.severity, DiagnosticStatus.OK), finding)
            for finding in findings
        ]
        of_faults = [
            _diagnostic(f"{fault.topic}: {fault.kind}", DiagnosticStatus.WARN, fault)
            for fault in faults
        ]
        self._level = max(
            (each.level for each in (*of_inputs, *of_findings, *of_faults)),
            default=DiagnosticStatus.OK,
        )
        own = self._own_status(self._session.status())
        array.status = [own, *of_inputs, *of_findings, *of_faults]
        self._diagnostics.publish(array)

    def _own_status(self, status: LiveStatus) -> DiagnosticStatus:
        """Returns what the node does: the estimate in words, or what is wrong.

        Its level is that of the gravest of what was noticed at the last look around.
        """
        estimate = self._session.estimate()
        wrong = self._contradiction or status.problem
        level = max(self._level, DiagnosticStatus.WARN if wrong else DiagnosticStatus.OK)
        if estimate is None:
            level, words = DiagnosticStatus.WARN, wrong or "waiting for messages"
        else:
            words = wrong or estimate.summary
        own = _diagnostic("status", level, words)
        facts = {
            "running": status.is_running,
            "payload_held": status.is_payload_held,
            "topics": ", ".join(status.topics or self._inputs.topics),
            "messages": status.messages,
            "samples": status.samples,
            "delay_s": status.delay_s,
            "cutoff_hz": status.cutoff_hz,
            "restarts": status.restarts,
        }
        if estimate is not None:
            facts |= {
                "windows": estimate.windows,
                "payload_changes": estimate.payload_changes,
                "payload_std_devs": _listed(estimate.std_devs),
            }
        contact = self._session.contact_wrench()
        if contact is not None:
            facts |= {
                "contact_frame": contact.frame,
                "contact_latency_s": contact.latency_s,
                "contact_std_devs": _listed(contact.wrench.std_devs),
                "contact_or_payload_change": contact.wrench.is_changing,
            }
        own.values = [KeyValue(key=key, value=str(value)) for key, value in facts.items()]
        return own

    def _of_inputs(self) -> list[DiagnosticStatus]:
        """Returns what the middleware reports of the topics."""
        lost = [
            _diagnostic(f"{topic}: lost", DiagnosticStatus.WARN, f"{count} messages were lost.")
            for topic, count in self._inputs.lost.items()
        ]
        incompatible = "A publisher offers another quality of service than the node requests."
        unfit = [
            _diagnostic(f"{topic}: incompatible_qos", DiagnosticStatus.ERROR, incompatible)
            for topic in sorted(self._inputs.incompatible)
        ]
        unknown = [
            _diagnostic(
                f"{topic}: unknown_type", DiagnosticStatus.WARN, "Its type is not installed."
            )
            for topic in sorted(self._inputs.unknown)
        ]
        return [*lost, *unfit, *unknown]

    def _on_reset(self, _: Any, response: Any) -> Any:
        self._session.reset()
        self._contradiction, self._level = None, DiagnosticStatus.OK
        response.success, response.message = True, "begins again with the next message"
        return response

    def _on_save(self, _: Any, response: Any) -> Any:
        path = Path(str(self.get_parameter("save_to").value))

        def save() -> None:
            estimate = self._session.estimate()
            if estimate is None:
                raise TactidError("nothing is identified yet")
            write_atomically(path, self._document(estimate))

        return _answer(response, save, f"wrote {path.absolute()}")

    def _on_tare(self, _: Any, response: Any) -> Any:
        done = "the zero of the sensor is determined anew"
        return _answer(response, self._session.tare, done)

    def _on_hold(self, request: Any, response: Any) -> Any:
        done = "what the payload does not explain is a contact" if request.data else "identifies"
        return _answer(response, lambda: self._session.hold_payload(request.data), done)

    def _document(self, estimate: PayloadEstimate) -> str:
        """Returns the estimate as JSON, which the option ``known_tool`` reads."""
        findings, _ = self._session.notices()
        document = {
            "schema": "tactid.live/1",
            "is_contradicted": any(finding.contradicts_result for finding in findings),
            "estimate": {
                "frame": estimate.frame,
                "values": nested(estimate.reported_values),
                "std_devs": nested(estimate.std_devs.tolist()),
                "windows": estimate.windows,
            },
            "findings": [str(finding) for finding in findings],
        }
        return json.dumps(document, indent=2, ensure_ascii=False) + "\n"


def run(
    given: Options,
    read: Callable[[Mapping[str, Any]], Options],
    ros_arguments: Sequence[str],
) -> None:
    """Runs the node until it is shut down or interrupted.

    Args:
        given: The options that the command line gives.
        read: Turns parameters into options, where these are written as on the command line.
        ros_arguments: Arguments for ROS, from ``--ros-args`` on.
    """
    rclpy.init(args=["tactid", *ros_arguments], signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = LiveNode(given, read)
        executor = SingleThreadedExecutor()
        try:
            node.run(executor)
        except ExternalShutdownException:
            pass
        finally:
            executor.shutdown()
            node.destroy_node()
    finally:
        rclpy.try_shutdown()


def _named_topics(options: Options) -> dict[str, list[str]]:
    """Returns the topics that options name, by the option."""
    named = {}
    for option in MEASURED:
        given = getattr(options, option)
        if given is not None:
            named[option] = [given] if isinstance(given, str) else list(given)
    return named


def _diagnostic(name: str, level: bytes, words: object) -> DiagnosticStatus:
    return DiagnosticStatus(level=level, name=f"tactid: {name}", message=str(words))


def _answer(response: Any, act: Callable[[], None], done: str) -> Any:
    """Returns the response of a service that acts, with what is then done or what is wrong."""
    try:
        act()
    except (TactidError, OSError) as error:
        response.success, response.message = False, str(error)
    else:
        response.success, response.message = True, done
    return response


def _listed(numbers: Iterable[float]) -> str:
    return ", ".join(f"{number:.3g}" for number in numbers)


def _wrench(contact: LiveContact) -> WrenchStamped:
    message = WrenchStamped()
    message.header.stamp = _stamp(contact.time_ns)
    message.header.frame_id = contact.frame
    x, y, z, *moment = contact.wrench.values.tolist()
    message.wrench.force = Vector3(x=x, y=y, z=z)
    x, y, z = moment
    message.wrench.torque = Vector3(x=x, y=y, z=z)
    return message


def _stamp(time_ns: int) -> Any:
    return Time(nanoseconds=max(time_ns, 0)).to_msg()
