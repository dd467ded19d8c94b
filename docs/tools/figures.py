"""The figures of the documentation: the averaging windows as DESIGN.md defines them, and results.

The results come from the installed package for simulated recordings.
"""

import io
import tempfile
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

import tactid
from tactid._cli.paper_run import driving_phases
from tactid._results.truth import read_truth
from tactid._show.drawing import STYLE
from tactid._show.paper_plots import PAIRS, History, parameters

CUTOFF_HZ = 10.0
WINDOW_S = 0.926 / CUTOFF_HZ
"""Length of an averaging window, as ``EquationSettings::cutoff_hz`` states it."""


def window() -> Figure:
    """Draws the weight of three averaging windows that follow each other."""
    figure, axes = plt.subplots(figsize=(6.4, 2.8))
    for k in range(3):
        time = np.linspace(-WINDOW_S / 2, WINDOW_S / 2, 200)
        start = 1e3 * k * WINDOW_S / 3
        axes.plot(start + 1e3 * time, np.cos(np.pi * time / WINDOW_S) ** 4, color=f"C{k}")
    axes.set(xlabel="time, ms", ylabel="weight")
    return figure


def intervals() -> Figure:
    """Draws how the 95 % intervals of a simulated recording become narrower."""
    experiment = tactid.Experiment.from_toml(
        'duration_s = 6.0\n[excitation]\nmode = "together"\n'
        "[noise]\nfinger_force_n = 15.0\nfinger_moment_nm = 1.0\n"
    )
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder, "run.mcap")
        tactid.simulate(experiment, log)
        result = tactid.identify(log)
    figure, axes = plt.subplots(figsize=(6.4, 2.8))
    for name, unit in (("mass", "kg"), ("Izz", "kg m²")):
        std_devs = result.history.std_devs[:, tactid.VALUE_NAMES.index(name)]
        axes.semilogy(result.history.times_s, 1.96 * std_devs, label=f"{name}, {unit}")
    axes.set(xlabel="time, s", ylabel="half width of the interval")
    axes.legend(frameon=False)
    return figure


def paper() -> Figure:
    """Draws mass and centre of mass by the paper's filter, as ``tactid paper --duration 30``."""
    experiment = tactid.Experiment.paper().replace(duration=30.0)
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder, "run.mcap")
        tactid.simulate(experiment, log)
        result = tactid.identify(log, estimator="nlms")
        truth = read_truth(tactid.info(log))
    return parameters(History.of(result, driving_phases(experiment)), truth, PAIRS[6])


FIGURES = {"window": window, "intervals": intervals, "paper": paper}


def draw(name: str) -> str:
    """Returns a figure as SVG, the same text each time."""
    with plt.rc_context({**STYLE, "svg.hashsalt": "tactid", "svg.fonttype": "path"}):
        figure = FIGURES[name]()
        drawn = io.StringIO()
        figure.savefig(drawn, format="svg", metadata={"Date": None})
        plt.close(figure)
    return drawn.getvalue()
