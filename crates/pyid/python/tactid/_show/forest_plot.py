"""The forest plot of several recordings: each value with its interval, alone and together."""

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tactid._base.values import UNITS
from tactid._native import VALUE_NAMES
from tactid._results.combination import CombinationData
from tactid._results.payload import PayloadEstimate
from tactid._show.combination_text import WHOLE
from tactid._show.drawing import ESTIMATE, remark
from tactid._show.recording_plots import PANELS, STYLE

SINGLE = "#5b6570"
LONGEST_NAME = 24
"""Largest number of characters of a recording's name beside a plot."""


def forest(result: CombinationData) -> Figure:
    """Draws a panel for each of the ten values: the recordings, and below them the whole.

    A value that is unobservable has no mark. The band is the interval of the whole.
    """
    # Between the tick labels of panels side by side.
    with mpl.rc_context(STYLE | {"figure.constrained_layout.w_pad": 0.12}):
        return _figure(result)


def _figure(result: CombinationData) -> Figure:
    estimates = [*(run.estimate for run in result.runs), result.estimate]
    names = [*map(_short, result.names), WHOLE]
    height = 0.75 + 0.24 * len(estimates)
    figure = Figure(figsize=(9.0, len(PANELS) * height))
    panels = figure.subplots(len(PANELS), 3, sharey=True, squeeze=False)
    for row, indices in zip(panels, PANELS, strict=True):
        for place, axes in enumerate(row):
            if place < len(indices):
                _panel(axes, indices[place], estimates)
            else:
                axes.set_axis_off()
    places = np.arange(len(names))
    panels[0, 0].set_ylim(len(names) - 0.5, -0.5)
    for axes in panels[:, 0]:
        axes.set_yticks(places, names)
    return figure


def _panel(axes: Axes, index: int, estimates: list[PayloadEstimate]) -> None:
    """Draws one value of all estimates, the last of which is the whole."""
    known = False
    for place, estimate in enumerate(estimates):
        value, interval = estimate.reported_values[index], estimate.reported_intervals[index]
        if value is None:
            continue
        known, whole = True, place == len(estimates) - 1
        low, high = interval or (value, value)
        if whole:
            axes.axvspan(low, high, color=ESTIMATE, alpha=0.12, linewidth=0)
        axes.errorbar(
            [value],
            [place],
            xerr=[[value - low], [high - value]],
            fmt="D" if whole else "o",
            color=ESTIMATE if whole else SINGLE,
            markersize=5 if whole else 4,
            capsize=3,
        )
    axes.set_title(f"{VALUE_NAMES[index]} / {UNITS[index]}")
    axes.tick_params(axis="y", length=0)
    axes.locator_params(axis="x", nbins=4)
    if not known:
        remark(axes, estimates[-1].observability[index])


def _short(name: str) -> str:
    return name if len(name) <= LONGEST_NAME else f"…{name[1 - LONGEST_NAME :]}"
