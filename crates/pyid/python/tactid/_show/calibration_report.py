"""The report of a calibration: one HTML file with table, remarks and a figure of each joint."""

import html
from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tactid._base.naming import Style
from tactid._base.output_files import FigureFormat
from tactid._base.values import Array
from tactid._results.calibration_data import CalibrationData, CalibrationRecording
from tactid._show import calibration_text, drawing, page
from tactid._show.drawing import EARLIER, ESTIMATE, TRUE, Figures

MEASURED = "#8a94a0"
STYLE = drawing.STYLE | {"axes.axisbelow": True, "axes.titlelocation": "left"}

PAUSE_S = 1.0
"""Time between two recordings in a figure, s."""

TITLES = {"unloaded": "unloaded", "loaded": "loaded", "hold_out": "held out"}

CAPTION = (
    "{joint}. Left: over velocity, the effort less the torque of the calibrated links, measured and"
    " of the model: friction, offset and the inertia of the rotor. The model's points do not lie on"
    " one curve where friction depends on the load, or the joint accelerates. Right: the"
    " effort over time, one recording after another, as it was measured, as the URDF alone gives"
    " it, and as the calibration does."
)


def write_report(
    arm: CalibrationData,
    path: Path,
    style: Style = "keyword",
    form: FigureFormat | None = None,
) -> list[Path]:
    """Writes the report of a calibration; returns the paths of its figures beside it."""
    figures = Figures(form)
    return figures.write(path, render(arm, style, figures))


def render(arm: CalibrationData, style: Style = "keyword", figures: Figures | None = None) -> str:
    """Returns the report as HTML, figures included."""
    sentences = calibration_text.lines(arm, style)
    items = "".join(f"<li>{html.escape(sentence)}</li>" for sentence in sentences)
    figures = figures or Figures()
    shown = "".join(
        figures.html(name, drawn, CAPTION.format(joint=name))
        for name, drawn in zip(arm.joints, joint_figures(arm), strict=False)
    )
    if not shown:
        shown = "<p>The calibration was read from a file, which has no recordings.</p>"
    return page.document(
        f"tactid: calibration of the arm to {arm.tip}",
        f"""<h1>Calibration of the arm to <code>{html.escape(arm.tip)}</code></h1>
<p class="lead">{html.escape(_sources(arm))}</p>
{_table(arm)}
<h2>Remarks</h2>
<ul>{items}</ul>
<h2>Measured and modelled</h2>
{shown}""",
    )


def joint_figures(arm: CalibrationData) -> list[Figure]:
    """Draws a figure of each joint; none where the calibration has no recordings."""
    if not arm.recordings:
        return []
    with mpl.rc_context(STYLE):
        return [_joint_figure(arm, joint) for joint in range(len(arm.joints))]


def _joint_figure(arm: CalibrationData, joint: int) -> Figure:
    figure = Figure(figsize=(9.0, 3.1))
    left, right = figure.subplots(1, 2, width_ratios=(1, 2))
    unit = arm.units[joint]
    _over_velocity(left, arm.recordings, joint)
    left.set_xlabel("velocity / (m/s)" if unit == "N" else "velocity / (rad/s)")
    left.set_ylabel(f"effort less links / {unit}" if unit == "N" else "effort less links / (N m)")
    _over_time(right, arm.recordings, joint)
    right.set_xlabel("time / s")
    right.set_ylabel(f"effort / {unit}" if unit == "N" else "effort / (N m)")
    left.set_title(arm.joints[joint].replace("$", r"\$"))  # no formula
    handles, labels = right.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(handles))
    return figure


def _over_velocity(axes: Axes, recordings: Sequence[CalibrationRecording], joint: int) -> None:
    for recording in recordings:
        velocity, friction = recording.velocity[:, joint], recording.friction[:, joint]
        torque = recording.calibrated[:, joint] - friction
        axes.plot(
            velocity, recording.measured[:, joint] - torque, ".", color=MEASURED, markersize=3
        )
        axes.plot(velocity, friction, ".", color=ESTIMATE, markersize=2)


def _over_time(axes: Axes, recordings: Sequence[CalibrationRecording], joint: int) -> None:
    start = 0.0
    for number, recording in enumerate(recordings):
        time = start + recording.times_s - recording.times_s[0]
        series: tuple[tuple[str, Array, str, float], ...] = (
            ("measured", recording.measured, MEASURED, 2.2),
            ("URDF alone", recording.described, TRUE, 0.8),
            ("calibrated", recording.calibrated, ESTIMATE, 1.0),
        )
        for label, values, color, width in series:
            shown = label if number == 0 else None
            x, y = _with_gaps(time, values[:, joint])
            axes.plot(x, y, color=color, linewidth=width, label=shown)
        if number:
            axes.axvline(start - PAUSE_S / 2, color=EARLIER, linewidth=0.8)
        place = (float(time[0]), 1.0)
        axes.annotate(
            TITLES[recording.role],
            place,
            xycoords=("data", "axes fraction"),
            fontsize=8,
            color=EARLIER,
        )
        start = float(time[-1]) + PAUSE_S


def _with_gaps(time: Array, values: Array) -> tuple[Array, NDArray[np.float64]]:
    """Returns a line that is interrupted where windows are missing."""
    step = np.diff(time)
    if not len(step):
        return time, values
    breaks = np.flatnonzero(step > 3 * np.median(step)) + 1
    return np.insert(time, breaks, time[breaks]), np.insert(values, breaks, np.nan)


def _sources(arm: CalibrationData) -> str:
    recordings = [
        f"{recording.path.name} ({TITLES[recording.role]}, {recording.duration_s:.0f} s)"
        for recording in arm.recordings
    ]
    return f"From {', '.join(recordings)}." if recordings else "Read from its file."


def _table(arm: CalibrationData) -> str:
    _, *others = calibration_text.HEADINGS
    titles = ("joint", "", "gain ± 95 %", *others)
    heads = "".join(f"<th>{head}</th>" for head in titles)
    body = ""
    for name, unit, *cells in calibration_text.rows(arm):
        numbers = "".join(f"<td>{cell}</td>" for cell in cells)
        body += f'<tr><td>{html.escape(name)}</td><td class="unit">{unit}</td>{numbers}</tr>\n'
    return f"""<div class="wide"><table>
<caption>Friction is in the unit of the efforts, angles in rad. The last three columns are the rms
residual with the URDF alone, with the calibration, and on windows that a second fit did not
see.</caption>
<thead><tr>{heads}</tr></thead>
<tbody>{body}</tbody></table></div>"""
