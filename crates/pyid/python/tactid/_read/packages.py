"""Packages that only some recordings need, imported where they are used."""

from importlib import import_module
from typing import Any

from tactid._base.errors import ArgumentError

INSTALLED_WITH = {
    "pyarrow": "pyarrow",
    "rosbags": "rosbags mcap",
    "mcap": "rosbags mcap",
    "xacro": "xacro",
    "distributed": "'tactid[fleet]'",
    "obstore": "'tactid[fleet]'",
}
"""What pip installs for a package: those that one kind of file needs, together."""


def package(
    module: str,
    what: str,
    option: str | None = None,
    advice: str = "",
    does: str = "reads",
    extra: str = "",
) -> Any:
    """Imports a module of a package that need not be installed.

    Args:
        module: The module, such as ``pyarrow.parquet``.
        what: What needs the package, as the beginning of an error.
        option: The option that names the file.
        advice: What else helps, as the end of an error.
        does: What the package does with it, as a verb.
        extra: The extra of tactid that has the package with all that is needed besides.

    Raises:
        ArgumentError: The package is not installed.
    """
    try:
        return import_module(module)
    except ImportError:
        name = module.partition(".")[0]
        installed = f"'tactid[{extra}]'" if extra else INSTALLED_WITH[name]
        raise ArgumentError(
            f"{what}, which the Python package {name} {does}, but it is not installed: pip install"
            f" {installed}{advice}",
            option=option,
        ) from None
