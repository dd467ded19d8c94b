//! What least squares need of all windows: the triangle of their rows, and the moments of their noise.

use tactid_nlms::{Estimator, Rls};

use super::running_noise::RunningNoise;
use crate::equations::Equation;
use crate::equations::window::NOISE_CORRELATION;
use crate::solve::information::{Information, inverse_of_upper};
use crate::solve::subspace::{Matrix, Vector};

/// A row and its wanted value.
pub(crate) type Row = (Vector, f64);

/// The rows of a window, one each channel, to be brought to units of their noise.
#[derive(Clone, Debug)]
pub(crate) struct Window {
    pub(crate) rows: Vec<Row>,
    /// Half-differences: noise alone, as large as that of the rows.
    pub(crate) differences: Vec<Row>,
}

impl Window {
    pub(crate) fn new(channels: usize) -> Self {
        Self {
            rows: vec![(Vector::zeros(), 0.0); channels],
            differences: vec![(Vector::zeros(), 0.0); channels],
        }
    }

    pub(crate) fn copy_from(&mut self, equation: &Equation) {
        for (place, row) in self.rows.iter_mut().zip(&equation.rows) {
            *place = (row.regressor, row.target);
        }
        for (place, row) in self.differences.iter_mut().zip(&equation.differences) {
            *place = (row.regressor, row.target);
        }
    }
}

/// What is explained but for this part of the load, its rms over all channels, is no sign of another
/// payload: the model of a robot and its sensors may be as wrong.
pub(crate) const MODEL: f64 = 0.03;

/// What a window departs from what was known before it.
pub(crate) struct Innovation {
    /// The sum of the squared innovations, each over its variance.
    pub(crate) distance: f64,
    /// The same, where the model may be wrong by a [part](MODEL) of what it predicts.
    pub(crate) beyond_model: f64,
    /// Variance of what was predicted over that of the noise, the mean over channels.
    pub(crate) leverage: f64,
}

/// What parameters say of a window's rows.
#[derive(Clone, Debug)]
pub(crate) struct Prediction {
    /// What is wanted less what is predicted, each channel's.
    pub(crate) residuals: Vec<f64>,
    /// Mean square over channels of what is predicted.
    pub(crate) load: f64,
}

impl Prediction {
    pub(crate) fn new(channels: usize) -> Self {
        Self {
            residuals: vec![0.0; channels],
            load: 0.0,
        }
    }

    pub(crate) fn predict(&mut self, rows: &[Row], parameters: &Vector) {
        self.load = 0.0;
        for (residual, (row, target)) in self.residuals.iter_mut().zip(rows) {
            let predicted = row.dot(parameters);
            *residual = target - predicted;
            self.load += predicted * predicted / rows.len() as f64;
        }
    }
}

/// What a window gives to the sums, of one channel.
#[derive(Clone, Debug)]
struct Scored {
    /// The row, and that of the window before.
    last: [Vector; 2],
    /// Half the row, and what the windows before have of its noise.
    alike: Vector,
    difference: Vector,
}

impl Scored {
    fn nothing() -> Self {
        Self {
            last: [Vector::zeros(); 2],
            alike: Vector::zeros(),
            difference: Vector::zeros(),
        }
    }
}

/// Sums over windows whose rows have noise of deviation one.
#[derive(Clone, Debug)]
pub(crate) struct Sums {
    rls: Rls<10>,
    /// `N = Σ D Dᵀ`, the differences' information.
    noise: Matrix,
    /// `Σ D d`, with what the differences want.
    noise_targets: Vector,
    /// `P = Σ A Cᵀ`, of rows and what is [alike](Scored::alike).
    alike: Matrix,
    channels: Vec<Scored>,
    /// `R⁻ᵀ` of the triangle, as it was solved.
    whitening: Matrix,
    /// Rows that the triangle takes in, and uses up.
    turned: Vec<(Vector, f64)>,
}

impl Sums {
    pub(crate) fn new(channels: usize) -> Self {
        Self {
            rls: Rls::new(),
            noise: Matrix::zeros(),
            noise_targets: Vector::zeros(),
            alike: Matrix::zeros(),
            channels: vec![Scored::nothing(); channels],
            whitening: Matrix::zeros(),
            turned: vec![(Vector::zeros(), 0.0); channels],
        }
    }

