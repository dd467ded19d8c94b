//! What an online identifier has noticed, for another thread.

use super::identifier::Identifier;
use super::recent_equations::RecentEquations;
use super::sample_checks::OnlineChecks;
use crate::Finding;
use crate::checks::FEWEST_SAMPLES;
use crate::diagnosis::findings_without_prior;
use crate::equations::EquationStream;
use crate::known_bodies::KnownBodies;
use crate::sampling::Sampling;

/// What the findings of an [`Identifier`] follow from, as of one sample. A control loop updates one without allocation, and
/// another thread computes the findings.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// The model of the robot and the settings, which no sample changes.
    stream: EquationStream,
    sampling: Sampling,
    windows: u64,
    checks: OnlineChecks,
    recent: RecentEquations,
    known: KnownBodies,
    /// Whether the measured wrenches act on the sensor.
    is_negated: bool,
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

    /// Copies what findings follow from into a snapshot that this identifier has made, or one with the same robot and
    /// settings. Allocates nothing.
    pub fn update_snapshot(&self, snapshot: &mut Snapshot) {
        snapshot.sampling = self.stream.sampling();
        snapshot.windows = self.windows;
        snapshot.checks.clone_from(&self.checks);
        snapshot.recent.clone_from(&self.recent);
        snapshot.known = self.update.known();
    }

    /// Returns the findings of a [`snapshot`](Self::snapshot) of this moment, see [`Snapshot::findings`].
    #[must_use]
    pub fn findings(&self) -> Vec<Finding> {
        self.snapshot().findings()
    }
}

impl Snapshot {
    /// Returns what the most recent samples show about the assumptions. The samples of the last 10 s show joint
    /// velocities or a twist that are not the derivatives of the positions or the pose, and channels of a sensor that
    /// never change. The windows show a wrong sign of gravity or of the load, an offset of the wrench sensor, a load that
    /// the model does not explain, and outliers: the findings that [`BatchIdentifier`](crate::BatchIdentifier) has for
    /// the same samples without prior information. Samples of which none is in a window are reported, too. What is
    /// wrong in the robot's description is reported as far as the method uses it.
    ///
    /// The windows are at most the last 324 (10 s at a cutoff of 10 Hz) since the last payload change.
    ///
    /// Cost: several least-squares fits, some 10 ms, with allocation: outside of the control loop.
    #[must_use]
    pub fn findings(&self) -> Vec<Finding> {
        let mut findings = self.checks.findings();
        let sampling = self.sampling;
        if self.windows == 0 && sampling.samples + sampling.rejected >= FEWEST_SAMPLES {
            findings.push(Finding::NoEquations(sampling));
        }
        let equations = self.recent.in_order();
        findings.extend(findings_without_prior(
            &equations,
            &self.stream,
            &self.known,
        ));
        if self.is_negated {
            findings.iter_mut().for_each(Finding::negate_wrenches);
        }
        findings
    }
}
