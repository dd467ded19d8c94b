"""Recordings in an object store: read by ranges, from a store that fails, without secrets."""

import io
import itertools
import json
import shutil
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zstandard
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

import object_store
import tactid
import test_foreign_logs
from object_store import Request, Store
from recorded_arm import ur5e
from tactid._fleet import ranges, run, stores, work
from tactid._fleet.recordings import find
from test_fleet import write_data_set

PASSING = ("503", "reset", "truncated")


@pytest.fixture(autouse=True)
def _small_recordings_stand_for_large_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ranges, "WHOLE", 0)


@pytest.fixture
def store(monkeypatch: pytest.MonkeyPatch) -> Iterator[Store]:
    monkeypatch.setattr(stores, "FIRST_WAIT_S", 0.001)
    stores._store.cache_clear()
    with object_store.serving() as served:
        for name, value in served.environment.items():
            monkeypatch.setenv(name, value)
        yield served


def rows_of(*urls: str, split: bool = False, **options: Any) -> list[dict[str, Any]]:
    """Rows as a worker computes them."""
    tasks = run.tasks_of(find(urls), tactid.Options(**options), split=split)
    return [row for task in tasks for row in work.identify_recording(task)]


def of_the_payload(row: dict[str, Any]) -> dict[str, Any]:
    passing = ("address", "size", "tag", "finished", "seconds", "requests", "bytes_read")
    return {name: value for name, value in row.items() if name not in passing}


def with_camera(
    log: Path, images: Sequence[int] = (4_000_000,), every_s: float = 1.0
) -> tuple[bytes, int]:
    """A recording with a camera, in chunks of its own, and the bytes of the other chunks.

    After each ``every_s`` seconds there is an image, of as many bytes as the next entry of
    ``images`` says.
    """
    written = io.BytesIO()
    writer = Writer(written, chunk_size=1 << 30, compression=CompressionType.ZSTD)
    writer.start(profile="ros2", library="test")
    channels: dict[int, int] = {}
    image_schema = writer.register_schema("sensor_msgs/msg/Image", "ros2msg", b"")
    camera = writer.register_channel("/camera", "cdr", image_schema)
    due, rng, sizes = 0, np.random.default_rng(1), itertools.cycle(images)
    with log.open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            if channel.id not in channels:
                known = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.id] = writer.register_channel(channel.topic, "cdr", known)
            writer.add_message(
                channels[channel.id], message.log_time, message.data, message.publish_time
            )
            due = due or message.log_time
            if message.log_time >= due + int(every_s * 1e9):
                _flush(writer)
                image = rng.bytes(next(sizes))
                writer.add_message(camera, message.log_time, image, message.log_time)
                _flush(writer)
                due = message.log_time
    writer.finish()
    summary = make_reader(io.BytesIO(written.getvalue())).get_summary()
    assert summary is not None
    chunks = [each for each in summary.chunk_indexes if camera not in each.message_index_offsets]
    return written.getvalue(), sum(each.chunk_length for each in chunks)


def _flush(writer: Writer) -> None:
    writer._Writer__finalize_chunk()  # type: ignore[attr-defined]


def test_an_object_has_the_row_of_its_file(store: Store, log: Path) -> None:
    """Also where the tags of a list have no quotes, as those of Azure."""
    store.objects = {"runs?/a#1 ü%20.mcap": log.read_bytes(), "runs?/notes.md": b"no log"}
    (row,) = rows_of("s3://fleet/runs?")
    (local,) = rows_of(str(log))
    assert row["address"] == "s3://fleet/runs?/a#1 ü%20.mcap"
    assert row["outcome"] == "identified"
    assert of_the_payload(row) == of_the_payload(local)
    (segment,), (local_segment,) = (
        rows_of(each, split=True) for each in (row["address"], str(log))
    )
    assert segment["end_s"] > segment["begin_s"] + 2.0
    assert of_the_payload(segment) == of_the_payload(local_segment)
    store.is_azure = True
    (one,) = rows_of("s3://fleet/runs?/a#1 ü%20.mcap")
    (matching,) = rows_of("s3://fleet/ru*/*.mcap")
    assert of_the_payload(one) == of_the_payload(matching) == of_the_payload(local)


