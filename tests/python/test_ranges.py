"""A log that an object in Python reads by ranges."""

from pathlib import Path

import pytest

import tactid
from tactid import _native


class Bytes:
    """The bytes of a log, with what was asked for."""

    def __init__(self, content: bytes, error: Exception | None = None) -> None:
        self.path = "store://bucket/run.mcap"
        self.content, self.error = content, error
        self.announced: list[tuple[int, int]] = []

    def length(self) -> int:
        return len(self.content)

    def read(self, at_byte: int, length: int) -> bytes:
        if self.error is not None:
            raise self.error
        return self.content[at_byte : at_byte + length]

    def announce(self, ranges: list[tuple[int, int]]) -> None:
        self.announced += ranges


def test_a_log_by_ranges_has_the_result_of_its_file(log: Path) -> None:
    given = Bytes(log.read_bytes())
    by_ranges = _native.identify_log(given, {})
    of_file = _native.identify_log(log, {})
    assert by_ranges["estimate"].values.tolist() == of_file["estimate"].values.tolist()
    assert given.announced


def test_an_error_of_the_object_names_the_log(log: Path) -> None:
    given = Bytes(log.read_bytes(), OSError("the store is gone"))
    with pytest.raises(tactid.LogError, match=r"store://bucket/run\.mcap.*the store is gone"):
        _native.identify_log(given, {})
