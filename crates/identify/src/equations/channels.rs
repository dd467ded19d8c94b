//! The channels of an equation: what each row measures, and what is known of its noise.

use nalgebra::DMatrix;

/// What one row of an equation measures.
#[derive(Clone, Debug, PartialEq, Eq)]
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
    pub kinds: Vec<usize>,
    /// Numbers of consecutive channels that come from one source of measurements.
    pub sources: Vec<usize>,
    /// Number of leading channels that may have an unknown constant offset.
    pub offsets: usize,
    /// Known noise of the sensors of some sources.
    pub given: Vec<GivenNoise>,
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
            given: Vec::new(),
        }
    }

    /// Returns these channels with an unknown offset in each of the six of the wrench, or with none.
    #[must_use]
    pub fn with_offsets(self, unknown: bool) -> Self {
        let offsets = if unknown { 6 } else { 0 };
        Self { offsets, ..self }
    }

    /// Number of channels.
    #[must_use]
    pub fn count(&self) -> usize {
        self.sources.iter().sum()
    }

    /// Returns the index of the source of each channel.
    pub(crate) fn source_of(&self) -> Vec<usize> {
        let counts = self.sources.iter().enumerate();
        let sources = counts.flat_map(|(source, &count)| std::iter::repeat_n(source, count));
        sources.collect()
    }
}

/// Names and units of the six channels of a wrench, the names behind a `prefix`.
pub(crate) fn wrench_channels(prefix: &str) -> Vec<Channel> {
    let of = |quantity: &'static str, unit| {
        ["x", "y", "z"].map(|axis| Channel {
            name: format!("{prefix}{quantity} {axis}"),
            unit,
        })
    };
    [of("force", "N"), of("moment", "N m")].concat()
}

/// Known white noise of the channels of one source.
#[derive(Clone, Debug)]
pub struct GivenNoise {
    /// Index of the source's first channel.
    pub(crate) first: usize,
    /// Standard deviation of one sample of each channel, in the channel's unit.
    pub(crate) std_devs: Vec<f64>,
    /// Lower triangle of the correlation matrix of the channels.
    pub(crate) correlation: DMatrix<f64>,
    /// Cholesky factor of the correlation matrix.
    pub(crate) root: DMatrix<f64>,
}

impl GivenNoise {
    /// Creates the noise of the channels that begin at `first` from the covariance of one sample, which
    /// is positive definite.
    pub(crate) fn new(first: usize, mut covariance: DMatrix<f64>) -> Self {
        let std_devs = covariance.diagonal().map(f64::sqrt);
        to_correlation(&mut covariance);
        let mut root = covariance.clone();
        if !cholesky_in_place(&mut root) {
            // Rounding has left one finger's lever no room beside the other's.
            root.fill_with_identity();
        }
        Self {
            first,
            std_devs: std_devs.as_slice().to_vec(),
            correlation: covariance,
            root,
        }
    }

    /// Range of the channels of this source.
    pub(crate) fn channels(&self) -> std::ops::Range<usize> {
        self.first..self.first + self.std_devs.len()
    }

    /// Writes the standard deviations of one sample times `scale`.
    pub(crate) fn write_scaled(&self, scale: f64, std_devs: &mut [f64]) {
        for (std_dev, of_a_sample) in std_devs.iter_mut().zip(&self.std_devs) {
            *std_dev = scale * of_a_sample;
        }
    }
}

/// Turns a lower triangle of a covariance matrix into one of correlations, in place.
pub(crate) fn to_correlation(covariance: &mut DMatrix<f64>) {
    for i in 0..covariance.nrows() {
        for j in 0..i {
            let size = (covariance[(i, i)] * covariance[(j, j)]).sqrt();
            covariance[(i, j)] /= size.max(f64::MIN_POSITIVE);
        }
    }
    covariance.fill_diagonal(1.0);
}

/// Replaces a lower triangle by its Cholesky factor. Returns false, and leaves garbage, where the matrix
/// is not positive definite.
pub(crate) fn cholesky_in_place(matrix: &mut DMatrix<f64>) -> bool {
    for j in 0..matrix.nrows() {
        for k in 0..j {
            let factor = matrix[(j, k)];
            for i in j..matrix.nrows() {
                matrix[(i, j)] -= factor * matrix[(i, k)];
            }
        }
        let pivot = matrix[(j, j)];
        // Not a number is not positive either.
        if pivot.is_nan() || pivot <= 0.0 {
            return false;
        }
        for i in j..matrix.nrows() {
            matrix[(i, j)] /= pivot.sqrt();
        }
    }
    matrix.fill_upper_triangle(0.0, 1);
    true
}
