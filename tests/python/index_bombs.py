"""Small logs whose index would take much time or memory."""

import sqlite3
import struct
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
import zstandard

from mcap_records import BEGIN, MAGIC, packed, record, text

MEGABYTE = 1 << 20

DEFINED = record(0x03, struct.pack("<H", 1) + text(b"std_msgs/msg/Float64") + 2 * text(b""))
DEFINED += record(0x04, struct.pack("<HH", 1, 1) + text(b"/t") + text(b"cdr") + text(b""))
"""A schema and a channel."""


def chunk_index(first: int, at: int, index_at: int) -> bytes:
    """An entry of an index: a chunk of ten bytes, and the index of its messages."""
    times = struct.pack("<QQQQ", first, 50, at, 10)
    return record(0x08, times + text(struct.pack("<HQ", 1, index_at)) + bytes(8 + 4 + 16))


def end(summary_at: int, messages: int, chunks: int, metadata: int) -> bytes:
    """The statistics and the footer of a log."""
    numbers = struct.pack("<QHIIIIQQ", messages, 1, 1, 0, metadata, chunks, 0, 0)
    statistics = record(0x0B, numbers + text(struct.pack("<HQ", 1, messages)))
    return statistics + record(0x02, struct.pack("<QQI", summary_at, 0, 0)) + MAGIC


def one_chunk(folder: Path) -> Path:
    """An index that names the same chunk 200 times, whose record has 200 MB after its messages."""
    at, size, count = len(BEGIN), 200 * MEGABYTE, 200
    parts = [record(0x05, struct.pack("<HIQQ", 1, 0, t, t) + bytes(12)) for t in (5, 50)]
    content = b"".join(parts)
    head = struct.pack("<QQQI", 0, 100, len(content), 0) + text(b"")
    body = head + struct.pack("<Q", len(content)) + content
    begin = b"\x06" + struct.pack("<Q", len(body) + size) + body
    times = record(0x07, struct.pack("<H", 1) + text(struct.pack("<QQQQ", 5, 0, 50, 40)))
    index_at = at + len(begin) + size
    summary = DEFINED + count * chunk_index(5, at, index_at)
    summary += end(index_at + len(times), 2 * count, count, 0)
    filling = 200 * [bytes(MEGABYTE)]
    return compressed(folder / "one_chunk.mcap.zstd", [BEGIN, begin, *filling, times, summary])


def metadata(folder: Path) -> Path:
    """An index of four records of metadata, of 200 MB each."""
    parts, entries, at = [BEGIN], b"", len(BEGIN)
    size = 200 * MEGABYTE
    for k in range(4):
        name = text(b"m%d" % k)
        head = name + struct.pack("<I", size + 9) + text(b"k") + struct.pack("<I", size)
        begin = b"\x0c" + struct.pack("<Q", len(head) + size) + head
        parts += [begin, *(200 * [bytes(MEGABYTE)])]
        entries += record(0x0D, struct.pack("<QQ", at, 9) + name)
        at += len(begin) + size
    parts.append(DEFINED + entries + end(at, 0, 0, 4))
    return compressed(folder / "metadata.mcap.zstd", parts)


def pairs(folder: Path) -> Path:
    """Metadata of five million pairs of texts, each of which needs more memory than its bytes."""
    numbers = np.arange(5_000_000, dtype="<u4")
    # Seven bits a byte, so that each text is one of ASCII.
    keys = sum(((numbers >> 7 * k) & 127) << 8 * k for k in range(4))
    content = np.zeros(len(numbers), dtype=[("length", "<u4"), ("key", "<u4"), ("value", "<u4")])
    content["length"], content["key"] = 4, keys
    body = text(b"m") + text(content.tobytes())
    return compressed(folder / "pairs.mcap.zstd", [BEGIN, record(0x0C, body)])


