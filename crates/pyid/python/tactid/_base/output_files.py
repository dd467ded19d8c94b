"""Checks of a command's output files before it reads or writes anything."""

import os
import re
from collections.abc import Iterable, Mapping
from itertools import combinations
from pathlib import Path
from typing import Literal, TypeAlias

from tactid._base.errors import ArgumentError
from tactid._base.files import is_stream

FigureFormat: TypeAlias = Literal["png", "svg", "pdf"]
"""Format of the figures of a report as files beside it."""


def check_report(
    option: str, path: Path, figures: FigureFormat | None, *, has_figures: bool = True
) -> None:
    """Checks that the name of a report is that of a page, beside which figures can be written.

    Raises:
        ArgumentError: It is the name of another kind of file, or a stream has no files beside it.
    """
    if is_stream(path):
        if figures is not None:
            raise ArgumentError(f"figures are written beside a report, but {option} {path} is none")
    elif path.suffix.lower() not in (".html", ".htm"):
        more = "; `figures` writes the figures of the report as .png, .svg or .pdf"
        raise ArgumentError(
            f"{option} {path}: expected a name that ends in .html{more * has_figures}",
            option="figures" if has_figures else None,
        )


def check_ending(option: str, path: Path | None, ending: str) -> None:
    """Checks that the name of a file ends as its format does; a stream has any name.

    Raises:
        ArgumentError: Its name promises another format, or none.
    """
    if path is not None and path.suffix.lower() != ending and not is_stream(path):
        raise ArgumentError(f"{option} {path}: expected a name that ends in {ending}")


def figure_paths(report: Path, names: Iterable[str], form: FigureFormat) -> dict[str, Path]:
    """Returns the files of a report's figures by name: ``payload_fit.svg`` of ``payload.html``.

    Names that would be the same file get a number, also where only their case differs, which some
    file systems ignore.
    """
    paths: dict[str, Path] = {}
    taken: set[str] = set()
    for name in names:
        first = stem = re.sub(r"[^a-zA-Z0-9]+", "_", name).strip("_") or "figure"
        number = 1
        while stem.lower() in taken:
            number += 1
            stem = f"{first}_{number}"
        taken.add(stem.lower())
        paths[name] = report.parent / f"{report.stem}_{stem}.{form}"
    return paths


def figure_outputs(
    report: Path | None, names: Iterable[str], form: FigureFormat | None
) -> dict[str, Path]:
    """Returns the figures of a report as outputs to check; none without a report or a format."""
    if report is None or form is None:
        return {}
    paths = figure_paths(report, names, form)
    return {f"the figure {name} of the report": path for name, path in paths.items()}


def check_outputs(outputs: Mapping[str, Path | None], inputs: Mapping[str, Path | None]) -> None:
    """Checks that every output can be created and replaces no input and no other output.

    Args:
        outputs: The files to write, by the option that names them; None where it is absent.
        inputs: The files and folders of bags to read, by the option or argument that names them.

    Raises:
        ArgumentError: The folder of an output does not exist, an output is a folder, or two
            options name the same file.
    """
    written = {option: path for option, path in outputs.items() if path is not None}
    for option, path in written.items():
        _check_place(option, path)
        for source, given in inputs.items():
            if given is not None:
                _check_input(option, path, source, given)
    for (option, path), (other, second) in combinations(written.items(), 2):
        if _is_same_file(path, second):
            raise ArgumentError(f"{option} and {other} are the same file, {path}")


OWN_MARKS = tuple(
    re.compile(mark, re.DOTALL)
    for mark in (
        rb'\{\s*"schema":\s*"tactid\.',
        rb'<!doctype html>.{,100}<meta name="generator" content="tactid ',
        rb"\x89PNG.*Software\0tactid",
        rb"<\?xml.*<dc:title>tactid</dc:title>",
        rb"%PDF.*/Creator \(tactid\)",
        # The library that its header names; what follows may be topics of tactid.
        rb"\x89MCAP.{,40}tactid ",
        # The name of the application of a Rerun recording, after its length.
        rb"RRF.*\x06tactid",
        rb"# Calibrated joint efforts of a robot arm\. `tactid calibrate` wrote this file",
        rb"address,episode,seed,robot,size,tag,options_sha256,version,",
        rb"# Motion for the payload at .*written[\s#]+by[\s#]+tactid\b",
    )
)
"""What the beginning of each format shows that tactid writes, and the end of PDF."""


def replaced_outputs(outputs: Mapping[str, Path | None]) -> list[Path]:
    """Returns the outputs in whose place a file of an earlier run is.

    Raises:
        ArgumentError: A file in the place of an output was not written by tactid.
    """
    replaced = []
    for option, path in outputs.items():
        if path is None or is_stream(path) or not path.is_file() or not path.stat().st_size:
            continue
        if not _is_own(path):
            raise ArgumentError(
                f"{option} {path} is there already, and tactid has not written it: give another"
                " name, or remove it"
            )
        replaced.append(path)
    return replaced


