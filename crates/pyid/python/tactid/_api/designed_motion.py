"""A designed motion: its states, what it will determine, and how much of its limits it uses."""

from __future__ import annotations

import os
from pathlib import Path

from tactid._base.field_docs import with_fields
from tactid._base.output_files import FigureFormat, checked_report
from tactid._documents import motion_files, motion_json
from tactid._documents.motion_speed import SPEED, optional_speed
from tactid._results import records
from tactid._show import captions, motion_text


@with_fields
class DesignedMotion(records.DesignedMotion):
    """A motion of all joints of a robot, as :func:`tactid.design_excitation` returns it.

    ``print`` shows the intervals that it will give and the limits that it uses. The arrays are in
    the robot's order of joints; joints that do not move the tip rest.
    """

    def write(self, folder: str | os.PathLike[str], *, speed: float = SPEED) -> None:
        """Writes the motion into a folder, which is made where it does not exist.

        The files are those of the command ``tactid excite``: ``trajectory.mcap``,
        ``trajectory.csv``, ``trajectory.script`` (Universal Robots), ``franka.csv``,
        ``moveit.yaml`` and ``result.json``. All but the last run the motion at a fraction of its
        speed, for a first look at it; the intervals are predicted for the whole speed. Each says
        what was tested for collisions.

        Args:
            folder: The folder to write into.
            speed: Fraction of the designed speed, from 0.01 to 1: times are divided by it,
                velocities multiplied by it, and accelerations by its square.

        Raises:
            ArgumentError: The folder cannot be written, or is a file, or the speed is out of range.
            LogError: ``trajectory.mcap`` cannot be written.
        """
        motion_files.write(self, Path(folder), speed)

    def report(
        self,
        path: str | os.PathLike[str],
        *,
        speed: float | None = None,
        figures: FigureFormat | None = None,
    ) -> None:
        """Writes the report: one HTML file with the table and figures of the motion.

        Args:
            path: The file to write.
            speed: The speed of the files that the report describes, as :meth:`write` took it.
                Default: the report describes no files.
            figures: Writes each figure beside the report, too: as ``png``, ``svg`` or ``pdf``.

        Raises:
            ArgumentError: The folder does not exist, the name does not end in ``.html``, or the
                speed is out of range.
        """
        from tactid._show import motion_report  # imports matplotlib, which takes a while to load

        checked = checked_report(path, {}, figures, captions.MOTION)
        motion_report.write_report(self, checked, speed=optional_speed(speed), form=figures)

    def to_json(self, *, speed: float | None = None) -> str:
        """Returns the result of the design as JSON, as ``result.json`` has it.

        Args:
            speed: The speed of the files that the result describes, as :meth:`write` took it.
                Default: the result describes no files.

        Raises:
            ArgumentError: The speed is out of range.
        """
        return motion_json.to_json(self, optional_speed(speed))

    def __repr__(self) -> str:
        return f"<tactid.DesignedMotion: {self.duration_s:g} s, {len(self.joints)} joints>"

    def __str__(self) -> str:
        return motion_text.text(self)
