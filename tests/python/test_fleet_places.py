"""A place of a fleet that cannot be used is a row with its cause, and the others have theirs."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow
import pytest
from pyarrow import parquet

import tactid
from tactid._fleet import run
from tactid._fleet.recordings import find
from tactid._fleet.work import identify_recording
from tactid._read.lerobot import LeRobotTable

FEATURES = {"observation.state": {"dtype": "float32", "names": ["a"]}, "episode_index": {}}


def rows_at(*places: Path, **options: Any) -> list[dict[str, Any]]:
    tasks = run.tasks_of(find(places), tactid.Options(**options))
    return [row for task in tasks for row in identify_recording(task)]


def data_set(folder: Path, files: dict[str, list[int]], total: int) -> Path:
    """Writes a data set of LeRobot with the episodes in files."""
    (folder / "meta").mkdir(parents=True)
    (folder / "data").mkdir()
    info = {"total_episodes": total, "features": FEATURES}
    (folder / "meta" / "info.json").write_text(json.dumps(info))
    for name, episodes in files.items():
        numbers = np.repeat(episodes, 50)
        table = {"observation.state": [[0.1]] * len(numbers), "episode_index": numbers}
        parquet.write_table(pyarrow.table(table), folder / "data" / name)
    return folder


def test_an_episode_whose_file_is_damaged_or_gone_leaves_the_others(
    tmp_path: Path, urdf: str
) -> None:
    files = {f"episode_{k:06}.parquet": [k] for k in (0, 1, 3)}
    folder = data_set(tmp_path / "v2", files, 4)
    damaged = folder / "data" / "episode_000001.parquet"
    damaged.write_bytes(damaged.read_bytes()[:40])
    first, cut, gone, last = rows_at(folder, urdf=urdf)
    assert (first["outcome"], first["error"]) == (last["outcome"], last["error"])
    assert "cannot be read" not in first["error"]
    assert (cut["outcome"], gone["outcome"]) == ("refused", "unreachable")
    assert cut["error"].startswith(f"{damaged} cannot be read")
    assert "episode_000002.parquet" in gone["error"]


def test_an_episode_without_rows_is_no_fault_of_tactid(tmp_path: Path) -> None:
    table = LeRobotTable(data_set(tmp_path / "v3", {"file-000.parquet": [0]}, 2), 1)
    with pytest.raises(tactid.LogError, match="has no rows of episode 1"):
        table.read(["observation.state"])


def test_places_that_cannot_be_used_are_rows(tmp_path: Path, log: Path) -> None:
    """A dangling link, a data set without JSON, a bag without its log, and a line of a list."""
    folder = tmp_path / "logs"
    data_set(folder / "set", {}, 1).joinpath("meta", "info.json").write_text("{")
    (folder / "bag").mkdir()
    (folder / "bag" / "metadata.yaml").write_text("rosbag2_bagfile_information:\n")
    (folder / "dangling.mcap").symlink_to("nothing")
    (folder / "good.mcap").symlink_to(log)
    expected = {
        "bag": ("unreachable", "has the metadata.yaml of a bag, but no log"),
        "dangling.mcap": ("unreachable", "dangling.mcap cannot be read: No such file"),
        "gone.mcap": ("unreachable", "list.txt, line 2: there is no file or folder"),
        "empty": ("refused", "list.txt, line 3: .* has no recording"),
        "set": ("refused", r"info\.json is not JSON"),
    }
    (tmp_path / "empty").mkdir()
    names = tmp_path / "list.txt"
    names.write_text(f"{folder}\n{tmp_path}/gone.mcap\n{tmp_path}/empty\n")
    rows = {Path(row["address"]).name: row for row in rows_at(names)}
    assert rows.pop("good.mcap")["outcome"] == "identified"
    assert rows.keys() == expected.keys()
    for name, (outcome, words) in expected.items():
        assert rows[name]["outcome"] == outcome, name
        assert re.search(words, rows[name]["error"]), rows[name]["error"]
    assert [Path(one.address).name for one in find([f"{folder}/**/*.mcap"])] == [
        "dangling.mcap",
        "good.mcap",
    ]
