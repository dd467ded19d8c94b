"""Small inputs that would take much time or memory, and what each costs.

``python tests/python/bombs.py`` runs a command on each of them, and prints a table: the exit code,
wall and processor time, and the largest memory of the process. Exit code, processor time and memory
are tested (``test_bombs.py``), and a command that takes longer than a minute is killed.
"""

import sqlite3
import struct
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import zstandard
from mcap.writer import CompressionType, Writer
from rich.console import Console
from rich.table import Table

import recorded_arm
import tactid
from commands import CommandServer, Done
from index_bombs import INDICES
from mcap_records import BEGIN, MAGIC, chunk, packed, record, text
from sqlite_bombs import DATABASES

MEGABYTE = 1 << 20

LIMIT_MB = 512.0
"""Memory that no input may make a process take, MB."""

DEADLINE_S = 60.0
"""Time after which a command is killed, s."""

FLOAT = ("std_msgs/msg/Float64", b"float64 data\n")
TEXT = ("std_msgs/msg/String", b"string data\n")


def text_channel() -> bytes:
    """The first records of a log whose only topic has texts."""
    named = struct.pack("<H", 1) + text(TEXT[0].encode()) + text(b"ros2msg") + text(TEXT[1])
    channel = struct.pack("<HH", 1, 1) + text(b"/text") + text(b"cdr") + text(b"")
    return BEGIN + record(0x03, named) + record(0x04, channel)


def long_text(size_mb: int, stamp: int) -> list[bytes]:
    """A message of a long text, in parts."""
    size = size_mb * MEGABYTE
    head = struct.pack("<HIQQ", 1, 0, stamp, stamp)
    content = b"\0\1\0\0" + struct.pack("<I", size)
    begin = b"\x05" + struct.pack("<Q", len(head + content) + size) + head + content
    return [begin, *(size_mb * [bytes(MEGABYTE)])]


def chunks(folder: Path) -> Path:
    """Twenty chunks of 100 MB in some kB, each of which overlaps all others in time."""
    path = folder / "chunks.mcap"
    with path.open("wb") as file:
        file.write(text_channel())
        for number in range(20):
            file.write(chunk(long_text(50, number) + long_text(50, 100 + number)))
    return path


def window(folder: Path) -> Path:
    """A chunk of 250 MB that is decompressed with a window of 128 MB."""
    path = folder / "window.mcap"
    path.write_bytes(text_channel() + chunk(long_text(250, 0), level=22))
    return path


def channels(folder: Path) -> Path:
    """As many topics as the format can number."""
    path = folder / "channels.mcap"
    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType.ZSTD)
        writer.start("ros2", "")
        content = b"\0\1\0\0" + struct.pack("<d", 1.0)
        number = writer.register_schema(*schema(FLOAT))
        states = writer.register_schema("sensor_msgs/msg/JointState", "ros2msg", b"")
        empty = b"\0\1\0\0" + bytes(8) + struct.pack("<I", 1) + bytes(4 + 4 * 4)
        for k in range(65_535):
            is_state = k == 60_000
            channel = writer.register_channel(f"/topic_{k}", "cdr", states if is_state else number)
            writer.add_message(channel, k, empty if is_state else content, k)
        writer.finish()
    return path


def metadata(folder: Path) -> Path:
    """Eight chunks with a metadata record of 200 MB each, in some kB."""
    path = folder / "metadata.mcap"
    size = 200 * MEGABYTE
    key = struct.pack("<I", size + 9) + text(b"k") + struct.pack("<I", size)
    begin = b"\x0c" + struct.pack("<Q", len(text(b"0") + key) + size) + text(b"0") + key
    path.write_bytes(BEGIN + 8 * chunk([begin, *(200 * [bytes(MEGABYTE)])]))
    return path


