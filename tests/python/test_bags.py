"""Every storage and compression of rosbag2 is one recording; what is none ends in one error."""

import json
import shutil
import sqlite3
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag2 import CompressionMode, StoragePlugin

import tactid
from conftest import TactidCommand
from expectations import Identify, assert_within
from recorded_arm import FIXED, PAYLOAD
from recordings import carried, write_bag
from test_cli import assert_refused

UNISA = Path(__file__).parents[3] / "shared/data/unisa"
MCAP, SQLITE = StoragePlugin.MCAP, StoragePlugin.SQLITE3
NONE, FILE, MESSAGE = CompressionMode.NONE, CompressionMode.FILE, CompressionMode.MESSAGE


@pytest.fixture(scope="module")
def twins(tmp_path_factory: pytest.TempPathFactory) -> Callable[[StoragePlugin, Any], Path]:
    """``twins(storage, compression)`` is the same recording in each, written once."""
    folder = tmp_path_factory.mktemp("twins")
    messages = carried(FIXED, 2.0, 250.0)

    def twin(storage: StoragePlugin, compression: CompressionMode) -> Path:
        # The folders have one name, which the description of a bag contains.
        bag = folder / f"{storage.name}-{compression.name}" / "bag"
        if not bag.exists():
            write_bag(bag, messages, storage=storage, compression=compression)
        return bag

    return twin


@pytest.fixture
def own_bag(twins: Callable[[StoragePlugin, Any], Path], tmp_path: Path) -> Path:
    """A plain SQLite bag that the test may change."""
    return Path(shutil.copytree(twins(SQLITE, NONE), tmp_path / "bag"))


@pytest.mark.parametrize("compression", [NONE, FILE, MESSAGE])
@pytest.mark.parametrize("storage", [MCAP, SQLITE])
def test_twins_give_the_same_result(
    command: TactidCommand,
    twins: Callable[[StoragePlugin, Any], Path],
    storage: StoragePlugin,
    compression: CompressionMode,
) -> None:
    bag, plain = twins(storage, compression), twins(MCAP, NONE)
    (file,) = (path for path in bag.iterdir() if path.suffix != ".yaml")
    assert file.name.endswith(".zstd") == (compression == FILE)
    texts = []
    for log in (plain, bag, file):
        done = command("identify", log, "--json")
        assert done.returncode == 0, done.stderr
        # The result names its input, as a path in remarks and by its name, and has the hashes of
        # its files.
        record = json.loads(done.stdout.replace(str(log), "LOG"))
        for own in (record["files"], record["sha256"], record["provenance"]):
            del own["log"]
        texts.append(record)
    assert texts[0] == texts[1] == texts[2]

    known, found = tactid.info(plain), tactid.info(bag)
    described = [
        [(t.name, t.type_name, t.encoding, t.count, t.frequency) for t in info.topics]
        for info in (known, found)
    ]
    assert described[0] == described[1]
    assert (known.start, known.duration) == (found.start, found.duration)
    assert list(found.metadata) == ["rosbag2"]
    assert found.damage == []
    state, twin = tactid.read(plain, "/joint_states"), tactid.read(bag, "/joint_states")
    for name in ("position", "velocity", "effort"):
        np.testing.assert_array_equal(state[name], twin[name])


def test_the_payload_of_a_sqlite_bag(
    identify: Identify, twins: Callable[[StoragePlugin, Any], Path]
) -> None:
    assert_within(identify(twins(SQLITE, NONE)), PAYLOAD.values, 1e-3)


def test_a_bag_that_is_being_recorded(
    identify: Identify, twins: Callable[[StoragePlugin, Any], Path], own_bag: Path
) -> None:
    recorder = sqlite3.connect(own_bag / "bag.db3")
    recorder.execute("PRAGMA journal_mode = WAL")
    recorder.execute("BEGIN IMMEDIATE")
    recorder.execute("INSERT INTO messages VALUES (NULL, 1, 1, x'00')")
    found = identify(own_bag)
    recorder.close()
    plain = identify(twins(MCAP, NONE))
    assert found["estimate"] == plain["estimate"]


def damaged(change: str) -> Callable[[Path], None]:
    def run(bag: Path) -> None:
        database = sqlite3.connect(bag / "bag.db3")
        database.executescript(change)
        database.close()

    return run


def cut(bag: Path) -> None:
    with (bag / "bag.db3").open("r+b") as file:
        file.truncate(100_000)


def other_content(bag: Path) -> None:
    (bag / "bag.db3").write_text("no database at all")


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (cut, ("damaged or cut off", ".recover")),
        (other_content, ("neither an MCAP log nor an SQLite bag",)),
        (damaged("DROP TABLE messages"), ("no table `messages`",)),
        (damaged("ALTER TABLE topics DROP COLUMN name"), ("`topics` has no stored column `name`",)),
        (damaged("UPDATE topics SET serialization_format = 'json'"), ('encoded as "json"', "cdr")),
        (damaged("UPDATE messages SET timestamp = 'x' WHERE id = 9"), ("row 9", "`timestamp`")),
        (damaged("DELETE FROM messages"), ("no message",)),
    ],
)
def test_what_is_no_bag_is_refused(
    command: TactidCommand, own_bag: Path, spoil: Callable[[Path], None], words: tuple[str, ...]
) -> None:
    spoil(own_bag)
    place = str(own_bag) if "encoded" not in words[0] else ""
    assert_refused(command("identify", own_bag), place, *words)


def test_a_locked_bag_is_refused(command: TactidCommand, own_bag: Path) -> None:
    other = sqlite3.connect(own_bag / "bag.db3")
    other.execute("BEGIN EXCLUSIVE")
    assert_refused(command("identify", own_bag), "bag.db3", "another process has locked it")
    other.close()


def test_a_compressed_file_that_is_cut_is_used_up_to_there(
    identify: Identify, twins: Callable[[StoragePlugin, Any], Path], tmp_path: Path
) -> None:
    bag = Path(shutil.copytree(twins(MCAP, FILE), tmp_path / "bag"))
    path = bag / "bag.mcap.zstd"
    path.write_bytes(path.read_bytes()[: path.stat().st_size * 9 // 10])
    (damage,) = identify(bag)["damage"]
    assert str(path) in damage
    assert "cannot be decompressed further" in damage


def test_a_sqlite_bag_is_shown(
    command: TactidCommand, twins: Callable[[StoragePlugin, Any], Path], tmp_path: Path
) -> None:
    scene = tmp_path / "scene.rrd"
    done = command("view", twins(SQLITE, MESSAGE), "--save", scene)
    assert done.returncode == 0, done.stderr
    assert scene.stat().st_size > 0


@pytest.mark.skipif(not UNISA.is_dir(), reason="the recordings are not part of the repository")
@pytest.mark.parametrize(("name", "count", "joint"), [("panda", 727, 7), ("ur10", 3441, 6)])
def test_bags_of_others(name: str, count: int, joint: int) -> None:
    bag = UNISA / f"{name}_exciting_trajectory.db3"
    (topic,) = tactid.info(bag).topics
    assert (topic.name, topic.count) == ("/joint_states", count)
    state = tactid.read(bag, "/joint_states")
    assert state["position"].shape == (count, joint)
    assert np.isfinite(state["effort"]).all()
