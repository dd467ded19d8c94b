"""The files of the meshes that a URDF names."""

import os
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import unquote

MOST_BYTES = 64 << 20
"""Most bytes of a mesh that is read or shown: over a million triangles."""


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


def is_too_large(path: Path) -> bool:
    """Returns whether a mesh is too large to be read or shown."""
    return path.stat().st_size > MOST_BYTES


def read(uri: str, folder: Path | None) -> bytes | str:
    """Returns the bytes of a mesh, or the reason why there are none."""
    for path in candidates(uri, folder):
        if path.is_file():
            try:
                if is_too_large(path):
                    return f"{path} is larger than {MOST_BYTES >> 20} MiB"
                return path.read_bytes()
            except OSError as error:
                return f"{path} cannot be read: {error.strerror}"
    if uri.startswith("package://"):
        searched = "in AMENT_PREFIX_PATH, in ROS_PACKAGE_PATH, or in a folder above the URDF"
        return f"its file was not found {searched}"
    return "its file was not found"
