"""Identifies what a robot is holding: mass, centre of mass and inertia of a grasped payload.

:func:`identify` takes a log or arrays; :class:`Identifier` takes samples one at a time. A robot is
read from a URDF, and its dynamics are computed on whole arrays. SI units everywhere; each argument
says its frame and its sign.

>>> import numpy as np
>>> import tactid
>>> pendulum = tactid.Manipulator.from_urdf('''
...     <robot name="pendulum">
...       <link name="base"/>
...       <link name="arm"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
...         <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
...       <joint name="hinge" type="continuous">
...         <parent link="base"/><child link="arm"/><axis xyz="0 1 0"/></joint>
...     </robot>''', base="fixed")
>>> q = [[0.0], [np.pi / 2]]  # hanging, and level on the side of -x
>>> torques, _ = pendulum.inverse_dynamics(q, gravity=[0, 0, -9.81])
>>> print(np.round(torques[:, 0], 3) + 0.0)  # N m: what holds it up
[0.   9.81]

The parameters of a body, and the wrench that moves it:

>>> payload = tactid.MassProperties(mass=100, com=[0.5, 0, 0], inertia=np.diag([10, 20, 10]))
>>> print(payload.parameters[7])  # Iyy about the frame's origin: 20 + 100 * 0.5**2
45.0
>>> rows = tactid.wrench_regressor([0, 0, 9.81], [0, 0, 0], [0, 0, 0])
>>> force_and_moment = rows @ payload.parameters
>>> print(np.round(force_and_moment, 3) + 0.0)
[   0.     0.   981.     0.  -490.5    0. ]

The paper's experiment, and the payload from its log::

    tactid.simulate(tactid.Experiment.paper(), "run.mcap")
    estimate = tactid.identify("run.mcap", estimator="least-squares").estimate
    print(estimate.body)
"""

# isort: off
from tactid._base import startup as _startup  # noqa: F401 - first: Ctrl-C while the others load

# isort: on
from tactid._api.calibrating import calibrate
from tactid._api.calibration import Calibration
from tactid._api.combined import Combination, combine
from tactid._api.comparison import Attempt, compare
from tactid._api.compensation import compensate
from tactid._api.designed_motion import DesignedMotion
from tactid._api.excitation import Grip, design_excitation
from tactid._api.offline import identify
from tactid._api.online import Identifier, PaperFilter, WrenchEstimate
from tactid._api.poses import identify_poses
from tactid._api.result import Identification, PaperIdentification
from tactid._api.simulation import simulate
from tactid._api.tactile import SummedForces, sum_forces
from tactid._base.errors import (
    ArgumentError,
    CalibrationError,
    ExcitationError,
    ExperimentError,
    IdentificationError,
    InternalError,
    LogError,
    ModelError,
    SimulationError,
    TactidError,
)
from tactid._base.findings import DataFault, Finding
from tactid._documents.schemas import (
    calibration_schema,
    combination_schema,
    motion_schema,
    result_schema,
)
from tactid._fleet.run import fleet
from tactid._fleet.study import StudyErrors, study, study_errors
from tactid._native import (
    VALUE_NAMES,
    VERSION,
    Estimator,
    Experiment,
    FrameMotion,
    Lms,
    LogInfo,
    Manipulator,
    MassProperties,
    Nlms,
    Rls,
    Samples,
    Topic,
    info,
    read,
    set_log_memory,
    wrench_regressor,
)
from tactid._options.options import Options
from tactid._read.dh import dh_urdf
from tactid._results.calibration_data import CalibrationRecording
from tactid._results.compensation import Compensation
from tactid._results.payload import PaperEstimate, PayloadEstimate
from tactid._results.records import (
    ActiveContradiction,
    ActiveReport,
    Agreement,
    ArmChange,
    BaseExcursion,
    BoundingBox,
    CalibratedFit,
    Channel,
    CollisionFinding,
    Delay,
    FitReport,
    Forecast,
    GravityEstimate,
    History,
    KnownMass,
    LinearEstimate,
    LoadEstimate,
    Margin,
    MotionHistory,
    PaperHistory,
    PaperSettings,
    PrincipalMoments,
    RunDistance,
    RunReport,
    ShapeFit,
    ShapePrior,
    SharedErrors,
    SingularValues,
    ValueDifference,
    WeightEstimate,
    WrenchOffset,
)

__version__ = VERSION

__all__ = [
    "VALUE_NAMES",
    "ActiveContradiction",
    "ActiveReport",
    "Agreement",
    "ArgumentError",
    "ArmChange",
    "Attempt",
    "BaseExcursion",
    "BoundingBox",
    "CalibratedFit",
    "Calibration",
    "CalibrationError",
    "CalibrationRecording",
    "Channel",
    "CollisionFinding",
    "Combination",
    "Compensation",
    "DataFault",
    "Delay",
    "DesignedMotion",
    "Estimator",
    "ExcitationError",
    "Experiment",
    "ExperimentError",
    "Finding",
    "FitReport",
    "Forecast",
    "FrameMotion",
    "GravityEstimate",
    "Grip",
    "History",
    "Identification",
    "IdentificationError",
    "Identifier",
    "InternalError",
    "KnownMass",
    "LinearEstimate",
    "Lms",
    "LoadEstimate",
    "LogError",
    "LogInfo",
    "Manipulator",
    "Margin",
    "MassProperties",
    "ModelError",
    "MotionHistory",
    "Nlms",
    "Options",
    "PaperEstimate",
    "PaperFilter",
    "PaperHistory",
    "PaperIdentification",
    "PaperSettings",
    "PayloadEstimate",
    "PrincipalMoments",
    "Rls",
    "RunDistance",
    "RunReport",
    "Samples",
    "ShapeFit",
    "ShapePrior",
    "SharedErrors",
    "SimulationError",
    "SingularValues",
    "StudyErrors",
    "SummedForces",
    "TactidError",
    "Topic",
    "ValueDifference",
    "WeightEstimate",
    "WrenchEstimate",
    "WrenchOffset",
    "__version__",
    "calibrate",
    "calibration_schema",
    "combination_schema",
    "combine",
    "compare",
    "compensate",
    "design_excitation",
    "dh_urdf",
    "fleet",
    "identify",
    "identify_poses",
    "info",
    "motion_schema",
    "read",
    "result_schema",
    "set_log_memory",
    "simulate",
    "study",
    "study_errors",
    "sum_forces",
    "wrench_regressor",
]


def __dir__() -> list[str]:
    return sorted(__all__)
