"""Where a result comes from: files with hashes, sensors, what was subtracted, options.

Table, report, JSON and the lines for controllers all take it from here.
"""

import functools
import operator
import os
import re
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from tactid._base.files import is_urdf_text, sha256
from tactid._base.naming import counted, listed
from tactid._base.values import Z95, Interval, Values, values_of
from tactid._native import MassProperties
from tactid._results.records import Setup
from tactid._results.table import number

MOST_FILES = 3
"""Most files of a recording that a sentence names."""

Hashes = Mapping[str, Mapping[str, str]]
"""SHA-256 of each file that was read, by what it is and by its name."""


class Sourced(Protocol):
    """What the result of a recording says about where it comes from."""

    @property
    def inputs(self) -> Mapping[str, Path]:
        """Files and folders that were read, by the words that name them."""

    @property
    def hashes(self) -> Hashes:
        """SHA-256 of each file that was read."""

    @property
    def given(self) -> Mapping[str, Any]:
        """The options that were given."""

    @property
    def setup(self) -> Setup:
        """Sensors, and what was subtracted."""


def hashes(inputs: Mapping[str, Path]) -> dict[str, dict[str, str]]:
    """Returns the SHA-256 of each file that was read; of a folder, of the recording in it."""
    found = {}
    for words, path in inputs.items():
        folder = path if path.is_dir() else path.parent
        files = sorted(_of_recording(path)) if path.is_dir() else [path]
        found[words] = {
            str(file.relative_to(folder)): sha256(file) for file in files if file.is_file()
        }
    return found


@contextmanager
def hashed_beside(recordings: Sequence[Mapping[str, Path]]) -> Iterator[None]:
    """Computes the hashes of the files of recordings on a thread while the block runs.

    :func:`hashes` has them at once then, because hashes are kept. A block that ends with an error
    does not wait for them.
    """

    def compute() -> None:
        with suppress(OSError):  # `hashes` raises it
            for inputs in recordings:
                hashes(inputs)

    thread = threading.Thread(target=compute, daemon=True)
    thread.start()
    yield
    thread.join()


def _of_recording(folder: Path) -> Iterator[Path]:
    """Yields the files of a rosbag2 folder, or of a data set of LeRobot."""
    yield folder / "meta" / "info.json"
    yield from (folder / "data").rglob("*.parquet")
    yield from filter(_is_of_bag, folder.iterdir())


def _is_of_bag(file: Path) -> bool:
    return file.name == "metadata.yaml" or bool(re.search(r"\.(mcap|db3)(\.zstd)?$", file.name))


def file_key(words: str) -> str:
    """Returns the name of a file, as documents have it, for the words of ``inputs``."""
    return words.strip("`").removeprefix("the ")


def given_options(options: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the options that were given, as JSON has them."""
    return {name: _plain(value) for name, value in options.items()}


def _plain(value: Any) -> Any:
    if isinstance(value, str | os.PathLike):
        return "as text" if is_urdf_text(value) else str(os.fspath(value))
    if isinstance(value, MassProperties):
        return values_of(value)
    if isinstance(value, Mapping):
        return {str(name): _plain(each) for name, each in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(each) for each in value]
    if hasattr(value, "__array__"):
        return np.asarray(value).tolist()
    return value if isinstance(value, bool | int | float) else f"a {type(value).__name__}"


def facts(result: Sourced) -> dict[str, str]:
    """Returns where a result comes from, by name, in words."""
    found = {}
    for words, path in result.inputs.items():
        found[file_key(words).replace("_", " ")] = _files(path, result.hashes.get(words, {}))
    setup = result.setup
    if setup.topics:
        found["measurements"] = ", ".join(setup.topics)
    wrenches = zip(setup.wrench_topics, setup.wrench_frames, strict=True)
    if placed := [f"{topic} in the frame {frame}" for topic, frame in wrenches]:
        found["wrenches"] = f"{listed(placed)}, acting on the {setup.wrench_acts_on}"
    bodies = subtracted(result)
    found["subtracted"] = listed(bodies) if bodies else "nothing"
    if result.given:
        options = (f"{name} {_written(value)}" for name, value in result.given.items())
        found["options"] = ", ".join(options)
    return found


def sentence(result: Sourced) -> str:
    """Says where a result comes from, on one line."""
    return "; ".join(f"{name} {words}" for name, words in facts(result).items()) + "."


def subtracted(result: Sourced) -> list[str]:
    """Says which bodies were subtracted from the measured load, with their masses."""
    setup, parts = result.setup, []
    if setup.known_tool is not None and setup.known_tool_std_devs is not None:
        mass, half_width = setup.known_tool.mass, Z95 * float(setup.known_tool_std_devs[0])
        shown = number(mass, Interval(mass - half_width, mass + half_width))
        around = f" ± {half_width:.2g}" if half_width else ""
        parts.append(f"known tool {shown}{around} kg")
    if setup.gripper is not None:
        parts.append(f"links beyond the tip {number(setup.gripper.mass)} kg")
    return parts


def subtracted_body(result: Sourced) -> Values | None:
    """Returns the ten values of all that was subtracted as one body; None where nothing was."""
    bodies = [each for each in (result.setup.known_tool, result.setup.gripper) if each is not None]
    return values_of(functools.reduce(operator.add, bodies)) if bodies else None


def _files(path: Path, hashes_of: Mapping[str, str]) -> str:
    shown = [f"{name} (SHA-256 {digest})" for name, digest in hashes_of.items() if _has_data(name)]
    more = len(shown) - MOST_FILES
    names = [*shown[:MOST_FILES], *([counted(more, "more file")] if more > 0 else [])]
    inside = listed(names) if names else path.name
    return inside if path.name in hashes_of or not names else f"{path.name} with {inside}"


def _has_data(name: str) -> bool:
    return not name.endswith((".yaml", ".yml"))


def _written(value: Any) -> str:
    if isinstance(value, list):
        return " ".join(map(_written, value))
    return f"{value:g}" if isinstance(value, float) else str(value)
