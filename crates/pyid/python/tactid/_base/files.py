"""Output files: a regular file is written whole or not at all, a device or pipe is written through.

A file is written beside its destination and then renamed, so that nobody reads half of it. The
destination of a symbolic link is the file that it points to; the link stays. A device, a named pipe
or a standard stream is never replaced: it gets the bytes of the complete file.
"""

import functools
import hashlib
import os
import secrets
import shutil
import stat
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from tactid._base.errors import ArgumentError, TactidError


@contextmanager
def atomic_path(path: Path) -> Iterator[Path]:
    """Yields a temporary path, whose file becomes ``path`` if the block ends without an error."""
    through, target = is_stream(path), Path(os.path.realpath(path))
    with _errors_name("the folder of temporary files (TMPDIR)" if through else path, None):
        temporary = _temporary(Path(tempfile.gettempdir()) if through else target.parent)
    try:
        with _errors_name(path, temporary):
            yield temporary
            # A device or a pipe may have come in the meantime: it is not replaced either.
            if through or is_stream(path):
                _write_through(temporary, path)
            else:
                _store(temporary)
                temporary.chmod(_mode(target))
                temporary.replace(target)
    finally:
        temporary.unlink(missing_ok=True)


def _temporary(folder: Path) -> Path:
    """Creates an empty file under a hidden name, which nobody else may read."""
    return _created(folder, 0o600)


def _created(folder: Path, mode: int) -> Path:
    path = folder / f".tactid-{secrets.token_hex(8)}"
    os.close(os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY, mode))
    return path


def _mode(target: Path) -> int:
    """Returns the permissions of a file that is to be replaced, or those of any new one."""
    if target.exists():
        return stat.S_IMODE(target.stat().st_mode)
    # Reading the process's mask would change it for other threads.
    probe = _created(target.parent, 0o666)
    mode = stat.S_IMODE(probe.stat().st_mode)
    probe.unlink()
    return mode


def _store(path: Path) -> None:
    """Waits until a file is on the disk: a power failure after its renaming must not empty it."""
    with path.open("rb") as file:
        os.fsync(file.fileno())


SCHEMES = ("s3", "gs", "az", "https", "http")
"""Beginnings of addresses in stores."""


def check_no_address(path: str | os.PathLike[str]) -> None:
    """Checks that a path is no address in a store, also where its slashes have become one.

    Raises:
        ArgumentError: It is one.
    """
    scheme, colon, rest = os.fspath(path).partition(":/")
    if colon and scheme in SCHEMES:
        raise ArgumentError(
            f"{scheme}://{rest.lstrip('/')} is an address in a store, where a path is expected:"
            " addresses are those of the recordings of `tactid fleet`"
        )


def is_stream(path: Path) -> bool:
    """Returns whether a path is written through and not replaced.

    It is a device, a named pipe, or the file behind standard output or error.
    """
    try:
        status = path.stat()
    except OSError:  # there is nothing yet
        return False
    return not (stat.S_ISREG(status.st_mode) or stat.S_ISDIR(status.st_mode)) or (
        _descriptor(status) is not None
    )


def _descriptor(status: os.stat_result) -> int | None:
    """Returns the standard output or error that a file is, also where it is redirected to a file.

    ``/dev/stdout`` of a redirected standard output is the file that the shell has opened. A file of
    the same name in its place would be lost to the shell.
    """
    for descriptor in (1, 2):
        try:
            if os.path.samestat(os.fstat(descriptor), status):
                return descriptor
        except OSError:  # it is closed
            continue
    return None


def _write_through(source: Path, path: Path) -> None:
    with source.open("rb") as complete, open(_stream(path), "wb") as stream:
        shutil.copyfileobj(complete, stream)


def _stream(path: Path) -> int:
    """Opens a device, a named pipe or a standard stream for writing.

    Raises:
        ArgumentError: A regular file has taken its place since the path was checked. It is left
            as it is.
    """
    standard = _descriptor(path.stat())
    if standard is not None:
        for printed in filter(None, (sys.stdout, sys.stderr)):
            printed.flush()  # what was printed before stays before
        return os.dup(standard)
    # Opening neither creates nor empties what is there.
    opened = os.open(path, os.O_WRONLY)
    if stat.S_ISREG(os.fstat(opened).st_mode):
        os.close(opened)
        raise ArgumentError(
            f"{path} has become a file while the result was computed: it is left as it is"
        )
    return opened


