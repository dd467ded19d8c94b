"""The executable ``live``: the command ``tactid live``."""

import sys

from tactid.__main__ import main as tactid


def main() -> None:
    """Runs ``tactid live`` with the arguments of ``ros2 run`` and ``ros2 launch``."""
    sys.argv[1:1] = ["live"]
    tactid()
