"""Data sets of LeRobot: the features of an episode as a table.

``meta/info.json`` names the features, and the Parquet files below ``data`` have their values, of
all episodes one after the other (version 3) or a file an episode (version 2).
"""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from tactid._base.errors import ArgumentError, LogError
from tactid._base.values import Array
from tactid._read.tables import ParquetTable, Progress, Table

INFO = Path("meta", "info.json")
"""Where a data set describes itself."""

EPISODE = "episode_index"
"""The column that says which episode a row belongs to."""


class LeRobotTable(Table):
    """An episode of a data set; each entry of a feature with names is a column, too.

    Args:
        folder: The folder of the data set.
        episode: Which episode; None where there is one.
    """

    def __init__(self, folder: Path, episode: int | None) -> None:
        total, features = _info(folder)
        self._chosen = chosen = _episode(folder, total, episode)
        files = _file(folder, chosen) or folder / "data"
        self._table = ParquetTable(files, filters=[(EPISODE, "==", chosen)])
        self._entries = dict(_entries(features))
        there = [name for name in self._table.names if name in features]
        inside = [name for name, (feature, _) in self._entries.items() if feature in there]
        super().__init__(folder, [*there, *inside])

    def read(self, names: Sequence[str], progress: Progress = None) -> dict[str, Array]:
        """Reads features, or entries of theirs: see :meth:`Table.read`."""
        sources = [self._entries.get(name, (name, None)) for name in names]
        features = list(dict.fromkeys(feature for feature, _ in sources))
        values = self._table.read(features, progress)
        if not all(map(len, values.values())):
            raise LogError(f"{self._table.path} has no rows of episode {self._chosen}")
        found = {}
        for name, (feature, entry) in zip(names, sources, strict=True):
            array = values[feature]
            if entry is not None and (array.ndim < 2 or array.shape[1] <= entry):
                raise LogError(f"{self.path}: `{feature}` has fewer numbers than {INFO} names")
            found[name] = array if entry is None else array[:, entry]
        return found


def is_dataset(path: Path) -> bool:
    """Returns whether a folder is a data set of LeRobot."""
    return (path / INFO).is_file()


def described(path: Path | str, content: bytes) -> tuple[int, dict[str, Any]]:
    """Returns the number of episodes and the features that a description names.

    Raises:
        LogError: It is no JSON, or does not say how many episodes there are.
    """
    try:
        info = json.loads(content)
    except ValueError:
        raise LogError(f"{path} is not JSON: expected that of a data set of LeRobot") from None
    total = info.get("total_episodes") if isinstance(info, dict) else None
    if not isinstance(total, int) or total < 1:
        raise LogError(f"{path} has no `total_episodes`: how many episodes there are")
    return total, info.get("features")


def _info(folder: Path) -> tuple[int, dict[str, Any]]:
    total, features = described(folder / INFO, (folder / INFO).read_bytes())
    if not isinstance(features, dict):
        raise LogError(f"{folder / INFO} describes no data set of LeRobot: it has no `features`")
    if not (folder / "data").is_dir():
        raise LogError(f"{folder} has {INFO}, but no folder `data` with the episodes")
    return total, features


def _episode(folder: Path, total: int, episode: int | None) -> int:
    """Returns the number of the episode that is read."""
    if episode is None and total > 1:
        raise ArgumentError(
            f"{folder} has {total} episodes: `episode` chooses one, from 0 to {total - 1}",
            option="episode",
        )
    if episode is not None and not 0 <= episode < total:
        raise ArgumentError(
            f"`episode` is {episode}: expected 0 to {total - 1}, which {folder} has",
            option="episode",
        )
    return episode or 0


def _file(folder: Path, episode: int) -> Path | None:
    """Returns the file of an episode; None where a file has several."""
    name = f"episode_{episode:06}.parquet"
    files = {path.name: path for path in (folder / "data").rglob("episode_*.parquet")}
    if files and name not in files:
        raise LogError(f"{folder} has no {name} below `data`: there is no such file")
    return files.get(name)


def _entries(features: dict[str, Any]) -> Iterator[tuple[str, tuple[str, int]]]:
    """Yields the entries that the features name, with their feature and place."""
    for feature, about in features.items():
        names = about.get("names") if isinstance(about, dict) else None
        if isinstance(names, dict):  # such as {"motors": [...]}
            names = next(iter(names.values()), None)
        if isinstance(names, list) and about.get("dtype") not in ("video", "image"):
            for place, name in enumerate(names):
                yield f"{feature}.{name}", (feature, place)
