"""The figures of the report of a fleet."""

from collections.abc import Callable, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.dates import AutoDateLocator, ConciseDateFormatter
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tactid._base.values import Z95
from tactid._fleet.analysis import Robot
from tactid._show.drawing import EARLIER, ESTIMATE, STYLE, TRUE, padded

COLOURS = (ESTIMATE, "#2a8a5b", "#8b5fbf", "#b8860b", "#1f9e9e", "#a0446c", "#5b6570")
"""Colours of clusters in the order of their first recordings; further ones share the last."""


LEAST_MARGIN_S = 60.0
"""Time that is shown before the first recording and after the last one, s."""


def payloads(robots: Sequence[Robot]) -> Figure:
    """Draws the mass over time of each robot, with a colour for each cluster."""
    return _panels(robots, _masses)


def offsets(robots: Sequence[Robot]) -> Figure:
    """Draws the offset of the forces over time of each robot."""
    return _panels(robots, _forces)


def _panels(robots: Sequence[Robot], draw: Callable[[Axes, Robot], None]) -> Figure:
    with mpl.rc_context(STYLE):
        rows = (len(robots) + 1) // 2
        figure = Figure(figsize=(9.5, 2.4 * rows))
        panels = figure.subplots(rows, 2, squeeze=False).ravel()
        for axes, robot in zip(panels, robots, strict=False):
            draw(axes, robot)
            axes.set_title(robot.name)
            if not robot.has_clock:
                axes.set_xlabel("number of the recording")
                continue
            times = [each.time_s for each in robot.payloads]
            axes.set_xlim(*_dates(_with_margin(min(times), max(times))))
            locator = AutoDateLocator(maxticks=6)  # type: ignore[no-untyped-call]
            axes.xaxis.set_major_locator(locator)
            axes.xaxis.set_major_formatter(
                ConciseDateFormatter(locator)  # type: ignore[no-untyped-call]
            )
        for axes in panels[len(robots) :]:
            axes.set_axis_off()
    return figure


def _with_margin(first_s: float, last_s: float) -> list[float]:
    margin_s = max(0.03 * (last_s - first_s), LEAST_MARGIN_S)
    return [first_s - margin_s, last_s + margin_s]


def _dates(times_s: Sequence[float]) -> NDArray[np.datetime64]:
    return (np.array(times_s) * 1e3).astype("datetime64[ms]")


def _places(robot: Robot, times_s: Sequence[float]) -> Any:
    """Returns where recordings are drawn: at their times, or by their numbers without a clock."""
    return _dates(times_s) if robot.has_clock else np.arange(1, len(times_s) + 1)


def _masses(axes: Axes, robot: Robot) -> None:
    labels = np.array(robot.labels)
    times = _places(robot, [each.time_s for each in robot.payloads])
    masses = np.array([each.values[0] for each in robot.payloads])
    half = Z95 * robot.scatter * np.sqrt([each.covariance[0, 0] for each in robot.payloads])
    for place in range(len(robot.clusters)):
        chosen = labels == place
        colour = COLOURS[min(place, len(COLOURS) - 1)]
        axes.errorbar(
            times[chosen],
            masses[chosen],
            yerr=half[chosen],
            fmt="o",
            color=colour,
            markersize=3,
            elinewidth=0.8,
            label=str(place + 1) if place < len(COLOURS) else None,
        )
    if len(robot.clusters) > 1:
        axes.legend(ncols=len(COLOURS), fontsize=8)
    configured = [(each.row.get("configured") or [np.nan])[0] for each in robot.payloads]
    if np.isfinite(configured).any():
        axes.step(times, configured, where="post", color=TRUE, linewidth=1.0)
    axes.set_ylim(*padded(float((masses - half).min()), float((masses + half).max()), 0.08))
    axes.set_ylabel("mass / kg")


def _forces(axes: Axes, robot: Robot) -> None:
    times, values = robot.offsets()
    dates = _places(robot, times.tolist())
    named = zip("xyz", values.T, (ESTIMATE, "#2a8a5b", TRUE), strict=False)
    for name, force, colour in named:
        axes.plot(dates, force, "o", color=colour, markersize=2.5, label=f"F{name}")
    axes.axhline(0.0, color=EARLIER, linewidth=0.6)
    axes.set_ylabel("offset / N")
    axes.legend(ncols=3, fontsize=8)
