//! The result of an identification.

use nalgebra::Vector3;
use tactid_identify::{
    BoundingBox, Delay, FitReport, Forecast, HistoryPoint, KnownMass, Method, PayloadEstimate,
    PrincipalMoments, SingularValues,
};

use crate::{DataFault, Estimator, Finding};

/// Which times of a log the messages were taken to be measured at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Clock {
    /// The stamps of their headers, or the times of the arrays.
    #[default]
    Stamps,
    /// The times of logging, because the messages have no stamps.
    LogTimes,
}

/// The payload that was identified from a recording, with how it was found.
#[derive(Clone, Debug)]
pub struct Identification {
    /// Payload at the end of the recording, in the frame `estimate.frame`.
    pub estimate: PayloadEstimate,
    /// Principal moments of inertia of the payload; `None` where its mass is zero.
    pub principal_moments: Option<PrincipalMoments>,
    /// Estimate over time. The paper's filter has a point at least every 0.1 s of each presentation.
    pub history: Vec<HistoryPoint>,
    /// How well the payload explains the measurements; `None` for the paper's filter.
    pub fit: Option<FitReport>,
    /// Strength with which the motion excited mass and inertia; for the paper's filter only.
    pub singular_values: Option<SingularValues>,
    /// Forecast of the uncertainty for a motion that goes on; `None` for the paper's filter.
    pub forecast: Option<Forecast>,
    /// Measurements that were used.
    pub method: Method,
    /// Estimator that was used.
    pub estimator: Estimator,
    /// Cutoff of the low-pass on both sides of the equations, Hz.
    pub cutoff_hz: f64,
    /// Longest time between two samples that was bridged, s.
    pub max_gap_s: f64,
    /// Gravitational acceleration that was assumed, in the inertial frame, m/s².
    pub gravity: Vector3<f64>,
    /// Delay of the wrenches' stamps that was corrected, s; positive where they are later than the motion.
    pub delay_s: f64,
    /// Delay as it was estimated; `None` where the request gave it, or where it cannot be estimated.
    pub estimated_delay: Option<Delay>,
    /// Mass of the payload as the request gave it.
    pub known_mass: Option<KnownMass>,
    /// Box around the payload as the request gave it.
    pub bounding_box: Option<BoundingBox>,
    /// Where the times came from.
    pub clock: Clock,
    /// Time zero of the recording, ns since the epoch of its clock; 0 for arrays.
    pub start_ns: i64,
    /// Time from the first aligned sample to the last, s.
    pub duration_s: f64,
    /// Messages and samples that could not be used, counted by topic and kind.
    pub faults: Vec<DataFault>,
    /// What a reader of the result should know.
    pub findings: Vec<Finding>,
    /// Whether the observer stopped the reading before the end.
    pub interrupted: bool,
    /// Where the log could not be read further, and why: an entry for each file that ends early.
    pub damage: Vec<String>,
}

impl Identification {
    /// Time for which the motion must continue until half of the 95 % interval of each value is `within`
    /// (0.01 for 1 %) times the largest value of its kind (mass, centre of mass, inertia), in the order of
    /// [`VALUE_NAMES`](crate::VALUE_NAMES), s. Zero where it is so already, infinite where the motion does
    /// not determine the value; `None` for the paper's filter, which estimates no uncertainty.
    ///
    /// The information is extrapolated at the rate of the second half of the windows. An error of the model
    /// (a sign, a frame, friction) is a bias, which no time removes.
    #[must_use]
    pub fn remaining_s(&self, within: f64) -> Option<[f64; 10]> {
        let std_devs = self.estimate.std_devs?;
        let forecast = self.forecast.as_ref()?;
        Some(forecast.remaining_s(&self.estimate.values(), &std_devs, within))
    }

    /// Points of the last presentation for [`write_estimates`](crate::write_estimates): the history, whose
    /// last point is replaced by the final estimate.
    #[must_use]
    pub fn estimates(&self) -> Vec<HistoryPoint> {
        let last = self.history.last();
        let (epoch, time_s) = last.map_or((0, 0.0), |point| (point.epoch, point.time_s));
        let history = self.history.iter().filter(|point| point.epoch == epoch);
        let mut points: Vec<HistoryPoint> = history.copied().collect();
        points.pop();
        points.push(HistoryPoint {
            epoch,
            time_s,
            values: self.estimate.values(),
            std_devs: self.estimate.std_devs,
        });
        points
    }
}
