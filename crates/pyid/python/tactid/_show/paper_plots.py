"""Figures in the manner of the paper's figures 5 to 10."""

from collections.abc import Sequence
from dataclasses import dataclass

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from tactid._base.values import UNITS
from tactid._native import VALUE_NAMES
from tactid._results.identification import Recorded
from tactid._results.truth import Truth
from tactid._show.drawing import EARLIER, ESTIMATE, STYLE, TRUE, padded, remark

PAIRS = {6: (0, 1), 7: (2, 3), 8: (4, 5), 9: (7, 6), 10: (9, 8)}
"""Indices of the two parameters that each of the paper's figures shows."""

FIGURES = {number: f"figure_{number:02}" for number in (5, *PAIRS)}
"""Name of each of the paper's figures; figure 5 shows the convergence."""

ENLARGED = 10.0
"""Length of the enlarged end of the time axis, s."""


@dataclass(frozen=True)
class Phase:
    """A phase of the run, s, and which joint is driven in it."""

    start: float
    end: float
    label: str


@dataclass(frozen=True)
class Pass:
    """Ten values over one presentation of the log: s, and SI in the order of ``VALUE_NAMES``."""

    time: NDArray[np.float64]
    values: NDArray[np.float64]


@dataclass(frozen=True)
class History:
    """The estimate over time, and which values were identified."""

    passes: Sequence[Pass]
    """Each presentation of the log, the first one first."""
    identifiable: Sequence[bool]
    phases: Sequence[Phase] = ()

    @classmethod
    def of(cls, result: Recorded, phases: Sequence[Phase]) -> "History":
        """Splits the history into its passes."""
        time, values = result.history.times_s, result.history.values
        epoch = np.array(getattr(result.history, "epoch", np.zeros(len(time))))
        passes = [Pass(time[epoch == e], values[epoch == e]) for e in np.unique(epoch)]
        return cls(passes, result.estimate.identifiable, phases)


def figures(history: History, truth: Truth | None) -> dict[str, Figure]:
    """Draws all figures, by name."""
    with mpl.rc_context(STYLE):
        drawn = {FIGURES[5]: _convergence(history, truth)}
        for number, indices in PAIRS.items():
            drawn[FIGURES[number]] = parameters(history, truth, indices)
    return drawn


def parameters(history: History, truth: Truth | None, indices: Sequence[int]) -> Figure:
    """Draws some parameters, each over the whole time and, enlarged, at the end."""
    figure = Figure(figsize=(9.0, 0.8 + 2.1 * len(indices)))
    axes = figure.subplots(len(indices), 2, width_ratios=(2, 1), sharex="col", squeeze=False)
    final = history.passes[-1]
    end = _end(final)
    late = final.time >= end - ENLARGED
    for row, index in enumerate(indices):
        whole, close = axes[row]
        true = None if truth is None else truth.actual[index]
        for earlier in history.passes[:-1]:
            whole.plot(earlier.time, earlier.values[:, index], color=EARLIER, linewidth=0.8)
        for panel in (whole, close):
            _line(panel, final.time, final.values[:, index], true)
        whole.set_ylabel(f"{VALUE_NAMES[index]} / {UNITS[index]}")
        whole.set_ylim(_settled_limits(history, index, true))
        close.ticklabel_format(axis="y", useOffset=False)
        close.set_ylim(_close_limits(final.values[late, index], true, truth, index))
        if not history.identifiable[index]:
            remark(whole, "not identifiable from this motion")
        _mark_phases(whole, history.phases, label=row == 0)
    axes[0, 1].set_title(f"last {min(ENLARGED, end):g} s")
    for panel, start in ((axes[-1, 0], 0.0), (axes[-1, 1], max(0.0, end - ENLARGED))):
        panel.set_xlabel("time / s")
        panel.set_xlim(start, end)
    _legend(figure, history, truth)
    return figure


def _end(presentation: Pass) -> float:
    """Returns the end of the time axis, s: the last sample is a step before the round number."""
    return float(np.round(presentation.time[-1], 1)) or float(presentation.time[-1])


