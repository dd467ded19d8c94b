"""An MCAP file in a store, of which only what is needed is read."""

import tempfile
from bisect import bisect_right
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

Range = tuple[int, int]
"""First byte, and the byte after the last one."""

BLOCK = 1 << 15
"""Bytes that are read at least."""

MOST_TAIL = 1 << 18
"""Bytes at the end that are read at once: the summary of a recording of hours."""

TAIL = 256
"""Bytes of a recording for each byte of its end that is read at once."""

WHOLE = 1 << 21
"""Bytes of a recording that is read by one request: a further one takes as long."""

MOST_BLOCK = 1 << 23
"""Bytes that are read at once where reads follow each other, as in a file without index."""

READ_AHEAD = 1 << 13
"""Bytes that the reader asks for at least, whether they are needed or not."""

AHEAD = 1 << 25
"""Announced bytes that are fetched together."""

OVERHEAD = 0.05
"""Fraction of what is needed by which gaps are read, too, so that requests become fewer."""

MOST_OVERHEAD = 0.19
"""The same fraction, with what else was read, where there are more than :data:`FEW` requests."""

FEW = 9
"""Requests of a recording that are few."""

AT_ONCE = 4
"""Requests at once."""

MOST_KEPT = 1 << 31
"""Bytes that are kept on the disk, because a recording is read more than once."""


class Ranges:
    """Bytes of an object, as the native reader asks for them.

    What was read is kept in a temporary file, which ends with this object.
    """

    def __init__(self, path: str, size: int, fetch: Callable[[int, int], bytes]) -> None:
        self.path = path
        """Address, by which errors name the recording."""
        self.failure: Exception | None = None
        """The error of the store that has ended the reading."""
        self.requests, self.bytes_read = 0, 0
        self._size, self._fetch = size, fetch
        self._kept: list[Range] = []
        self._announced: list[Range] = []
        self._block = BLOCK
        tail = size if size <= WHOLE else min(max(size // TAIL, BLOCK), MOST_TAIL)
        self._tail = size - tail
        self._file = tempfile.TemporaryFile(prefix="tactid-")  # noqa: SIM115 - until `close`

    def close(self) -> None:
        """Removes what is kept."""
        self._file.close()

    def length(self) -> int:
        """Returns the number of bytes of the object."""
        return self._size

    def announce(self, ranges: Sequence[Range]) -> None:
        """Takes note of ranges that are read next, in this order."""
        self._announced = list(ranges)

    def read(self, at_byte: int, length: int) -> bytes:
        """Returns bytes from an offset on, fewer at the end of the object."""
        end = min(at_byte + length, self._size)
        if self._missing((at_byte, end)):
            if self.failure is not None:
                raise self.failure  # the native reader asks again and again
            try:
                self._fetch_all(self._needed((at_byte, end)))
            except Exception as error:
                self.failure = error
                raise
        self._file.seek(at_byte)
        return self._file.read(end - at_byte)

    def _needed(self, asked: Range) -> list[Range]:
        """Returns what to fetch for a range: what was announced after it, too."""
        start, end = asked
        place = next((k for k, (a, b) in enumerate(self._announced) if a <= start < b), None)
        if place is None:
            self._block = min(2 * self._block, MOST_BLOCK) if self._follows(start) else BLOCK
            if start >= self._tail:
                return [(self._tail, self._size)]
            if self._missing(asked)[-1][1] < end:  # it ends in what is kept: it is read backwards
                start = max(start - self._block, 0)
            return [(start, max(end, start + self._block))]
        chosen, total = [asked], 0
        for a, b in self._announced[place:]:
            if total + b - a > AHEAD:
                break
            chosen.append((a, max(b, a + READ_AHEAD)))
            total += b - a
        return chosen

    def _follows(self, start: int) -> bool:
        """Returns whether a range begins where what is kept ends."""
        place = bisect_right(self._kept, (start, self._size))
        return place > 0 and self._kept[place - 1][1] >= start

    def _fetch_all(self, needed: list[Range]) -> None:
        requests = self._requests(needed)
        if sum(end - start for start, end in [*self._kept, *requests]) > MOST_KEPT:
            self._kept = []
            self._file.truncate(0)
            requests = self._requests(needed)
        with ThreadPoolExecutor(AT_ONCE) as threads:
            bodies = threads.map(lambda each: self._fetch(*each), requests)
            for (start, end), body in zip(requests, bodies, strict=True):
                self._file.seek(start)
                self._file.write(body)
                self._kept = joined([*self._kept, (start, end)])
                self.requests += 1
                self.bytes_read += len(body)

    def _requests(self, needed: list[Range]) -> list[Range]:
        """Returns what to fetch for some ranges: what is missing of them, by few requests."""
        cut = ((start, min(end, self._size)) for start, end in joined(needed))
        parts = [part for each in cut for part in self._missing(each)]
        return coalesced(parts, max(FEW - self.requests, 1), self.bytes_read)

    def _missing(self, asked: Range) -> list[Range]:
        """Returns the parts of a range that are not kept."""
        start, end = asked
        found = []
        for a, b in self._kept:
            if b <= start or a >= end:
                continue
            if a > start:
                found.append((start, a))
            start = max(start, b)
        return [*found, (start, end)] if start < end else found


def joined(ranges: Sequence[Range]) -> list[Range]:
    """Returns ranges in order, as one where they touch or overlap."""
    found: list[Range] = []
    for start, end in sorted(ranges):
        if found and start <= found[-1][1]:
            found[-1] = (found[-1][0], max(end, found[-1][1]))
        else:
            found.append((start, end))
    return found


def coalesced(ranges: Sequence[Range], few: int = FEW, spent: int = 0) -> list[Range]:
    """Returns fewer ranges that contain all: the smallest gaps are read, too.

    Their bytes together are at most :data:`OVERHEAD` of those of the ranges; and, while there are
    more ranges than ``few``, at most :data:`MOST_OVERHEAD`, less those that were ``spent``.
    """
    parts = joined(ranges)
    total, read = sum(end - start for start, end in parts), 0
    gaps = sorted((b[0] - a[1], a[1], b[0]) for a, b in pairwise(parts))
    for count, (gap, start, end) in zip(range(len(parts), 0, -1), gaps, strict=False):
        read += gap
        if read > OVERHEAD * total and (count <= few or read + spent > MOST_OVERHEAD * total):
            break
        parts.append((start, end))
    return joined(parts)
