//! What least squares need of all windows: the triangle of their rows, and the moments of their noise.

use nalgebra::SVector;
use tactid_nlms::{Estimator, Rls};

use super::running::RunningNoise;
use crate::information::{Information, Matrix, Vector};
use crate::window::NOISE_CORRELATION;

/// A row with its wanted value, then its half-difference with its own: noise alone, as large.
pub(crate) type Pair = SVector<f64, 22>;

/// What is explained but for this part of the load, its rms over all channels, is no sign of another
/// payload: the model of a robot and its sensors may be as wrong.
pub(crate) const MODEL: f64 = 0.03;

/// What a window departs from what was known before it.
pub(crate) struct Surprise {
    /// The sum of the squared innovations, each over its variance.
    pub(crate) distance: f64,
    /// The same, where the model may be wrong by a [part](MODEL) of what it predicts.
    pub(crate) beyond_model: f64,
    /// Variance of what was predicted over that of the noise, the mean over channels.
    pub(crate) leverage: f64,
}

/// Sums over windows whose rows have noise of deviation one.
#[derive(Clone, Debug)]
pub(crate) struct Sums {
    rls: Rls<10>,
    /// `N = Σ D Dᵀ`, the differences' information.
    noise: Matrix,
    /// `Σ D d`, with what the differences want.
    noise_wanted: Vector,
    /// Covariance of the sum of scores `A r - D d`, a row times what it leaves.
    scores: Matrix,
    /// Rows of the last window and the one before, each channel's.
    last: Vec<[Vector; 2]>,
}

impl Sums {
    pub(crate) fn new(channels: usize) -> Self {
        Self {
            rls: Rls::new(),
            noise: Matrix::zeros(),
            noise_wanted: Vector::zeros(),
            scores: Matrix::zeros(),
            last: vec![[Vector::zeros(); 2]; channels],
        }
    }

    /// Forgets all but where it stands.
    pub(crate) fn begin_anew(&mut self) {
        self.rls = Rls::new().starting_at(self.rls.parameters());
        self.noise = Matrix::zeros();
        self.noise_wanted = Vector::zeros();
        self.scores = Matrix::zeros();
        self.last.fill([Vector::zeros(); 2]);
    }

    /// Takes a window in, with its noise's correlation to the two before it.
    pub(crate) fn take(&mut self, rows: &[Pair], weight: f64, noise: &RunningNoise) {
        let root = weight.sqrt();
        for (channel, (row, last)) in rows.iter().zip(&mut self.last).enumerate() {
            let entries = row.fixed_rows::<10>(0) * root;
            self.rls.update(&entries, row[10] * root);
            let difference = row.fixed_rows::<10>(11) * root;
            self.noise.ger(1.0, &difference, &difference, 1.0);
            self.noise_wanted.axpy(row[21] * root, &difference, 1.0);
            // Residual and difference both have the variance one.
            self.scores.ger(1.0, &difference, &difference, 1.0);
            let [next, second] = noise.correlation(channel);
            let alike = entries * 0.5 + last[0] * next + last[1] * second;
            self.scores.ger(1.0, &entries, &alike, 1.0);
            self.scores.ger(1.0, &alike, &entries, 1.0);
            *last = [entries, last[0]];
        }
    }

    /// The parameters without the bias of the motion's noise, `(A - N) π = b - n` for least squares'
    /// `A π = b`, and their information.
    pub(crate) fn solve(&self) -> (Vector, Information) {
        let biased = self.rls.parameters();
        let information = Information::new(self.rls.root(), &self.noise);
        let bias = information.solve(&(self.noise * biased - self.noise_wanted));
        (biased + bias, information)
    }

    pub(crate) fn scores(&self) -> &Matrix {
        &self.scores
    }

    /// What makes the columns of all rows of length one.
    pub(crate) fn scales(&self) -> Vector {
        let root = self.rls.root();
        Vector::from_fn(|k, _| root.column(k).norm().recip())
    }

    /// Given what is known now, in known directions.
    pub(crate) fn surprise(
        &self,
        rows: &[Pair],
        parameters: &Vector,
        covariance: &Matrix,
    ) -> Surprise {
        let channels = rows.len() as f64;
        let predict = |row: &Pair| row.fixed_rows::<10>(0).dot(parameters);
        let load: f64 = rows.iter().map(|row| predict(row).powi(2)).sum();
        let model = MODEL * MODEL * load / channels;
        let mut surprise = Surprise {
            distance: 0.0,
            beyond_model: 0.0,
            leverage: 0.0,
        };
        for row in rows {
            let entries = row.fixed_rows::<10>(0).into_owned();
            let square = (row[10] - predict(row)).powi(2);
            // The triangle alone tells of a direction that no row has had yet.
            let known = (covariance * entries).dot(&entries);
            let leverage = known.max(NOISE_CORRELATION * self.rls.leverage(&entries));
            surprise.distance += square / (1.0 + leverage);
            surprise.beyond_model += square / (1.0 + leverage + model);
            surprise.leverage += leverage / channels;
        }
        surprise
    }
}
