"""A calibration in words: its table, and what a reader must know besides."""

import math
from typing import TYPE_CHECKING

import numpy as np

from tactid._base.naming import Style, listed
from tactid._base.text_table import as_text, empty_table
from tactid._base.values import Z95, digits_of
from tactid._results.calibration_data import CalibrationData, CalibrationRecording

if TYPE_CHECKING:
    from rich.table import Table

HEADINGS = (
    "gain",
    "Coulomb",
    "viscous",
    "load friction",
    "rotor inertia",
    "before",
    "after",
    "held out",
)
"""Headings of the columns of :func:`rows` after those of the joint and its unit."""


def rich_table(arm: CalibrationData) -> "Table":
    """Returns the table of a calibration: a row for each joint."""
    table = empty_table()
    table.add_column("joint")
    table.add_column("unit", style="dim")
    for heading in HEADINGS:
        table.add_column(heading, justify="right")
    for row in rows(arm):
        table.add_row(*row)
    return table


def rows(arm: CalibrationData) -> list[list[str]]:
    """Returns the cells of the table of a calibration: a list for each joint."""
    still = {each.data["joint"] for each in arm.shortages if each.kind == "joint_still"}
    # The friction and the rotor of a joint that stands are not known.
    known = [math.nan if name in still else 1.0 for name in arm.joints]
    return [
        [
            name,
            arm.units[j],
            _gain(arm, j),
            _number(known[j] * arm.coulomb[j]),
            _number(known[j] * arm.viscous[j]),
            "–" if name in still else f"{100 * arm.load_friction[j]:.1f} %",
            _number(known[j] * arm.rotor_inertia[j]),
            _number(arm.residual_before[j]),
            _number(arm.residual_after[j]),
            _number(arm.residual_held_out[j]),
        ]
        for j, name in enumerate(arm.joints)
    ]


def heading(arm: CalibrationData) -> str:
    """Says what the numbers of the table are."""
    return (
        f"Joint efforts of the arm to {arm.tip}: gain ± 95 %, friction, and rms residual before and"
        " after the calibration"
    )


def lines(arm: CalibrationData, style: Style = "keyword") -> list[str]:
    """Returns what a reader must know besides the table, a line each."""
    return [
        *(each.worded(style) for each in arm.contradictions),
        *(each.worded(style) for each in arm.shortages),
        *_without_unloaded(arm),
        *(
            _hold_out(arm, recording)
            for recording in arm.recordings
            if recording.role == "hold_out"
        ),
        *(line for recording in arm.recordings for line in _of_recording(recording, style)),
        gains(arm),
        _delay(arm),
        _data(arm),
    ]


def _without_unloaded(arm: CalibrationData) -> list[str]:
    """Says what the masses of the payloads mean where no recording is without a payload."""
    if not arm.recordings or any(recording.role == "unloaded" for recording in arm.recordings):
        return []
    return [
        "No recording is without a payload: the masses of the payloads are what the arm holds"
        " beyond the URDF, and errors of the links are hard to distinguish from gains. Record the"
        " unloaded arm, too."
    ]


def gains(arm: CalibrationData) -> str:
    """Says where the gains come from."""
    if not arm.gain_std_dev.any():
        given = not np.all(arm.effort_gain == 1.0)
        what = "Efforts times the given gains" if given else "Efforts"
        return f"{what} count as torques: no gain was to be found."
    prior = "" if arm.gain_prior is None else f", known to {100 * arm.gain_prior:g} % before"
    source = "loaded recordings" if len(arm.payloads) else "unloaded recordings alone"
    return f"Gains were found from {source}{prior}."


def _delay(arm: CalibrationData) -> str:
    half_width = Z95 * 1e3 * arm.delay.std_dev_s
    digits = digits_of(half_width)
    size = f"{abs(1e3 * arm.delay.delay_s):.{digits}f} ± {half_width:.{digits}f} ms"
    if abs(1e3 * arm.delay.delay_s) < half_width:
        return f"Efforts show no delay: {size}."
    return f"Efforts {'lag' if arm.delay.delay_s >= 0.0 else 'lead'} the motion by {size}."


def text(arm: CalibrationData) -> str:
    """Returns the whole as text, for a reader who writes Python."""
    return "\n".join([heading(arm), as_text(rich_table(arm)), "", *lines(arm)])


def _hold_out(arm: CalibrationData, recording: CalibrationRecording) -> str:
    pairs = zip(
        arm.joints, recording.residual_before, recording.residual_after, arm.units, strict=True
    )
    each = [
        f"{name} {_number(before)} → {_number(after)} {unit}" for name, before, after, unit in pairs
    ]
    return f"Held out, {recording.path.name}: rms residual {listed(each)}."


def _of_recording(recording: CalibrationRecording, style: Style) -> list[str]:
    noticed = [
        *(finding.worded(style) for finding in recording.findings),
        *map(str, recording.faults),
    ]
    return [
        *(f"{recording.path.name}: {sentence}" for sentence in noticed),
        # These name the file.
        *(f"{damage}; what could be read was used." for damage in recording.damage),
    ]


def _data(arm: CalibrationData) -> str:
    gravity = " ".join(f"{entry:g}" for entry in arm.gravity_m_s2)
    return (
        f"{arm.windows} windows of {arm.window_s:.3g} s; cutoff {arm.cutoff_hz:.3g} Hz; gravity"
        f" {gravity} m/s²."
    )


def _gain(arm: CalibrationData, joint: int) -> str:
    factor = float(arm.effort_gain[joint])
    value, half_width = factor * arm.gain[joint], Z95 * abs(factor) * arm.gain_std_dev[joint]
    if not half_width:
        return f"{value:.4g}"
    digits = digits_of(half_width)
    return f"{value:.{digits}f} ± {half_width:.{digits}f}"


def _number(value: float) -> str:
    # Three digits, zeros at the end included.
    return f"{value + 0.0:#.3g}".rstrip(".") if math.isfinite(value) else "–"
