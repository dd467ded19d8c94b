"""Figures of a result: the fit, its residuals, the estimate over time, and the excitation."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from tactid._base.values import UNITS, Z95, Array
from tactid._native import PARAMETER_NAMES, VALUE_NAMES
from tactid._results.identification import IdentificationData, Recorded
from tactid._results.payload import PayloadEstimate
from tactid._results.records import FitReport
from tactid._show import drawing
from tactid._show.drawing import EARLIER, ESTIMATE, TRUE, padded, remark
from tactid._show.reported import reported_history

STYLE = drawing.STYLE | {
    "axes.axisbelow": True,
    "axes.titlelocation": "left",
}
Places = NDArray[np.intp]

MEASURED, OUTLIER, HELD_OUT = "#8a94a0", "#e08a1e", "#eef1f4"

PANELS = ((0,), (1, 2, 3), (4, 7, 9), (5, 6, 8))
"""The rows of the figure of parameters: mass, centre, moments, products."""

FLOOR = 1e-8
"""A direction that is weaker than this, relative to the strongest, is rounding."""

SEGMENT = 256
"""Largest number of windows in a segment of a spectrum."""


def figures(result: Recorded) -> dict[str, Figure]:
    """Draws all figures that there are data for, by name."""
    drawers: dict[str, Callable[[], Figure]] = {}
    if len(result.history.times_s):
        drawers["parameters"] = lambda: parameters(result)
    if isinstance(result, IdentificationData):
        fit, observable = result.fit, observed(result.estimate)
        drawers |= {
            "fit": lambda: fit_panels(fit),
            "residuals": lambda: residuals(fit, result.cutoff_hz),
            "excitation": lambda: excitation(fit, observable),
        }
    with mpl.rc_context(STYLE):
        return {name: draw() for name, draw in drawers.items()}


def fit_panels(fit: FitReport) -> Figure:
    """Draws measured and predicted load, a panel for each channel."""
    count = len(fit.channels)
    rows = -(-count // 2)
    figure = Figure(figsize=(9.0, 0.9 + 1.7 * rows))
    panels = figure.subplots(rows, 2, sharex=True, squeeze=False)
    # Down the columns: forces on the left, moments on the right.
    styles: list[tuple[str, Array, dict[str, Any]]] = [
        ("measured", fit.measured, {"color": MEASURED, "linewidth": 2.2, "markersize": 11}),
        ("predicted", fit.predicted, {"color": ESTIMATE, "linewidth": 1.0}),
    ]
    for channel, axes in enumerate(panels.T.flat):
        _place_axis(axes, fit, labelled=channel < count and axes in panels[-1])
        if channel >= count:
            _time_axis_above(axes)
            continue
        _shade_held_out(axes, fit)
        for _, values, style in styles:
            _series(axes, fit, values[:, channel], **style)
        outlier = outliers(fit)
        _dots(axes, _places(fit)[outlier], fit.measured[outlier, channel])
        _name(axes, fit, channel)
    lines = [Line2D([], [], label=label, **_marks(fit), **style) for label, _, style in styles]
    _legend(figure, lines, fit)
    return figure


def residuals(fit: FitReport, cutoff: float) -> Figure:
    """Draws the residual of each channel, over time and over frequency; of poses, of each one."""
    count = len(fit.channels)
    figure = Figure(figsize=(9.0, 0.9 + 1.45 * count))
    widths = (1,) if _is_of_poses(fit) else (2, 1)
    panels = figure.subplots(count, len(widths), sharex="col", squeeze=False, width_ratios=widths)
    error = fit.measured - fit.predicted
    for channel, (axes, *spectra) in enumerate(panels):
        outlier = outliers(fit)
        limit = _largest(error[~outlier, channel]) or _largest(error[:, channel])
        _shade_held_out(axes, fit)
        _series(axes, fit, error[:, channel], color=ESTIMATE, linewidth=0.8)
        if limit > 0:
            axes.set_ylim(-1.15 * limit, 1.15 * limit)
            _dots(axes, _places(fit)[outlier], error[outlier, channel], 1.1 * limit)
            _sizes(axes, fit, error[:, channel], 1.1 * limit)
        _name(axes, fit, channel)
        regular = np.where(outlier, np.nan, error[:, channel])
        for spectral in spectra:
            _spectra(spectral, fit, cutoff, (fit.measured[:, channel], regular))
            spectral.set_ylabel(f"{fit.channels[channel].unit} / √Hz")
        _place_axis(axes, fit, labelled=channel == count - 1)
    style: dict[str, Any] = {"color": ESTIMATE, "linewidth": 0.8} | _marks(fit)
    lines = [Line2D([], [], label="measured less predicted", **style)]
    if not _is_of_poses(fit):
        panels[-1, 1].set_xlabel("frequency / Hz")
        lines += [
            Line2D([], [], color=MEASURED, label="measured (spectrum)"),
            Line2D([], [], color=TRUE, linestyle=":", linewidth=1.0, label="cutoff"),
        ]
    _legend(figure, lines, fit)
    return figure


def parameters(result: Recorded) -> Figure:
    """Draws the ten values over time, each with its 95 % interval."""
    figure = Figure(figsize=(9.0, 8.2))
    panels = figure.subplots(len(PANELS), 3, sharex=True)
    shown = reported_history(result)
    values = shown["values"]
    half_widths = Z95 * shown.get("std_devs", np.full_like(values, np.nan))
    for row, indices in enumerate(PANELS):
        for column, axes in enumerate(panels[row]):
            if column >= len(indices):
                axes.axis("off")
                continue
            index = indices[column]
            _history(axes, result, index, values[:, index], half_widths[:, index])
            axes.set_title(VALUE_NAMES[index])
            axes.set_ylabel(UNITS[index])
            axes.set_xlim(_span(result.history.times_s))
    for axes in panels[-1]:
        axes.set_xlabel("time / s")
    handles = [
        Line2D([], [], color=ESTIMATE, label="estimate from all until then"),
        Patch(color=ESTIMATE, alpha=0.2, linewidth=0, label="95 % interval"),
        Line2D([], [], color=TRUE, linestyle="--", linewidth=1.0, label="result"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
    return figure


def observed(estimate: PayloadEstimate) -> list[bool]:
    """Returns whether the motion excites each of the ten values."""
    return [each != "unobservable" for each in estimate.observability]


def excitation(fit: FitReport, observable: Sequence[bool]) -> Figure:
    """Draws how strongly the motion excites each direction, and what the direction consists of."""
    relative, weak = relative_excitation(fit, observable)
    figure = Figure(figsize=(9.0, 3.9))
    axes = figure.subplots()
    if not relative.any():
        axes.axis("off")
        remark(axes, "the motion excited nothing")
        return figure
    place = np.arange(len(relative))
    colors = np.where(weak, TRUE, ESTIMATE)
    axes.barh(place, np.maximum(relative, FLOOR), color=colors.tolist(), height=0.65)
    for at in place[relative < FLOOR]:
        axes.annotate(
            "none", (0.005, at), xycoords=("axes fraction", "data"), color=TRUE, va="center"
        )
    axes.set_yticks(place, [composition(row) for row in fit.excitation_directions])
    axes.invert_yaxis()
    axes.grid(visible=False, axis="y")
    axes.set_xscale("log")
    axes.set_xlim(min(relative[relative >= FLOOR].min() / 3, 0.09), 1.2)
    axes.set_xlabel("strength of excitation, relative to the strongest")
    if weak.any():
        named = [
            Patch(color=ESTIMATE, label="excited"),
            Patch(color=TRUE, label="too weak"),
        ]
        figure.legend(handles=named, loc="outside lower center", ncols=2)
    return figure


def relative_excitation(
    fit: FitReport, observable: Sequence[bool]
) -> tuple[Array, NDArray[np.bool_]]:
    """Returns the strength of each direction relative to the strongest, and which are too weak.

    A faint direction is too weak if it consists mostly of unobservable values.
    """
    strength = np.nan_to_num(fit.excitation, nan=0.0, posinf=0.0)
    relative = strength / (strength.max() or 1.0)
    unknown = ~np.array(observable)
    unknown_fraction = np.nan_to_num(fit.excitation_directions[:, unknown] ** 2).sum(axis=1)
    return relative, (relative < FLOOR) | ((relative < 0.01) & (unknown_fraction > 0.5))


def composition(direction: Array, most: int = 3) -> str:
    """Says what a direction consists of: its largest components in percent of its square."""
    percent = 100 * np.nan_to_num(direction) ** 2
    largest = [
        index for index in np.argsort(-percent, kind="stable")[:most] if percent[index] >= 4.5
    ]
    if not largest:
        return "a little of each" if percent.any() else "nothing"
    return ", ".join(
        PARAMETER_NAMES[index]
        if percent[index] > 99.5
        else f"{percent[index]:.0f} % {PARAMETER_NAMES[index]}"
        for index in largest
    )


def outliers(fit: FitReport) -> NDArray[np.bool_]:
    """Returns which windows have less than half of the full weight, (W,).

    Held-out windows are not among them.
    """
    weight = np.nan_to_num(fit.weights, nan=1.0, posinf=1.0)
    full = weight.max(initial=0.0)
    lowered: NDArray[np.bool_] = (weight < 0.5 * full) & ~fit.held_out
    return lowered


def spectrum(time: Array, values: Array) -> tuple[Array, Array]:
    """Returns frequencies, Hz, and the amplitude density by Welch's method.

    Both are empty for too few windows.

    Segments lie within stretches without a gap, and overlap by half.
    """
    step = _step(time)
    starts, ends = _stretches(time, values, step)
    length = min(SEGMENT, int((ends - starts).max(initial=0)))
    if length < 16:
        return np.zeros(0), np.zeros(0)
    window = np.hanning(length)
    powers = []
    for start, end in zip(starts, ends, strict=True):
        for at in range(start, end - length + 1, length // 2):
            segment = values[at : at + length]
            powers.append(np.abs(np.fft.rfft(window * (segment - segment.mean()))) ** 2)
    density: Array = 2 * step * np.mean(powers, axis=0) / (window @ window)
    # Without the mean, the first entry of a windowed spectrum is meaningless.
    frequency: Array = np.arange(1, length // 2 + 1) / (length * step)
    amplitude: Array = np.sqrt(density)[1:]
    return frequency, amplitude


def _spectra(axes: Axes, fit: FitReport, cutoff: float, signals: Sequence[Array]) -> None:
    for signal, color in zip(signals, (MEASURED, ESTIMATE), strict=True):
        frequency, density = spectrum(fit.times_s, signal)
        shown = density > 0
        if shown.any():
            axes.loglog(frequency[shown], density[shown], color=color)
    axes.minorticks_off()
    if not axes.lines:
        axes.set_yticks([])
        remark(axes, "no spectrum")
    elif axes.get_xlim()[0] < cutoff < axes.get_xlim()[1]:
        axes.axvline(cutoff, color=TRUE, linestyle=":", linewidth=1.0)


def _history(axes: Axes, result: Recorded, index: int, values: Array, half: Array) -> None:
    final = float(result.estimate.values[index])
    if not result.estimate.is_reported[index] or not np.isfinite(final):
        axes.set_yticks([])
        remark(axes, result.estimate.observability[index])
        return
    time = result.history.times_s
    axes.fill_between(time, values - half, values + half, color=ESTIMATE, alpha=0.2, linewidth=0)
    _line(axes, time, values, color=ESTIMATE)
    axes.axhline(final, color=TRUE, linestyle="--", linewidth=1.0)
    # The wide intervals of the beginning would hide all that follows.
    settled = np.concatenate([values - half, values + half, values])
    settled = settled[np.isfinite(settled)]
    shown = [final, *np.percentile(settled, (7, 93))] if settled.size else [final]
    low, high = min(shown), max(shown)
    if math.isclose(low, high, rel_tol=1e-8):  # a mass that is given as exact has rounding alone
        low = high = final
    axes.set_ylim(padded(low, high, 0.2))
    axes.ticklabel_format(axis="y", useOffset=False)


def _name(axes: Axes, fit: FitReport, channel: int) -> None:
    axes.set_title(fit.channels[channel].name.replace("$", r"\$"))  # no formula
    axes.set_ylabel(fit.channels[channel].unit)


def _legend(figure: Figure, lines: Sequence[Line2D], fit: FitReport) -> None:
    handles: list[Line2D | Patch] = list(lines)
    if outliers(fit).any():
        label = "left out" if _is_of_poses(fit) else "weight below one half"
        handles.append(Line2D([], [], color=OUTLIER, marker=".", linestyle="", label=label))
    if fit.held_out.any():
        handles.append(Patch(facecolor=HELD_OUT, edgecolor=EARLIER, label="held out"))
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))


def _dots(axes: Axes, places: Array, values: Array, limit: float = math.inf) -> None:
    """Draws outliers, and those beyond a limit as arrows that point to them from the edge."""
    beyond = np.where(np.abs(values) > limit, np.sign(values), 0)
    for sign, marker in ((0, "."), (1, "^"), (-1, "v")):
        shown = values[beyond == sign].clip(-limit, limit)
        axes.plot(places[beyond == sign], shown, marker, color=OUTLIER, markersize=5, zorder=3)


def _sizes(axes: Axes, fit: FitReport, values: Array, limit: float) -> None:
    """Writes the size of what is beyond a limit beside its arrow, for poses, which are few."""
    beyond = outliers(fit) & (np.abs(values) > limit) & _is_of_poses(fit)
    for place, value in zip(_places(fit)[beyond], values[beyond], strict=True):
        axes.annotate(
            f"{value:.3g}",
            (place, np.clip(value, -limit, limit)),
            xytext=(5, 0),
            textcoords="offset points",
            va="bottom" if value < 0 else "top",
            color=OUTLIER,
        )


def _shade_held_out(axes: Axes, fit: FitReport) -> None:
    if not fit.held_out.any():
        return
    half = _step(fit.times_s) / 2
    edges = np.flatnonzero(np.diff([False, *fit.held_out, False]))
    for start, end in edges.reshape(-1, 2):
        first, last = fit.times_s[start], fit.times_s[end - 1]
        axes.axvspan(first - half, last + half, color=HELD_OUT, linewidth=0, zorder=0)


def _is_of_poses(fit: FitReport) -> bool:
    """Returns whether the windows are poses at rest, which have no times."""
    return bool(np.isnan(fit.stride_s))


def _places(fit: FitReport) -> Array:
    """Returns where windows are on the axis: their times, s, or the numbers of the poses."""
    return fit.times_s + 1 if _is_of_poses(fit) else fit.times_s


def _place_axis(axes: Axes, fit: FitReport, *, labelled: bool) -> None:
    """Sets the limits of the axis of :func:`_places`, and its label."""
    places = _places(fit)
    if _is_of_poses(fit):
        axes.set_xlim(0.5, len(places) + 0.5)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    else:
        axes.set_xlim(_span(places))
    if labelled:
        axes.set_xlabel("pose" if _is_of_poses(fit) else "time / s")


def _series(axes: Axes, fit: FitReport, values: Array, **style: Any) -> None:
    _line(axes, _places(fit), values, **_marks(fit), **style)


def _marks(fit: FitReport) -> dict[str, Any]:
    """Returns how values are drawn: those of poses, which nothing connects, as points."""
    return {"linestyle": "", "marker": "."} if _is_of_poses(fit) else {}


def _line(axes: Axes, time: Array, values: Array, **style: Any) -> None:
    """Draws a line that does not bridge gaps, and marks each point where there are few."""
    gaps = np.flatnonzero(np.diff(time) > 3 * _step(time)) + 1
    broken = (np.insert(time, gaps, np.nan), np.insert(values, gaps, np.nan))
    axes.plot(*broken, **{"marker": "." if len(time) < 20 else "", **style})


def _time_axis_above(axes: Axes) -> None:
    """Shows the time axis of the panel above in the place that an odd number of panels leaves."""
    axes.spines[:].set_visible(False)
    axes.grid(visible=False)
    axes.yaxis.set_visible(False)
    axes.xaxis.tick_top()
    axes.tick_params(top=False, labeltop=True, labelbottom=False)


def _stretches(
    time: Array, values: Array, step: float
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Returns starts and ends of the stretches without a gap."""
    finite = np.isfinite(values)
    joined = finite[1:] & finite[:-1] & (np.abs(np.diff(time) - step) < 0.5 * step)
    edges = np.flatnonzero(np.diff([False, *joined, False]))
    return edges[0::2], edges[1::2] + 1


def _step(time: Array) -> float:
    """Returns the median time from one window to the next."""
    return float(np.median(np.diff(time))) if len(time) > 1 else 0.0


def _span(time: Array) -> tuple[float, float]:
    if len(time) == 0:
        return 0.0, 1.0
    low, high = float(time[0]), float(time[-1])
    return (low, high) if high > low else padded(low, high, 0.5)


def _largest(values: Array) -> float:
    return float(np.abs(values[np.isfinite(values)]).max(initial=0.0))