def index(folder: Path) -> Path:
    """An index of 20 000 chunks that names the same message index of 8 MB for each."""
    path = folder / "index.mcap"
    count = 20_000
    times = struct.pack("<QQ", 2**62, 0) * (MEGABYTE // 2)
    data = BEGIN + record(0x07, struct.pack("<H", 1) + text(times))
    summary = record(0x03, struct.pack("<H", 1) + text(FLOAT[0].encode()) + text(b"") + text(b""))
    summary += record(0x04, struct.pack("<HH", 1, 1) + text(b"/t") + text(b"cdr") + text(b""))
    entry = struct.pack("<QQQQ", 0, 2**63, 9, 9) + text(struct.pack("<HQ", 1, len(BEGIN)))
    summary += count * record(0x08, entry + bytes(8) + text(b"zstd") + bytes(16))
    numbers = struct.pack("<QHIIIIQQ", count, 1, 1, 0, 0, count, 0, 0)
    summary += record(0x0B, numbers + text(struct.pack("<HQ", 1, count)))
    footer = record(0x02, struct.pack("<QQI", len(data), 0, 0))
    path.write_bytes(data + summary + footer + MAGIC)
    return path


def messages(folder: Path) -> Path:
    """A chunk of 5.5 million messages without content, whose headers need more than their bytes."""
    path = folder / "messages.mcap"
    named = struct.pack("<H", 1) + text(FLOAT[0].encode()) + text(b"ros2msg") + text(FLOAT[1])
    channel = struct.pack("<HH", 1, 1) + text(b"/t") + text(b"cdr") + text(b"")
    begin = record(0x03, named) + record(0x04, channel)
    empty = 5500 * record(0x05, struct.pack("<HIQQ", 1, 0, 1, 1))
    path.write_bytes(BEGIN + chunk([begin, *(1000 * [empty])]))
    return path


def message(folder: Path) -> Path:
    """A message of 250 MB that is compressed to some kB."""
    path = folder / "message.mcap"
    begin = b"\0\1\0\0" + struct.pack("<I", 250 * MEGABYTE)
    content = packed([begin, *(250 * [bytes(MEGABYTE)])])
    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType.NONE)
        writer.start("ros2", "")
        number = writer.register_schema(*schema(TEXT))
        channel = writer.register_channel("/robot_description", "cdr", number)
        writer.add_message(channel, 1, content, 1)
        states = writer.register_schema("sensor_msgs/msg/JointState", "ros2msg", b"")
        writer.add_message(writer.register_channel("/joint_states", "cdr", states), 1, b"", 1)
        writer.finish()
    return path


def value(folder: Path) -> Path:
    """A compressed SQLite bag of some hundred kB with one message of 250 MB."""
    path = folder / "value.db3.zstd"
    database = folder / "value.db3"
    with sqlite3.connect(database) as bag:
        bag.execute("CREATE TABLE topics (id, name, type, serialization_format)")
        bag.execute("CREATE TABLE messages (topic_id, timestamp, data)")
        bag.execute(f"INSERT INTO topics VALUES (1, '/text', '{TEXT[0]}', 'cdr')")
        bag.execute(f"INSERT INTO messages VALUES (1, 1, zeroblob({250 * MEGABYTE}))")
    bag.close()
    with database.open("rb") as content, path.open("wb") as file:
        zstandard.ZstdCompressor().copy_stream(content, file)
    database.unlink()
    return path


def listed(folder: Path) -> Path:
    """The folder of a bag whose metadata.yaml has a hole of 1 GB."""
    path = folder / "listed"
    path.mkdir()
    with (path / "metadata.yaml").open("wb") as file:
        file.truncate(1 << 30)
    return path


def nested(folder: Path) -> Path:
    """The folder of a bag whose metadata.yaml nests 100 000 lists."""
    path = folder / "nested"
    path.mkdir()
    text = f"rosbag2_bagfile_information: {'[' * 100_000}{']' * 100_000}\n"
    (path / "metadata.yaml").write_text(text)
    return path


def schema(of: tuple[str, bytes]) -> tuple[str, str, bytes]:
    """The arguments with which a schema is registered."""
    return of[0], "ros2msg", of[1]


def bag(folder: Path) -> Path:
    """A compressed SQLite file of 8 GB in some hundred kB, which is no database."""
    path = folder / "bag.db3.zstd"
    compressor = zstandard.ZstdCompressor()
    with path.open("wb") as file, compressor.stream_writer(file) as writer:
        writer.write(b"SQLite format 3\0")
        zeros = bytes(16 * MEGABYTE)
        for _ in range(512):
            writer.write(zeros)
    return path


def robot(count: int, kind: str, parent: Callable[[int], int], shapes: int = 1) -> str:
    """A robot of links that joints of one kind join, each with some boxes."""
    box = "<visual><geometry><box size='1 1 1'/></geometry></visual>" * shapes
    limit = "<limit effort='1' velocity='1' lower='-1' upper='1'/>"
    links = "".join(f"<link name='l{k}'>{box}</link>" for k in range(count))
    joints = "".join(
        f"<joint name='j{k}' type='{kind}'><parent link='l{parent(k)}'/><child link='l{k}'/>"
        f"<origin xyz='0.1 0 0'/><axis xyz='0 0 1'/>{limit}</joint>"
        for k in range(1, count)
    )
    return f"<robot name='many'>{links}{joints}</robot>"


@dataclass(frozen=True)
class Mesh:
    """A mesh that a URDF names, and its scale."""

    name: str
    scale: float = 1.0


