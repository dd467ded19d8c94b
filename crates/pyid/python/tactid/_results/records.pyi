# Written by docs/tools/record_stub.py: do not edit.
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tactid._base.equality import ComparedByValue
from tactid._base.findings import DataFault, Finding
from tactid._native import MassProperties

CLASSES: dict[str, type[Record]]
SCHEMAS: dict[str, dict[str, Any]]

def sentences(text: str) -> str: ...
def schema_of(record: type[Record] | Record) -> dict[str, Any]: ...
def without_null(schema: Mapping[str, Any]) -> Mapping[str, Any]: ...
def is_nullable(schema: Mapping[str, Any]) -> bool: ...
def of_ten(schema: Mapping[str, Any]) -> Mapping[str, Any] | None: ...
def array_of(schema: Mapping[str, Any]) -> tuple[int, str]: ...
def in_order(schema: Mapping[str, Any]) -> dict[str, dict[str, Any]]: ...

class Record(ComparedByValue):
    def __post_init__(self) -> None: ...

ActsOn: TypeAlias = Literal["payload", "sensor"]
Clock: TypeAlias = Literal["stamps", "log times", "given", "none"]
EstimatorKind: TypeAlias = Literal["least-squares", "nlms"]
Method: TypeAlias = Literal["tactile", "effort", "joint-sensing", "combined"]
MotionEstimate: TypeAlias = Literal[
    "with-payload",
    "smoothed",
    "no-velocities",
    "given-cutoff",
    "too-few",
    "too-fast",
    "unexplained",
    "exact",
]
Observability: TypeAlias = Literal["identifiable", "uncertain", "unobservable"]
Role: TypeAlias = Literal["unloaded", "loaded", "hold_out"]

@dataclass(frozen=True, eq=False)
class ActiveContradiction(Record):
    field: str
    bound: float
    estimate: float
    std_dev: float

@dataclass(frozen=True, eq=False)
class ActiveReport(Record):
    plans: int
    widest: str
    out_of_reach: bool
    contradictions: Sequence[ActiveContradiction]
    reached_s: float | None = ...
    interval_ratio: float | None = ...
    binding: str | None = ...
    untested_shapes: Sequence[str] = ...

@dataclass(frozen=True, eq=False)
class Agreement(Record):
    chi_square: float
    degrees_of_freedom: float
    noise_degrees_of_freedom: float
    p_value: float
    value_p_values: NDArray[np.float64]
    agree: bool
    runs: Sequence[RunDistance]
    largest: ValueDifference | None = ...

@dataclass(frozen=True, eq=False)
class ArmChange(Record):
    by_joint: NDArray[np.float64]
    log_evidence: float

@dataclass(frozen=True, eq=False)
class BaseExcursion(Record):
    attitude_deg: float
    position_m: float

@dataclass(frozen=True, eq=False)
class BoundingBox(Record):
    min: NDArray[np.float64]
    max: NDArray[np.float64]

@dataclass(frozen=True, eq=False)
class CalibratedFit(Record):
    joints: Sequence[str]
    misfit: NDArray[np.float64]
    noise_fraction: NDArray[np.float64]
    updated_by_unloaded: bool
    friction_change: ArmChange | None = ...
    gain_change: ArmChange | None = ...

@dataclass(frozen=True, eq=False)
class Calibration(Record):
    tip: str
    joints: Sequence[str]
    units: Sequence[str]
    links: Sequence[str]
    gravity_m_s2: NDArray[np.float64]
    cutoff_hz: float
    delay: Delay
    effort_gain: NDArray[np.float64]
    gain: NDArray[np.float64]
    gain_std_dev: NDArray[np.float64]
    offset: NDArray[np.float64]
    coulomb: NDArray[np.float64]
    viscous: NDArray[np.float64]
    friction: NDArray[np.float64]
    friction_velocities: NDArray[np.float64]
    load_friction: NDArray[np.float64]
    payload_friction: NDArray[np.float64]
    rotor_inertia: NDArray[np.float64]
    max_velocity: NDArray[np.float64]
    residual_before: NDArray[np.float64]
    residual_after: NDArray[np.float64]
    residual_held_out: NDArray[np.float64]
    described: NDArray[np.float64]
    calibrated: NDArray[np.float64]
    std_devs: NDArray[np.float64]
    payloads: NDArray[np.float64]
    windows: int
    window_s: float
    shortages: Sequence[Finding]
    contradictions: Sequence[Finding]

