from collections.abc import Callable, Sequence
from os import PathLike
from typing import Final, Literal, TypeAlias, final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from typing_extensions import disjoint_base

_Array: TypeAlias = NDArray[np.float64]
_Path: TypeAlias = str | PathLike[str]
_Progress: TypeAlias = Callable[[float], object]
_Way: TypeAlias = Literal["tactile", "effort", "joint-sensing"]
_Filter: TypeAlias = Literal["nlms", "rls"]

__all__ = [
    "VALUE_NAMES",
    "VERSION",
    "Estimator",
    "Experiment",
    "FrameMotion",
    "Identification",
    "Identifier",
    "Lms",
    "LogInfo",
    "Manipulator",
    "MassProperties",
    "Nlms",
    "PayloadEstimate",
    "Rls",
    "RunReport",
    "Samples",
    "Topic",
    "identify",
    "info",
    "read",
    "simulate",
    "wrench_regressor",
]

VERSION: Final[str]
VALUE_NAMES: Final[list[str]]

@final
class MassProperties:
    def __new__(cls, mass: float, com: ArrayLike, inertia: ArrayLike) -> MassProperties: ...
    @staticmethod
    def from_parameters(parameters: ArrayLike) -> MassProperties: ...
    @property
    def mass(self) -> float: ...
    @property
    def com(self) -> _Array: ...
    @property
    def inertia(self) -> _Array: ...
    @property
    def parameters(self) -> _Array: ...
    @property
    def is_physical(self) -> bool: ...
    def is_physical_within(self, tolerance: float) -> bool: ...
    def expressed_in(self, a_from_b: ArrayLike) -> MassProperties: ...
    def __add__(self, value: MassProperties, /) -> MassProperties: ...
    def __radd__(self, value: MassProperties, /) -> MassProperties: ...
    def __sub__(self, value: MassProperties, /) -> MassProperties: ...
    def __rsub__(self, value: MassProperties, /) -> MassProperties: ...
    def __eq__(self, value: object, /) -> bool: ...
    def __ne__(self, value: object, /) -> bool: ...

@final
class FrameMotion:
    @property
    def pose(self) -> _Array: ...
    @property
    def velocity(self) -> _Array: ...
    @property
    def angular_velocity(self) -> _Array: ...
    @property
    def acceleration(self) -> _Array: ...
    @property
    def angular_acceleration(self) -> _Array: ...

@final
class Manipulator:
    @staticmethod
    def from_urdf(
        urdf: _Path,
        base: Literal["floating", "fixed"] = "floating",
        *,
        base_link: str | None = None,
    ) -> Manipulator: ...
    @property
    def dof(self) -> int: ...
    @property
    def joint_names(self) -> list[str]: ...
    @property
    def frame_names(self) -> list[str]: ...
    @property
    def base(self) -> Literal["floating", "fixed"]: ...
    @property
    def mass(self) -> float: ...
    def with_payload(self, frame: str, body: MassProperties) -> Manipulator: ...
    def without_subtree(self, frame: str) -> Manipulator: ...
    def kinematics(
        self,
        frame: str,
        q: ArrayLike,
        qd: ArrayLike | None = None,
        qdd: ArrayLike | None = None,
        *,
        base_pose: ArrayLike | None = None,
        base_twist: ArrayLike | None = None,
        base_acceleration: ArrayLike | None = None,
    ) -> FrameMotion: ...
    def inverse_dynamics(
        self,
        q: ArrayLike,
        qd: ArrayLike | None = None,
        qdd: ArrayLike | None = None,
        *,
        base_pose: ArrayLike | None = None,
        base_twist: ArrayLike | None = None,
        base_acceleration: ArrayLike | None = None,
        gravity: ArrayLike | None = None,
    ) -> tuple[_Array, _Array]: ...
    def base_acceleration(
        self,
        q: ArrayLike,
        qd: ArrayLike | None = None,
        qdd: ArrayLike | None = None,
        *,
        base_pose: ArrayLike | None = None,
        base_twist: ArrayLike | None = None,
    ) -> _Array: ...
    def momentum(
        self,
        q: ArrayLike,
        qd: ArrayLike | None = None,
        *,
        base_pose: ArrayLike | None = None,
        base_twist: ArrayLike | None = None,
    ) -> _Array: ...

def wrench_regressor(
    acceleration: ArrayLike, angular_velocity: ArrayLike, angular_acceleration: ArrayLike
) -> _Array: ...

