//! The rows of the paper's two stages, read from an averaged equation.
//!
//! `tactid_dynamics` forms the same rows from the motion at one instant. The filter needs the means
//! over a window of their products, which only the averaged equation has.

use nalgebra::{Matrix3x4, Matrix3x6, Vector3};
use tactid_dynamics::Rows;

use tactid_identify::equations::Equation;

/// Returns the rows of (48), for the inverse of the mass, 1/kg, and the centre of mass, m, from the
/// force in the first three channels.
pub(crate) fn mass_rows(equation: &Equation) -> Rows<4> {
    let mut rows = Rows {
        matrix: Matrix3x4::zeros(),
        target: Vector3::zeros(),
    };
    for (k, row) in equation.rows[..3].iter().enumerate() {
        // A_3 = [f_K | Ω̇_U], (32)
        rows.matrix[(k, 0)] = -row.target; // f_K = -f_U, (47)
        for axis in 0..3 {
            rows.matrix[(k, 1 + axis)] = row.regressor[1 + axis]; // Ω̇_U, (31)
        }
        rows.target[k] = -row.regressor[0]; // b_3 = -(p̈_U - g), (30)
    }
    rows
}

/// Returns the rows of (46), for the inertia about the centre of mass, kg m², from force and moment
/// in the first six channels. The force enters in proportion to the given centre of mass, m.
pub(crate) fn inertia_rows(equation: &Equation, center_of_mass: &Vector3<f64>) -> Rows<6> {
    let force = Vector3::from_fn(|k, _| equation.rows[k].target);
    let moment = Vector3::from_fn(|k, _| equation.rows[3 + k].target);
    Rows {
        // A_4 = Q̇_U, (46)
        matrix: Matrix3x6::from_fn(|k, entry| equation.rows[3 + k].regressor[4 + entry]),
        target: moment - center_of_mass.cross(&force), // b_4 = n_U - a_U × f_U, (45)
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng, rngs::SmallRng};
    use tactid_dynamics::{ToolMotion, Wrench, tactile_mass_rows, wrench_regressor};

    use super::*;

    /// At one instant the rows are those of `tactid_dynamics`, to the last bit.
    #[test]
    fn rows_of_one_instant_are_those_of_the_dynamics() {
        let mut random = SmallRng::seed_from_u64(1);
        let mut vector = || Vector3::from_fn(|_, _| random.random_range(-2.0..2.0));
        for _ in 0..100 {
            let motion = ToolMotion {
                acceleration: vector(),
                angular_velocity: vector(),
                angular_acceleration: vector(),
            };
            let wrench = Wrench {
                force: vector(),
                moment: vector(),
            };
            let center_of_mass = vector();
            let mut equation = Equation::new(6);
            let regressor = wrench_regressor(&motion);
            let targets = wrench.force.iter().chain(&wrench.moment);
            for ((k, row), target) in equation.rows.iter_mut().enumerate().zip(targets) {
                row.regressor = regressor.row(k).transpose();
                row.target = *target;
            }
            let expected = tactile_mass_rows(&motion, &wrench.force);
            assert_eq!(mass_rows(&equation), expected);
            let expected = tactid_dynamics::inertia_rows(&motion, &wrench, &center_of_mass);
            assert_eq!(inertia_rows(&equation, &center_of_mass), expected);
        }
    }
}
