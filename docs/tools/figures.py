"""The figures of the documentation, drawn from what the installed package computes."""

import io
import tempfile
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

import tactid

CUTOFF_HZ = 10.0
WINDOW_S = 0.926 / CUTOFF_HZ
"""Length of an averaging window, as ``EquationSettings::cutoff_hz`` states it."""


def window(axes: Axes) -> None:
    """Draws the weight of three averaging windows that follow each other."""
    for k in range(3):
        time = np.linspace(-WINDOW_S / 2, WINDOW_S / 2, 200)
        start = 1e3 * k * WINDOW_S / 3
        axes.plot(start + 1e3 * time, np.cos(np.pi * time / WINDOW_S) ** 4, color=f"C{k}")
    axes.set(xlabel="time, ms", ylabel="weight")


def intervals(axes: Axes) -> None:
    """Draws how the 95 % intervals of a simulated recording become narrower."""
    experiment = tactid.Experiment.from_toml(
        'duration_s = 6.0\n[excitation]\nmode = "together"\n'
        "[noise]\nfinger_force_n = 15.0\nfinger_moment_nm = 1.0\n"
    )
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder, "run.mcap")
        tactid.simulate(experiment, log)
        result = tactid.identify(log)
    for name, unit in (("mass", "kg"), ("Izz", "kg m²")):
        std_devs = result.history.std_devs[:, tactid.VALUE_NAMES.index(name)]
        axes.semilogy(result.history.time, 1.96 * std_devs, label=f"{name}, {unit}")
    axes.set(xlabel="time, s", ylabel="half width of the interval")
    axes.legend(frameon=False)


FIGURES = {"window": window, "intervals": intervals}


def draw(name: str) -> str:
    """Returns a figure as SVG, the same text each time."""
    with plt.rc_context({"svg.hashsalt": "tactid", "svg.fonttype": "path", "font.size": 10}):
        figure, axes = plt.subplots(figsize=(6.4, 2.8), layout="constrained")
        FIGURES[name](axes)
        axes.spines[["top", "right"]].set_visible(False)
        drawn = io.StringIO()
        figure.savefig(drawn, format="svg", metadata={"Date": None})
        plt.close(figure)
    return drawn.getvalue()