def test_of_a_recording_with_a_camera_little_is_read(store: Store, log: Path) -> None:
    content, needed = with_camera(log)
    assert needed < 0.25 * len(content)
    store.objects = {"camera.mcap": content}
    (row,) = rows_of("s3://fleet/camera.mcap")
    (local,) = rows_of(str(log))
    for name in ("estimate.values.mass", "estimate.covariance", "estimate.windows"):
        assert row[name] == local[name]
    assert store.requests["camera.mcap"] == row["requests"] <= 10
    assert store.sent["camera.mcap"] == row["bytes_read"] <= 1.2 * needed


def test_runs_of_chunks_with_small_gaps_are_read_together(store: Store, log: Path) -> None:
    content, needed = with_camera(log, images=(100, 100, 2_500_000), every_s=0.29)
    assert needed < 0.25 * len(content)
    store.objects = {"camera.mcap": content}
    (row,) = rows_of("s3://fleet/camera.mcap")
    assert row["outcome"] == "identified"
    assert row["requests"] <= 10
    assert row["bytes_read"] <= 1.2 * needed


@pytest.mark.parametrize("fault", PASSING)
def test_a_fault_that_passes_changes_nothing(store: Store, log: Path, fault: str) -> None:
    store.objects = {"a.mcap": log.read_bytes()}
    (sound,) = rows_of("s3://fleet/a.mcap")
    store.requests.clear()
    asked: Counter[int] = Counter()

    def first_two(request: Request) -> str | None:
        asked[request.start] += 1
        return fault if asked[request.start] <= 2 else None

    store.fault = first_two
    (row,) = rows_of("s3://fleet/a.mcap")
    assert of_the_payload(row) == of_the_payload(sound)
    assert store.requests["a.mcap"] > sound["requests"]


@pytest.mark.parametrize("fault", PASSING)
def test_a_fault_that_stays_is_a_row_that_the_next_run_repeats(
    store: Store, log: Path, fault: str
) -> None:
    store.objects = {"a.mcap": log.read_bytes()}
    store.fault = lambda request: fault if request.number > 0 else None
    (row,) = rows_of("s3://fleet/a.mcap")
    assert row["outcome"] == "unreachable"
    assert row["error"].startswith("s3://fleet/a.mcap cannot be read: the store ")
    assert "estimate.values.mass" not in row
    assert object_store.SECRET not in str(row)


def test_an_object_that_changes_meanwhile_is_no_number(store: Store, log: Path) -> None:
    store.objects = {"a.mcap": log.read_bytes()}

    def fault(request: Request) -> str | None:
        return "changed" if request.number == 1 else None

    store.fault = fault
    (row,) = rows_of("s3://fleet/a.mcap")
    assert (row["outcome"], row["error"]) == (
        "unreachable",
        "s3://fleet/a.mcap has changed while it was read",
    )