def _is_own(path: Path) -> bool:
    """Returns whether tactid has written a file, which one of :data:`OWN_MARKS` shows."""
    with path.open("rb") as file:
        content = file.read(2048)
        if content.startswith(b"%PDF"):  # names its writer after the figure
            file.seek(max(path.stat().st_size - 4096, 0))
            content += file.read()
    return any(mark.match(content) for mark in OWN_MARKS)


def check_inputs_of_folder(option: str, path: Path, inputs: Mapping[str, Path | None]) -> None:
    """Checks that a folder to write is not in a folder that is read.

    Raises:
        ArgumentError: It is.
    """
    target = Path(os.path.realpath(path))
    for source, given in inputs.items():
        if given is not None and given.is_dir():
            folder = Path(os.path.realpath(given))
            if folder == target or folder in target.parents:
                raise ArgumentError(f"{option} {path} is in the folder of {source}, {given}")


def checked_output(
    path: str | os.PathLike[str], inputs: Mapping[str, Path | None], ending: str
) -> Path:
    """Returns the path of one output of a method once it and its ending have passed all checks."""
    check_outputs({"`path`": Path(path)}, inputs)
    check_ending("`path`", Path(path), ending)
    return Path(path)


def checked_report(
    path: str | os.PathLike[str],
    inputs: Mapping[str, Path | None],
    figures: FigureFormat | None,
    names: Iterable[str],
) -> Path:
    """Returns the path of the report of a method once it and its figures have passed all checks."""
    report = Path(path)
    check_report("`path`", report, figures)
    check_outputs({"`path`": report, **figure_outputs(report, names, figures)}, inputs)
    return report


def _check_place(option: str, path: Path) -> None:
    if is_stream(path):
        if not os.access(path, os.W_OK):
            raise ArgumentError(f"{option} {path} cannot be written")
        return
    if path.is_symlink() and Path(os.path.realpath(path)).is_symlink():
        raise ArgumentError(f"{option} {path} is a link that leads to itself")
    # The target of a link is replaced, and not the link.
    folder = Path(os.path.realpath(path)).parent if path.is_symlink() else path.parent
    if not folder.is_dir():
        problem = "is not a folder" if folder.exists() else "does not exist"
        raise ArgumentError(f"the folder {folder} of {option} {problem}")
    if not os.access(folder, os.W_OK):
        raise ArgumentError(f"the folder {folder} of {option} cannot be written")
    if path.is_dir():
        raise ArgumentError(f"{option} {path} is a folder: expected a file to write")


def _check_input(option: str, path: Path, source: str, given: Path) -> None:
    if not given.is_dir():
        if _is_same_file(path, given):
            raise ArgumentError(f"{option} and {source} are the same file, {path}")
        if any(_is_same_file(path, file) for file in _beside(given)):
            raise ArgumentError(f"{option} {path} belongs to {source}, {given}")
        return
    # A bag may consist of links to files elsewhere.
    inside = Path(os.path.realpath(given)) in Path(os.path.realpath(path)).parents
    if inside or any(_is_same_file(path, file) for file in given.iterdir()):
        raise ArgumentError(f"{option} {path} is a file in the folder of {source}, {given}")


LOG_BEGINNINGS = (b"\x89MCAP", b"SQLite format 3\0", b"\x28\xb5\x2f\xfd")
"""First bytes of MCAP files, of SQLite databases, and of files that zstd has compressed."""

PART = re.compile(r"(.*?)(_\d+)?\.(mcap|db3)(\.zstd)?")
"""Name of a log file: that of its bag, the number of the part, the storage and the compression."""


def _beside(given: Path) -> list[Path]:
    """Paths of a recorder's files that belong to a log: its other parts and its database's."""
    if not _is_log(given):
        return []
    names = ["metadata.yaml", *(f"{given.name}-{suffix}" for suffix in ("wal", "shm", "journal"))]
    if of_log := PART.fullmatch(given.name):
        logs = ((file.name, PART.fullmatch(file.name)) for file in given.parent.iterdir())
        names += [name for name, part in logs if part is not None and part[1] == of_log[1]]
    return [given.with_name(name) for name in names]


def _is_log(path: Path) -> bool:
    """Returns whether a file is a log, which its first bytes show, whatever its name."""
    if not path.is_file():  # a pipe would wait for its writer, and lose the bytes that are read
        return False
    try:
        with path.open("rb") as file:
            return file.read(16).startswith(LOG_BEGINNINGS)
    except OSError:  # that it cannot be read is reported where it is opened
        return False


def _is_same_file(path: Path, other: Path) -> bool:
    if path.is_char_device():  # nothing is lost: /dev/null takes everything
        return False
    try:
        return path.samefile(other)
    except OSError:  # one of them does not exist
        return os.path.realpath(path) == os.path.realpath(other)
