from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, Final, Literal, TypeAlias, final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from typing_extensions import disjoint_base

_Array: TypeAlias = NDArray[np.float64]
_Path: TypeAlias = str | PathLike[str]
_Source: TypeAlias = _Path | Mapping[str, ArrayLike]
"""A log, or the arrays of a recording by their names."""
_Robot: TypeAlias = Manipulator | None
_Sensors: TypeAlias = str | Sequence[str] | None
_Progress: TypeAlias = Callable[[float], object] | None
_Data: TypeAlias = dict[str, Any]
"""Values by the names of the fields of a class in ``tactid._results.records``."""

__all__ = [
    "PARAMETER_NAMES",
    "VALUE_NAMES",
    "VERSION",
    "ArmModel",
    "Estimator",
    "Experiment",
    "FrameMotion",
    "Identifier",
    "LiveSession",
    "Lms",
    "LogInfo",
    "LogMessages",
    "Manipulator",
    "MassProperties",
    "Nlms",
    "OnlineSolver",
    "PaperFilter",
    "Rls",
    "Samples",
    "Topic",
    "calibrate_arm",
    "combine",
    "design_excitation",
    "distance_of_runs",
    "fault_words",
    "finding_grade",
    "finding_schemas",
    "finding_words",
    "identify_arrays",
    "identify_log",
    "identify_logs",
    "identify_poses",
    "info",
    "options",
    "probability",
    "read",
    "read_motion",
    "record_schemas",
    "remaining",
    "set_log_memory",
    "simulate",
    "wrench_regressor",
    "write_estimates",
    "write_samples",
    "write_trajectory",
]

VERSION: Final[str]
VALUE_NAMES: Final[list[str]]
PARAMETER_NAMES: Final[list[str]]

@final
class MassProperties:
    def __new__(cls, mass: float, com: ArrayLike, inertia: ArrayLike) -> MassProperties: ...
    @staticmethod
    def from_parameters(parameters: ArrayLike) -> MassProperties: ...
    @staticmethod
    def from_values(values: ArrayLike) -> MassProperties: ...
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
        base: Literal["fixed", "floating"] = "fixed",
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
    def base(self) -> Literal["fixed", "floating"]: ...
    @property
    def mass(self) -> float: ...
    @property
    def findings(self) -> list[Any]: ...
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
    def update(self, rows: ArrayLike, targets: ArrayLike) -> int: ...
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

@disjoint_base
class OnlineSolver:
    def push(
        self,
        time: ArrayLike,
        q: ArrayLike | None = None,
        qd: ArrayLike | None = None,
        wrench: ArrayLike | None = None,
        *,
        effort: ArrayLike | None = None,
        pose: ArrayLike | None = None,
        twist: ArrayLike | None = None,
        acceleration: ArrayLike | None = None,
    ) -> int: ...

@final
class Identifier(OnlineSolver):
    def __new__(
        cls, robot: _Robot, sensors: _Sensors, effort: bool, options: _Data
    ) -> Identifier: ...
    def estimate(self) -> _Data: ...
    def covariance(self) -> _Array | None: ...
    def wrench_offset(self) -> _Data | None: ...
    def findings(self) -> list[tuple[str, _Data]]: ...

@final
class PaperFilter(OnlineSolver):
    def __new__(cls, robot: _Robot, sensors: _Sensors, options: _Data) -> PaperFilter: ...
    def estimate(self) -> _Data: ...
    def rewind(self) -> None: ...
    def singular_values(self) -> _Data: ...

@final
class LiveSession:
    def __new__(cls, options: _Data, first_s: float, in_background: bool) -> LiveSession: ...
    def announce(self, topics: Sequence[tuple[str, str]]) -> None: ...
    def push(self, messages: Sequence[tuple[str, str, bytes, int]]) -> None: ...
    def finish(self) -> None: ...
    def reset(self) -> None: ...
    def estimate(self) -> _Data | None: ...
    def wrench_offset(self) -> _Data | None: ...
    def status(self) -> _Data: ...
    def notices(self, now_ns: int) -> tuple[list[tuple[str, _Data]], list[_Data]]: ...

@final
class LogMessages:
    def __new__(cls, log: _Path) -> LogMessages: ...
    def read(self, count: int) -> list[tuple[str, str, bytes, int]]: ...

