"""The files of the meshes that a URDF names."""

import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from urllib.parse import unquote

MAX_MIB = 64
"""Largest size of one mesh, MiB: over a million triangles of a binary STL file."""
MAX_TOTAL_MIB = 96
"""Largest size of all meshes of a robot, MiB, each counted as often as the URDF names it."""


MAX_NAMES = 1000
"""Largest number of different meshes of a robot that are searched."""

MAX_FOLDERS = 12
"""Largest number of folders above a URDF in which its packages are searched."""


class Meshes:
    """The files of the meshes of one robot, within limits of their size.

    The limits keep a small URDF from taking much memory: it may name one file, or links to it, as
    often as it wants.
    """

    def __init__(self) -> None:
        self._found: dict[str, tuple[Path, int] | str] = {}
        self._total = 0

    def find(self, uri: str, folder: Path | None) -> Path | str:
        """Returns the file of a mesh, or the reason why it is not used.

        Args:
            uri: Name of the mesh in the URDF.
            folder: Folder of the URDF; None for a URDF that is no file.
        """
        if uri not in self._found:
            if len(self._found) == MAX_NAMES:
                return f"the URDF names more than {MAX_NAMES} other meshes"
            self._found[uri] = _search(uri, folder)
        found = self._found[uri]
        if isinstance(found, str):
            return found
        path, size = found
        if self._total + size > MAX_TOTAL_MIB << 20:
            return f"with it, the meshes of the robot exceed {MAX_TOTAL_MIB} MiB"
        self._total += size
        return path

    def read(self, uri: str, folder: Path | None) -> bytes | str:
        """Returns the bytes of the file that :meth:`find` returns, or the reason."""
        found = self.find(uri, folder)
        try:
            return found if isinstance(found, str) else found.read_bytes()
        except OSError as error:
            return f"its file cannot be read: {error.strerror}"


def _search(uri: str, folder: Path | None) -> tuple[Path, int] | str:
    """Returns the file of a mesh and its size in bytes, or the reason why it is not used."""
    paths = list(candidates(uri, folder))
    # `Path.is_file` raises for a name that is too long.
    path = next((path for path in paths if os.path.isfile(path)), None)
    if path is None:
        return _absence(uri, paths)
    try:
        with path.open("rb") as file:
            size = os.fstat(file.fileno()).st_size
    except OSError as error:
        return f"its file cannot be read: {error.strerror}"
    # Files of the system, such as those of /proc, have no size and may block their reader.
    if size == 0:
        return "its file has no content"
    if size > MAX_MIB << 20:
        return f"its file is larger than {MAX_MIB} MiB"
    return path, size


def _absence(uri: str, paths: Sequence[Path]) -> str:
    if any(map(os.path.lexists, paths)):
        return "it is not a regular file"
    searched = "in AMENT_PREFIX_PATH, in ROS_PACKAGE_PATH, or in a folder above the URDF"
    return "its file was not found" + (f" {searched}" if uri.startswith("package://") else "")


def candidates(uri: str, folder: Path | None) -> Iterator[Path]:
    """Yields where the file of a mesh may be, the likeliest place first.

    A name without a scheme is relative to the folder of the URDF. A package is looked for in the
    environment of ROS, then in the folders above the URDF.
    """
    scheme, found, rest = uri.partition("://")
    if not found:
        yield Path(uri) if folder is None else folder / uri
    elif scheme == "file":
        yield Path(unquote(rest))
    elif scheme == "package":
        package, _, inside = rest.partition("/")
        prefixes = [Path(p) for p in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if p]
        yield from (prefix / "share" / package / inside for prefix in prefixes)
        sources = [Path(p) for p in os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep) if p]
        yield from (source / package / inside for source in sources)
        yield from (source / inside for source in sources if source.name == package)
        if folder is not None:
            # A URDF mostly stands in its own package, some folders down.
            yield from (above / rest for above in folder.parents[:MAX_FOLDERS])
