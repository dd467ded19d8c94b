"""Records of MCAP files, written one by one: also those that no writer writes."""

import struct
from collections.abc import Iterable

import zstandard


def record(opcode: int, body: bytes) -> bytes:
    """A record of an MCAP file."""
    return bytes([opcode]) + struct.pack("<Q", len(body)) + body


def text(content: bytes) -> bytes:
    """A text or a map in a record: its length, then its bytes."""
    return struct.pack("<I", len(content)) + content


def packed(parts: Iterable[bytes], level: int = 3) -> bytes:
    """Compressed bytes, whose parts are not in memory at once."""
    compressor = zstandard.ZstdCompressor(level).compressobj()
    return b"".join(map(compressor.compress, parts)) + compressor.flush()


def chunk(parts: list[bytes], level: int = 3) -> bytes:
    """A compressed chunk of an MCAP file."""
    content = packed(parts, level)
    head = struct.pack("<QQQI", 0, 2**63, sum(map(len, parts)), 0) + text(b"zstd")
    return record(0x06, head + struct.pack("<Q", len(content)) + content)


MAGIC = b"\x89MCAP0\r\n"
BEGIN = MAGIC + record(0x01, text(b"ros2") + text(b""))
