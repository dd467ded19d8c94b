"""How well least squares explains a recording: the channels of its windows, as plain data."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tactid.equality import ComparedByValue

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Channel:
    """One measured quantity of a window: a component of a wrench, or the effort of a joint."""

    name: str
    """Name such as ``force x`` or ``effort elbow``."""
    unit: str
    """Unit such as ``N``."""


@dataclass(frozen=True, eq=False)
class WrenchOffset(ComparedByValue):
    """A constant offset of the sum of the wrenches: a sensor zero that was not set."""

    frame: str
    """Name of the frame in which the offset is expressed, and about whose origin its moment is."""
    values: Array
    """Force, N, then moment, N m, (6,)."""
    std_devs: Array
    """Standard deviations of force and moment, N and N m, (6,); NaN where none are estimated."""


@dataclass(frozen=True, eq=False)
class Fit(ComparedByValue):
    """How well least squares explains what was measured: W windows of C channels."""

    channels: Sequence[Channel]
    """Channels of the measured load: C of them."""
    time: Array
    """Time of the middle of each window on the recording's clock, s, (W,)."""
    measured: Array
    """The measured load after the low-pass, (W, C)."""
    predicted: Array
    """The load that the estimate predicts from the motion, (W, C)."""
    weights: Array
    """Robust weight of each measurement, (W, C): 1, or less for an outlier."""
    held_out: NDArray[np.bool_]
    """Whether each window was held out from the validation fit, (W,)."""
    residual_rms: Array
    """Weighted rms of measured less predicted, (C,)."""
    held_out_rms: Array
    """Weighted rms on the held-out windows, predicted by a fit to all others, (C,)."""
    stride: float
    """Time from one window to the next, s."""
    excitation: Array
    """Strength with which the motion excites ten directions of the parameters, (10,).

    It is relative to the strongest direction, in descending order.
    """
    excitation_directions: Array
    """Directions of the parameters that ``excitation`` refers to, as rows, (10, 10).

    They are unit vectors in mass, first moments and inertia about the frame's origin, each divided
    by its scale.
    """
    wrench_offset: WrenchOffset | None = None
    """The offset of the wrenches, where the option ``wrench_offset`` makes it an unknown."""
    noise_fraction: Array = field(default_factory=lambda: np.ones(10))
    """Fraction of the variance of each of the ten values that is noise of the recording, (10,).

    It is 1 where the gains of the efforts are exact. The rest is their uncertainty, the option
    ``effort_gain_std_dev``, which no longer recording reduces.
    """
