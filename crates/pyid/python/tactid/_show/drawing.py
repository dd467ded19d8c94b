"""Colours, style and functions that all figures share."""

import io
import warnings
from pathlib import Path
from typing import Any, get_args

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.image import imsave

from tactid._base.errors import ArgumentError
from tactid._base.files import write_atomically
from tactid._base.naming import listed
from tactid._base.output_files import FigureFormat, figure_paths
from tactid._show import page

ESTIMATE, EARLIER, TRUE, GRID = "#1f5fa8", "#a9b1ba", "#c8502d", "#d9dde2"
STYLE: Any = {
    "agg.path.chunksize": 10_000,  # an hour of windows is one line
    "axes.edgecolor": "#5b6570",
    "axes.grid": True,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlesize": 10,
    "figure.constrained_layout.use": True,
    "figure.dpi": 150,
    "font.size": 10,
    "grid.color": GRID,
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "lines.linewidth": 1.2,
    "pdf.fonttype": 42,  # text stays text in PDF, and in SVG, too
    "svg.fonttype": "none",
    "svg.hashsalt": "tactid",
}

METADATA: dict[FigureFormat, dict[str, Any]] = {
    "png": {"Software": "tactid"},
    "svg": {"Creator": "tactid", "Date": None},
    "pdf": {"Creator": "tactid", "CreationDate": None},
}
"""What names the writer of a figure, and makes it the same file each time."""


def padded(low: float, high: float, fraction: float) -> tuple[float, float]:
    """Returns limits with a fraction of the range left free on either side."""
    margin = fraction * (high - low) or fraction * (abs(high) or 1.0)
    return low - margin, high + margin


def remark(axes: Axes, text: str) -> None:
    """Writes a text in the middle of a plot."""
    axes.text(
        0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", color=TRUE, fontsize=11
    )


class Figures:
    """The figures of a report: as PNG in its page, and in a format of choice as files beside it."""

    def __init__(self, form: FigureFormat | None = None) -> None:
        if form is not None and form not in get_args(FigureFormat):
            choices = listed([f"'{each}'" for each in get_args(FigureFormat)])
            raise ArgumentError(f"`figures` is {form!r}: expected one of {choices}")
        self.form = form
        self.files: dict[str, bytes] = {}
        """Content of the files, by the name of the figure."""

    def html(self, name: str, figure: Figure, caption: str) -> str:
        """Returns a figure with its caption for the page, and draws it for its file."""
        png = saved(figure, "png")
        if self.form is not None:
            self.files[name] = png if self.form == "png" else saved(figure, self.form)
        return page.figure(png, caption)

    def write(self, path: Path, text: str) -> list[Path]:
        """Writes a page, and its figures beside it, whose paths it returns."""
        write_atomically(path, text)
        files = {} if self.form is None else figure_paths(path, self.files, self.form)
        for name, file in files.items():
            write_atomically(file, self.files[name])
        return list(files.values())


def saved(figure: Figure, form: FigureFormat) -> bytes:
    """Returns a figure as a file."""
    file = io.BytesIO()
    with mpl.rc_context(STYLE), warnings.catch_warnings():
        # A name in a script that the font lacks is drawn as boxes, which needs no warning.
        warnings.filterwarnings("ignore", message="Glyph")
        if form == "png":
            # The library's method to save draws a figure twice: first to lay it out.
            canvas: Any = FigureCanvasAgg(figure)
            canvas.draw()
            picture = canvas.buffer_rgba()
            imsave(file, picture, format=form, dpi=figure.dpi, metadata=METADATA[form])
        else:
            figure.savefig(file, format=form, metadata=METADATA[form])
    return file.getvalue()
