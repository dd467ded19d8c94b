//! Principal moments of inertia and their uncertainty.

use nalgebra::{Matrix3, SMatrix, SVector, SymmetricEigen};
use schemars::JsonSchema;
use serde::Serialize;
use tactid_dynamics::InertialParameters;
use tactid_identify::solve::{HALF_WIDTH_95, NullSpace, std_dev, value_jacobian};

/// The three principal moments of inertia about the centre of mass.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct PrincipalMoments {
    /// The moments, ascending, kg m².
    pub values: [f64; 3],
    /// Standard deviations of the moments, kg m², in the same order. All are infinite where the
    /// motion does not determine the whole inertia, because then not even the order of the moments
    /// is known.
    ///
    /// A moment that is well separated from the others has the standard deviation of `vᵀ dI v`, its
    /// derivative, where `v` is its unit axis. Moments that are nearer to each other than their
    /// noise have no derivatives, and noise drives their estimates apart. Each of them has the root
    /// mean square of `Vᵀ dI V` (Frobenius norm), where `V` has all axes of the group. No moment of
    /// the group errs by more than the norm of that matrix (Weyl's inequality), so an interval of
    /// 1.96 standard deviations contains it with a probability of 95 % or more (Székely and Bakirov
    /// 2003, doi 10.1007/s00440-003-0262-6).
    pub std_devs: [f64; 3],
    /// Lower and upper limit of the 95 % interval of each moment, kg m²: 1.96 standard deviations
    /// to each side, but not below zero unless the moment itself is, which no body can have.
    pub intervals: [[f64; 2]; 3],
}

impl PrincipalMoments {
    /// Returns the moments of parameters with their covariance; `None` for a mass of zero.
    pub(crate) fn with_std_devs(
        parameters: &SVector<f64, 10>,
        covariance: &SMatrix<f64, 10, 10>,
        null_space: &NullSpace,
    ) -> Option<Self> {
        let body = InertialParameters::from_vector(*parameters);
        let values: [f64; 3] = body.principal_moments()?.into();
        let inertia = body.mass_properties()?.inertia;
        let eigen = SymmetricEigen::new(inertia);
        let mut order = [0, 1, 2];
        order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
        let axes = order.map(|k| eigen.eigenvectors.column(k).into_owned());
        let about_com = value_jacobian(parameters)?.fixed_rows::<6>(4).into_owned();
        // Variance of each entry of dI along the principal axes.
        let variances = Matrix3::from_fn(|i, j| {
            let (u, v) = (&axes[i], &axes[j]);
            let product = |a: usize, b: usize| match a == b {
                true => u[a] * v[a],
                false => u[a] * v[b] + u[b] * v[a],
            };
            let entries = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];
            let weights = SVector::from(entries.map(|(a, b)| product(a, b)));
            let gradient = weights.transpose() * about_com;
            std_dev(&gradient, covariance, null_space).powi(2)
        });
        let std_devs = std_devs(&values, &variances);
        Some(Self {
            values,
            std_devs,
            intervals: moment_intervals(&values, &std_devs),
        })
    }
}

/// Returns the standard deviations of ascending moments, given the variances of the entries of `dI`
/// along their axes.
fn std_devs(moments: &[f64; 3], variances: &Matrix3<f64>) -> [f64; 3] {
    let size = |first: usize, end: usize| {
        let group = variances.view((first, first), (end - first, end - first));
        group.sum().sqrt()
    };
    if !size(0, 3).is_finite() {
        return [f64::INFINITY; 3];
    }
    // Neighbours that noise could make equal belong to one group.
    let joined = |k: usize| moments[k + 1] - moments[k] <= HALF_WIDTH_95 * size(k, k + 2);
    match (joined(0), joined(1)) {
        (false, false) => [size(0, 1), size(1, 2), size(2, 3)],
        (true, false) => [size(0, 2), size(0, 2), size(2, 3)],
        (false, true) => [size(0, 1), size(1, 3), size(1, 3)],
        (true, true) => [size(0, 3); 3],
    }
}

/// Returns the 95 % intervals of principal moments of inertia, which are not negative.
fn moment_intervals(moments: &[f64; 3], std_devs: &[f64; 3]) -> [[f64; 2]; 3] {
    std::array::from_fn(|k| {
        let half_width = HALF_WIDTH_95 * std_devs[k];
        let low = moments[k] - half_width;
        let least = if moments[k] < 0.0 { low } else { low.max(0.0) };
        [least, moments[k] + half_width]
    })
}

#[cfg(test)]
mod tests {
    use nalgebra::Rotation3;
    use rand::{RngExt, SeedableRng, rngs::SmallRng};
    use rand_distr::StandardNormal;
    use tactid_dynamics::MassProperties;

