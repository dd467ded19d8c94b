"""A log, the robot in it and what it holds, or a designed motion, in Rerun's viewer.

What is shown comes from the log (:mod:`tactid._view.scene`, with the shapes of the URDF from
:mod:`tactid._view.shapes`) or the motion (:mod:`tactid._view.motion`), and from a result
(:mod:`tactid._view.estimate`); only :mod:`tactid._view.draw` knows Rerun.
"""

import subprocess
import sys
from pathlib import Path

from tactid._base.errors import ArgumentError, TactidError
from tactid._view.estimate import Estimate
from tactid._view.motion import is_motion, motion_scene
from tactid._view.scene import Scene, read_scene


def record(
    log: Path,
    path: Path,
    *,
    result: Path | None = None,
    urdf: Path | None = None,
    tip: str | None = None,
) -> list[str]:
    """Writes a recording, an ``.rrd`` file, that the viewer opens.

    Args:
        log: The folder of a rosbag2 bag, an ``.mcap`` or ``.db3`` file, or a designed motion.
        path: The recording: it is there whole afterwards, or not at all.
        result: A ``result.json`` of ``tactid identify``, whose payload and curves are shown, too.
        urdf: The robot, where it is not the log's ``/robot_description``.
        tip: The frame that the payload is attached to, where it is not the result's.

    Returns:
        What is not shown, and why, a sentence each.
    """
    try:
        from tactid._view import draw
    except ModuleNotFoundError as error:
        if error.name is None or error.name.partition(".")[0] not in ("rerun", "rerun_bindings"):
            raise
        raise TactidError("Rerun is missing, which shows it: pip install rerun-sdk") from None
    estimate = None if result is None else Estimate.read(result)
    scene = _scene(log, urdf, estimate)
    # A name that is not UTF-8 is shown with replacement characters.
    name = log.name.encode(errors="replace").decode()
    return draw.record(scene, estimate, path, name=name, tip=tip)


def _scene(log: Path, urdf: Path | None, estimate: Estimate | None) -> Scene:
    if not is_motion(log):
        return read_scene(log, urdf, None if estimate is None else estimate.start_ns)
    if estimate is not None:
        raise ArgumentError(
            f"`result` is of a log, but {log} is a designed motion", option="result"
        )
    return motion_scene(log, urdf)


def open_viewer(recording: Path) -> None:
    """Opens the viewer on a recording, and returns when it is closed."""
    # A viewer that is open already would take the recording and leave it to us.
    command = [sys.executable, "-m", "rerun", "--new", str(recording)]
    done = subprocess.run(command, stderr=subprocess.PIPE, text=True, check=False)
    if done.returncode != 0:
        lines = [line.strip() for line in done.stderr.splitlines() if line.strip()]
        errors = [line for line in lines if line.lower().startswith("error:")] or lines[-1:]
        why = errors[-1].partition(":")[2].strip(" .") if errors else f"exit code {done.returncode}"
        raise TactidError(
            f"the viewer did not open: {why}; `save` writes what it would show to an .rrd file",
            option="save",
        )