def test_an_object_without_index_is_read_once(store: Store, log: Path) -> None:
    whole = log.read_bytes()
    cut = whole[: len(whole) * 3 // 4]
    store.objects = {"killed.mcap": cut}
    (row,) = rows_of("s3://fleet/killed.mcap")
    assert row["outcome"] in ("identified", "contradicted")
    assert row["damage"]
    assert store.sent["killed.mcap"] <= 1.1 * len(cut)
    assert store.requests["killed.mcap"] <= 20


@pytest.mark.parametrize("form", ["ros1", "json"])
def test_messages_that_are_not_cdr_are_converted(store: Store, tmp_path: Path, form: str) -> None:
    path = test_foreign_logs.FORMS[form](tmp_path)
    store.objects = {path.name: path.read_bytes()}
    (row,) = rows_of(f"s3://fleet/{path.name}", urdf=ur5e(), cutoff_hz=5.0)
    assert row["outcome"] == "identified"
    assert row["bytes_read"] > row["size"]


def test_bags_are_downloaded_as_a_whole(store: Store, log: Path, tmp_path: Path) -> None:
    shutil.copy(log, tmp_path / "bag_0.mcap")
    store.objects = {
        "x/bag/bag_0.mcap": log.read_bytes(),
        "x/bag/bag_1.mcap": log.read_bytes(),
        "x/zip.mcap.zstd": zstandard.compress(log.read_bytes()),
        "x/bag/metadata.yaml": json.dumps(
            {
                "rosbag2_bagfile_information": {
                    "version": 5,
                    "storage_identifier": "mcap",
                    "relative_file_paths": ["bag_0.mcap", "bag_1.mcap"],
                    "duration": {"nanoseconds": 0},
                    "starting_time": {"nanoseconds_since_epoch": 0},
                    "message_count": 0,
                    "topics_with_message_count": [],
                    "compression_format": "",
                    "compression_mode": "",
                }
            }
        ).encode(),
        "x/old.db3": b"SQLite format 3\0 but no more",
    }
    bag, old, compressed = rows_of("s3://fleet/x")
    (local,) = rows_of(str(log))
    assert of_the_payload(compressed) == of_the_payload(local)
    assert bag["outcome"] == "identified"
    assert (bag["address"], old["address"]) == ("s3://fleet/x/bag", "s3://fleet/x/old.db3")
    assert old["outcome"] == "refused"
    assert "s3://fleet/x/old.db3" in old["error"]
    assert "/tmp" not in old["error"]
    assert bag["bytes_read"] == bag["size"]


def test_a_data_set_is_downloaded_for_its_episodes(
    store: Store, log: Path, urdf: str, tmp_path: Path
) -> None:
    folder = write_data_set(tmp_path / "set", log)
    files = [path for path in folder.rglob("*") if path.is_file()]
    store.objects = {
        f"x/{path.relative_to(tmp_path).as_posix()}": path.read_bytes() for path in files
    }
    there, here = rows_of("s3://fleet/x", urdf=urdf), rows_of(str(folder), urdf=urdf)
    assert [row["bytes_read"] for row in there] == [there[0]["size"], 0]
    assert sum(store.requests.values()) == len(files) + 1  # the description is listed, too
    assert [(row["address"], row["episode"]) for row in there] == [
        ("s3://fleet/x/set", 0),
        ("s3://fleet/x/set", 1),
    ]
    for one, other in zip(there, here, strict=True):
        assert one["error"] == other["error"].replace(str(folder), "s3://fleet/x/set")


@pytest.mark.usefixtures("store")
def test_a_store_that_is_not_there_is_reported_without_keys(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("AWS_ENDPOINT_URL", "http://127.0.0.1:9")
    stores._store.cache_clear()
    with pytest.raises(stores.StoreError) as caught:
        stores.read("s3://fleet/x", stores.Object("a.mcap", 3, '"x"'), 0, 3)
    assert object_store.SECRET not in str(caught.value)
    assert str(caught.value) == "s3://fleet/x/a.mcap cannot be read: the store cannot be reached"


def test_an_endpoint_without_tls_needs_no_permission(
    store: Store, log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("AWS_ALLOW_HTTP")
    store.objects["a.mcap"] = log.read_bytes()
    (recording,) = find(["s3://fleet/a.mcap"])
    assert recording.size == log.stat().st_size
    with pytest.raises(stores.StoreError, match="there is no such bucket"):
        find(["s3://fleets/*.mcap"])


def test_what_is_kept_on_the_disk_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where too much would be kept, it is read again, and the bytes stay right."""
    monkeypatch.setattr(ranges, "MOST_KEPT", 3 * ranges.BLOCK)
    content = np.random.default_rng(4).bytes(20 * ranges.BLOCK)
    given = ranges.Ranges("x.mcap", len(content), lambda start, end: content[start:end])
    for place in (0, 11, 3, 19, 11, 0):
        at_byte = place * ranges.BLOCK + 7
        assert given.read(at_byte, 100) == content[at_byte : at_byte + 100]
        assert sum(end - start for start, end in given._kept) <= 3 * ranges.BLOCK
    assert given.requests == 6
    given.close()


def test_a_small_recording_is_read_by_one_request(monkeypatch: pytest.MonkeyPatch) -> None:
    content = bytes(range(256)) * 16
    monkeypatch.setattr(ranges, "WHOLE", len(content))
    given = ranges.Ranges("x.mcap", len(content), lambda start, end: content[start:end])
    assert given.read(len(content) - 40, 40) == content[-40:]
    assert given.read(8, 9) == content[8:17]
    assert (given.requests, given.bytes_read) == (1, len(content))
    given.close()
