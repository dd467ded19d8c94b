//! The noise of each joint that explains its residuals best.

use nalgebra::{DMatrix, DVector};

use super::noise::{EffortNoise, Whitening};
use super::rows::Unknowns;
use super::simplex::minimise;
use super::solver::{Block, Problem};

/// Most windows on which the noise is chosen.
const MOST_WINDOWS: usize = 2000;

/// Number of neighbouring windows that are kept together where there are more.
const STRETCH: usize = 100;

/// Standard deviations of the logarithms of the four numbers about a typical noise.
const LOG_STD_DEVS: [f64; 4] = [2.0, 2.0, 1.0, 1.5];

/// Number of steps and size of the first simplex, for the first pass and for the others.
const FIRST_SEARCH: (usize, f64) = (40, 0.6);
const SEARCH: (usize, f64) = (15, 0.25);

/// Windows on which the noise is chosen.
#[derive(Clone, Debug)]
pub(crate) struct NoiseWindows<'a> {
    blocks: Vec<Block<'a>>,
    /// Whether these are all windows. Uncertain unknowns hardly show in the residuals of many.
    are_all: bool,
}

/// Chooses stretches of at most [`MOST_WINDOWS`] windows in all.
pub(crate) fn noise_windows<'a>(blocks: &[Block<'a>]) -> NoiseWindows<'a> {
    let counts: Vec<usize> = blocks.iter().map(|block| block.windows.len()).collect();
    let kept = blocks.iter().zip(chosen(&counts));
    let thinned = kept.map(|(block, kept)| Block {
        windows: kept.into_iter().map(|k| block.windows[k]).collect(),
        ..block.clone()
    });
    NoiseWindows {
        blocks: thinned.collect(),
        are_all: counts.iter().sum::<usize>() <= MOST_WINDOWS,
    }
}

/// Returns the places of the chosen windows in each of several recordings, in increasing order.
/// Each recording is divided into stretches of equal length. Multiples of the golden ratio decide
/// which of them are kept: these are spread evenly over all recordings, and with no period that
/// could meet always the same part of recordings of one length.
fn chosen(counts: &[usize]) -> Vec<Vec<usize>> {
    if counts.iter().sum::<usize>() <= MOST_WINDOWS {
        return counts.iter().map(|count| (0..*count).collect()).collect();
    }
    let of_recording = |(recording, &count): (usize, &usize)| {
        let stretches = count.div_ceil(STRETCH);
        let place = move |k: usize| k * count / stretches;
        (0..stretches).map(move |k| (recording, place(k)..place(k + 1)))
    };
    let stretches = counts.iter().enumerate().flat_map(of_recording);
    let golden_ratio = 0.5 * (1.0 + 5.0_f64.sqrt());
    let ranked = stretches.enumerate();
    let mut ranked: Vec<_> = ranked
        .map(|(k, stretch)| ((k as f64 * golden_ratio).fract(), stretch))
        .collect();
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut left = MOST_WINDOWS;
    let mut kept = vec![Vec::new(); counts.len()];
    for (_, (recording, places)) in ranked {
        if let Some(rest) = left.checked_sub(places.len()) {
            left = rest;
            kept[recording].extend(places);
        }
    }
    kept.iter_mut().for_each(|places| places.sort_unstable());
    kept
}

/// Returns how improbable the logarithms of a noise are for a joint with this friction, N m or N.
pub(crate) fn penalty(logs: &[f64; 4], friction: f64) -> f64 {
    let typical = EffortNoise::typical(friction).logs();
    let distance = |k: usize| (logs[k] - typical[k]) / LOG_STD_DEVS[k];
    0.5 * (0..4).map(|k| distance(k).powi(2)).sum::<f64>()
}

/// Residuals of one joint in one block, and the columns of their uncertainty.
struct BlockResiduals<'a, 'b> {
    block: &'b Block<'a>,
    standstill: Vec<f64>,
    columns: DMatrix<f64>,
}

/// Residuals of one joint in all blocks on which its noise is chosen.
pub(crate) struct Residuals<'a, 'b>(Vec<BlockResiduals<'a, 'b>>);

