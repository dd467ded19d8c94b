//! Settings of the online identifier beside those of its equations.

use crate::{ActsOn, KnownTool};

/// Settings of the online identifier: known bodies in the load, the sign of the wrenches and their
/// delay. They have the names and the meaning of the options of a recording.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OnlineSettings {
    /// A known body that the measured load contains besides the payload, in the tool frame: it is
    /// subtracted, and its uncertainty is part of that of the payload. Default: none.
    pub known_tool: Option<KnownTool>,
    /// Body on which the measured wrenches act. Wrenches that an identifier returns have the sign
    /// of the measured ones. Default: the payload.
    pub wrench_acts_on: ActsOn,
    /// Delay of the wrenches relative to the motion of the same sample, s: it is subtracted from
    /// their times, between which they are interpolated. An estimate lags the samples by as much.
    /// Between -1 and 1, at up to 4000 samples per second. Default: 0.
    pub delay_s: f64,
}
