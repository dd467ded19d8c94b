"""The recordings that addresses stand for: of folders, patterns, stores, lists and data sets."""

import glob
import hashlib
import os
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatch
from pathlib import Path
from urllib.parse import unquote

from tactid._base.errors import ArgumentError, LogError, TactidError
from tactid._base.files import sha256
from tactid._fleet import stores
from tactid._fleet.stores import Object, is_address
from tactid._read import lerobot, tables

LOGS = (".mcap", ".db3", ".mcap.zstd", ".db3.zstd", ".bag")
"""Ends of the names of the files of logs, which a folder is searched for."""

TABLES = tuple(end for end in tables.TABLES if end != ".txt")
"""Ends of the names of tables, which are read where an address names them; ``.txt`` is a list."""

BAG = b"rosbag2_bagfile_information"
"""First key of the ``metadata.yaml`` of a bag."""

MOST_EPISODES = 1 << 20
"""Episodes of a data set: the largest public ones have some hundred thousand."""


@dataclass(frozen=True)
class Recording:
    """A recording as it is listed."""

    address: str
    """Path or address, by which rows and errors name it."""
    size: int
    """Number of bytes of its files."""
    tag: str
    """E-tag, or the time of the last change: it is another one where the recording is."""
    episode: int | None = None
    """Number of the episode of a data set."""
    base: str = ""
    """Address below which its objects are; empty for a path."""
    objects: Sequence[Object] = field(default=(), compare=False)
    """Objects in a store that it consists of."""
    experiment: str | None = None
    """The experiment, TOML, of a recording that is simulated."""
    seed: int | None = None
    """The seed of the simulation."""
    cause: Exception | None = field(default=None, compare=False)
    """Why the place cannot be used: its row says so."""


class UnusableError(ArgumentError):
    """A place without a recording: an error where it is typed, a row where a list names it."""


def find(
    urls: Iterable[str | os.PathLike[str]], within: str = "", left_out: list[str] | None = None
) -> list[Recording]:
    """Returns the recordings that paths and addresses stand for, each once, in order.

    Args:
        urls: The paths and addresses.
        within: The list that they are from.
        left_out: Receives what looks like a recording in a folder, and is not read.

    Raises:
        ArgumentError: There is nothing at an address, or it is of an unknown kind.
        StoreError: A store cannot be reached.
    """
    found: dict[tuple[str, int | None], Recording] = {}
    for url in urls:
        text = os.fspath(url)
        if within and text.endswith(".txt"):
            raise ArgumentError(f"{within} names the list {text}: expected recordings or folders")
        others: list[str] = []
        each = list(_in_store(text) if is_address(text) else _at_path(text, others))
        if left_out is not None:
            left_out += others
        found |= {(one.address, one.episode): one for one in each}
        if not each:
            names = [other for other in others if other.lower().endswith(TABLES)]
            if names:
                raise UnusableError(
                    f"{text} has tables, such as {names[0]}, which are read where a path or a"
                    f" pattern names them: {os.path.join(text, '*' + Path(names[0]).suffix)}"
                )
            raise UnusableError(
                f"{text} has no recording: expected logs ({', '.join(LOGS)}), or a folder, a"
                " pattern, a data set of LeRobot or a .txt file with addresses of some"
            )
    return list(found.values())


def _of_list(text: str, content: bytes, left_out: list[str] | None = None) -> list[Recording]:
    """Returns the recordings that a list names: a path or an address a line, and comments.

    A comment begins a line with ``#``, or follows a space, because names may contain the sign.
    """
    try:
        lines = content.decode("utf-8-sig").splitlines()
    except UnicodeError:
        raise ArgumentError(f"{text} is not UTF-8: expected a path or an address a line") from None
    found: list[Recording] = []
    for number, line in enumerate(lines, start=1):
        named = re.split(r"(?:^|\s)#", line)[0].strip()
        try:
            found += find([named], text, left_out) if named else []
        except ArgumentError as error:
            error.message = f"{text}, line {number}: {error.message}"
            if not isinstance(error, UnusableError):
                raise
            address = named if is_address(named) else os.path.abspath(named)
            found.append(Recording(address, 0, "", cause=error))
        except OSError as error:
            found.append(Recording(named, 0, "", cause=error))
    return found


