"""A copy of a log with the wrenches of load and contact."""

from pathlib import Path
from typing import Any

from tactid import _native
from tactid._api.compensation import Load, Place, Progress
from tactid._base.files import write_atomically
from tactid._options.options import Options
from tactid._read.recordings import LogPath, opened
from tactid._results.compensation import CompensatedLog


def compensate_into(
    log: LogPath,
    folder: Path,
    file: str,
    options: Options,
    load: Load,
    place: Place,
    progress: Progress,
) -> CompensatedLog:
    """Writes a bag to an empty folder: the log with the topics of load and contact."""
    with opened([log], options, progress, method="tactile") as ([path], run):
        plain = run.options.plain()
        found: dict[str, Any] = _native.compensate_into(
            path, folder, file, plain, (load.fields, *place), run.progress
        )
    write_atomically(folder / "metadata.yaml", found["bag_metadata"])
    names = CompensatedLog.__dataclass_fields__
    return CompensatedLog(**{name: found[name] for name in names})