@disjoint_base
class Estimator:
    def update(self, rows: ArrayLike, wanted: ArrayLike) -> int: ...
    @property
    def parameters(self) -> _Array: ...
    @property
    def used(self) -> int: ...
    @property
    def refused(self) -> int: ...

@final
class Lms(Estimator):
    def __new__(cls, size: int, step: float, *, start: ArrayLike | None = None) -> Lms: ...

@final
class Nlms(Estimator):
    def __new__(
        cls,
        size: int,
        alpha: float = 1.8,
        beta: float = 0.9,
        *,
        start: ArrayLike | None = None,
    ) -> Nlms: ...

@final
class Rls(Estimator):
    def __new__(cls, size: int, *, start: ArrayLike | None = None) -> Rls: ...
    @property
    def covariance(self) -> _Array | None: ...

@final
class PayloadEstimate:
    @property
    def body(self) -> MassProperties: ...
    @property
    def composite(self) -> MassProperties | None: ...
    @property
    def values(self) -> _Array: ...
    @property
    def deviations(self) -> _Array: ...
    @property
    def identifiable(self) -> list[bool]: ...
    @property
    def not_identifiable(self) -> list[str]: ...
    @property
    def mass_singular_values(self) -> _Array: ...
    @property
    def inertia_singular_values(self) -> _Array: ...
    @property
    def is_physical(self) -> bool: ...
    @property
    def intervals(self) -> int: ...
    @property
    def refused(self) -> int: ...
    @property
    def gaps(self) -> int: ...

@final
class Identifier:
    def __new__(
        cls,
        robot: Manipulator,
        tool: str,
        sensors: Sequence[str] = ...,
        *,
        way: _Way = "tactile",
        estimator: _Filter = "rls",
        alpha: float = 1.8,
        beta: float = 0.9,
        gravity: ArrayLike | None = None,
        average: float | None = None,
        cutoff: float = 10.0,
        max_gap: float = 0.1,
    ) -> Identifier: ...
    def push(
        self,
        time: ArrayLike,
        q: ArrayLike,
        qd: ArrayLike | None = None,
        wrenches: ArrayLike | None = None,
        *,
        effort: ArrayLike | None = None,
        base_pose: ArrayLike | None = None,
        base_twist: ArrayLike | None = None,
    ) -> int: ...
    def rewind(self) -> None: ...
    def estimate(self) -> PayloadEstimate: ...

@final
class Identification:
    @property
    def estimate(self) -> PayloadEstimate: ...
    @property
    def tool(self) -> str: ...
    @property
    def way(self) -> _Way: ...
    @property
    def estimator(self) -> _Filter: ...
    @property
    def average(self) -> float: ...
    @property
    def epochs(self) -> int: ...
    @property
    def cutoff(self) -> float: ...
    @property
    def stride(self) -> float: ...
    @property
    def history_epoch(self) -> NDArray[np.uint32]: ...
    @property
    def history_time(self) -> _Array: ...
    @property
    def history(self) -> _Array: ...
    @property
    def history_deviation(self) -> _Array: ...
    @property
    def deviation(self) -> _Array: ...
    @property
    def fit_time(self) -> _Array: ...
    @property
    def fit_measured(self) -> _Array: ...
    @property
    def fit_predicted(self) -> _Array: ...
    @property
    def fit_weight(self) -> _Array: ...
    @property
    def fit_held_out(self) -> NDArray[np.bool_]: ...
    @property
    def channels(self) -> list[str]: ...
    @property
    def channel_units(self) -> list[str]: ...
    @property
    def residual_rms(self) -> _Array: ...
    @property
    def held_out_rms(self) -> _Array: ...
    @property
    def excitation_values(self) -> _Array: ...
    @property
    def excitation_directions(self) -> _Array: ...
    @property
    def motion_advice(self) -> list[str]: ...
    @property
    def start_ns(self) -> int: ...
    @property
    def delay(self) -> float: ...
    @property
    def delay_estimate(self) -> float | None: ...
    @property
    def delay_deviation(self) -> float | None: ...
    @property
    def clock(self) -> Literal["stamps", "log times"]: ...
    @property
    def dirt(self) -> list[tuple[str, str, int, float]]: ...
    @property
    def remarks(self) -> list[str]: ...
    @property
    def gravity(self) -> _Array: ...
    @property
    def duration(self) -> float: ...
    @property
    def damage(self) -> list[str]: ...