@contextmanager
def _errors_name(path: Path | str, temporary: Path | None) -> Iterator[None]:
    """Makes errors name the path that the user gave, not the temporary one."""
    try:
        yield
    except OSError as error:
        if temporary is None or error.filename in (None, str(temporary), temporary):
            error.filename, error.filename2 = str(path), None
        raise
    except TactidError as error:
        if temporary is not None:
            error.message = error.message.replace(str(temporary), str(path))
        raise


def _check_folder_name(path: Path, option: str) -> None:
    """Refuses a folder whose name is that of a log in it.

    Raises:
        ArgumentError: The name ends as that of a file.
    """
    if path.suffix.lower() in (".mcap", ".db3"):
        raise ArgumentError(
            f"{option} {path}: expected the name of the folder to write, without {path.suffix}"
        )


@contextmanager
def new_folder(path: Path, option: str) -> Iterator[None]:
    """Creates the folder that an option names, unless it is there.

    If the block ends with an error and without a file, what was created is removed.

    Raises:
        ArgumentError: It cannot be created or written, or it is the folder of a recording.
    """
    _check_folder_name(path, option)
    if (path / "metadata.yaml").exists():
        raise ArgumentError(f"{option} {path} is the folder of a recording: give another one")
    missing = [folder for folder in (path, *path.parents) if not folder.exists()]
    there = next(folder for folder in (path, *path.parents) if folder.exists())
    if not there.is_dir():
        raise ArgumentError(f"{option} {path} needs a folder, but {there} is a file")
    if not os.access(there, os.W_OK):
        raise ArgumentError(f"the folder {there} of {option} cannot be written")
    try:
        path.mkdir(parents=True, exist_ok=True)
        yield
    except BaseException:
        for folder in missing:
            with suppress(OSError):  # it has files, or was not created
                folder.rmdir()
        raise


@contextmanager
def whole_folder(path: Path, option: str) -> Iterator[Path]:
    """Yields an empty folder that becomes the one of an option if the block ends without an error.

    Raises:
        ArgumentError: There is something else than an empty folder, or it cannot be created.
    """
    _check_folder_name(path, option)
    target = Path(os.path.realpath(path))
    if target.exists() and not (target.is_dir() and not any(target.iterdir())):
        raise ArgumentError(f"{option} {path} exists already: give a new folder")
    if not target.parent.is_dir():
        raise ArgumentError(f"the folder {target.parent} of {option} does not exist")
    if not os.access(target.parent, os.W_OK):
        raise ArgumentError(f"the folder {target.parent} of {option} cannot be written")
    temporary = target.parent / f".tactid-{secrets.token_hex(8)}"
    temporary.mkdir()
    try:
        with _errors_name(path, temporary):
            yield temporary
            for file in temporary.iterdir():
                _store(file)
            temporary.rename(target)
    except BaseException:
        shutil.rmtree(temporary, ignore_errors=True)
        raise


def write_atomically(path: Path, content: str | bytes) -> None:
    """Writes a file so that it is there whole or not at all.

    A name that is not UTF-8, such as that of a log, is written with replacement characters.
    """
    encoded = content if isinstance(content, bytes) else content.encode(errors="replace")
    with atomic_path(path) as temporary:
        temporary.write_bytes(encoded)


def is_urdf_text(given: object) -> bool:
    """Returns whether what stands for a URDF is its text, and not a path."""
    return isinstance(given, str) and given.lstrip("\ufeff").lstrip().startswith("<")


def sha256(path: Path) -> str:
    """Returns the SHA-256 of a file as hexadecimal digits; a file is read again if it changes."""
    status = path.stat()
    return _sha256(path, status.st_size, status.st_mtime_ns)


@functools.cache
def _sha256(path: Path, _size: int, _changed_ns: int) -> str:
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while block := file.read(1 << 20):
            digest.update(block)
    return digest.hexdigest()
