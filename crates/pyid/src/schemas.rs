//! JSON schemas of results, from which Python makes their classes.

use pyo3::prelude::*;
use schemars::generate::SchemaSettings;
use tactid_recordings::{
    Combination, Identification, LiveStatus, PaperIdentification, RecordingReport,
};
use tactid_sim::RunReport;

use crate::arm_model::Calibration;
use crate::calibration::RecordingData;
use crate::motion::DesignedMotion;

/// Returns the JSON schemas of results by the names of their structures, as one JSON document.
#[pyfunction]
pub(crate) fn record_schemas() -> String {
    let settings = SchemaSettings::draft2020_12().for_serialize();
    let mut generator = settings.into_generator();
    generator.subschema_for::<RecordingReport>();
    generator.subschema_for::<Identification>();
    generator.subschema_for::<PaperIdentification>();
    generator.subschema_for::<Combination>();
    generator.subschema_for::<LiveStatus>();
    generator.subschema_for::<DesignedMotion>();
    generator.subschema_for::<Calibration>();
    generator.subschema_for::<RecordingData>();
    generator.subschema_for::<RunReport>();
    serde_json::Value::from(generator.take_definitions(false)).to_string()
}
