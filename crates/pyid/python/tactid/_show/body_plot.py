"""The payload as its equivalent ellipsoid, in the frame that holds it."""

from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from tactid._base import bodies
from tactid._base.values import Array, Values
from tactid._show.drawing import STYLE

AXES = "xyz"
COLORS = ("#c8502d", "#3c8d40", "#1f5fa8")
"""Colours of the frame's axes x, y and z: red, green and blue."""

BODY, INNER = "#5d4a8c", "#a99cc9"

VIEWS = ((0, 1, "from above"), (0, 2, "from the front"), (1, 2, "from the side"))
"""Index of the axis to the right, index of the axis upwards, and name of each view."""


def ellipsoid(values: Values, half_widths: Values, *, solid: bool) -> Figure | None:
    """Draws three views and one in perspective; None where the centre of mass is unknown.

    Only the centre is drawn where the body is not ``solid``: its inertia is unknown or impossible.
    """
    known = [float("nan") if value is None else value for value in values]
    com = np.array(known[1:4])
    if not np.isfinite(com).all():
        return None
    # Semi-axes as columns, so that this matrix makes the ellipsoid of the unit sphere.
    shape = np.zeros((3, 3))
    if solid:
        lengths, directions = bodies.ellipsoid(known)
        shape = directions * lengths
    with mpl.rc_context(STYLE):
        return _views(com, half_widths[1:4], shape)


def _views(com: Array, half_widths: Values, shape: Array) -> Figure:
    figure = Figure(figsize=(9.0, 8.4))
    reach = np.sqrt((shape**2).sum(axis=1))
    low, high = np.minimum(com - reach, 0.0), np.maximum(com + reach, 0.0)
    half = 0.58 * (float((high - low).max()) or 1.0)
    limits = [(middle - half, middle + half) for middle in (low + high) / 2]
    for place, (right, up, name) in zip((1, 3, 4), VIEWS, strict=True):
        axes = figure.add_subplot(2, 2, place)
        pair = [right, up]
        _flat(axes, com[pair], [half_widths[axis] for axis in pair], shape[pair])
        for axis, tip in ((right, (0.45 * half, 0.0)), (up, (0.0, 0.45 * half))):
            _arrow(axes, tip, axis)
        axes.set_title(name, loc="left")
        axes.set_xlabel(f"{AXES[right]} / m")
        axes.set_ylabel(f"{AXES[up]} / m")
        axes.set_aspect("equal")
        axes.set_xlim(limits[right])
        axes.set_ylim(limits[up])
    _perspective(figure, com, shape, limits)
    handles: list[Line2D | Patch] = [
        Line2D([], [], color=BODY, marker="o", label="centre of mass, 95 %"),
        Line2D([], [], color=COLORS[0], label="axes of the frame: x"),
        Line2D([], [], color=COLORS[1], label="y"),
        Line2D([], [], color=COLORS[2], label="z"),
    ]
    if shape.any():
        outline = Patch(facecolor=(BODY, 0.12), edgecolor=BODY, label="ellipsoid")
        handles[1:1] = [outline, Line2D([], [], color=INNER, label="its axes")]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
    return figure


def _flat(axes: Axes, com: Array, half_widths: Values, shape: Array) -> None:
    """Draws the projection of the ellipsoid, which is an ellipse, with the semi-axes in it."""
    turn, lengths, _ = np.linalg.svd(shape, full_matrices=False)
    angle = np.linspace(0, 2 * np.pi, 181)
    outline = com[:, None] + turn * lengths @ [np.cos(angle), np.sin(angle)]
    if shape.any():
        axes.fill(*outline, facecolor=(BODY, 0.12), edgecolor=BODY)
    for semi_axis in shape.T:
        axes.plot(*np.transpose([com - semi_axis, com + semi_axis]), color=INNER, linewidth=0.8)
    x, y = com
    across, along = (half or 0.0 for half in half_widths)
    axes.errorbar(x, y, along, across, color=BODY, marker="o", markersize=5, capsize=3, zorder=3)


def _arrow(axes: Axes, tip: tuple[float, float], axis: int) -> None:
    style = {"arrowstyle": "-|>", "color": COLORS[axis], "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", tip, (0.0, 0.0), arrowprops=style)
    beyond = (8, -1) if tip[0] else (0, 9)
    axes.annotate(
        AXES[axis],
        tip,
        beyond,
        textcoords="offset points",
        color=COLORS[axis],
        ha="center",
        va="center",
    )


def _perspective(
    figure: Figure, com: Array, shape: Array, limits: Sequence[tuple[float, float]]
) -> None:
    axes: Any = figure.add_subplot(2, 2, 2, projection="3d")
    if shape.any():
        round_, down = np.linspace(0, 2 * np.pi, 49), np.linspace(0, np.pi, 25)
        sphere = np.array(
            [
                np.outer(np.cos(round_), np.sin(down)),
                np.outer(np.sin(round_), np.sin(down)),
                np.outer(np.ones_like(round_), np.cos(down)),
            ]
        )
        surface = com[:, None, None] + np.tensordot(shape, sphere, axes=1)
        axes.plot_wireframe(*surface, color=BODY, linewidth=0.5, alpha=0.5, rcount=17, ccount=9)
    axes.plot(*com[:, None], "o", color=BODY, markersize=5)
    length = 0.225 * (limits[0][1] - limits[0][0])
    for axis, color in enumerate(COLORS):
        tip = length * np.eye(3)[axis]
        axes.plot(*np.transpose([np.zeros(3), tip]), color=color, linewidth=2)
    axes.set(xlim=limits[0], ylim=limits[1], zlim=limits[2])
    axes.set(xlabel="x / m", ylabel="y / m", zlabel="z / m")
    axes.set_title("in perspective", loc="left")
    axes.set_box_aspect((1, 1, 1), zoom=0.9)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_major_locator(MaxNLocator(3))
        axis.labelpad = 7