@final
class ArmModel:
    def __new__(cls, toml: str) -> ArmModel: ...
    def __eq__(self, value: object, /) -> bool: ...
    def __ne__(self, value: object, /) -> bool: ...
    @staticmethod
    def read(path: _Path) -> ArmModel: ...
    def write(self, path: _Path) -> None: ...
    def data(self) -> _Data: ...

def calibrate_arm(
    given: _Data,
    options: _Data,
    progress: _Progress = None,
    robot: _Robot = None,
) -> _Data: ...
def options() -> tuple[list[_Data], list[_Data], list[_Data]]: ...
def design_excitation(
    robot: Manipulator,
    given: _Data,
    options: _Data,
    read_mesh: Callable[[str, Path | None], bytes | str],
    progress: _Progress = None,
) -> _Data: ...
def write_samples(
    path: _Path,
    *,
    joints: tuple[str, Sequence[str], ArrayLike, ArrayLike, ArrayLike | None, ArrayLike | None]
    | None = None,
    wrench: tuple[str, ArrayLike, ArrayLike] | None = None,
) -> None: ...
def write_trajectory(
    path: _Path,
    *,
    joints: Sequence[str],
    time: ArrayLike,
    q: ArrayLike,
    qd: ArrayLike,
    qdd: ArrayLike,
    metadata: Mapping[str, str],
) -> None: ...
def identify_log(log: _Path, options: _Data, progress: _Progress = None) -> _Data: ...
def identify_logs(
    logs: Sequence[_Path], options: _Data, progress: _Progress = None
) -> list[_Data]: ...
def combine(runs: Sequence[_Data]) -> _Data: ...
def record_schemas() -> str: ...
def remaining(
    forecast: _Data | None, values: Sequence[float], std_devs: Sequence[float], within: float
) -> list[float]: ...
def finding_words(kind: str, data: Mapping[str, Any], style: str) -> str: ...
def finding_grade(kind: str, data: Mapping[str, Any]) -> tuple[Any, Any]: ...
def fault_words(data: dict[str, Any]) -> str: ...
def finding_schemas() -> list[str]: ...
def probability(p_value: float) -> str: ...
def distance_of_runs(
    chi_square: float, degrees_of_freedom: float, of_noise: float | None, p_value: float
) -> str: ...
def identify_arrays(
    time: ArrayLike,
    options: _Data,
    progress: _Progress = None,
    *,
    robot: _Robot = None,
    q: ArrayLike | None = None,
    qd: ArrayLike | None = None,
    effort: ArrayLike | None = None,
    wrench: ArrayLike | None = None,
    pose: ArrayLike | None = None,
    twist: ArrayLike | None = None,
    acceleration: ArrayLike | None = None,
    sensors: _Sensors = None,
) -> _Data: ...
def identify_poses(
    options: _Data,
    *,
    robot: _Robot = None,
    q: ArrayLike | None = None,
    wrench: ArrayLike | None = None,
    pose: ArrayLike | None = None,
    sensors: _Sensors = None,
) -> _Data: ...
def write_estimates(
    path: _Path,
    *,
    frame: str,
    start_ns: int,
    times: ArrayLike,
    values: ArrayLike,
    std_devs: ArrayLike | None = None,
) -> None: ...

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
def set_log_memory(mebibytes: float) -> None: ...

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
        step: float | None = None,
        gravity: ArrayLike | None = None,
        robot: Mapping[str, object] | None = None,
        base: Mapping[str, object] | None = None,
        payload: Mapping[str, object] | MassProperties | None = None,
        gripper: Mapping[str, object] | None = None,
        excitation: Mapping[str, object] | None = None,
        noise: Mapping[str, object] | None = None,
        bounds: Mapping[str, object] | None = None,
    ) -> Experiment: ...
    def following(self, motion: _Path) -> Experiment: ...
    def to_toml(self) -> str: ...
    def to_dict(self) -> _Data: ...
    @property
    def gravity(self) -> _Array: ...
    @property
    def base(self) -> str: ...
    @property
    def duration(self) -> float: ...
    @property
    def tip(self) -> str: ...
    @property
    def payload(self) -> MassProperties: ...
    @property
    def urdf(self) -> str: ...
    def __eq__(self, value: object, /) -> bool: ...
    def __ne__(self, value: object, /) -> bool: ...

def read_motion(path: _Path, rate: float, most: int) -> tuple[list[str], _Array, _Array]: ...
def simulate(experiment: Experiment, out: _Path, *, progress: _Progress = None) -> _Data: ...
