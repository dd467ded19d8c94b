"""The picture of a compensation: the measured wrench, and that of the contact with its interval."""

import matplotlib as mpl
from matplotlib.figure import Figure

from tactid._base.values import Z95
from tactid._results.compensation import CompensatedLog
from tactid._show import drawing
from tactid._show.compensation_text import CHANNELS
from tactid._show.drawing import EARLIER, ESTIMATE


def picture(written: CompensatedLog) -> bytes:
    """Returns the picture as PNG: a panel for each entry of the wrench."""
    with mpl.rc_context(drawing.STYLE):
        return drawing.saved(_figure(written), "png")


def _figure(written: CompensatedLog) -> Figure:
    figure = Figure(figsize=(9.0, 6.0))
    panels = figure.subplots(3, 2, sharex=True)
    times = written.times_s
    # Down the columns: forces on the left, moments on the right.
    for k, (axes, (name, unit)) in enumerate(zip(panels.T.flat, CHANNELS, strict=True)):
        contact, around = written.contact[:, k], Z95 * written.std_devs[:, k]
        axes.plot(times, written.measured[:, k], color=EARLIER, label="measured")
        axes.fill_between(
            times, contact - around, contact + around, color=ESTIMATE, alpha=0.25, linewidth=0
        )
        axes.plot(times, contact, color=ESTIMATE, label="contact, with its 95 % interval")
        axes.set_ylabel(f"{name} / {unit}")
    for axes in panels[-1]:
        axes.set_xlabel("time / s")
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper right", ncols=2)
    return figure
