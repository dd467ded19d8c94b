"""What a calibration of the arm contributed to an identification."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactid.equality import ComparedByValue


@dataclass(frozen=True, eq=False)
class CalibratedFit(ComparedByValue):
    """What a calibration of the arm contributed to an identification."""

    joints: Sequence[str]
    """Names of the n joints between base and tip."""
    misfit: NDArray[np.float64]
    """Mean square of the whitened residual of each joint, (n,).

    It is about one where the effort is as noisy as at the calibration. Where it is larger, the
    noise of the joint is enlarged by so much.
    """
    noise_fraction: NDArray[np.float64]
    """Fraction of the variance of each of the ten values that is noise of this recording, (10,).

    The rest is what the calibration does not know of the arm, which no longer recording reduces.
    """
    updated_by_unloaded: bool
    """Whether an unloaded recording updated the calibration first."""
    friction_change: NDArray[np.float64] | None
    """How the friction of each joint has changed since the calibration, as a fraction, (n,).

    It is positive where the friction is larger now; None where the recordings do not show that it
    has changed. The payload's values take it into account.
    """
    gain_change: NDArray[np.float64] | None
    """How the gain of each joint has changed since the calibration, as a fraction, (n,).

    None where the recordings do not show that the gains have changed, and where they are known.
    """
