"""Descriptions of robots in other forms than URDF: xacro, and Denavit-Hartenberg tables in TOML."""

import os
from pathlib import Path

from tactid._base.errors import ArgumentError, ModelError
from tactid._base.files import is_urdf_text
from tactid._options.options import Options
from tactid._read.dh import urdf_from_toml
from tactid._read.packages import package


def as_urdf(given: str | os.PathLike[str]) -> str | os.PathLike[str]:
    """Returns a URDF, as a path or a text, for the path of a robot in another form.

    Raises:
        ModelError: The file is not what its name says.
        ArgumentError: It is xacro, which is not installed.
    """
    if is_urdf_text(given):
        return given
    try:
        path = Path(given)
    except TypeError:  # which is reported where the URDF is read
        return given
    if path.suffix == ".xacro":
        return _expanded(path)
    if path.suffix == ".toml":
        return urdf_from_toml(path)
    return given


def with_urdf(options: Options) -> Options:
    """Returns options in which a robot in another form is a URDF."""
    return options if options.urdf is None else options.replace(urdf=as_urdf(options.urdf))


def _expanded(path: Path) -> str:
    """Returns the URDF that a xacro file describes."""
    advice = f"xacro {path} > robot.urdf"
    xacro = package("xacro", f"{path} is xacro", "urdf", f", or expand it elsewhere: {advice}")
    if not path.is_file():
        raise ArgumentError(f"there is no file {path}", option="urdf")
    try:
        return str(xacro.process_file(str(path)).toxml())
    except KeyboardInterrupt:
        raise
    except (Exception, SystemExit) as error:  # xacro has many, and exits where it is a command
        reason = " ".join(str(error).split()) or type(error).__name__
        raise ModelError(
            f"xacro cannot expand {path}: {reason}; where its packages are found, this does:"
            f" {advice}",
            "urdf",
        ) from None