def chunk_indices(folder: Path) -> Path:
    """An index of three million chunks."""
    at, count = len(BEGIN), 3_000_000
    times = record(0x07, struct.pack("<H", 1) + text(struct.pack("<QQ", 5, 0)))
    entries = (count // 1000) * [1000 * chunk_index(5, 9, at)]
    parts = [BEGIN, times, DEFINED, *entries, end(at + len(times), count, count, 0)]
    return compressed(folder / "chunk_indices.mcap.zstd", parts)


def small_chunks(folder: Path) -> Path:
    """Eight million chunks of 80 bytes without an index."""
    message = record(0x05, struct.pack("<HIQQ", 1, 0, 5, 5))
    head = struct.pack("<QQQI", 0, 9, len(message), 0) + text(b"")
    chunk = record(0x06, head + struct.pack("<Q", len(message)) + message)
    parts = [BEGIN, DEFINED, *(8000 * [1000 * chunk])]
    return compressed(folder / "small_chunks.mcap.zstd", parts)


def topic_names(folder: Path) -> Path:
    """An SQLite bag with four topics, whose names have 200 MB each."""
    database, path = folder / "names.db3", folder / "names.db3.zstd"
    bag = create(database)
    for k in range(4):
        name = f"CAST(zeroblob({200 * MEGABYTE}) AS TEXT)"
        bag.execute(f"INSERT INTO topics VALUES ({k}, {name}, 'std_msgs/msg/Float64', 'cdr')")
    bag.commit()
    bag.close()
    with database.open("rb") as content, path.open("wb") as file:
        zstandard.ZstdCompressor().copy_stream(content, file)
    database.unlink()
    return path


def long_name(folder: Path) -> Path:
    """A log whose only topic has a name of 50 MB of escapes, in some kB."""
    schema = record(0x03, struct.pack("<H", 1) + text(b"std_msgs/msg/Float64") + 2 * text(b""))
    name = text(b"\x1b" * (50 * MEGABYTE))
    channel = record(0x04, struct.pack("<HH", 1, 1) + name + text(b"cdr") + text(b""))
    message = record(0x05, struct.pack("<HIQQ", 1, 0, 5, 5) + bytes(12))
    return compressed(folder / "name.mcap.zstd", [BEGIN, schema, channel, message])


def long_sqlite_name(folder: Path) -> Path:
    """An SQLite bag with a topic whose name has 5 MB that are no UTF-8."""
    path = folder / "name.db3"
    bag = create(path)
    name = b"\xff" * (5 * MEGABYTE)
    bag.execute(
        "INSERT INTO topics VALUES (1, CAST(? AS TEXT), 'std_msgs/msg/Float64', 'cdr')", (name,)
    )
    bag.commit()
    bag.close()
    return path


def equal_times(folder: Path) -> Path:
    """An SQLite bag of 300 000 messages of one time, with an index of times and another column."""
    path = folder / "times.db3"
    bag = create(path)
    bag.execute("CREATE INDEX times ON messages (timestamp, data)")
    bag.execute("INSERT INTO topics VALUES (1, '/t', 'std_msgs/msg/Float64', 'cdr')")
    numbers = "WITH RECURSIVE n(k) AS (SELECT 1 UNION ALL SELECT k + 1 FROM n WHERE k < 300000)"
    bag.execute(f"{numbers} INSERT INTO messages SELECT 1, 1, x'00' FROM n")
    bag.commit()
    bag.close()
    return path


def create(path: Path) -> sqlite3.Connection:
    """Creates an empty SQLite bag."""
    bag = sqlite3.connect(path)
    bag.execute("CREATE TABLE topics (id, name, type, serialization_format)")
    bag.execute("CREATE TABLE messages (topic_id, timestamp, data)")
    return bag


def compressed(path: Path, parts: Iterable[bytes]) -> Path:
    """Writes a file that is compressed as a whole."""
    path.write_bytes(packed(parts))
    return path


INDICES: dict[str, Callable[[Path], Path]] = {
    "200 entries for one chunk of 200 MB": one_chunk,
    "800 MB of metadata in an index": metadata,
    "5 million pairs of metadata": pairs,
    "3 million chunks in an index": chunk_indices,
    "8 million chunks without an index": small_chunks,
    "800 MB of names of SQLite": topic_names,
    "a topic with a name of 50 MB": long_name,
    "a topic of SQLite with a name of 5 MB": long_sqlite_name,
    "300 000 messages of one time": equal_times,
}
"""What writes each log."""