@dataclass(frozen=True, eq=False)
class CalibrationRecording(Record):
    path: Path
    role: Role
    duration_s: float
    times_s: NDArray[np.float64]
    velocity: NDArray[np.float64]
    measured: NDArray[np.float64]
    described: NDArray[np.float64]
    calibrated: NDArray[np.float64]
    friction: NDArray[np.float64]
    faults: Sequence[DataFault]
    findings: Sequence[Finding]
    damage: Sequence[str]

@dataclass(frozen=True, eq=False)
class Channel(Record):
    name: str
    unit: str

@dataclass(frozen=True, eq=False)
class CollisionFinding(Record):
    text: str
    pairs: Sequence[Sequence[str]]

@dataclass(frozen=True, eq=False)
class Combination(Record):
    estimate: PayloadEstimate
    agreement: Agreement
    between_runs: NDArray[np.float64]
    principal_moments: PrincipalMoments | None = ...
    shape: ShapeFit | None = ...

@dataclass(frozen=True, eq=False)
class Delay(Record):
    delay_s: float
    std_dev_s: float

@dataclass(frozen=True, eq=False)
class DesignedMotion(Record):
    tip: str
    method: Method
    joints: Sequence[str]
    moving_joints: Sequence[str]
    duration_s: float
    seed: int
    times_s: NDArray[np.float64]
    q: NDArray[np.float64]
    qd: NDArray[np.float64]
    qdd: NDArray[np.float64]
    expected_payload: NDArray[np.float64]
    predicted_std_devs: NDArray[np.float64]
    within: float
    interval_ratios: NDArray[np.float64]
    assumed_noise: Sequence[str]
    margins: Sequence[Margin]
    binding_constraints: Sequence[str]
    payload_tested: bool
    surroundings: Sequence[str]
    history: MotionHistory
    base_attitude_deg: float | None = ...
    base_position_m: float | None = ...
    collision_findings: Sequence[CollisionFinding] | None = ...

@dataclass(frozen=True, eq=False)
class FitReport(Record):
    channels: Sequence[Channel]
    times_s: NDArray[np.float64]
    measured: NDArray[np.float64]
    predicted: NDArray[np.float64]
    weights: NDArray[np.float64]
    held_out: NDArray[np.bool_]
    residual_rms: NDArray[np.float64]
    held_out_rms: NDArray[np.float64]
    held_out_plain_rms: NDArray[np.float64]
    noise_fraction: NDArray[np.float64]
    excitation: NDArray[np.float64]
    excitation_directions: NDArray[np.float64]
    motion: MotionEstimate
    stride_s: float
    cutoff_hz: float
    wrench_offset: WrenchOffset | None = ...
    gravity: GravityEstimate | None = ...
    subtracted_weight: WeightEstimate | None = ...
    motion_until_s: float | None = ...

@dataclass(frozen=True, eq=False)
class Forecast(Record):
    growth: NDArray[np.float64]
    fractions: NDArray[np.float64]
    noise_fraction: NDArray[np.float64]
    length_s: float

@dataclass(frozen=True, eq=False)
class GravityEstimate(Record):
    values: NDArray[np.float64]
    std_devs: NDArray[np.float64]

@dataclass(frozen=True, eq=False)
class History(Record):
    times_s: NDArray[np.float64]
    values: NDArray[np.float64]
    std_devs: NDArray[np.float64]

@dataclass(frozen=True, eq=False)
class Identification(RecordingReport):
    estimate: PayloadEstimate
    linear: LinearEstimate
    history: History
    fit: FitReport
    subtracts_unloaded: bool
    principal_moments: PrincipalMoments | None = ...
    load: LoadEstimate | None = ...
    forecast: Forecast | None = ...
    estimated_delay: Delay | None = ...
    calibrated: CalibratedFit | None = ...
    known_mass: KnownMass | None = ...
    bounding_box: BoundingBox | None = ...
    shape: ShapeFit | None = ...

@dataclass(frozen=True, eq=False)
class KnownMass(Record):
    mass_kg: float
    std_dev_kg: float

@dataclass(frozen=True, eq=False)
class LinearEstimate(Record):
    parameters: NDArray[np.float64]
    information: NDArray[np.float64]
    covariance: NDArray[np.float64]
    shared: SharedErrors
    degrees_of_freedom: float

@dataclass(frozen=True, eq=False)
class LiveStatus(Record):
    is_running: bool
    is_payload_held: bool
    topics: Sequence[str]
    messages: int
    samples: int
    last_ns: int
    delay_s: float
    cutoff_hz: float
    restarts: int
    problem: str | None = ...

@dataclass(frozen=True, eq=False)
class LoadEstimate(Record):
    parameters: NDArray[np.float64]
    offset: NDArray[np.float64]
    covariance: NDArray[np.float64]
    unobservable: NDArray[np.float64]
    noise: NDArray[np.float64]

