"""A designed motion in words: its table, and what a reader must know besides."""

import math
from typing import TYPE_CHECKING

from tactid._base.naming import Style, abridged, listed, option_name
from tactid._base.text_table import as_text, empty_table
from tactid._base.values import UNITS, Z95, digits_of
from tactid._native import VALUE_NAMES
from tactid._results.records import CollisionFinding, DesignedMotion, Margin

if TYPE_CHECKING:
    from rich.table import Table

WORKSPACE = "the workspace"
"""Name of the box that the tip and the payload's box stay in."""

MOST_SHOWN = 6
"""Largest number of limits in the table of those that are used most."""


LONGEST_S = 3600.0
"""Longest motion that is designed, s."""


def heading(motion: DesignedMotion) -> str:
    """Says what the numbers of the table are."""
    return (
        f"Motion of {motion.duration_s:.4g} s for the payload at {motion.tip} ({motion.method}):"
        " predicted 95 % intervals"
    )


def rich_table(motion: DesignedMotion) -> "Table":
    """Returns the table of predicted intervals: a row for each value."""
    shown = empty_table()
    shown.add_column("value")
    shown.add_column("unit", style="dim")
    for name in ("expected", "± 95 %", "of target"):
        shown.add_column(name, justify="right")
    for row in rows(motion):
        shown.add_row(*row)
    return shown


def rows(motion: DesignedMotion) -> list[list[str]]:
    """Returns the cells of the table: a list for each of the ten values."""
    expected, ratios = motion.expected_payload.tolist(), motion.interval_ratios.tolist()
    std_devs = motion.predicted_std_devs.tolist()
    cells = []
    for k, (name, unit) in enumerate(zip(VALUE_NAMES, UNITS, strict=True)):
        half_width = Z95 * std_devs[k]
        digits = digits_of(half_width)
        value, interval = f"{expected[k]:.{digits}f}", f"{half_width:.{digits}f}"
        cells.append([name, unit, value, interval, f"{100 * ratios[k]:.0f} %"])
    return cells


def limits_table(motion: DesignedMotion) -> "Table":
    """Returns the table of the limits of which most is used."""
    shown = empty_table()
    shown.add_column("limit")
    for name in ("used", "at"):
        shown.add_column(name, justify="right")
    shown.add_column("")
    for margin in most_used(motion)[:MOST_SHOWN]:
        shown.add_row(*margin_cells(margin))
    return shown


def most_used(motion: DesignedMotion) -> list[Margin]:
    """Returns the margins, those of which most is used first."""
    return sorted(motion.margins, key=lambda margin: -margin.used)


def margin_cells(margin: Margin) -> list[str]:
    """Returns the cells of one limit."""
    used = f"{100 * margin.used:.1f} %"
    limit = margin.limit
    if margin.distance_m is not None:
        limit += f" ({1e3 * margin.distance_m:.0f} mm)"
    return [limit, used, f"{margin.time_s:.2f} s", "binds" if margin.binds else ""]


def lines(
    motion: DesignedMotion, style: Style = "keyword", speed: float | None = None
) -> list[str]:
    """Returns what a reader must know besides the table, a line each.

    Args:
        motion: The motion.
        style: Who reads the lines.
        speed: Fraction of the designed speed at which the files of the motion run; None where no
            files are described.
    """
    ratios = motion.interval_ratios.tolist()
    largest = max(ratios)
    name = VALUE_NAMES[ratios.index(largest)]
    target = f"{100 * motion.within:g} % of the largest of its kind"
    reached = f"every value will be known within {target}"
    if largest > 1:
        remedy = _remedy(name, largest, motion.duration_s)
        reached = f"not every value will be known within {target}: {remedy}"
    said = [f"If the noise is as given, {reached}."]
    if motion.assumed_noise:
        names = listed([option_name(each, style) for each in motion.assumed_noise])
        said.append(f"The noise is assumed: give {names} of your sensors.")
    if motion.base_attitude_deg is not None and motion.base_position_m is not None:
        said.append(
            f"The base turns by at most {motion.base_attitude_deg:.3g} degrees and moves by at most"
            f" {1e3 * motion.base_position_m:.3g} mm with the expected payload."
        )
    binding = motion.binding_constraints
    if binding:
        more = f" and {len(binding) - MOST_SHOWN} more" if len(binding) > MOST_SHOWN else ""
        said.append(f"What binds: {', '.join(binding[:MOST_SHOWN])}{more}.")
    limited = {margin.limit for margin in motion.margins}
    free = [name for name in motion.moving_joints if f"the effort of joint {name}" not in limited]
    if free:
        said.append(
            f"The URDF has no effort limit for {abridged(free)}: their torques are not limited."
        )
    said += collision_lines(motion, style)
    if speed is not None:
        said.append(speed_line(motion, speed))
        if speed < 1:
            full = "--speed 100%" if style == "command-line" else "`speed=1`"
            said[-1] += f" Look at a dry run, then write the files with {full} for these intervals."
    return said


