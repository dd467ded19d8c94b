//! The shortest motion that determines a payload well enough.

use tactid_identify::VALUE_NAMES;
use tactid_identify::equations::window;

use crate::ExcitationError;
use crate::checks::value;
use crate::design::{Design, design_like};
use crate::motion::Trajectory;
use crate::problem::Problem;
use crate::progress::Observer;
use crate::settings::DesignSettings;

/// Shortest duration that is tried, in averaging windows.
const SHORTEST_IN_WINDOWS: f64 = 2.0;

/// Least and largest ratio of two successive durations before the shortest is bracketed.
const LEAST_FACTOR: f64 = 1.2;
const LARGEST_FACTOR: f64 = 3.0;

/// Settings of a search for the shortest motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShortestSettings {
    /// Settings of each design.
    pub design: DesignSettings,
    /// Longest duration, s, at least two averaging windows. Default: 60.
    pub longest_s: f64,
    /// Ratio of two durations that count as the same, more than 1. Default: 1.03.
    pub precision: f64,
}

impl Default for ShortestSettings {
    fn default() -> Self {
        Self {
            design: DesignSettings::default(),
            longest_s: 60.0,
            precision: 1.03,
        }
    }
}

impl ShortestSettings {
    /// Checks the settings, given the shortest duration that is tried, s.
    fn check(&self, shortest_s: f64) -> Result<(), ExcitationError> {
        let is_long = self.longest_s >= shortest_s && self.longest_s.is_finite();
        value(
            "longest_s",
            self.longest_s,
            is_long,
            &format!("at least two averaging windows, {shortest_s:.3} s"),
        )?;
        let is_ratio = self.precision > 1.0 && self.precision.is_finite();
        value("precision", self.precision, is_ratio, "more than 1")
    }
}

/// Designs the shortest motion with all predicted intervals within their targets. The duration of
/// `problem` is the first that is tried.
///
/// Cost: some eight designs.
///
/// # Errors
/// Returns [`ExcitationError::OutOfReach`] where the longest motion does not reach the targets,
/// [`ExcitationError::Value`] for settings that are out of range, and the errors of
/// [`design_observed`](crate::design_observed) for the longest motion.
pub fn shortest(
    problem: &Problem,
    settings: &ShortestSettings,
    observer: &mut Observer<'_>,
) -> Result<Design, ExcitationError> {
    problem.check()?;
    let shortest_s = SHORTEST_IN_WINDOWS * window::length_s(problem.sensing.equations.cutoff_hz);
    settings.check(shortest_s)?;
    // The longest duration that is too short; unknown until one has failed.
    let mut short_s: Option<f64> = None;
    let mut duration_s = problem.duration_s.clamp(shortest_s, settings.longest_s);
    let mut found: Option<(f64, Design)> = None;
    let mut last: Option<Trajectory> = None;
    loop {
        let design = tried(problem, duration_s, settings, last.as_ref(), observer)?;
        if let Some(design) = &design {
            last = Some(design.trajectory.clone());
        }
        let ratio = design.as_ref().map(|design| design.prediction.largest().1);
        match design {
            Some(design) if design.prediction.largest().1 <= 1.0 => {
                found = Some((duration_s, design));
            }
            Some(design) if found.is_none() && duration_s >= settings.longest_s => {
                return Err(out_of_reach(&design, settings.longest_s));
            }
            _ => short_s = Some(duration_s),
        }
        // Standard deviations fall with a power of the duration between 0.5 and 2.5.
        let factor = ratio.map_or(LARGEST_FACTOR, |ratio| ratio.powf(0.5));
        duration_s = match found {
            None => {
                let longer = duration_s * factor.clamp(LEAST_FACTOR, LARGEST_FACTOR);
                longer.min(settings.longest_s)
            }
            Some((long_s, design))
                if long_s <= short_s.unwrap_or(shortest_s) * settings.precision =>
            {
                return Ok(design);
            }
            Some((long_s, design)) => {
                found = Some((long_s, design));
                match short_s {
                    Some(short_s) => (short_s * long_s).sqrt(),
                    None => {
                        let factor = factor.clamp(LARGEST_FACTOR.recip(), LEAST_FACTOR.recip());
                        (long_s * factor).max(shortest_s)
                    }
                }
            }
        };
    }
}

/// Designs a motion of a duration; `None` where there is none, but a longer one may be possible.
fn tried(
    problem: &Problem,
    duration_s: f64,
    settings: &ShortestSettings,
    like: Option<&Trajectory>,
    observer: &mut Observer<'_>,
) -> Result<Option<Design>, ExcitationError> {
    let problem = Problem {
        duration_s,
        ..problem.clone()
    };
    match design_like(&problem, &settings.design, like, observer) {
        Ok(design) => Ok(Some(design)),
        // In a short time it may not be possible to determine everything, or to reach the end.
        Err(
            ExcitationError::NotObservable
            | ExcitationError::TooShort { .. }
            | ExcitationError::Impossible { .. },
        ) if duration_s < settings.longest_s => Ok(None),
        Err(error) => Err(error),
    }
}

fn out_of_reach(design: &Design, longest_s: f64) -> ExcitationError {
    let (value, ratio) = design.prediction.largest();
    ExcitationError::OutOfReach {
        longest_s,
        value: VALUE_NAMES[value],
        ratio,
        binding: design.binding().next().cloned(),
    }
}
