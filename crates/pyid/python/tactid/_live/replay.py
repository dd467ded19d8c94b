"""Recordings that are played as a robot would publish them."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

from tactid import _native
from tactid._live.session import Message

BATCH_S = 0.02
"""Time of logging of the messages that are played at once, s."""

READ = 2000
"""Number of messages that are read at once."""


def played(log: Path, rate: float | None) -> Iterator[list[Message]]:
    """Yields the messages of a log in batches, in the order of their times of logging.

    Args:
        log: The folder of a rosbag2 bag, or an ``.mcap`` or ``.db3`` file.
        rate: Speed relative to that of the recording; None for as fast as possible.

    Raises:
        LogError: There is no log that can be read.
    """
    begun: tuple[float, int] | None = None
    for batch in _batches(log):
        first_ns = batch[0][3]
        if rate is not None:
            begun = begun or (time.monotonic(), first_ns)
            ahead = (first_ns - begun[1]) * 1e-9 / rate - (time.monotonic() - begun[0])
            # The description of the robot may have been published long before.
            time.sleep(min(max(ahead, 0.0), 1.0))
        yield batch


def _batches(log: Path) -> Iterator[list[Message]]:
    messages = _native.LogMessages(log)
    batch: list[Message] = []
    while read := messages.read(READ):
        for message in read:
            if batch and message[3] - batch[0][3] > BATCH_S * 1e9:
                yield batch
                batch = []
            batch.append(message)
    if batch:
        yield batch