@dataclass(frozen=True, eq=False)
class Margin(Record):
    limit: str
    used: float
    time_s: float
    binds: bool
    distance_m: float | None = ...

@dataclass(frozen=True, eq=False)
class MotionHistory(Record):
    times_s: NDArray[np.float64]
    std_devs: NDArray[np.float64]
    base_attitude_deg: NDArray[np.float64]

@dataclass(frozen=True, eq=False)
class PaperEstimate(Record):
    frame: str
    values: NDArray[np.float64]
    observability: Sequence[Observability]
    is_physical: bool
    composite: MassProperties | None = ...
    windows: int = ...
    rejected: int = ...
    gaps: int = ...

@dataclass(frozen=True, eq=False)
class PaperHistory(Record):
    epoch: Sequence[int]
    times_s: NDArray[np.float64]
    values: NDArray[np.float64]

@dataclass(frozen=True, eq=False)
class PaperIdentification(RecordingReport):
    estimate: PaperEstimate
    history: PaperHistory
    singular_values: SingularValues
    settings: PaperSettings
    principal_moments: NDArray[np.float64] | None = ...

@dataclass(frozen=True, eq=False)
class PaperSettings(Record):
    alpha: float
    beta: float
    average_s: float
    epochs: int

@dataclass(frozen=True, eq=False)
class PayloadEstimate(Record):
    frame: str
    values: NDArray[np.float64]
    observability: Sequence[Observability]
    std_devs: NDArray[np.float64]
    is_physical: bool
    composite: MassProperties | None = ...
    intervals: NDArray[np.float64] = ...
    covariance: NDArray[np.float64] | None = ...
    windows: int = ...
    payload_changes: int = ...
    since_s: float = ...
    rejected: int = ...
    gaps: int = ...

@dataclass(frozen=True, eq=False)
class PrincipalMoments(Record):
    values: NDArray[np.float64]
    std_devs: NDArray[np.float64]
    intervals: NDArray[np.float64]

@dataclass(frozen=True, eq=False)
class RecordingReport(Record):
    setup: Setup
    method: Method
    estimator: EstimatorKind
    cutoff_hz: float
    max_gap_s: float
    gravity_m_s2: NDArray[np.float64]
    delay_s: float
    clock: Clock
    start_ns: int
    duration_s: float
    faults: Sequence[DataFault]
    findings: Sequence[Finding]
    interrupted: bool
    damage: Sequence[str]

@dataclass(frozen=True, eq=False)
class RunDistance(Record):
    chi_square: float
    degrees_of_freedom: float
    p_value: float
    others_agree: bool

@dataclass(frozen=True, eq=False)
class RunReport(Record):
    grasp_drift_m: float
    grasp_drift_rad: float
    newton_residual: float
    euler_residual: float
    grip_force_n: float
    steps: int
    simulated_time_s: float
    interrupted: bool
    linear_momentum_drift: float | None = ...
    angular_momentum_drift: float | None = ...
    base: BaseExcursion | None = ...
    active: ActiveReport | None = ...
    wall_time_s: float = ...
    steps_per_second: float = ...

@dataclass(frozen=True, eq=False)
class Setup(Record):
    beginning: str
    topics: Sequence[str]
    wrench_topics: Sequence[str]
    wrench_frames: Sequence[str]
    wrench_acts_on: ActsOn
    known_tool: MassProperties | None = ...
    known_tool_std_devs: NDArray[np.float64] | None = ...
    gripper: MassProperties | None = ...

@dataclass(frozen=True, eq=False)
class ShapeFit(Record):
    fraction: NDArray[np.float64]
    is_used: bool
    chi_square: float
    degrees_of_freedom: float
    p_value: float
    prior: ShapePrior

@dataclass(frozen=True, eq=False)
class ShapePrior(Record):
    mean: NDArray[np.float64]
    covariance: NDArray[np.float64]

@dataclass(frozen=True, eq=False)
class SharedErrors(Record):
    unknowns: Sequence[int]
    changes: NDArray[np.float64]

@dataclass(frozen=True, eq=False)
class SingularValues(Record):
    mass: NDArray[np.float64]
    inertia: NDArray[np.float64]

@dataclass(frozen=True, eq=False)
class ValueDifference(Record):
    run: int
    value: str
    difference: float
    others: float
    std_dev: float

@dataclass(frozen=True, eq=False)
class WeightEstimate(Record):
    values: NDArray[np.float64]
    std_devs: NDArray[np.float64]
    along_m_s2: NDArray[np.float64] | None = ...

@dataclass(frozen=True, eq=False)
class WrenchOffset(Record):
    frame: str
    values: NDArray[np.float64]
    std_devs: NDArray[np.float64]
