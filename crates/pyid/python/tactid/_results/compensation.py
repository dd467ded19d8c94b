"""What a compensation finds: the wrenches of load and contact of a recording."""

from dataclasses import dataclass
from typing import cast

import numpy as np

from tactid._base.field_docs import with_fields
from tactid._base.findings import DataFault, Finding
from tactid._base.values import Array


@with_fields
@dataclass(frozen=True, eq=False)
class Compensation:
    """The wrenches at the N aligned samples of a recording, force, N, then moment, N m.

    All are about the origin of ``point`` and along the axes of ``axes``, with the sign of the
    measured wrenches. All have passed the same filter, the windows of the equations, without delay.
    The first and last samples of a stretch without gaps have no derivatives: NaN.
    """

    times_s: Array
    """Times of the samples, s, (N,), on the clock of the recording: since ``start_ns``."""
    measured: Array
    """Measured wrench, (N, 6): the sum of offset, load and contact."""
    load: Array
    """Wrench by which the robot carries and accelerates payload and known tool, (N, 6)."""
    contact: Array
    """Wrench of the contact, (N, 6): the measured wrench less offset and load. Where wrenches act
    on the payload, it is what the payload exerts on what it touches; where they act on the sensor,
    it is what acts on the payload from outside."""
    load_covariance: Array
    """Covariance of ``load``, (N, 6, 6)."""
    contact_covariance: Array
    """Covariance of ``contact``, (N, 6, 6): of load, offset and noise."""
    point: str
    """Link about whose origin the moments are."""
    axes: str
    """Link along whose axes the wrenches are, or "world"."""
    acts_on: str
    """Body on which the wrenches act: "payload" or "sensor"."""
    wrench_topics: list[str]
    """Topic or array of each wrench: several are summed."""
    cutoff_hz: float
    """Cutoff of the filter, Hz."""
    delay_s: float
    """Delay that was subtracted from the times of the wrenches, s."""
    clock: str
    """Where the times come from."""
    start_ns: int
    """Time zero, ns since the epoch of the clock; 0 for arrays."""
    faults: list[DataFault]
    """Messages and samples that could not be used."""
    findings: list[Finding]
    """What was noticed about the recording."""
    damage: list[str]
    """Where the log could not be read further, and why."""

    @property
    def std_devs(self) -> Array:
        """Standard deviations of ``contact``, (N, 6)."""
        return cast(Array, np.sqrt(np.diagonal(self.contact_covariance, axis1=1, axis2=2)))


@dataclass(frozen=True, eq=False)
class CompensatedLog:
    """What a log that was written is like: wrenches are force, N, then moment, N m."""

    topics: tuple[str, str]
    """Topics of the wrenches of load and contact."""
    samples: tuple[int, int]
    """Number of samples, and of those that have wrenches."""
    times_s: Array
    """Times of P points of a picture, (P,), s."""
    measured: Array
    """Measured wrench through the filter, (P, 6)."""
    contact: Array
    """Wrench of the contact, (P, 6)."""
    std_devs: Array
    """Standard deviations of the contact, (P, 6)."""
    measured_rms: list[float]
    """Rms of the measured wrench over all samples, (6,)."""
    contact_rms: list[float]
    """Rms of the wrench of the contact over all samples, (6,)."""
    greatest: list[tuple[float, list[float], list[float]]]
    """Time, contact and its standard deviations with the greatest force, and with the greatest
    moment; nothing where no sample has wrenches."""
    point: str
    """Link about whose origin the moments are."""
    axes: str
    """Link along whose axes the wrenches are."""
    acts_on: str
    """Body on which the wrenches act."""
    cutoff_hz: float
    """Cutoff of the filter, Hz."""
    faults: list[DataFault]
    """Messages and samples that could not be used."""
    findings: list[Finding]
    """What was noticed about the recording."""
    damage: list[str]
    """Where the log could not be read further."""
