//! The channels of an equation: what each row measures, and what is known of its noise.

use nalgebra::{DMatrix, Matrix6};
use schemars::JsonSchema;
use serde::Serialize;

/// What one row of an equation measures.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Channel {
    /// Name of the measured quantity, such as `force x` or `effort joint_2`.
    pub name: String,
    /// Unit of the measured quantity.
    pub unit: &'static str,
}

/// The channels of all equations of a stream, grouped by kind and by source.
#[derive(Clone, Debug)]
pub struct Channels {
    /// Name and unit of each channel, in the order of the rows.
    pub channels: Vec<Channel>,
    /// Numbers of consecutive channels whose noise is of similar size, such as the axes of a force.
    /// Their sum is the number of channels.
    pub kinds: Vec<usize>,
    /// Numbers of consecutive channels that come from one measurement source. Their sum is the
    /// number of channels.
    pub sources: Vec<usize>,
    /// Number of leading channels that may have an unknown constant offset: six or none.
    pub offsets: usize,
    /// Known noise of the sensors of some sources.
    pub known_noise: Vec<KnownNoise>,
    /// Projection of a wrench in the tool frame, force then moment, onto its channels that are
    /// measured; `None` where all are.
    pub projection: Option<Matrix6<f64>>,
}

impl Channels {
    /// The six channels of one wrench whose noise is unknown: force in N, then moment in N m.
    #[must_use]
    pub fn of_wrench() -> Self {
        Self {
            channels: wrench_channels(""),
            kinds: vec![3, 3],
            sources: vec![6],
            offsets: 0,
            known_noise: Vec::new(),
            projection: None,
        }
    }

    /// Returns these channels with an unknown offset in each of the six of the wrench, or with
    /// none.
    #[must_use]
    pub fn with_offsets(self, unknown: bool) -> Self {
        let offsets = if unknown { WRENCH } else { 0 };
        Self { offsets, ..self }
    }

    /// Returns whether the first six channels are the force and the moment of a wrench on the
    /// end-effector.
    #[must_use]
    pub fn begin_with_wrench(&self) -> bool {
        self.channels.starts_with(&wrench_channels(""))
    }

    /// Number of channels.
    #[must_use]
    pub fn count(&self) -> usize {
        self.sources.iter().sum()
    }

    /// Index of the source of each channel.
    pub fn source_of(&self) -> Vec<usize> {
        let counts = self.sources.iter().enumerate();
        let sources = counts.flat_map(|(source, &count)| std::iter::repeat_n(source, count));
        sources.collect()
    }
}

/// Number of channels of a wrench.
pub const WRENCH: usize = 6;

/// Names and units of the six channels of a wrench, force then moment. Each name follows the
/// `prefix`.
pub(crate) fn wrench_channels(prefix: &str) -> Vec<Channel> {
    let axes_of = |quantity: &'static str, unit| {
        ["x", "y", "z"].map(|axis| Channel {
            name: format!("{prefix}{quantity} {axis}"),
            unit,
        })
    };
    [axes_of("force", "N"), axes_of("moment", "N m")].concat()
}

/// Known white noise of the channels of one source.
#[derive(Clone, Debug)]
pub struct KnownNoise {
    /// Index of the source's first channel.
    pub first_channel: usize,
    /// Covariance of the noise of one sample across the source's channels, in their units; positive
    /// definite.
    pub covariance: DMatrix<f64>,
}
