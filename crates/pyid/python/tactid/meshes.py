"""The files of the meshes that a URDF names."""

import os
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import unquote

MAX_MIB = 64
"""Largest size of one mesh, MiB: over a million triangles of a binary STL file."""
MAX_TOTAL_MIB = 96
"""Largest size of all meshes of a robot, MiB, each counted as often as the URDF names it."""


class Meshes:
    """The files of the meshes of one robot, within limits of their size.

    The limits keep a small URDF from taking much memory: it may name one file, or links to it, as
    often as it wants.
    """

    def __init__(self) -> None:
        self._total = 0

    def find(self, uri: str, folder: Path | None) -> Path | str:
        """Returns the file of a mesh, or the reason why there is none.

        ``folder`` is the one of the URDF.
        """
        # `Path.is_file` raises for a name that is too long.
        path = next((path for path in candidates(uri, folder) if os.path.isfile(path)), None)
        if path is None:
            searched = "in AMENT_PREFIX_PATH, in ROS_PACKAGE_PATH, or in a folder above the URDF"
            where = f" {searched}" if uri.startswith("package://") else ""
            return f"its file was not found{where}"
        size = path.stat().st_size
        if size > MAX_MIB << 20:
            return f"its file is larger than {MAX_MIB} MiB"
        if self._total + size > MAX_TOTAL_MIB << 20:
            return f"the meshes of the robot have more than {MAX_TOTAL_MIB} MiB with it"
        self._total += size
        return path

    def read(self, uri: str, folder: Path | None) -> bytes | str:
        """Returns the bytes of a mesh, or the reason why there are none."""
        found = self.find(uri, folder)
        if isinstance(found, str):
            return found
        try:
            with found.open("rb") as file:
                # The size of a file of the system's own, such as one of /proc, says nothing.
                return file.read(MAX_MIB << 20)
        except OSError as error:
            return f"its file cannot be read: {error.strerror}"


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
            yield from (above / rest for above in folder.parents)
