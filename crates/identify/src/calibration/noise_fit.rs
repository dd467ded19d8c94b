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

/// Standard deviations of the logarithms of the four numbers about those of a typical noise.
const LOG_STD_DEVS: [f64; 4] = [2.0, 2.0, 1.0, 1.5];

/// Number of steps and size of the first simplex, for the first pass and for the others.
const FIRST_SEARCH: (usize, f64) = (40, 0.6);
const SEARCH: (usize, f64) = (15, 0.25);

/// Windows on which the noise is chosen.
#[derive(Clone, Debug)]
pub(crate) struct NoiseWindows<'a> {
    blocks: Vec<Block<'a>>,
    /// Whether these are all windows. The uncertainty of the unknowns hardly shows in the residuals of many.
    are_all: bool,
}

/// Chooses stretches of some 2000 windows in all.
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

/// Returns the places of the chosen windows in each of several recordings. Stretches are counted across recordings, as
/// many short ones have no more windows than one that is long.
fn chosen(counts: &[usize]) -> Vec<Vec<usize>> {
    let all: usize = counts.iter().sum();
    let every = all.div_ceil(MOST_WINDOWS).max(1);
    let mut stretches = 0;
    let of_recording = |count: &usize| {
        let first = stretches;
        stretches += count.div_ceil(STRETCH);
        let is_kept = |place: &usize| (first + place / STRETCH).is_multiple_of(every);
        (0..*count).filter(is_kept).collect()
    };
    counts.iter().map(of_recording).collect()
}

/// Returns how improbable the logarithms of a noise are for a joint with so much friction, N m or N.
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
    /// Computes the residuals of the linear equations at some unknowns after a step, with the covariance of the unknowns.
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

    /// Returns the noise that minimises `log det R + rᵀ R⁻¹ r + tr(R⁻¹ X C Xᵀ)` and its penalty: an EM step for the
    /// restricted likelihood of the residuals `r` with rows `X`, whose unknowns have the covariance `C`. The joint has so
    /// much friction, N m or N.
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

/// Returns the residual and, beside it, `X L` with the rows `X` and the covariance `C = L Lᵀ` of their unknowns.
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

    /// One long recording and many short ones keep some 2000 windows, spread over all; few windows are all kept.
    #[test]
    fn many_short_recordings_keep_no_more_windows_than_a_long_one() {
        for counts in [vec![20_000], vec![40; 500], vec![150; 200]] {
            let kept = chosen(&counts);
            let windows: usize = kept.iter().map(Vec::len).sum();
            assert!((1500..=2600).contains(&windows), "{windows}");
            let last = kept.iter().rposition(|kept| !kept.is_empty());
            assert!(last.is_some_and(|last| 10 * last >= 9 * (counts.len() - 1)));
        }
        let kept = chosen(&[40, 3, 300]);
        assert_eq!(kept.iter().map(Vec::len).collect::<Vec<_>>(), [40, 3, 300]);
    }
}
