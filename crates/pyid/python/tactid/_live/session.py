"""A live session: messages in, the payload and what was noticed at any time."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

from tactid import _native
from tactid._api.online import WrenchEstimate
from tactid._base.findings import DataFault, Finding
from tactid._options.options import Options
from tactid._results.payload import PayloadEstimate
from tactid._results.records import LiveStatus, WrenchOffset

Message: TypeAlias = tuple[str, str, bytes, int]
"""Topic, type, data as CDR, and time of arrival in ns since the epoch of a message."""


@dataclass(frozen=True)
class LiveContact:
    """The wrench of a contact."""

    time_ns: int
    """Time to which it belongs on the clock of the messages, ns since the epoch."""
    frame: str
    """The link about whose origin and along whose axes it is."""
    latency_s: float
    """Time by which it lags the last sample, s."""
    wrench: WrenchEstimate
    """The wrench with its uncertainty."""


class Session:
    """Identifies a payload from messages while they come.

    What the options leave open is chosen from the first seconds, as for a recording, and once more
    from 30 s.

    Args:
        options: The options of the identification.
        in_background: Whether what is left open is chosen in another thread, while
            :meth:`push` returns at once. Results then depend on how fast the machine is.
        contact_frame: The link about whose origin and along whose axes the wrench of a contact is;
            it moves with the tip. Default: that of the sensor, or the tip where there are several.
    """

    def __init__(
        self, options: Options, *, in_background: bool, contact_frame: str | None = None
    ) -> None:
        self._native = _native.LiveSession(options.plain(), in_background, contact_frame)

    def announce(self, topics: Sequence[tuple[str, str]]) -> None:
        """Notes that there are topics, each with its type: one that is not used is reported."""
        self._native.announce(topics)

    def push(self, messages: Sequence[Message]) -> None:
        """Takes messages in the order in which they came.

        It also takes over what another thread has chosen: call it without messages, too.
        """
        self._native.push(messages)

    def finish(self) -> None:
        """Completes a session without further messages.

        Raises:
            TactidError: No identification could begin.
        """
        self._native.finish()

    def reset(self) -> None:
        """Forgets what was identified, and begins again with the next message."""
        self._native.reset()

    def estimate(self) -> PayloadEstimate | None:
        """Returns the payload as known now; None before an identification runs."""
        estimate = self._native.estimate()
        return None if estimate is None else PayloadEstimate(**estimate)

    def wrench_offset(self) -> WrenchOffset | None:
        """Returns the offset of the wrenches; None where it is not an unknown."""
        offset = self._native.wrench_offset()
        return None if offset is None else WrenchOffset(**offset)

    def contact_wrench(self) -> LiveContact | None:
        """Returns the wrench of a contact as of the last sample: measured less offset and load.

        None stands before the motion has determined mass, centre of mass and offset.
        """
        found = self._native.contact_wrench()
        if found is None:
            return None
        time_ns, frame, latency_s, wrench = found
        return LiveContact(time_ns, frame, latency_s, WrenchEstimate(*wrench))

    def payload_changes(self) -> int:
        """Returns the number of payload changes since the identification began."""
        return self._native.payload_changes()

    def tare(self) -> None:
        """Sets the zero of the wrench sensor; see :meth:`tactid.Identifier.tare`.

        Raises:
            TactidError: The payload is not known yet, or is held.
            ArgumentError: The option ``wrench_offset`` does not make the zero an unknown.
        """
        self._native.tare()

    def hold_payload(self, is_held: bool) -> None:
        """Holds the payload or ends that; see :meth:`tactid.Identifier.hold_payload`.

        A session that starts again, by itself or by :meth:`reset`, holds nothing.

        Raises:
            TactidError: The payload that is to be held is not known yet.
        """
        self._native.hold_payload(is_held)

    def status(self) -> LiveStatus:
        """Returns what the session does at the moment."""
        return LiveStatus(**self._native.status())

    def notices(self, now_ns: int | None = None) -> tuple[list[Finding], list[DataFault]]:
        """Returns findings, the gravest first, and faults of messages; it takes some 20 ms.

        Args:
            now_ns: Time at which topics are asked for messages, ns since the epoch: now by default.
        """
        findings, faults = self._native.notices(time.time_ns() if now_ns is None else now_ns)
        return sorted(findings, key=lambda finding: finding.rank), faults