def _remedy(name: str, ratio: float, duration_s: float) -> str:
    """Says how a value whose interval is some times its target can be known.

    The intervals of a motion that is made again and again fall with the square root of its number.
    """
    needed_s = duration_s * ratio**2
    if needed_s <= LONGEST_S:
        return f"a motion of {_rounded_up(needed_s)} s is long enough for {name}"
    return (
        f"the interval of {name} is {ratio:.3g} times its target, which no motion within these"
        " limits reaches in an hour: allow more of what binds"
    )


def _rounded_up(seconds: float) -> str:
    """Returns a duration in two digits, rounded up."""
    unit = 10.0 ** (math.floor(math.log10(seconds)) - 1)
    return f"{math.ceil(seconds / unit) * unit:g}"


def speed_line(motion: DesignedMotion, speed: float) -> str:
    """Says at which speed the files of a motion run, and what that does to its intervals."""
    duration = f"{motion.duration_s / speed:.4g} s"
    if speed == 1:
        return f"The files run at 100 % of the designed speed, in {duration}."
    return (
        f"The files run at {100 * speed:g} % of the designed speed, in {duration}: velocities are"
        f" {100 * speed:g} % and accelerations {100 * speed**2:.3g} % of those designed. A slower"
        " motion determines the payload, above all its inertia, less precisely: the intervals are"
        " predicted for 100 %."
    )


def collision_lines(motion: DesignedMotion, style: Style | None = None) -> list[str]:
    """Says what was tested for collisions and what was not, a line each.

    Args:
        motion: The motion.
        style: Who reads the lines; None where they name no option, as in a file.
    """
    payload = ["the payload's box"] if motion.payload_tested else []
    keep_out = [each for each in motion.surroundings if each != WORKSPACE]
    said = []
    if motion.collision_findings is None:
        tested = [*(payload or ["the tip"]), *keep_out] if keep_out else []
        said.append(
            "The links of the robot are not tested for collisions: the motion may run the robot"
            " through itself. Look at it before the robot makes it."
        )
    else:
        tested = ["the links of the robot", *payload, *keep_out]
    if tested:
        said.append(f"Tested for collisions: {listed(tested)}.")
    if WORKSPACE in motion.surroundings:
        said.append(f"In the workspace stay {listed(['the tip', *payload])}, and no other links.")
    if not keep_out:
        boxes = "" if style is None else f": {option_name('keep_out', style)} gives its box"
        said.append(
            f"What stands around the robot, such as a floor or a table, is not tested{boxes}."
        )
    if motion.collision_findings is not None and not payload:
        boxes = "" if style is None else f": {option_name('payload_box', style)} gives its box"
        said.append(f"The payload is not tested for collisions{boxes}.")
    return said + [collision_line(finding) for finding in motion.collision_findings or ()]


def collision_line(finding: CollisionFinding) -> str:
    """Says what the test for collisions leaves out, and names each pair."""
    shown = [" and ".join(pair) for pair in finding.pairs]
    pairs = ": " + ", ".join(shown) if shown else ""
    return finding.text[0].upper() + finding.text[1:] + pairs + "."


def text(motion: DesignedMotion) -> str:
    """Returns heading, tables and remarks as plain text."""
    parts = [as_text(rich_table(motion)), as_text(limits_table(motion))]
    return "\n".join([heading(motion), *parts, *lines(motion)])
