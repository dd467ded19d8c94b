//! What an online identifier has noticed, for another thread.

use super::identifier::Identifier;
use super::recent_equations::RecentEquations;
use crate::checks::SampleChecks;
use crate::equations::EquationStream;
use crate::known_bodies::KnownBodies;
use crate::sampling::Sampling;

/// What the findings of an [`Identifier`] follow from, as of one sample. A control loop updates one
/// without allocation, and another thread computes the findings: `online_findings` of
/// `tactid-batch`.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// The model of the robot and the settings, which no sample changes.
    pub stream: EquationStream,
    /// Numbers of samples, and of those that were left out.
    pub sampling: Sampling,
    /// Number of windows since the last payload change.
    pub windows: u64,
    /// The last 10 s of samples.
    pub checks: SampleChecks,
    /// The windows since the last payload change.
    pub recent: RecentEquations,
    /// What the identified body contains besides the payload.
    pub known: KnownBodies,
    /// Whether the measured wrenches act on the sensor.
    pub is_negated: bool,
}

impl Identifier {
    /// Copies what findings follow from, with allocation.
    #[must_use]
    pub fn snapshot(&self) -> Snapshot {
        Snapshot {
            stream: self.stream.clone(),
            sampling: self.stream.sampling(),
            windows: self.windows,
            checks: self.checks.clone(),
            recent: self.recent.clone(),
            known: self.update.known(),
            is_negated: self.sign < 0.0,
        }
    }

    /// Copies what findings follow from into a snapshot that this identifier has made, or one with
    /// the same robot and settings. Allocates nothing.
    pub fn update_snapshot(&self, snapshot: &mut Snapshot) {
        snapshot.sampling = self.stream.sampling();
        snapshot.windows = self.windows;
        snapshot.checks.clone_from(&self.checks);
        snapshot.recent.clone_from(&self.recent);
        snapshot.known = self.update.known();
    }
}
