"""The command ``tactid excite``: the motion from which a payload is identified quickly."""

from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from tactid._api.designed_motion import DesignedMotion
from tactid._api.excitation import design_excitation
from tactid._base.errors import ArgumentError
from tactid._base.files import new_folder
from tactid._base.output_files import FigureFormat, figure_outputs
from tactid._base.terminal import printable
from tactid._cli import option_flags, option_text
from tactid._cli.command import interruptible
from tactid._cli.console import (
    FIGURES,
    check_files,
    notes,
    print_whole,
    print_written,
    progress,
    write_files,
)
from tactid._documents import motion_files
from tactid._documents.motion_speed import LEAST_SPEED, SPEED
from tactid._native import Manipulator
from tactid._options.options import OWN, options_for
from tactid._read.descriptions import as_urdf
from tactid._show import captions, motion_text

REPORT = "report.html"
"""Name of the report in the folder of a motion."""


def excite(
    urdf: Annotated[Path, typer.Option(help="The robot's URDF file, without the payload.")],
    out: Annotated[
        Path,
        typer.Option(
            help="Folder for the motion, its result and its report; files of these names in it"
            " are replaced."
        ),
    ],
    base: Annotated[
        Literal["fixed", "floating"] | None,
        typer.Option(
            help="Whether the base floats. Default: fixed, unless its motion is bounded.",
            show_default=False,
        ),
    ] = None,
    speed: Annotated[
        str,
        typer.Option(
            help="Fraction of the designed speed at which the files run, in percent with its sign,"
            " at most 100%. The intervals are predicted for 100%.",
        ),
    ] = f"{100 * SPEED:g}%",
    figures: Annotated[
        FigureFormat | None,
        typer.Option(help=FIGURES),
    ] = None,
    **arguments: Any,
) -> None:
    """Designs the motion from which a payload is identified quickly, within the robot's limits.

    The numbers of one option are separated by commas or by spaces: --from 0 -1.2 1.6 -0.4 1.5 0.
    """
    outputs = {f"{name} in --out": out / name for name in (*motion_files.NAMES, REPORT)}
    outputs |= figure_outputs(out / REPORT, captions.MOTION, figures)
    fraction = _speed(speed)
    with new_folder(out, "--out"):
        replaced = check_files(outputs, {"--urdf": urdf})
        motion = _design(urdf, base, arguments)
        report = {out / REPORT: partial(_write_report, motion, fraction, figures)}
        written = write_files({**motion_files.writers(motion, out, fraction), **report})
    with interruptible(f"wrote {out}"):
        _print(motion, fraction)
        print_written(f"Wrote {out}: {', '.join(file.name for file in written)}.", replaced)


def _speed(text: str) -> float:
    """Reads the speed of the files, before the design takes its time."""
    speed = option_text.fraction("--speed", text)
    if not LEAST_SPEED <= speed <= 1:
        raise ArgumentError(
            f"--speed is {text!r}: expected a percentage from {100 * LEAST_SPEED:g}% to 100%, the"
            " designed speed, which is within the limits of the robot"
        )
    return speed


def _design(
    urdf: Path, base: Literal["fixed", "floating"] | None, arguments: dict[str, Any]
) -> DesignedMotion:
    keywords = option_flags.values(arguments, OWN["design"].values())
    floats = "base_attitude" in keywords or "base_position" in keywords
    robot = Manipulator.from_urdf(as_urdf(urdf), base or ("floating" if floats else "fixed"))
    for finding in robot.findings:
        notes.print(finding.worded("command-line"), markup=False)
    with interruptible("no motion was written"), progress("designing") as done:
        return design_excitation(
            robot,
            options=option_flags.read(arguments, "design"),
            progress=done,
            **keywords,
        )


def _print(motion: DesignedMotion, speed: float) -> None:
    print(printable(motion_text.heading(motion)))
    print_whole(motion_text.rich_table(motion))
    print_whole(motion_text.limits_table(motion))
    for line in motion_text.lines(motion, "command-line", speed):
        notes.print(line, markup=False)


def _write_report(
    motion: DesignedMotion, speed: float, figures: FigureFormat | None, path: Path
) -> list[Path]:
    with notes.status("drawing"):
        from tactid._show import motion_report  # imports matplotlib, which takes a while to load

        return motion_report.write_report(motion, path, "command-line", speed, figures)


option_flags.show(
    excite,
    option_flags.parameters([*OWN["design"].values(), *options_for("design")]),
)
