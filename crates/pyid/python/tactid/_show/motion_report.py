"""The report of a designed motion: one HTML file with its tables and figures."""

import html
from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure

from tactid._base.naming import Style
from tactid._base.output_files import FigureFormat
from tactid._native import VALUE_NAMES
from tactid._results.records import DesignedMotion
from tactid._show import captions, drawing, motion_text, page
from tactid._show.drawing import ESTIMATE, TRUE, Figures


def write_report(
    motion: DesignedMotion,
    path: Path,
    style: Style = "keyword",
    speed: float | None = None,
    form: FigureFormat | None = None,
) -> list[Path]:
    """Writes the report of a designed motion; returns the paths of its figures beside it.

    The files of the motion run at a fraction of its speed.
    """
    figures = Figures(form)
    return figures.write(path, render(motion, style, speed, figures))


def render(
    motion: DesignedMotion,
    style: Style = "keyword",
    speed: float | None = None,
    figures: Figures | None = None,
) -> str:
    """Returns the report as HTML, figures included."""
    lines = motion_text.lines(motion, style, speed)
    items = "".join(f"<li>{html.escape(line)}</li>" for line in lines)
    figures = figures or Figures()
    with mpl.rc_context(drawing.STYLE):
        shown = figures.html("motion", _motion(motion), captions.MOTION["motion"])
        shown += figures.html("intervals", _intervals(motion), captions.MOTION["intervals"])
        if motion.base_attitude_deg is not None:
            shown += figures.html("base", _base(motion), captions.MOTION["base"])
    values = _table(("value", "unit", "expected", "± 95 %", "of target"), motion_text.rows(motion))
    margins = [motion_text.margin_cells(margin) for margin in motion_text.most_used(motion)]
    return page.document(
        "tactid: designed motion",
        f"""<h1>Designed motion</h1>
<p class="lead">{html.escape(motion_text.heading(motion))}</p>
{values}
<ul>{items}</ul>
<h2>Motion</h2>
{shown}
<h2>Limits</h2>
{_table(("limit", "used", "at", ""), margins)}""",
    )


def _table(heads: tuple[str, ...], rows: list[list[str]]) -> str:
    head = "".join(f"<th>{html.escape(text)}</th>" for text in heads)
    body = "".join(
        "<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in row) + "</tr>\n"
        for row in rows
    )
    return f'<div class="wide"><table><thead><tr>{head}</tr></thead>\n{body}</table></div>'


def _motion(motion: DesignedMotion) -> Figure:
    figure = Figure(figsize=(9.0, 6.0))
    axes = figure.subplots(3, 1, sharex=True)
    places = [motion.joints.index(name) for name in motion.moving_joints]
    quantities = (
        ("position / rad", motion.q),
        ("velocity / (rad/s)", motion.qd),
        ("acceleration / (rad/s²)", motion.qdd),
    )
    for one, (name, values) in zip(axes, quantities, strict=True):
        for place in places:
            one.plot(
                motion.times_s, values[:, place], label=motion.joints[place].replace("$", r"\$")
            )
        one.set_ylabel(name)
    axes[-1].set_xlabel("time / s")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4)
    return figure


def _intervals(motion: DesignedMotion) -> Figure:
    figure = Figure(figsize=(9.0, 3.2))
    axes = figure.subplots()
    std_devs, ratios = motion.predicted_std_devs.tolist(), motion.interval_ratios.tolist()
    for k, name in enumerate(VALUE_NAMES):
        # The ratio of an interval to its target is the same fraction of the target at each time.
        of_target = ratios[k] * motion.history.std_devs[:, k] / std_devs[k]
        axes.plot(motion.history.times_s, 100 * motion.within * of_target, label=name)
    axes.axhline(100 * motion.within, color=TRUE, linewidth=0.8)
    axes.set_yscale("log")
    axes.set_xlabel("time / s")
    axes.set_ylabel("half interval / %")
    figure.legend(loc="outside right upper")
    return figure


def _base(motion: DesignedMotion) -> Figure:
    figure = Figure(figsize=(9.0, 2.2))
    axes = figure.subplots()
    axes.plot(motion.history.times_s, motion.history.base_attitude_deg, color=ESTIMATE)
    axes.set_ylim(bottom=0)
    axes.set_xlabel("time / s")
    axes.set_ylabel("largest so far / degrees")
    return figure
