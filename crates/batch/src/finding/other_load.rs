//! Times of a recording with another load.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tactid_dynamics::words::{general, listed};

/// Parts of a recording in which the load is not that of the rest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct OtherLoad {
    /// Begin and end of each part, on the clock of the samples, s.
    pub parts: Vec<[f64; 2]>,
    /// Fraction of the windows that are in these parts, without a unit.
    pub fraction: f64,
    /// Rms over these parts of what the load of the rest does not explain of the force, N.
    pub force_rms: f64,
    /// Rms over these parts of what the load of the rest does not explain of the moment, N m.
    pub moment_rms: f64,
}

impl OtherLoad {
    /// Returns whether the parts are at least half of the recording, so that the rest need not be
    /// the payload.
    pub(crate) fn is_most(&self) -> bool {
        self.fraction >= 0.5
    }

    pub(super) fn words(&self) -> String {
        let named = |&[from_s, to_s]: &[f64; 2]| format!("from {from_s:.1} s to {to_s:.1} s");
        let when = match &self.parts[..] {
            [[from_s, _], _, _, .., [_, to_s]] => {
                format!("in {} spans {}", self.parts.len(), named(&[*from_s, *to_s]))
            }
            few => listed(&few.iter().map(named).collect::<Vec<_>>()),
        };
        let consequence = if self.is_most() {
            "The result is that of the rest, which is no more than half: it may be another load \
             than the payload. Record the payload without contact."
        } else {
            "They are left out, and the result is that of the rest."
        };
        format!(
            "The wrenches {when}, {:.0} % of the time, are not those of the load in the rest of \
             the recording, by {} N and {} N m (rms): something touched the payload, or it was \
             another one. {consequence}",
            100.0 * self.fraction,
            general(self.force_rms, 2),
            general(self.moment_rms, 2)
        )
    }
}