    use super::*;

    const RUNS: u32 = 100;
    const DRAWS: u32 = 200;

    fn without(directions: &[SVector<f64, 10>]) -> NullSpace {
        NullSpace::new(SVector::repeat(1.0), directions.iter().copied())
    }

    /// An interval is cut at zero, but for a moment that no body can have.
    #[test]
    fn only_the_interval_of_a_possible_moment_is_cut() {
        let (moments, std_devs) = ([-3.0, 1.0, 5.0], [1.0; 3]);
        let [below, cut, whole] = moment_intervals(&moments, &std_devs);
        assert_eq!(below, [-3.0 - HALF_WIDTH_95, -3.0 + HALF_WIDTH_95]);
        assert_eq!(cut, [0.0, 1.0 + HALF_WIDTH_95]);
        assert_eq!(whole, [5.0 - HALF_WIDTH_95, 5.0 + HALF_WIDTH_95]);
    }

    /// Returns how often the intervals contain each moment, over random attitudes of the body and
    /// random covariances whose standard deviations are about `size`.
    fn coverage(moments: [f64; 3], size: f64, seed: u64) -> [f64; 3] {
        let mut random = SmallRng::seed_from_u64(seed);
        let mut contained = [0u32; 3];
        for _ in 0..RUNS {
            let mut draw = || random.random_range(-1.0..1.0);
            let turn = Rotation3::from_euler_angles(3.0 * draw(), draw(), 3.0 * draw());
            let truth = InertialParameters::from(MassProperties {
                mass_kg: 2.0,
                center_of_mass: 0.3 * SVector::from_fn(|_, _| draw()),
                inertia: turn * Matrix3::from_diagonal(&moments.into()) * turn.inverse(),
            });
            let root = SMatrix::<f64, 10, 10>::from_fn(|_, _| 0.5 * size * draw());
            let covariance = root * root.transpose();
            for _ in 0..DRAWS {
                let noise = SVector::<f64, 10>::from_fn(|_, _| random.sample(StandardNormal));
                let estimate = truth.as_vector() + root * noise;
                let found =
                    PrincipalMoments::with_std_devs(&estimate, &covariance, &without(&[])).unwrap();
                for k in 0..3 {
                    let half_width = HALF_WIDTH_95 * found.std_devs[k];
                    contained[k] += u32::from((found.values[k] - moments[k]).abs() <= half_width);
                }
            }
        }
        contained.map(|count| f64::from(count) / f64::from(RUNS * DRAWS))
    }

    /// Of well-separated moments 95 % of the intervals contain the truth, within the scatter of 20
    /// 000 draws.
    #[test]
    fn intervals_of_separated_moments_have_their_coverage() {
        let scatter = (0.95 * 0.05 / f64::from(RUNS * DRAWS)).sqrt();
        for fraction in coverage([1.0, 2.0, 2.8], 1e-4, 1) {
            assert!((fraction - 0.95).abs() < 4.0 * scatter, "{fraction}");
        }
    }

    /// Intervals of two or three equal moments, and of a pair from equal to five standard
    /// deviations apart, contain the truth with at least their probability, but for the scatter of
    /// the draws.
    #[test]
    fn intervals_of_similar_moments_have_at_least_their_coverage() {
        let size = 1e-4;
        for (k, moments) in [[1.0, 1.0, 1.5], [1.0, 1.5, 1.5], [1.0, 1.0, 1.0]]
            .iter()
            .enumerate()
        {
            let fractions = coverage(*moments, size, 2 + k as u64);
            assert!(
                fractions.iter().all(|fraction| *fraction > 0.945),
                "{moments:?}: {fractions:?}"
            );
        }
        for gap in 1u8..10 {
            let moments = [1.0, 1.0 + 0.5 * size * f64::from(gap), 1.5];
            let fractions = coverage(moments, size, 10 + u64::from(gap));
            assert!(
                fractions.iter().all(|fraction| *fraction > 0.945),
                "{gap}: {fractions:?}"
            );
        }
    }

    /// Where the motion does not determine one entry of the inertia, no moment is known.
    #[test]
    fn moments_of_a_partly_unobservable_inertia_are_unknown() {
        let null_space = without(&[SVector::ith(4, 1.0)]);
        let estimate = SVector::from([2.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 2.0, 0.0, 2.5]);
        let covariance = SMatrix::identity() * 1e-6;
        let found = PrincipalMoments::with_std_devs(&estimate, &covariance, &null_space).unwrap();
        assert_eq!(found.values, [1.0, 2.0, 2.5]);
        assert_eq!(found.std_devs, [f64::INFINITY; 3]);
    }
}
