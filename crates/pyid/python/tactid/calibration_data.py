"""What a calibration finds: plain data of the joints, the links and the recordings.

All arrays are NumPy arrays of SI units. W is the number of windows, n that of the joints.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np

from tactid import _native
from tactid.equality import ComparedByValue
from tactid.field_docs import with_fields
from tactid.findings import DataFault, Finding
from tactid.values import Array

Role = Literal["unloaded", "loaded", "hold_out"]
"""What a recording is to a calibration: without a payload, with a known one, or not used."""


@with_fields
@dataclass(frozen=True, eq=False, repr=False)
class CalibrationRecording(ComparedByValue):
    """A recording of a calibration: measured and modelled efforts of W windows and n joints."""

    path: Path
    """Path of the log; of arrays, their place among the arguments, such as ``unloaded[0]``."""
    role: Role
    """What the recording is to the calibration."""
    duration: float
    """Time from the first sample to the last, s."""
    time: Array
    """Time of the middle of each window on the recording's clock, s, (W,)."""
    velocity: Array
    """Joint velocities, rad/s or m/s, (W, n)."""
    measured: Array
    """Measured efforts without their delay, N m or N, (W, n)."""
    described: Array
    """Efforts of the URDF alone, with the payload and without friction, (W, n)."""
    calibrated: Array
    """Efforts of the calibrated model with the payload, (W, n)."""
    friction: Array
    """What ``calibrated`` contains beside the torques of the links and the payload, (W, n)."""
    faults: Sequence[DataFault] = ()
    """What was wrong with messages or samples, and how often."""
    findings: Sequence[Finding] = ()
    """What was noticed about the recording."""
    damage: Sequence[str] = ()
    """Where the log could not be read further, and why, a line each."""

    @property
    def residual_before(self) -> Array:
        """Rms of measured less described efforts, N m or N, (n,)."""
        return _rms(self.measured - self.described)

    @property
    def residual_after(self) -> Array:
        """Rms of measured less calibrated efforts, N m or N, (n,)."""
        return _rms(self.measured - self.calibrated)

    def __repr__(self) -> str:
        about = f"{self.role}, {self.duration:.1f} s, {len(self.time)} windows"
        return f"<tactid.CalibrationRecording: {self.path.name}, {about}>"


@with_fields
@dataclass(frozen=True, eq=False, repr=False)
class CalibrationData(ComparedByValue):
    """The fields of :class:`tactid.Calibration`.

    Two calibrations are equal where all that the file has is equal.
    """

    model: _native.ArmModel
    """The model behind the numbers, which identifications use."""
    tip: str
    """The end-effector frame."""
    joints: Sequence[str]
    """Names of the n joints between base and tip, in the robot's order."""
    units: Sequence[str]
    """Unit of the effort of each joint: ``"N m"`` or ``"N"``."""
    links: Sequence[str]
    """Names of the B links that these joints move."""
    gravity: Array
    """Gravitational acceleration in world axes, m/s², (3,)."""
    cutoff: float
    """Cutoff of the window means, Hz."""
    delay: float
    """Time by which efforts lag the motion, s; negative where they lead."""
    delay_std_dev: float
    """Standard deviation of the delay, s."""
    effort_gain: Array
    """Effort for one unit of the recorded value as it was given, N m or N, (n,)."""
    gain: Array
    """Factor from these efforts to torques: 1 where efforts count as torques, (n,)."""
    gain_std_dev: Array
    """Standard deviation of the gain; 0 where it was not to be found, (n,)."""
    offset: Array
    """Offset of the effort, N m or N, (n,)."""
    viscous: Array
    """Viscous friction, N m s/rad or N s/m, (n,)."""
    friction: Array
    """Friction that saturates at each of ``friction_velocities``, N m or N, (n, T)."""
    friction_velocities: Array
    """Velocities v of the friction terms tanh(velocity / v), rad/s or m/s, (T,)."""
    load_friction: Array
    """Friction as a fraction of the joint's torque, (n,)."""
    payload_friction: Array
    """What a payload's torque adds to the load friction, as a fraction of this torque, (n,)."""
    rotor_inertia: Array
    """Inertia of the rotor as the joint moves it, kg m² or kg, (n,)."""
    max_velocity: Array
    """Largest velocity in the positive and in the negative direction, rad/s or m/s, (n, 2)."""
    residual_before: Array
    """Rms of measured less modelled efforts with the URDF alone, N m or N, (n,)."""
    residual_after: Array
    """Rms of measured less modelled efforts with the calibration, N m or N, (n,)."""
    residual_held_out: Array
    """The same on windows that a second fit did not see; NaN where these are too few, (n,)."""
    described: Array
    """Ten inertial parameters of each link as the URDF has them, (B, 10).

    Mass, kg, first moments, kg m, and inertia about the origin of the link's frame, kg m², with all
    links fixed to it.
    """
    calibrated: Array
    """The calibrated parameters of each link, (B, 10).

    Motion determines combinations of several links only; the others stay as described.
    """
    std_devs: Array
    """Standard deviations of the calibrated parameters, (B, 10)."""
    payloads: Array
    """Ten parameters of the payload of each loaded recording, in the tip's frame, (L, 10)."""
    windows: int
    """Number of windows of all recordings that were used."""
    window: float
    """Length of a window, s."""
    shortages: Sequence[Finding] = ()
    """What the motion does not determine."""
    contradictions: Sequence[Finding] = ()
    """Assumptions that the recordings contradict: a gain that is improbable by what was known of
    it, and the one that they contradict most, such as the direction of gravity."""
    gain_prior: float | None = field(default=None, compare=False)
    """Standard deviation of the gains before the calibration; None where the calibration was read
    from a file."""
    recordings: Sequence[CalibrationRecording] = field(default=(), compare=False)
    """The recordings: unloaded, loaded, held out; none where the calibration is from a file."""
    inputs: Mapping[str, Path] = field(default_factory=dict, compare=False)
    """Files and folders that were read, by the words that name them."""

    @property
    def coulomb(self) -> Array:
        """Coulomb friction far from standstill at the rms torque of the joint, N m or N, (n,)."""
        total: Array = self.friction.sum(axis=1)
        return total


def _rms(values: Array) -> Array:
    rms: Array = np.sqrt(np.mean(values**2, axis=0))
    return rms
