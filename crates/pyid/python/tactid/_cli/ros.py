"""The modules that need the user's installation of ROS 2."""

import importlib
from types import ModuleType

from tactid._base.errors import TactidError


def ros_module(name: str, otherwise: str = "") -> ModuleType:
    """Returns a module of ``_ros``.

    Args:
        name: The module.
        otherwise: End of the error's sentence: what needs no ROS.

    Raises:
        TactidError: ROS 2 cannot be imported.
    """
    try:
        return importlib.import_module(f"tactid._ros.{name}")
    except ImportError as error:
        raise TactidError(
            f"the Python packages of ROS 2 cannot be imported ({error}): source the"
            " setup file of ROS 2 (source /opt/ros/DISTRIBUTION/setup.bash) and use its Python"
            f"{otherwise}"
        ) from None