def _line(
    axes: Axes, time: NDArray[np.float64], values: NDArray[np.float64], true: float | None
) -> None:
    axes.plot(time, values, color=ESTIMATE)
    if true is not None:
        axes.axhline(true, color=TRUE, linestyle="--", linewidth=1.0)


def _legend(figure: Figure, history: History, truth: Truth | None) -> None:
    several = len(history.passes) > 1
    handles = [Line2D([], [], color=ESTIMATE, label="last pass" if several else "identified")]
    if several:
        name = "first pass" if len(history.passes) == 2 else "earlier passes"
        handles.insert(0, Line2D([], [], color=EARLIER, linewidth=0.8, label=name))
    if truth is not None:
        handles.append(
            Line2D([], [], color=TRUE, linestyle="--", linewidth=1.0, label="true value")
        )
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))


def _settled_limits(history: History, index: int, true: float | None) -> tuple[float, float]:
    """Returns limits that show the convergence but not the spikes of the first rows."""
    values = np.concatenate([each.values[:, index] for each in history.passes])
    values = values[np.isfinite(values)]
    shown = [*np.percentile(values, (1, 99))] if values.size else [0.0]
    return padded(min([*shown, *_given(true)]), max([*shown, *_given(true)]), 0.15)


def _close_limits(
    values: NDArray[np.float64], true: float | None, truth: Truth | None, index: int
) -> tuple[float, float]:
    """Returns limits that show at least 1 % of the scale, lest rounding look like noise."""
    values = values[np.isfinite(values)]
    shown = [*values, *_given(true)] or [0.0]
    low, high = padded(min(shown), max(shown), 0.15)
    if truth is not None:
        middle, least = (low + high) / 2, 0.01 * truth.scales[index]
        low, high = min(low, middle - least), max(high, middle + least)
    return low, high


def _given(true: float | None) -> list[float]:
    return [] if true is None else [true]


def _mark_phases(axes: Axes, phases: Sequence[Phase], *, label: bool) -> None:
    for phase in phases:
        if phase.start > 0:
            axes.axvline(phase.start, color="#8a94a0", linewidth=0.8, linestyle=":")
        if label:
            axes.annotate(
                phase.label,
                ((phase.start + phase.end) / 2, 1.0),
                xycoords=("data", "axes fraction"),
                xytext=(0, 4),
                textcoords="offset points",
                ha="center",
                color="#5b6570",
                fontsize=9,
            )


def _convergence(history: History, truth: Truth | None) -> Figure:
    """Draws the error of each value in the last pass, or the values where no truth is known."""
    figure = Figure(figsize=(9.0, 4.0))
    axes = figure.subplots()
    final = history.passes[-1]
    for index, name in enumerate(VALUE_NAMES):
        values = final.values[:, index]
        if truth is not None:
            error = 100 * np.abs(values - truth.actual[index]) / truth.scales[index]
            values = _largest_lately(final.time, error)
        style = "-" if history.identifiable[index] else ":"
        axes.plot(final.time, values, style, color=f"C{index}", label=name)
    if truth is None:
        axes.set_ylabel("value / SI")
        axes.set_yscale("symlog")
    else:
        axes.set_ylabel("error / %")
        axes.set_yscale("log")
        axes.set_ylim(1e-4, 1e3)
    axes.set_xlabel("time / s")
    axes.set_xlim(0, _end(final))
    _mark_phases(axes, history.phases, label=True)
    figure.legend(loc="outside right upper")
    return figure


def _largest_lately(time: NDArray[np.float64], error: NDArray[np.float64]) -> NDArray[np.float64]:
    """Returns the largest error in each span of time, since an error may pass through zero."""
    spans = 150
    span = np.floor(time * spans / max(time[-1], 1e-9)).astype(int).clip(max=spans - 1)
    largest: NDArray[np.float64] = np.zeros(spans)
    np.maximum.at(largest, span, np.nan_to_num(error))
    lately: NDArray[np.float64] = largest[span]
    return lately
