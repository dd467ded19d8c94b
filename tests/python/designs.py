"""A designed motion of the built-in arm that several files of tests look at."""

from functools import cache
from pathlib import Path

import tactid

URDF = Path(__file__).parents[2] / "crates" / "sim" / "robots" / "tactid.urdf"
START = [0.0, -1.2, 1.6, -0.4, 1.5, 0.0]
BOX = [[-0.1, -0.08, 0.0], [0.14, 0.1, 0.2]]


@cache
def designed() -> tactid.DesignedMotion:
    robot = tactid.Manipulator.from_urdf(URDF)
    return tactid.design_excitation(
        robot, start=START, duration=2.0, payload_mass_max=2.0, payload_box=BOX, rate=500.0
    )