def meshed(meshes: Sequence[Mesh]) -> str:
    """An arm, a link of which has the shapes of meshes."""
    shape = "<{0}><geometry><mesh filename='{1.name}' scale='1 1 {1.scale}'/></geometry></{0}>"
    shapes = "".join(shape.format(tag, mesh) for mesh in meshes for tag in ("visual", "collision"))
    link = '<link name="forearm_link">'
    return recorded_arm.ur5e().replace(link, link + shapes)


def hole(folder: Path) -> list[Mesh]:
    """A mesh with a hole of 1 GB."""
    with (folder / "hole.stl").open("wb") as file:
        file.truncate(1 << 30)
    return [Mesh("hole.stl")]


def sphere(count: int) -> np.ndarray:
    """Points on a sphere, all of which are corners of their hull."""
    points = np.random.default_rng(1).normal(size=(count, 3))
    return 0.05 * points / np.linalg.norm(points, axis=1, keepdims=True)


def large_meshes(folder: Path) -> list[Mesh]:
    """A round mesh of 60 MB under sixty names."""
    triangles = np.zeros(
        1_200_000, dtype=[("normal", "<f4", 3), ("corners", "<f4", 9), ("", "<u2")]
    )
    triangles["corners"] = sphere(3 * len(triangles)).reshape(-1, 9)
    with (folder / "round.stl").open("wb") as file:
        file.write(bytes(80) + struct.pack("<I", len(triangles)) + triangles.tobytes())
    names = [f"round_{k}.stl" for k in range(60)]
    for name in names:
        (folder / name).hardlink_to(folder / "round.stl")
    return [Mesh(name) for name in names]


def small_meshes(folder: Path) -> list[Mesh]:
    """A round mesh of 1 MB at 160 scales."""
    lines = [f"v {x:.4f} {y:.4f} {z:.4f}\n" for x, y, z in sphere(40_000)]
    (folder / "small.obj").write_text("".join(lines))
    return [Mesh("small.obj", 1 + 1e-3 * k) for k in range(160)]


def objects(folder: Path) -> list[Mesh]:
    """A mesh of 60 MB with as many objects as fit."""
    (folder / "objects.obj").write_bytes(6_000_000 * b"o\nv 0 0 0\n")
    return [Mesh("objects.obj")]


def line_without_end(folder: Path) -> list[Mesh]:
    """A mesh of 60 MB in one line of words."""
    (folder / "line.stl").write_bytes(b"solid x\n" + 30_000_000 * b"a ")
    return [Mesh("line.stl")]


def small_shapes(folder: Path) -> list[Mesh]:
    """A small mesh 2000 times."""
    corners = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\n"
    (folder / "tetrahedron.obj").write_text(corners)
    return 2000 * [Mesh("tetrahedron.obj")]


def missing(_folder: Path) -> list[Mesh]:
    """20 000 meshes that no package has, and one with a name of a megabyte."""
    missing = [Mesh(f"package://arm/{k}.stl") for k in range(20_000)]
    return [*missing, Mesh(MEGABYTE * "a" + ".stl")]


def of_the_system(folder: Path) -> list[Mesh]:
    """Files of the system without an end, without a size, or that block their reader."""
    names = []
    for k, path in enumerate(("/dev/zero", "/proc/kmsg", "/proc/kallsyms", "/proc/self/mem")):
        names += [f"{path}", f"system_{k}.stl"]
        (folder / names[-1]).symlink_to(path)
    return [Mesh(name) for name in 100 * names]


MESHES: dict[str, Callable[[Path], list[Mesh]]] = {
    "a mesh of 1 GB": hole,
    "a round mesh of 60 MB under 60 names": large_meshes,
    "a round mesh of 1 MB at 160 scales": small_meshes,
    "a mesh of 6 million objects": objects,
    "a mesh of 60 MB in a line": line_without_end,
    "20 000 meshes that are missing": missing,
    "files of the system as meshes": of_the_system,
    "a tetrahedron 2000 times": small_shapes,
}
"""What writes the meshes of a robot, and gives their names."""


ROBOTS: dict[str, Callable[[], str]] = {
    "20 001 fixed links": lambda: robot(20_001, "fixed", lambda k: k - 1),
    "20 001 links without shapes": lambda: robot(20_001, "fixed", lambda _: 0, shapes=0),
    "20 001 joints on one link": lambda: robot(20_001, "revolute", lambda _: 0),
    "3001 joints in a chain": lambda: robot(3001, "revolute", lambda k: k - 1),
    "20 000 boxes on two links": lambda: robot(2, "revolute", lambda _: 0, shapes=10_000),
    "200 000 nested elements": lambda: f"<robot>{'<a>' * 200_000}{'</a>' * 200_000}</robot>",
}


