//! What explains the windows since a payload change was detected: the payload before it, a contact
//! with that payload, or a new payload.

use tactid_nlms::Rls;

use super::accumulated_rows::AccumulatedRows;
use super::changes::{is_evident, score};
use super::innovation::{Prediction, WhitenedRow};
use super::noise_tracker::{
    INITIAL_WINDOWS, MIN_WINDOWS, NoiseTracker, TRIAL_WINDOWS, VARIANCE_GROWTH,
};
use super::trusted::{JointEstimate, State};
use crate::checks::MODEL_ERROR;
use crate::equations::window::{NOISE_CORRELATION, PRODUCT_CORRELATION};
use crate::equations::{Equation, WRENCH};
use crate::solve::subspace::Vector;
use crate::solve::weights::{RARE_QUANTILE, rare_distance, wilson_hilferty};

/// What the windows since a payload change was detected say about the payload, from nothing to all.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Verdict {
    /// No payload explains them.
    Contradicted,
    /// They are too few to say anything.
    Unknown,
    /// The payload before the change explains them as well as any other.
    Returned,
    /// A payload explains them, and so does a contact with the payload before: a constant force at
    /// rest is a weight.
    Ambiguous,
    /// A payload explains them, with its inertia, which a contact does not have.
    Payload,
}

/// Compares the windows since a payload change was detected, or since they contradicted a payload,
/// with the payload before the change, alone and together with a contact.
///
/// The contact is a wrench that is constant in the tool, and a weight that has no inertia: a force
/// that is constant along the vertical. Nothing is allocated after construction.
#[derive(Clone, Debug)]
pub(crate) struct Explanations {
    /// Fit of a contact to what the payload before leaves of the windows: weight and first moments
    /// without inertia, then the constant wrench.
    contact: Rls<10>,
    windows: usize,
    /// Sum of the squared distances from the payload before.
    distance: f64,
    /// Sum over the windows of the square of load and contact together, the mean over the channels,
    /// in units of the noise.
    squares: f64,
    /// The same sum for a mass of one, and the sums of each channel.
    weight_squares: f64,
    sums: Vec<f64>,
    /// Number of windows in a row that the payload before the change explains.
    returning: usize,
    /// Buffers for a window: its rows, and those of a contact.
    rows: Vec<WhitenedRow>,
    of_contact: Vec<WhitenedRow>,
    prediction: Prediction,
}

impl Explanations {
    /// Creates a comparison of no windows of so many channels.
    pub(crate) fn new(channels: usize) -> Self {
        Self {
            contact: Rls::starting_at(Vector::zeros()),
            windows: 0,
            distance: 0.0,
            squares: 0.0,
            weight_squares: 0.0,
            sums: vec![0.0; channels],
            returning: 0,
            rows: vec![(Vector::zeros(), 0.0); channels],
            of_contact: vec![(Vector::zeros(), 0.0); channels],
            prediction: Prediction::new(channels),
        }
    }

    /// Discards all windows, but for the count of those that the payload before explains.
    pub(crate) fn restart(&mut self) {
        self.contact = Rls::starting_at(Vector::zeros());
        self.windows = 0;
        (self.distance, self.squares, self.weight_squares) = (0.0, 0.0, 0.0);
        self.sums.fill(0.0);
    }

    /// Discards the count of windows that the payload before explains.
    pub(crate) fn restart_returning(&mut self) {
        self.returning = 0;
    }

    /// Adds a window, and returns whether [`MIN_WINDOWS`] windows in a row show that the payload is
    /// again the one before the change: that payload explains them, and they contradict the present
    /// one. Windows that both payloads explain do not interrupt the row. `before` is the estimate
    /// of the payload before the change, `rows` are those that it was estimated from.
    pub(crate) fn add(
        &mut self,
        equation: &Equation,
        before: &JointEstimate,
        (noise, rows): (&NoiseTracker, &AccumulatedRows),
        contradicts_present: bool,
    ) -> bool {
        self.set_rows(equation, before, noise);
        self.prediction.predict(&self.rows, &before.parameters);
        let innovation = rows.innovation(&self.rows, &self.prediction, &before.covariance);
        self.windows += 1;
        self.distance += innovation.distance;
        let share = (self.rows.len() as f64).recip();
        for (sum, (regressor, target)) in self.sums.iter_mut().zip(&self.rows) {
            *sum += regressor[0];
            self.weight_squares += share * regressor[0] * regressor[0];
            self.squares += share * target * target;
        }
        self.add_to_contact(before);
        let distance = innovation.distance_beyond_model;
        let explains = !is_evident(score(distance, self.rows.len(), noise));
        self.returning = match (explains, contradicts_present) {
            (true, true) => self.returning + 1,
            (true, false) => self.returning,
            (false, _) => 0,
        };
        self.returning >= MIN_WINDOWS
    }

    /// Sets the rows to those of a window without the offsets, and those of a contact.
    fn set_rows(&mut self, equation: &Equation, before: &JointEstimate, noise: &NoiseTracker) {
        let places = self.rows.iter_mut().zip(&mut self.of_contact);
        for (k, ((place, of_contact), row)) in places.zip(&equation.rows).enumerate() {
            let offsets = before.offsets.as_ref().filter(|_| k < WRENCH);
            let offset = offsets.map_or(0.0, |offsets| offsets.values[k]);
            *place = (row.regressor, row.target - offset);
            let mut regressor = Vector::zeros();
            regressor.fixed_rows_mut::<4>(0).copy_from(&row.gravity);
            if k < WRENCH {
                regressor[4 + k] = 1.0;
            }
            *of_contact = (regressor, 0.0);
        }
        noise.whiten(&mut self.rows);
        noise.whiten(&mut self.of_contact);
    }