impl<'a, 'b> Residuals<'a, 'b> {
    /// Computes the residuals of the linear equations at some unknowns after a step, with the
    /// covariance of the unknowns.
    pub(crate) fn new(
        problem: &Problem<'_>,
        windows: &'b NoiseWindows<'a>,
        joint: usize,
        (at, step, covariance): (&Unknowns, &DVector<f64>, &DMatrix<f64>),
    ) -> Self {
        let of_block = |block: &'b Block<'a>| {
            let standstill = |&window: &usize| block.recording.columns(window, joint).standstill();
            let residual = problem.residual(block, joint, at, step);
            BlockResiduals {
                standstill: block.windows.iter().map(standstill).collect(),
                columns: if windows.are_all {
                    with_uncertainty(problem, block, joint, at, covariance, &residual)
                } else {
                    residual
                },
                block,
            }
        };
        Self(windows.blocks.iter().map(of_block).collect())
    }

    /// Returns the noise that minimises `log det R + rᵀ R⁻¹ r + tr(R⁻¹ X C Xᵀ)` and its penalty: an
    /// EM step for the restricted likelihood of the residuals `r` with rows `X` of unknowns with
    /// the covariance `C`. The joint has so much friction, N m or N.
    pub(crate) fn fit_noise(
        &self,
        friction: f64,
        start: &EffortNoise,
        is_first: bool,
    ) -> EffortNoise {
        let mut whitened: Vec<DMatrix<f64>> = self.0.iter().map(|r| r.columns.clone()).collect();
        let (steps, size) = if is_first { FIRST_SEARCH } else { SEARCH };
        let value = |logs: &[f64; 4]| {
            let noise = EffortNoise::from_logs(logs);
            let mut sum = 0.0;
            for (residuals, whitened) in self.0.iter().zip(&mut whitened) {
                let times_s = residuals.block.recording.times_s();
                let times_s = residuals
                    .block
                    .windows
                    .iter()
                    .map(|&window| times_s[window]);
                let pairs = times_s.zip(residuals.standstill.iter().copied());
                let whitening = Whitening::new(&noise, pairs);
                whitened.copy_from(&residuals.columns);
                whitening.apply(whitened);
                sum += whitening.log_det + whitened.norm_squared();
            }
            let value = 0.5 * sum + penalty(logs, friction);
            if value.is_finite() { value } else { f64::MAX }
        };
        EffortNoise::from_logs(&minimise(value, &start.logs(), size, steps))
    }
}

/// Returns the residual beside `X L` with the rows `X` and the unknowns' covariance `C = L Lᵀ`.
fn with_uncertainty(
    problem: &Problem<'_>,
    block: &Block<'_>,
    joint: usize,
    at: &Unknowns,
    covariance: &DMatrix<f64>,
    residual: &DMatrix<f64>,
) -> DMatrix<f64> {
    let indices = problem.indices(block, joint);
    let count = indices.len();
    let of_block = DMatrix::from_fn(count, count, |i, k| covariance[(indices[i], indices[k])]);
    let Some(factor) = of_block.cholesky() else {
        return residual.clone();
    };
    let rows = problem.rows(block, joint, at);
    let uncertain = rows.columns(0, count) * factor.l();
    let mut columns = DMatrix::zeros(residual.nrows(), count + 1);
    columns.columns_mut(0, 1).copy_from(residual);
    columns.columns_mut(1, count).copy_from(&uncertain);
    columns
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One long recording and many short ones keep nearly as many windows as are allowed, and the
    /// beginnings of recordings as often as their ends; few windows are all kept.
    #[test]
    fn chosen_windows_are_spread_over_all_recordings() {
        let lengths = [40, 99, 101, 150, 199, 200, 250, 1000];
        let of_many = lengths.map(|length| vec![length; 30_000 / length]);
        let of_one = [2001, 2500, 20_000].map(|length| vec![length]);
        for counts in of_many.into_iter().chain(of_one) {
            let kept = chosen(&counts);
            let windows: usize = kept.iter().map(Vec::len).sum();
            assert!((1800..=MOST_WINDOWS).contains(&windows), "{windows}");
            let pairs = || kept.iter().zip(&counts);
            assert!(pairs().all(|(kept, _)| kept.is_sorted_by(|a, b| a < b)));
            let all = pairs().flat_map(|(kept, count)| kept.iter().map(|k| (2 * k + 1).cmp(count)));
            let balance: i64 = all.map(|half| half as i64).sum();
            assert!(balance.unsigned_abs() < 300, "{balance} {}", counts[0]);
            let last = kept.iter().rposition(|kept| !kept.is_empty());
            assert!(last.is_some_and(|last| 10 * last >= 9 * (counts.len() - 1)));
        }
        let kept = chosen(&[40, 3, 300]);
        assert_eq!(kept.iter().map(Vec::len).collect::<Vec<_>>(), [40, 3, 300]);
    }
}