def _usable(address: str | Path, recordings: Iterator[Recording]) -> Iterator[Recording]:
    """Yields the recordings of a place; one that cannot be read is a recording with its cause."""
    try:
        yield from recordings
    except OSError as error:
        cause = OSError(f"{address} cannot be read: {error.strerror or error}")
        yield Recording(str(address), 0, "", cause=cause)
    except TactidError as error:
        yield Recording(str(address), 0, "", cause=error)


def _at_path(text: str, left_out: list[str]) -> Iterator[Recording]:
    # A worker may be in another folder.
    path = Path(os.path.abspath(text))
    if not path.exists():
        matches = sorted(glob.glob(text, recursive=True))
        if not matches:
            raise UnusableError(f"there is no file or folder {text}")
        for match in matches:
            is_folder = os.path.isdir(match)
            yield from (
                _at_path(match, left_out) if is_folder else _files([Path(os.path.abspath(match))])
            )
    elif path.is_dir():
        yield from _usable(path, _in_folder(path, left_out))
    elif path.suffix == ".txt":
        yield from _of_list(text, path.read_bytes(), left_out)
    else:
        yield from _files([path])


def _in_folder(folder: Path, left_out: list[str]) -> Iterator[Recording]:
    """Yields the recordings in a folder and below it, in the order of their names."""
    if lerobot.is_dataset(folder):
        files = [folder / lerobot.INFO, *sorted((folder / "data").rglob("*.parquet"))]
        yield from _episodes(str(folder), _statuses(files), (folder / lerobot.INFO).read_bytes)
        return
    entries = sorted(entry for entry in folder.iterdir() if not entry.name.startswith("."))
    files = [entry for entry in entries if not entry.is_dir() and _ends(entry, LOGS)]
    description = folder / "metadata.yaml"
    if files and description.is_file():
        statuses = _statuses([description, *files])
        yield Recording(str(folder), *_whole(statuses))
    elif not files and description.is_file() and BAG in description.read_bytes():
        raise LogError(
            f"{folder} has the metadata.yaml of a bag, but no log: there is no such file"
        )
    else:
        yield from _files(files)
    for entry in entries:
        if entry.is_dir() and not entry.is_symlink():
            if _ends(entry, (".parquet",)):  # a table of this command
                continue
            each = list(_usable(entry, _in_folder(entry, left_out)))
            yield from each
            if not each and _ends(entry, LOGS):
                left_out.append(str(entry))
        elif entry not in files and (_ends(entry, (*LOGS, *TABLES)) or entry.is_symlink()):
            left_out.append(str(entry))


def _ends(path: Path, ends: tuple[str, ...]) -> bool:
    return path.name.lower().endswith(ends)


def _files(paths: Iterable[Path]) -> Iterator[Recording]:
    for path in paths:
        yield from _usable(path, map(_file, [path]))


def _file(path: Path) -> Recording:
    return Recording(*_statuses([path])[0])


def _statuses(paths: Iterable[Path]) -> list[Object]:
    """Returns files with the times of their last changes as tags."""
    found = ((path, path.stat()) for path in paths)
    return [Object(str(path), each.st_size, str(each.st_mtime_ns)) for path, each in found]


