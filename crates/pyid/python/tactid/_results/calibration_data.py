"""What a calibration finds: plain data of the joints, the links and the recordings.

All arrays are NumPy arrays of SI units. W is the number of windows, n that of the joints.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from tactid import _native
from tactid._base.field_docs import with_fields
from tactid._base.values import Array
from tactid._results import records


@with_fields
class CalibrationRecording(records.CalibrationRecording):
    """A recording of a calibration: measured and modelled efforts of W windows and n joints."""

    @property
    def residual_before(self) -> Array:
        """Rms of measured less described efforts, N m or N, (n,)."""
        return _rms(self.measured - self.described)

    @property
    def residual_after(self) -> Array:
        """Rms of measured less calibrated efforts, N m or N, (n,)."""
        return _rms(self.measured - self.calibrated)

    def __repr__(self) -> str:
        about = f"{self.role}, {self.duration_s:.1f} s, {len(self.times_s)} windows"
        return f"<tactid.CalibrationRecording: {self.path.name}, {about}>"


@with_fields
@dataclass(frozen=True, eq=False, repr=False)
class CalibrationData(records.Calibration):
    """The fields of :class:`tactid.Calibration`.

    Two calibrations are equal where all that the file has is equal.
    """

    model: _native.ArmModel
    """The model behind the numbers, which identifications use."""
    gain_prior: float | None = field(default=None, compare=False)
    """Standard deviation of the gains before the calibration; None where the calibration was read
    from a file."""
    recordings: Sequence[CalibrationRecording] = field(default=(), compare=False)
    """The recordings: unloaded, loaded, held out; none where the calibration is from a file."""
    inputs: Mapping[str, Path] = field(default_factory=dict, compare=False)
    """Files and folders that were read, by the words that name them."""


def _rms(values: Array) -> Array:
    rms: Array = np.sqrt(np.mean(values**2, axis=0))
    return rms
