//! Covariance matrix adaptation, to optimise Fourier motions globally (Hansen, "The CMA evolution
//! strategy: a tutorial", 2016).

use nalgebra::{DMatrix, DVector};
use rand::rngs::StdRng;
use rand_distr::{Distribution, StandardNormal};

/// Returns the best point that so many evaluations find from a start, with steps of about `sigma`.
pub(crate) fn minimise(
    mut function: impl FnMut(&[f64]) -> f64,
    start: &[f64],
    mut sigma: f64,
    evaluations: usize,
    random: &mut StdRng,
) -> Vec<f64> {
    let n = start.len();
    let size = n as f64;
    let offspring = 4 + (3.0 * size.ln()) as usize;
    let parents = offspring / 2;
    let weight = |k: usize| (parents as f64 + 0.5).ln() - (k as f64 + 1.0).ln();
    let sum: f64 = (0..parents).map(weight).sum();
    let weights: Vec<f64> = (0..parents).map(|k| weight(k) / sum).collect();
    let mass = weights.iter().map(|w| w * w).sum::<f64>().recip();
    let c_sigma = (mass + 2.0) / (size + mass + 5.0);
    let damping = 1.0 + 2.0 * (((mass - 1.0) / (size + 1.0)).sqrt() - 1.0).max(0.0) + c_sigma;
    let c_path = (4.0 + mass / size) / (size + 4.0 + 2.0 * mass / size);
    let c_one = 2.0 / ((size + 1.3).powi(2) + mass);
    let c_mu = (2.0 * (mass - 2.0 + 1.0 / mass) / ((size + 2.0).powi(2) + mass)).min(1.0 - c_one);
    let length = size.sqrt() * (1.0 - 1.0 / (4.0 * size) + 1.0 / (21.0 * size * size));
    let mut mean = DVector::from_column_slice(start);
    let mut covariance = DMatrix::<f64>::identity(n, n);
    let (mut path, mut path_sigma) = (DVector::zeros(n), DVector::<f64>::zeros(n));
    let mut best = (f64::INFINITY, start.to_vec());
    for _ in 0..evaluations / offspring {
        let eigen = covariance.clone().symmetric_eigen();
        let roots = eigen.eigenvalues.map(|value| value.max(1e-20).sqrt());
        let basis = &eigen.eigenvectors;
        let mut drawn: Vec<(f64, DVector<f64>)> = (0..offspring)
            .map(|_| {
                let z = DVector::from_fn(n, |_, _| StandardNormal.sample(random));
                let step = basis * roots.component_mul(&z);
                (function((&mean + &step * sigma).as_slice()), step)
            })
            .collect();
        drawn.sort_by(|a, b| a.0.total_cmp(&b.0));
        if drawn[0].0 < best.0 {
            best = (
                drawn[0].0,
                (&mean + &drawn[0].1 * sigma).as_slice().to_vec(),
            );
        }
        let chosen = || weights.iter().zip(&drawn);
        let step: DVector<f64> = chosen().map(|(w, (_, step))| step * *w).sum();
        mean += &step * sigma;
        let white = basis * (basis.tr_mul(&step)).component_div(&roots);
        path_sigma =
            path_sigma * (1.0 - c_sigma) + white * (c_sigma * (2.0 - c_sigma) * mass).sqrt();
        path = path * (1.0 - c_path) + &step * (c_path * (2.0 - c_path) * mass).sqrt();
        covariance *= 1.0 - c_one - c_mu;
        covariance += &path * path.transpose() * c_one;
        for (w, (_, step)) in chosen() {
            covariance += step * step.transpose() * (c_mu * w);
        }
        sigma *= (c_sigma / damping * (path_sigma.norm() / length - 1.0)).exp();
    }
    best.1
}