def state_of_folder(folder: Path) -> str:
    """Returns what changes where a file of a folder changes: a hash of names, sizes and times."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return _whole(_statuses(files))[1] if files else ""


def content_of(path: Path) -> str:
    """Returns what changes with the content of a file or a folder; its name where there is none."""
    if path.is_file():
        return sha256(path)
    return state_of_folder(path) if path.is_dir() else str(path)


def _whole(objects: Sequence[Object]) -> tuple[int, str]:
    """Returns size and tag of a recording of some files."""
    if len(objects) == 1:
        return objects[0].size, objects[0].tag
    tags = "\n".join(f"{each.name} {each.size} {each.tag}" for each in objects)
    return sum(each.size for each in objects), hashlib.sha256(tags.encode()).hexdigest()[:32]


def _in_store(url: str) -> Iterator[Recording]:
    stores.check_address(url)
    folder, _, name = url.rpartition("/")
    # A store has names, a web server addresses, whose special characters are percent signs.
    name = unquote(name) if url.startswith("http") else name
    if "*" not in url and name.endswith((*LOGS, *TABLES, ".txt")):
        one = stores.found(folder, name)
        if one is None:
            raise UnusableError(f"there is no object {url}")
        if name.endswith(".txt"):
            yield from _of_list(url, stores.read(folder, one, 0, one.size))
        else:
            yield Recording(url, one.size, one.tag, base=folder, objects=[one])
        return
    if url.startswith("http"):
        raise ArgumentError(f"{url}: a web server does not list folders: give addresses of files")
    base = url if "*" not in url else url[: url.index("*")].rpartition("/")[0]
    base = base.rstrip("/")
    pattern = url[len(base) + 1 :] if "*" in url else "*"
    objects = [each for each in stores.listed(base) if fnmatch(each.name, pattern)]
    yield from _grouped(base, objects, (*LOGS, *TABLES) if "*" in url else LOGS)


def _grouped(base: str, objects: Iterable[Object], ends: tuple[str, ...]) -> Iterator[Recording]:
    """Yields the recordings of listed objects: bags and data sets are folders."""
    folders: dict[str, list[Object]] = {}
    for each in objects:
        folders.setdefault(each.name.rpartition("/")[0], []).append(each)
    sets = [name.removesuffix("meta") for name, inside in folders.items() if _has_info(inside)]
    for prefix in sets:
        inside = [each for each in objects if each.name.startswith(prefix)]
        info = next(each for each in inside if each.name == f"{prefix}{lerobot.INFO.as_posix()}")
        data = [each for each in inside if each.name.startswith(f"{prefix}data/")]
        address = f"{base}/{prefix}".rstrip("/")

        def described(info: Object = info) -> bytes:
            return stores.read(base, info, 0, info.size)

        yield from _usable(address, _episodes(address, [info, *data], described, base))
    for folder, inside in folders.items():
        if any(f"{folder}/".startswith(prefix) for prefix in sets):
            continue
        logs = [each for each in inside if each.name.endswith(ends)]
        described_by = [each for each in inside if each.name.endswith("metadata.yaml")]
        if logs and described_by:
            bag = [*described_by, *logs]
            address = f"{base}/{folder}".rstrip("/")
            yield Recording(address, *_whole(bag), base=base, objects=bag)
        else:
            for one in logs:
                address = f"{base}/{one.name}"
                yield Recording(address, one.size, one.tag, base=base, objects=[one])


def _has_info(objects: Iterable[Object]) -> bool:
    return any(f"/{each.name}".endswith(f"/{lerobot.INFO.as_posix()}") for each in objects)


def _episodes(
    address: str, objects: Sequence[Object], described: Callable[[], bytes], base: str = ""
) -> Iterator[Recording]:
    """Yields each episode of a data set, with the size and the tag of the whole or of its file."""
    total = lerobot.described(f"{address}/{lerobot.INFO}", described())[0]
    if total > MOST_EPISODES:
        raise ArgumentError(
            f"{address}/{lerobot.INFO} has {total} episodes: expected at most {MOST_EPISODES}"
        )
    by_episode: dict[int, list[Object]] = {}
    for each in objects:
        if named := re.search(r"episode_(\d{6,})\.", each.name):
            by_episode.setdefault(int(named[1]), []).append(each)
    info = [each for each in objects if each.name.endswith(lerobot.INFO.name)]
    of_all = _whole(objects)
    for episode in range(total):
        own = by_episode.get(episode)
        files = [*info, *own] if own else objects
        state = _whole(files) if own else of_all
        yield Recording(address, *state, episode, base, files if base else ())
