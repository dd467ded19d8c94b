"""Colours, style and functions that all figures share."""

import io
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

ESTIMATE, EARLIER, TRUE, GRID = "#1f5fa8", "#a9b1ba", "#c8502d", "#d9dde2"
STYLE: Any = {
    "axes.edgecolor": "#5b6570",
    "axes.grid": True,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlesize": 10,
    "figure.constrained_layout.use": True,
    "font.size": 10,
    "grid.color": GRID,
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "lines.linewidth": 1.2,
    "savefig.dpi": 150,
}


def padded(low: float, high: float, fraction: float) -> tuple[float, float]:
    """Returns limits with a fraction of the range left free on either side."""
    margin = fraction * (high - low) or fraction * (abs(high) or 1.0)
    return low - margin, high + margin


def remark(axes: Axes, text: str) -> None:
    """Writes a text in the middle of a plot."""
    axes.text(
        0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", color=TRUE, fontsize=11
    )


def png(figure: Figure) -> bytes:
    """Returns the figure as a PNG."""
    file = io.BytesIO()
    figure.savefig(file, format="png")
    return file.getvalue()