    /// Forgets all but where it stands.
    pub(crate) fn begin_anew(&mut self) {
        self.rls = Rls::new().starting_at(self.rls.parameters());
        self.noise = Matrix::zeros();
        self.noise_targets = Vector::zeros();
        self.alike = Matrix::zeros();
        self.channels.fill(Scored::nothing());
    }

    /// Takes a whitened window in, with its noise's correlation to the two before it; [`turn_in`](Self::turn_in) ends
    /// it.
    pub(crate) fn take(&mut self, window: &Window, weight: f64, noise: &RunningNoise) {
        let root = weight.sqrt();
        let rows = window.rows.iter().zip(&window.differences);
        let places = self.channels.iter_mut().zip(&mut self.turned);
        for (channel, ((scored, turned), (row, difference))) in places.zip(rows).enumerate() {
            let entries = row.0 * root;
            *turned = (entries, row.1 * root);
            scored.difference = difference.0 * root;
            let target = difference.1 * root;
            self.noise_targets.axpy(target, &scored.difference, 1.0);
            let [next, second] = noise.correlation(channel);
            scored.alike = entries * 0.5 + scored.last[0] * next + scored.last[1] * second;
            scored.last = [entries, scored.last[0]];
        }
        let channels = self.channels.iter();
        add_products(
            &mut self.noise,
            channels.clone().map(|c| (&c.difference, &c.difference)),
        );
        add_products(&mut self.alike, channels.map(|c| (&c.last[0], &c.alike)));
    }

    /// The last part of [`take`](Self::take): the rows go into the triangle.
    pub(crate) fn update_square_root(&mut self) {
        self.rls.update_all(&mut self.turned);
    }

    /// The parameters without the bias of the motion's noise, `(A - N) π = b - n` for least squares'
    /// `A π = b`, and their information.
    pub(crate) fn solve(&mut self) -> (Vector, Information) {
        self.whitening = inverse_of_upper(self.rls.root()).transpose();
        let biased = self.rls.parameters();
        let information = Information::new(self.rls.root(), &self.noise);
        let bias = information.solve(&(self.noise * biased - self.noise_targets));
        (biased + bias, information)
    }

    /// Covariance of the sum of scores `A r - D d`, a row times what it leaves: residual and difference
    /// both have the variance one.
    pub(crate) fn scores(&self) -> Matrix {
        self.noise + self.alike + self.alike.transpose()
    }

    /// What makes the columns of all rows of length one.
    pub(crate) fn scales(&self) -> Vector {
        let root = self.rls.root();
        Vector::from_fn(|k, _| root.column(k).norm().recip())
    }

    /// Of rows of which this was predicted, given the parameters' covariance in known directions.
    pub(crate) fn innovation(
        &self,
        rows: &[Row],
        prediction: &Prediction,
        covariance: &Matrix,
    ) -> Innovation {
        let model = MODEL * MODEL * prediction.load;
        let mut innovation = Innovation {
            distance: 0.0,
            beyond_model: 0.0,
            leverage: 0.0,
        };
        for ((row, _), residual) in rows.iter().zip(&prediction.residuals) {
            let square = residual * residual;
            // The triangle alone tells of a direction that no row has had yet.
            let known = (covariance * row).dot(row);
            let all = (self.whitening * row).norm_squared();
            let leverage = known.max(NOISE_CORRELATION * all);
            innovation.distance += square / (1.0 + leverage);
            innovation.beyond_model += square / (1.0 + leverage + model);
            innovation.leverage += leverage / rows.len() as f64;
        }
        innovation
    }
}

/// Adds `Σ left rightᵀ`, a column after another.
fn add_products<'a>(
    sum: &mut Matrix,
    pairs: impl Iterator<Item = (&'a Vector, &'a Vector)> + Clone,
) {
    for (k, mut column) in sum.column_iter_mut().enumerate() {
        let mut more = Vector::zeros();
        for (left, right) in pairs.clone() {
            more.axpy(right[k], left, 1.0);
        }
        column += more;
    }
}