    /// Adds the window to the fit of a contact. Its target is what the payload before leaves. Of
    /// the uncertainty of this payload and the model error only the part that accelerations show
    /// counts: an error of the weight is a contact, too.
    fn add_to_contact(&mut self, before: &JointEstimate) {
        let mut variance = 1.0;
        let share = (self.rows.len() as f64).recip();
        for ((regressor, _), (of_contact, _)) in self.rows.iter().zip(&self.of_contact) {
            let mut of_acceleration = *regressor;
            let mut first = of_acceleration.fixed_rows_mut::<4>(0);
            first += of_contact.fixed_rows::<4>(0);
            let load = MODEL_ERROR * of_acceleration.dot(&before.parameters);
            let leverage = (before.covariance * of_acceleration).dot(&of_acceleration);
            variance += share * (load * load + leverage);
        }
        let weight = variance.sqrt().recip();
        let residuals = &self.prediction.residuals;
        for ((regressor, target), residual) in self.of_contact.iter_mut().zip(residuals) {
            *regressor *= weight;
            *target = residual * weight;
        }
        self.contact.update_all(&mut self.of_contact);
    }

    /// Returns what the windows say, given the rows of the payload that they have been fitted with,
    /// and the squared Mahalanobis distance of six offsets from those before the change. `present`
    /// has its noise and its parameters, and the present verdict holds unless they contradict it.
    pub(crate) fn verdict(&self, present: &State, mass_std_dev: f64, last: Verdict) -> Verdict {
        if self.windows < MIN_WINDOWS {
            return Verdict::Unknown;
        }
        let squares = present.rows.residual_squares();
        let unknowns = if present.centering.is_needed() {
            16
        } else {
            10
        };
        let explains = |model: f64| {
            self.score(squares / (1.0 + model), unknowns, &present.noise) < RARE_QUANTILE
                && explains_zero(present, model)
        };
        let has_mass = present.parameters[0] > -RARE_QUANTILE * mass_std_dev;
        if !has_mass || !explains(self.model_error()) {
            return Verdict::Contradicted;
        }
        // Within the model error, few windows of a contact are those of some body.
        if self.windows <= INITIAL_WINDOWS && !explains(0.0) {
            return last;
        }
        match self.compare(present, squares, unknowns) {
            Verdict::Ambiguous | Verdict::Unknown if last == Verdict::Payload => last,
            verdict => verdict,
        }
    }

    /// Compares a payload that explains the windows, with this least sum of squared residuals, with
    /// the payload before the change and with a contact.
    fn compare(&self, present: &State, squares: f64, unknowns: usize) -> Verdict {
        // The least squares take noise of derived accelerations for an inertia; the estimate does
        // not.
        let of_estimate = present.rows.squares_at(&present.parameters);
        let size = (squares / self.freedom(unknowns)).max(1.0);
        let rare = NOISE_CORRELATION * rare_distance(10) * size;
        let of_contact = self.contact.residual_squares();
        let is_resting = self.scatter() < 1.0;
        if self.windows > INITIAL_WINDOWS && self.distance - squares < rare {
            Verdict::Returned
        } else if of_contact - of_estimate > rare {
            Verdict::Payload
        } else if squares - of_contact > rare {
            Verdict::Unknown
        } else if is_resting || self.windows >= TRIAL_WINDOWS {
            Verdict::Ambiguous
        } else {
            Verdict::Unknown
        }
    }

    /// Returns the variance of the model error in units of the noise.
    fn model_error(&self) -> f64 {
        MODEL_ERROR * MODEL_ERROR * self.squares / self.windows as f64
    }

    /// Returns by how much the motion changes the weight of load and contact together: its variance
    /// over the windows, the sum over the channels, in units of the noise. Below one, the arm
    /// rests.
    fn scatter(&self) -> f64 {
        let (count, channels) = (self.windows as f64, self.sums.len() as f64);
        let square = self.weight_squares.max(f64::MIN_POSITIVE);
        let means = self.sums.iter().map(|sum| sum * sum / count).sum::<f64>();
        self.squares / square * (square * channels - means) / count
    }

    /// Number of rows less the unknowns that were estimated from them.
    fn freedom(&self, unknowns: usize) -> f64 {
        let rows = (self.windows * self.sums.len()) as f64;
        (rows - NOISE_CORRELATION * unknowns as f64).max(1.0)
    }

    /// Returns the score of a sum of squared residuals of a fit, in units of the noise: a standard
    /// normal variable where the noise has grown as far as it may.
    fn score(&self, squares: f64, unknowns: usize, noise: &NoiseTracker) -> f64 {
        let freedom = self.freedom(unknowns);
        let independent = (freedom / PRODUCT_CORRELATION).max(1.0) as usize;
        let (mean, std_dev) = wilson_hilferty(independent);
        let ratio = squares / (freedom * noise.inflation() * VARIANCE_GROWTH);
        (ratio.cbrt() - mean) / std_dev
    }
}

/// Returns whether the zero of the sensor is the one before the change, given the variance of the
/// model error in units of the noise.
fn explains_zero(present: &State, model: f64) -> bool {
    let shift = |noise| (present.centering).shift(&present.parameters, &noise, model);
    let distance = present.noise.of_wrench().and_then(shift);
    distance.is_none_or(|distance| distance < VARIANCE_GROWTH * rare_distance(WRENCH))
}
