//! The extension module `tactid._native`: the crates in Python.
//!
//! It contains no mathematics: arrays come in, a crate's function runs with the interpreter
//! released, and arrays go out.

mod arguments;
mod arm_model;
mod arrays;
mod calibration;
mod collision_model;
mod combine;
mod compensation;
mod dynamics;
mod errors;
mod estimators;
mod excitation;
mod experiment_fields;
mod faults;
mod findings;
mod identification;
mod identify;
mod inertia;
mod interruption;
mod joint_arrays;
mod live;
mod logs;
mod motion;
mod online;
mod online_samples;
mod options;
mod poses;
mod ranges;
mod read;
mod record;
mod regressor;
mod rows;
mod samples;
mod schemas;
mod shapes;
mod simulate;
mod states;
mod table;
mod table_log;
mod text;
mod urdf;
mod workspaces;

/// The compiled part of the package `tactid`.
#[pyo3::pymodule]
mod _native {
    use pyo3::prelude::*;

    #[pymodule_export]
    use crate::arm_model::ArmModel;
    #[pymodule_export]
    use crate::calibration::calibrate_arm;
    #[pymodule_export]
    use crate::combine::{combine, identify_logs};
    #[pymodule_export]
    use crate::compensation::{compensate_arrays, compensate_into, compensate_log};
    #[pymodule_export]
    use crate::dynamics::{FrameMotion, Manipulator};
    #[pymodule_export]
    use crate::estimators::{Estimator, Lms, Nlms, Rls};
    #[pymodule_export]
    use crate::excitation::{design_excitation, write_trajectory};
    #[pymodule_export]
    use crate::findings::{
        distance_of_runs, fault_words, finding_grade, finding_schemas, finding_words, probability,
    };
    #[pymodule_export]
    use crate::identification::remaining;
    #[pymodule_export]
    use crate::identify::{
        identify_arrays, identify_log, identify_poses, split_log, write_estimates,
    };
    #[pymodule_export]
    use crate::inertia::MassProperties;
    #[pymodule_export]
    use crate::live::{LiveSession, LogMessages};
    #[pymodule_export]
    use crate::logs::{LogInfo, Topic, info, set_log_memory};
    #[pymodule_export]
    use crate::online::{Identifier, LagIdentifier, OnlineSolver, PaperFilter};
    #[pymodule_export]
    use crate::options::options;
    #[pymodule_export]
    use crate::read::read;
    #[pymodule_export]
    use crate::regressor::wrench_regressor;
    #[pymodule_export]
    use crate::samples::Samples;
    #[pymodule_export]
    use crate::schemas::record_schemas;
    #[pymodule_export]
    use crate::simulate::{Experiment, read_motion, simulate};
    #[pymodule_export]
    use crate::table_log::write_samples;

    /// Reports a panic, which is a fault of tactid, in one line.
    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        std::panic::set_hook(Box::new(|panic| {
            let what = panic.to_string().replace('\n', " ");
            eprintln!("tactid: internal error: {what}; please report it");
        }));
        // The first array, and the first borrowed one, load the interface of NumPy, which panics where a
        // signal interrupts it: NumPy itself, which takes longest, is loaded before.
        module.py().import("numpy")?;
        let array = numpy::PyArray1::<f64>::zeros(module.py(), 0, false);
        drop(numpy::PyArrayMethods::try_readonly(&array)?);
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }

    /// Names of the ten values of a payload, in order.
    #[pymodule_export]
    const VALUE_NAMES: [&str; 10] = tactid_identify::VALUE_NAMES;
    /// Names of the ten inertial parameters in which the dynamics are linear, in order.
    #[pymodule_export]
    const PARAMETER_NAMES: [&str; 10] = tactid_dynamics::PARAMETER_NAMES;
}
