"""Addresses in stores and on web servers: their forms, their secrets, and what passes."""

import os
import threading
from collections.abc import Iterator
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import tactid
from tactid._fleet import rows, run, stores, work
from tactid._fleet.recordings import Recording, find
from test_fleet_stores import rows_of


@pytest.fixture
def server(tmp_path: Path) -> Iterator[str]:
    """A web server that sends no ranges, of a folder."""

    class Handler(SimpleHTTPRequestHandler):
        def __init__(self, *arguments: Any) -> None:
            super().__init__(*arguments, directory=str(tmp_path))

        def log_message(self, *_: object) -> None:
            pass

    served = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=served.serve_forever, args=(0.02,), daemon=True)
    thread.start()
    yield f"http://127.0.0.1:{served.server_port}"
    served.shutdown()
    served.server_close()
    thread.join()


@pytest.mark.parametrize(
    "url",
    [
        "az://c/*.mcap?sv=2024&sig=SECRET",
        "az://c/a#b/*.mcap?sig=SECRET",
        "https://host/*.mcap?X-Amz-Signature=SECRET",
        "https://host/a.mcap?SECRET",
        "s3://key:SECRET@b/a.mcap",
    ],
)
def test_a_signature_is_refused_and_not_printed(url: str) -> None:
    with pytest.raises(tactid.ArgumentError, match="credentials come from") as caught:
        find([url])
    assert "SECRET" not in str(caught.value)


@pytest.mark.parametrize("base", ["s3://b", "gs://b", "az://c"])
def test_names_may_have_characters_of_queries(base: str, monkeypatch: pytest.MonkeyPatch) -> None:
    there = [stores.Object("d?/a#1.mcap", 3, "x"), stores.Object("d?/b.mcap.zstd", 4, "y")]
    monkeypatch.setattr(stores, "listed", lambda _: iter(there))
    monkeypatch.setattr(stores, "found", lambda _, name: stores.Object(name, 3, "x"))
    addresses = [each.address for each in find([f"{base}/d?/a#1.mcap", base])]
    assert addresses == [f"{base}/d?/a#1.mcap", f"{base}/d?/b.mcap.zstd"]


def test_a_server_without_ranges_is_reported_at_once(
    server: str, log: Path, tmp_path: Path
) -> None:
    (tmp_path / "sp ace.mcap").write_bytes(log.read_bytes())
    (row,) = rows_of(f"{server}/sp%20ace.mcap")
    assert row["outcome"] == "refused"
    assert "sp ace.mcap is on a server that does not send ranges" in row["error"]
    assert row["seconds"] < 5.0


def test_the_region_of_the_environment_counts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "config").write_text("[default]\nregion = eu-west-1\n")
    for name in [name for name in os.environ if name.startswith("AWS_")]:
        monkeypatch.delenv(name)
    monkeypatch.setenv("AWS_CONFIG_FILE", str(tmp_path / "config"))
    assert stores._aws_files() == {"region": "eu-west-1"}
    monkeypatch.setenv("AWS_REGION", "eu-north-1")
    assert stores._aws_files() == {}


def test_what_passes_is_tried_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Files that are not there and disks that fail or are full are not those of the recording."""
    path = tmp_path / "a.mcap"
    path.write_bytes(b"x")
    (task,) = run.tasks_of(find([path]), tactid.Options())
    path.unlink()
    (row,) = work.identify_recording(task)
    assert row["outcome"] == "unreachable"
    failing = tactid.LogError("cannot read x.mcap: Input/output error (os error 5)")
    assert rows.of_error(failing)["outcome"] == "unreachable"
    assert rows.of_error(tactid.LogError("x.mcap is no log"))["outcome"] == "refused"
    large = Recording("s3://b/x.db3", 10**9, "", base="s3://b")
    monkeypatch.setattr("shutil.disk_usage", lambda _: SimpleNamespace(free=1))
    with pytest.raises(OSError, match="has room for"):
        work._downloaded(large, tmp_path, {})


def test_a_reader_that_asks_again_gets_the_failure_at_once() -> None:
    asked = []

    def fetch(start: int, end: int) -> bytes:
        asked.append((start, end))
        raise stores.StoreError("it is gone")

    given = work.Ranges("x.mcap", 100, fetch)
    for _ in range(3):
        with pytest.raises(stores.StoreError):
            given.read(0, 10)
    given.close()
    assert len(asked) == 1
