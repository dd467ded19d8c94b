//! The equations of motion: at one instant, and as means over a time.

use nalgebra::{SVector, Vector3, Vector4};
use tactid_dynamics::Rows;

/// One row equation `regressor · π = wanted`, `π` in the order of
/// [`InertialParameters`](tactid_dynamics::InertialParameters).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Row {
    pub(crate) regressor: SVector<f64, 10>,
    pub(crate) wanted: f64,
    /// What an acceleration equal to gravity would add to the entries of mass and first moments; the
    /// others do not depend on gravity. It asks what another gravity would have explained.
    pub(crate) gravity: Vector4<f64>,
}

impl Row {
    pub(crate) fn zero() -> Self {
        Self {
            regressor: SVector::zeros(),
            wanted: 0.0,
            gravity: Vector4::zeros(),
        }
    }

    pub(crate) fn add(&mut self, row: &Self, weight: f64) {
        self.regressor += row.regressor * weight;
        self.wanted += row.wanted * weight;
        self.gravity += row.gravity * weight;
    }

    pub(crate) fn scale(&mut self, by: f64) {
        self.regressor *= by;
        self.wanted *= by;
        self.gravity *= by;
    }
}

/// Rows of the one-stage form as weighted means over a time.
///
/// The rows are averaged as a whole, after their products are formed, so that both sides pass the
/// same filter and the equation holds for the means as it does at every instant.
#[derive(Clone, Debug)]
pub(crate) struct Equation {
    /// The middle of the time, s.
    pub(crate) time_s: f64,
    /// Six for a wrench (force, then moment about the origin of `Σ_U`), else one a joint.
    pub(crate) rows: Vec<Row>,
    /// Half the difference between the means over every second instant and over the others: noise
    /// alone, as large as in `rows`, for what is slow is the same in both.
    pub(crate) differences: Vec<Row>,
    /// `d wanted / dt` through the same filter, a row each: what a delay of the load would change.
    pub(crate) rates: Vec<f64>,
    weight: f64,
    slope_weight: f64,
    difference_weight: f64,
    pub(crate) instants: u32,
}

impl Equation {
    pub(crate) fn new(rows: usize) -> Self {
        Self {
            time_s: 0.0,
            rows: vec![Row::zero(); rows],
            differences: vec![Row::zero(); rows],
            rates: vec![0.0; rows],
            weight: 0.0,
            slope_weight: 0.0,
            difference_weight: 0.0,
            instants: 0,
        }
    }

    /// Becomes another of as many rows, without allocation.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.rows.copy_from_slice(&other.rows);
        self.differences.copy_from_slice(&other.differences);
        self.rates.copy_from_slice(&other.rates);
        (self.time_s, self.instants) = (other.time_s, other.instants);
    }

    pub(crate) fn clear(&mut self, time_s: f64) {
        self.time_s = time_s;
        self.rows.fill(Row::zero());
        self.differences.fill(Row::zero());
        self.rates.fill(0.0);
        (self.weight, self.slope_weight, self.difference_weight) = (0.0, 0.0, 0.0);
        self.instants = 0;
    }

    /// Adds an instant with its weight, the weight of its part in the derivative, and its side in the
    /// differences, 1 or -1. Until the end, `rows` has the sums of the one side, `differences` of the other.
    pub(crate) fn add(&mut self, rows: &[Row], weight: f64, slope_weight: f64, side: f64) {
        let sums = if side > 0.0 {
            &mut self.rows
        } else {
            &mut self.differences
        };
        for ((sum, rate), row) in sums.iter_mut().zip(&mut self.rates).zip(rows) {
            sum.add(row, weight);
            *rate += row.wanted * slope_weight;
        }
        self.difference_weight += side * weight;
        self.weight += weight;
        self.slope_weight += slope_weight;
        self.instants += 1;
    }

    /// Adds another equation, finished, with its share in the mean of several.
    pub(crate) fn add_mean(&mut self, other: &Self, share: f64) {
        for (sum, row) in self.rows.iter_mut().zip(&other.rows) {
            sum.add(row, share);
        }
        for (sum, row) in self.differences.iter_mut().zip(&other.differences) {
            sum.add(row, share);
        }
        for (sum, rate) in self.rates.iter_mut().zip(&other.rates) {
            *sum += share * rate;
        }
        self.instants += other.instants;
    }

    /// Turns sums into means.
    pub(crate) fn finish(&mut self) {
        let share = 1.0 / self.weight;
        let sums = self.rows.iter_mut().zip(&mut self.differences);
        for ((row, difference), rate) in sums.zip(&mut self.rates) {
            let other = *difference;
            difference.scale(-1.0);
            difference.add(row, 1.0);
            row.add(&other, 1.0);
            row.scale(share);
            // Both sides weigh the same but for the ends of the window and uneven times.
            difference.add(row, -self.difference_weight);
            difference.scale(share);
            // The slope's weights sum to zero but for rounding and uneven times.
            *rate = (*rate - self.slope_weight * row.wanted) * share;
        }
    }

    /// (48): mass and centre of mass from the force.
    pub(crate) fn mass(&self) -> Rows<4> {
        let mut rows = Rows {
            matrix: nalgebra::Matrix3x4::zeros(),
            target: Vector3::zeros(),
        };
        for (k, row) in self.rows[..3].iter().enumerate() {
            rows.matrix[(k, 0)] = -row.wanted; // f_K = -f_U, (47)
            for axis in 0..3 {
                rows.matrix[(k, 1 + axis)] = row.regressor[1 + axis]; // Ω̇_U, (31)
            }
            rows.target[k] = -row.regressor[0]; // -(p̈_U - g), (30)
        }
        rows
    }

    /// (46) for a centre of mass, which enters in proportion to the force.
    pub(crate) fn inertia(&self, center_of_mass: &Vector3<f64>) -> Rows<6> {
        let force = Vector3::from_fn(|k, _| self.rows[k].wanted);
        let moment = Vector3::from_fn(|k, _| self.rows[3 + k].wanted);
        Rows {
            matrix: nalgebra::Matrix3x6::from_fn(|k, entry| self.rows[3 + k].regressor[4 + entry]),
            target: moment - center_of_mass.cross(&force), // b_4, (45)
        }
    }
}