@dataclass(frozen=True)
class Case:
    """A command on one input."""

    name: str
    arguments: list[str]


def cases(folder: Path) -> Iterator[Case]:
    """Writes the inputs, and gives the commands that read them."""
    (folder / "short.toml").write_text("duration_s = 0.5\n")
    log = folder / "short.mcap"
    tactid.simulate(tactid.Experiment.from_toml("duration_s = 0.5\n"), log)
    drawn = ["--save", f"{folder}/drawn.rrd"]
    calibrated = ["--tip", "tool0", "--out", f"{folder}/arm.toml"]
    arm = folder / "arm.urdf"
    arm.write_text(recorded_arm.ur5e())
    for name, path in (
        ("20 chunks of 100 MB that overlap", chunks(folder)),
        ("a chunk of 250 MB, its window 128 MB", window(folder)),
        ("65 535 topics", channels(folder)),
        ("8 GB in a compressed SQLite file", bag(folder)),
        ("1.6 GB of metadata in chunks", metadata(folder)),
        ("20 000 entries for one index of 8 MB", index(folder)),
        ("5.5 million empty messages", messages(folder)),
        ("250 MB in a compressed message", message(folder)),
        ("250 MB in a value of SQLite", value(folder)),
        ("1 GB of metadata.yaml", listed(folder)),
        ("100 000 nested lists in metadata.yaml", nested(folder)),
    ):
        for command in ("info", "identify", "view"):
            yield Case(name, [command, str(path), *(drawn if command == "view" else [])])
        yield Case(name, ["calibrate", "--urdf", str(arm), "--unloaded", str(path), *calibrated])
    assert not INDICES.keys() & DATABASES.keys(), "two bombs have one name"
    for name, write in (INDICES | DATABASES).items():
        path = write(folder)
        for command in ("info", "identify"):
            yield Case(name, [command, str(path)])
        path.unlink()
    named = ["--urdf", str(arm), "--method", "effort", "--joint-topic", "/topic_60000"]
    yield Case("65 535 topics, one by its name", ["identify", f"{folder}/channels.mcap", *named])
    for number, (name, described) in enumerate(ROBOTS.items()):
        urdf = folder / f"robot_{number}.urdf"
        urdf.write_text(described())
        yield Case(name, ["view", str(log), "--urdf", str(urdf), *drawn])
        yield Case(name, ["identify", str(log), "--urdf", str(urdf)])
        motion = ["--from", "0", "--duration", "1", "--payload-mass-max", "3", "--payload-box"]
        box = ["-0.1,-0.1,0,0.1,0.1,0.2", "--out", f"{folder}/motion"]
        yield Case(name, ["excite", "--urdf", str(urdf), "--tip", "l1", *motion, *box])
    for number, (name, meshes) in enumerate(MESHES.items()):
        urdf = folder / f"meshes_{number}.urdf"
        urdf.write_text(meshed(meshes(folder)))
        yield Case(name, ["view", str(log), "--urdf", str(urdf), *drawn])
        excited = ["--tip", "tool0", "--from", "0,-1.2,1.6,-0.4,1.6,0", *motion[2:], *box]
        yield Case(name, ["excite", "--urdf", str(urdf), *excited])
    brackets = folder / "nested.toml"
    brackets.write_text(f"a = {'[' * 200_000}{']' * 200_000}\n")
    for command in (
        ["simulate", str(brackets), "--out", f"{folder}/o.mcap"],
        ["identify", str(log), "--calibration", str(brackets)],
    ):
        yield Case("200 000 nested brackets", command)


def run(case: Case, server: CommandServer, folder: Path) -> Done:
    """Runs a command and measures it."""
    return server.run(case.arguments, folder, DEADLINE_S)


def main() -> None:
    """Prints what each case costs."""
    table = Table(title=f"limits: {LIMIT_MB:g} MB, 5 s on an idle core")
    table.add_column("input")
    table.add_column("command")
    for name in ("exit code", "wall time / s", "processor time / s", "memory / MB"):
        table.add_column(name, justify="right")
    server = CommandServer()
    with tempfile.TemporaryDirectory() as name:
        for case in cases(Path(name)):
            start_s = time.perf_counter()
            cost = run(case, server, Path(name))
            numbers = (time.perf_counter() - start_s, cost.processor_s, cost.memory_mb)
            shown = [str(cost.returncode), *(f"{number:.1f}" for number in numbers)]
            table.add_row(case.name, case.arguments[0], *shown)
    server.close()
    Console().print(table)


if __name__ == "__main__":
    main()
