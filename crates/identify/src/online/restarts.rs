//! What follows when windows contradict the estimate: it starts again, and either a payload
//! explains the new windows, or the estimate before continues.

use super::explanations::Verdict;
use super::least_squares::{Assessment, OnlineLeastSquares};
use super::noise_tracker::TRIAL_WINDOWS;
use super::trusted::JointEstimate;
use crate::equations::Equation;
use crate::solve::offsets::Offsets;

/// Number of times in a row that the windows since a payload change contradict any payload, at
/// least 30 s at a cutoff of 10 Hz, after which the noise may be larger than before.
const MOST_CANDIDATES: usize = TRIAL_WINDOWS;

impl OnlineLeastSquares {
    /// Compares the windows since a payload change with what may explain them, before a new window
    /// is added. Returns what the new window means, if not that it is added.
    pub(super) fn doubt(&mut self, equation: &Equation) -> Option<Assessment> {
        let before = self.trusted.estimate().filter(|_| self.alarms > 0)?;
        if self.alarms <= MOST_CANDIDATES {
            let mass_std_dev = self.covariance[(0, 0)].max(0.0).sqrt();
            let verdict = self
                .explanations
                .verdict(&self.state, mass_std_dev, self.verdict);
            if verdict == Verdict::Contradicted {
                return Some(self.restart());
            }
            self.verdict = verdict;
        }
        let contradicts_present = self.is_contradicted || self.alarms > 1;
        let (noise, rows) = (&self.state.noise, &self.trusted.state().rows);
        let returns = (self.explanations).add(equation, before, (noise, rows), contradicts_present);
        (returns || self.verdict == Verdict::Returned).then(|| {
            self.return_to_trusted();
            Assessment::PayloadReturned
        })
    }

    /// Takes the present estimate as the one that nothing contradicts, if so: payload changes are
    /// detected, and no window since the last one shows any evidence of one.
    pub(super) fn trust_unless_contradicted(&mut self) {
        if self.is_settled() {
            self.trust();
        }
    }

    /// Takes the present estimate as the one that nothing contradicts.
    pub(super) fn trust(&mut self) {
        let estimate = self.joint_estimate();
        self.trusted.set(&self.state, estimate);
        self.alarms = 0;
        self.verdict = Verdict::Payload;
    }

    /// Says that nothing touches the payload, so that whatever explains the windows is a payload.
    /// Returns whether one does, from windows that are enough for it to be held.
    pub(crate) fn confirm_payload(&mut self) -> bool {
        let is_confirmed = self.detects_changes() && self.is_known();
        if is_confirmed && self.alarms > 0 {
            self.trust();
        }
        is_confirmed
    }

    /// Whether the estimate started again once since it was trusted.
    pub(crate) fn is_first_alarm(&self) -> bool {
        self.alarms == 1
    }

    /// Whether a payload explains the windows since the last payload change.
    pub(crate) fn is_known(&self) -> bool {
        self.verdict >= Verdict::Ambiguous
    }

    /// Whether the noise before a payload change holds for the windows after it, too: whatever no
    /// body explains is then a contact. After many changes in a row, or in the first seconds, the
    /// noise may have been underestimated instead.
    pub(super) fn knows_noise(&self) -> bool {
        self.trusted.estimate().is_some()
            && self.windows >= TRIAL_WINDOWS
            && self.alarms <= MOST_CANDIDATES
    }

    /// Discards all windows after a payload change, and keeps what is known of the offsets, and of
    /// the noise. Noise that may have been underestimated is increased. Returns what that means: a
    /// payload change where 32 windows had shown a payload.
    pub(super) fn restart(&mut self) -> Assessment {
        let was_known = self.detects_changes() && self.is_known();
        if self.alarms == 0 {
            self.explanations.restart_returning();
        }
        self.alarms += 1;
        if self.knows_noise() {
            self.state.noise.copy_from(&self.trusted.state().noise);
        } else if self.state.windows_since_start < TRIAL_WINDOWS {
            self.state.noise.increase();
        }
        let trusted = self.trusted.estimate().copied();
        let before = trusted.map_or(self.state.parameters, |trusted| trusted.parameters);
        self.state.rows.restart_at(&before);
        let offsets = trusted.as_ref().and_then(JointEstimate::known_offsets);
        self.state.centering.restart(offsets);
        self.changes.restart();
        self.explanations.restart();
        self.is_contradicted = false;
        self.state.windows_since_start = 0;
        self.verdict = match trusted {
            Some(_) if self.alarms <= MOST_CANDIDATES => Verdict::Unknown,
            _ => Verdict::Payload,
        };
        if was_known {
            Assessment::PayloadChanged
        } else {
            Assessment::Contradicted
        }
    }

    /// Continues with the last estimate that nothing contradicted. Returns whether that takes a
    /// payload change back.
    pub(super) fn return_to_trusted(&mut self) -> bool {
        self.state.copy_from(self.trusted.state());
        self.changes.restart();
        self.explanations.restart();
        self.explanations.restart_returning();
        self.verdict = Verdict::Payload;
        std::mem::take(&mut self.alarms) > 0
    }

    /// Holds the load at the last estimate that nothing contradicted, and has the offsets
    /// determined anew by the windows that follow. Returns whether a payload change is taken back;
    /// the update then begins with [`Stage::Solve`]. `None`, and nothing done, where the offsets
    /// are no unknowns, or no load is known.
    pub(crate) fn forget_offsets(&mut self) -> Option<bool> {
        if !self.state.centering.is_needed() || self.trusted.estimate().is_none() {
            return None;
        }
        let is_taken_back = self.return_to_trusted();
        let factor = self.score_factor();
        self.state.rows.keep_offset_rows(factor);
        self.state.earlier = self.state.rows.sums();
        self.state.centering.restart(None);
        Some(is_taken_back)
    }

    /// Returns the offsets: those before a payload change until its windows show a payload.
    pub(crate) fn known_offsets(&self) -> Option<Offsets> {
        if self.verdict == Verdict::Payload {
            return self.joint_estimate().offsets;
        }
        let before = self.trusted.estimate()?.known_offsets()?;
        Some(Offsets::known(&before))
    }
}