def identify_log(
    log: _Path,
    *,
    tool: str | None = None,
    way: _Way | None = None,
    estimator: _Filter = "rls",
    alpha: float = 1.8,
    beta: float = 0.9,
    gravity: ArrayLike | None = None,
    average: float | None = None,
    cutoff: float | None = None,
    epochs: int | None = None,
    max_gap: float | None = None,
    urdf: str | None = None,
    joints: Sequence[str] = ...,
    wrenches: Sequence[str] = ...,
    odometry: str | None = None,
    imu: str | None = None,
    acceleration: str | None = None,
    wrench_acts_on: Literal["payload", "sensor"] = "payload",
    known_tool: MassProperties | None = None,
    delay: float | None = None,
    bare: _Path | None = None,
    effort_gain: Sequence[float] = ...,
    progress: _Progress | None = None,
) -> Identification: ...
def identify_arrays(
    time: ArrayLike,
    *,
    robot: Manipulator | None = None,
    q: ArrayLike | None = None,
    qd: ArrayLike | None = None,
    effort: ArrayLike | None = None,
    wrench: ArrayLike | None = None,
    pose: ArrayLike | None = None,
    twist: ArrayLike | None = None,
    acceleration: ArrayLike | None = None,
    sensors: Sequence[str] | None = None,
    tool: str | None = None,
    way: _Way | None = None,
    estimator: _Filter = "rls",
    alpha: float = 1.8,
    beta: float = 0.9,
    gravity: ArrayLike | None = None,
    average: float | None = None,
    cutoff: float | None = None,
    epochs: int | None = None,
    max_gap: float | None = None,
    known_tool: MassProperties | None = None,
    delay: float | None = None,
    progress: _Progress | None = None,
) -> Identification: ...

@final
class Topic:
    @property
    def name(self) -> str: ...
    @property
    def type_name(self) -> str: ...
    @property
    def encoding(self) -> str: ...
    @property
    def count(self) -> int: ...
    @property
    def frequency(self) -> float | None: ...

@final
class LogInfo:
    @property
    def topics(self) -> list[Topic]: ...
    @property
    def start(self) -> float | None: ...
    @property
    def duration(self) -> float | None: ...
    @property
    def metadata(self) -> dict[str, dict[str, str]]: ...
    @property
    def damage(self) -> list[str]: ...

def info(log: _Path) -> LogInfo: ...

@final
class Samples:
    @property
    def topic(self) -> str: ...
    @property
    def type_name(self) -> str: ...
    @property
    def start_ns(self) -> int: ...
    @property
    def time(self) -> _Array: ...
    @property
    def names(self) -> list[str]: ...
    @property
    def frame_id(self) -> str: ...
    @property
    def child_frame_id(self) -> str: ...
    @property
    def text(self) -> list[str]: ...
    @property
    def damage(self) -> list[str]: ...
    def keys(self) -> list[str]: ...
    def __getitem__(self, key: str, /) -> _Array: ...
    def __len__(self) -> int: ...

def read(log: _Path, topic: str, *, every: float = 0.0) -> Samples: ...

@final
class Experiment:
    PAPER_TOML: Final[str]
    @staticmethod
    def paper() -> Experiment: ...
    @staticmethod
    def from_toml(text: str) -> Experiment: ...
    @staticmethod
    def from_file(path: _Path) -> Experiment: ...
    def replace(
        self,
        *,
        frequency: float | None = None,
        posture: str | Sequence[float] | None = None,
        seed: int | None = None,
        duration: float | None = None,
    ) -> Experiment: ...
    def to_toml(self) -> str: ...
    @property
    def duration(self) -> float: ...
    @property
    def tool(self) -> str: ...
    @property
    def payload(self) -> MassProperties: ...
    @property
    def urdf(self) -> str: ...
    def __eq__(self, value: object, /) -> bool: ...
    def __ne__(self, value: object, /) -> bool: ...

@final
class RunReport:
    @property
    def linear_momentum_drift(self) -> float: ...
    @property
    def angular_momentum_drift(self) -> float: ...
    @property
    def grasp_drift(self) -> float: ...
    @property
    def grasp_rotation(self) -> float: ...
    @property
    def newton_residual(self) -> float: ...
    @property
    def euler_residual(self) -> float: ...
    @property
    def grip_force(self) -> float: ...
    @property
    def steps(self) -> int: ...
    @property
    def simulated_time(self) -> float: ...
    @property
    def wall_time(self) -> float: ...
    @property
    def steps_per_second(self) -> float: ...

def simulate(
    experiment: Experiment, out: _Path, *, progress: _Progress | None = None
) -> RunReport: ...
