from ._api.calibrating import calibrate as calibrate
from ._api.calibration import Calibration as Calibration
from ._api.combined import Combination as Combination, combine as combine
from ._api.comparison import Attempt as Attempt, compare as compare
from ._api.compensation import compensate as compensate
from ._api.designed_motion import DesignedMotion as DesignedMotion
from ._api.excitation import Grip as Grip, design_excitation as design_excitation
from ._api.offline import identify as identify
from ._api.online import (
    Identifier as Identifier,
    LagIdentifier as LagIdentifier,
    PaperFilter as PaperFilter,
    WrenchEstimate as WrenchEstimate,
)
from ._api.poses import identify_poses as identify_poses
from ._api.result import (
    Identification as Identification,
    PaperIdentification as PaperIdentification,
)
from ._api.simulation import simulate as simulate
from ._api.tactile import SummedForces as SummedForces, sum_forces as sum_forces
from ._base.errors import (
    ArgumentError as ArgumentError,
    CalibrationError as CalibrationError,
    ExcitationError as ExcitationError,
    ExperimentError as ExperimentError,
    IdentificationError as IdentificationError,
    InternalError as InternalError,
    LogError as LogError,
    ModelError as ModelError,
    SimulationError as SimulationError,
    TactidError as TactidError,
)
from ._base.findings import DataFault as DataFault, Finding as Finding
from ._documents.schemas import (
    calibration_schema as calibration_schema,
    combination_schema as combination_schema,
    motion_schema as motion_schema,
    result_schema as result_schema,
)
from ._fleet.run import fleet as fleet
from ._fleet.study import StudyErrors as StudyErrors, study as study, study_errors as study_errors
from ._native import (
    VALUE_NAMES as VALUE_NAMES,
    Estimator as Estimator,
    Experiment as Experiment,
    FrameMotion as FrameMotion,
    Lms as Lms,
    LogInfo as LogInfo,
    Manipulator as Manipulator,
    MassProperties as MassProperties,
    Nlms as Nlms,
    Rls as Rls,
    Samples as Samples,
    Topic as Topic,
    __version__ as __version__,
    info as info,
    read as read,
    set_log_memory as set_log_memory,
    wrench_regressor as wrench_regressor,
)
from ._options.options import Options as Options
from ._read.dh import dh_urdf as dh_urdf
from ._results.calibration_data import CalibrationRecording as CalibrationRecording
from ._results.compensation import Compensation as Compensation
from ._results.payload import PaperEstimate as PaperEstimate, PayloadEstimate as PayloadEstimate
from ._results.records import (
    ActiveContradiction as ActiveContradiction,
    ActiveReport as ActiveReport,
    Agreement as Agreement,
    ArmChange as ArmChange,
    BaseExcursion as BaseExcursion,
    BoundingBox as BoundingBox,
    CalibratedFit as CalibratedFit,
    Channel as Channel,
    CollisionFinding as CollisionFinding,
    Delay as Delay,
    FitReport as FitReport,
    Forecast as Forecast,
    GravityEstimate as GravityEstimate,
    History as History,
    KnownMass as KnownMass,
    LinearEstimate as LinearEstimate,
    LoadEstimate as LoadEstimate,
    Margin as Margin,
    MotionHistory as MotionHistory,
    PaperHistory as PaperHistory,
    PaperSettings as PaperSettings,
    PrincipalMoments as PrincipalMoments,
    RunDistance as RunDistance,
    RunReport as RunReport,
    ShapeFit as ShapeFit,
    ShapePrior as ShapePrior,
    SharedErrors as SharedErrors,
    SingularValues as SingularValues,
    ValueDifference as ValueDifference,
    WeightEstimate as WeightEstimate,
    WrenchOffset as WrenchOffset,
)
