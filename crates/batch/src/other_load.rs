//! Times of a recording with another load than in the rest: a contact, or a payload change.
//!
//! The recording is cut into sections. From the load of each fifth of them, in a row, all sections
//! are added that it explains, until none follows; the load that explains most of the recording is
//! that of the rest. Unlike the reweighting of windows, which starts from all of them, this finds
//! the payload behind a contact that lasts for half of a recording.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use tactid_identify::checks::{BEYOND_NOISE, MODEL_ERROR};
use tactid_identify::equations::{Equation, EquationStream, Row, WRENCH};
use tactid_identify::solve::OUTLIER;

use crate::diagnosis::LEAST_WINDOWS;
use crate::finding::{Finding, OtherLoad};
use crate::fit::Fit;
use crate::fit::least_squares::MAX_PASSES;
use crate::report::{HELD_OUT_EVERY, VALIDATION_SECTIONS as SECTIONS};
use crate::solve::Spectrum;

/// Least information in the rest, relative to that in all of the recording, in each direction of
/// the unknowns: any load would explain what is not excited there.
const LEAST_INFORMATION: f64 = 0.01;

/// Products of the extended rows of forces, and of those of moments, summed over windows. An
/// extended row has an entry for each unknown, which are the parameters and the offset of the
/// wrench, then the target. A quadratic form of the products is a sum of squares of residuals.
type Products = [DMatrix<f64>; 2];

/// The times of a recording that have another load.
pub(super) struct Parts {
    found: OtherLoad,
    /// Whether each window is in the rest.
    is_rest: Vec<bool>,
}

impl Parts {
    /// Finds the times; `None` where there are none, or where no load explains enough of the
    /// recording.
    pub(super) fn find(equations: &[Equation], stream: &EquationStream) -> Option<Self> {
        if !stream.measures_wrench() || equations.len() < SECTIONS * LEAST_WINDOWS {
            return None;
        }
        let sections = Sections::new(equations);
        let unknowns = sections.most_explained()?;
        let spans = sections.spans(equations, &unknowns);
        if spans.is_empty() {
            return None;
        }
        let mut is_rest = vec![true; equations.len()];
        for span in &spans {
            is_rest[span.clone()].fill(false);
        }
        let windows = spans.iter().flat_map(|span| &equations[span.clone()]);
        let count = windows.clone().count() as f64;
        let left = squares(&products(windows, |each| &each.rows), &unknowns);
        let [force_rms, moment_rms] = left.map(|sum| (sum / count).sqrt());
        let time_s = |k: usize| equations[k].time_s;
        let times = |span: &Range<usize>| [time_s(span.start), time_s(span.end - 1)];
        Some(Self {
            found: OtherLoad {
                parts: spans.iter().map(times).collect(),
                fraction: count / equations.len() as f64,
                force_rms,
                moment_rms,
            },
            is_rest,
        })
    }

    /// Whether each window is in the rest.
    pub(super) fn is_rest(&self) -> &[bool] {
        &self.is_rest
    }

    /// Reports the times, and only the outliers besides them.
    pub(super) fn report(&self, fit: &Fit, findings: &mut Vec<Finding>) {
        findings.retain(|found| !matches!(found, Finding::Outliers { .. }));
        let windows = self.is_rest.len();
        let is_outlier = |&k: &usize| self.is_rest[k] && fit.is_outlier(k);
        let outliers = (0..windows).filter(is_outlier).count();
        if outliers > 0 {
            findings.push(Finding::Outliers { outliers, windows });
        }
        findings.insert(0, Finding::OtherLoad(self.found.clone()));
    }
}

/// Takes the weight of times with another load, if there are any, from a fit to the rest.
pub(super) fn leave_out(parts: Option<&Parts>, fit: &mut Fit) {
    let is_rest = parts.iter().flat_map(|parts| &parts.is_rest);
    for (weight, is_rest) in fit.weights.iter_mut().zip(is_rest) {
        *weight = if *is_rest { *weight } else { 0.0 };
    }
}

/// Returns the products of the wrench's rows of windows.
fn products<'a>(
    windows: impl IntoIterator<Item = &'a Equation>,
    rows: impl Fn(&Equation) -> &[Row],
) -> Products {
    let target = 10 + WRENCH;
    let mut products = [0, 1].map(|_| DMatrix::zeros(target + 1, target + 1));
    let mut extended = DVector::zeros(target + 1);
    for window in windows {
        for (channel, row) in rows(window).iter().take(WRENCH).enumerate() {
            extended.fill(0.0);
            extended.rows_mut(0, 10).copy_from(&row.regressor);
            extended[10 + channel] = 1.0;
            extended[target] = row.target;
            products[channel / 3].ger(1.0, &extended, &extended, 1.0);
        }
    }
    products
}

/// Returns the sums of squares of the residuals of forces and moments that unknowns leave.
fn squares(products: &Products, unknowns: &DVector<f64>) -> [f64; 2] {
    [0, 1].map(|unit| (&products[unit] * unknowns).dot(unknowns).max(0.0))
}

/// The sections of a recording.
struct Sections {
    ranges: Vec<Range<usize>>,
    products: Vec<Products>,
    /// Products of the half-differences of all windows, whose residuals are noise.
    differences: Products,
    windows: f64,
    /// Mean squares of force and moment.
    sizes: [f64; 2],
}

impl Sections {
    fn new(equations: &[Equation]) -> Self {
        let count = equations.len();
        let ranges = (0..SECTIONS).map(|k| k * count / SECTIONS..(k + 1) * count / SECTIONS);
        let ranges: Vec<_> = ranges.collect();
        let of_range = |range: &Range<usize>| products(&equations[range.clone()], |e| &e.rows);
        let products_of: Vec<Products> = ranges.iter().map(of_range).collect();
        let mut differences = products(equations, |each| &each.differences);
        for of_unit in &mut differences {
            // A difference has no offset.
            of_unit.rows_mut(10, WRENCH).fill(0.0);
            of_unit.columns_mut(10, WRENCH).fill(0.0);
        }
        let square = |of_unit: &DMatrix<f64>| of_unit[(of_unit.nrows() - 1, of_unit.ncols() - 1)];
        let size = |unit: usize| products_of.iter().map(|of| square(&of[unit])).sum::<f64>();
        Self {
            sizes: [size(0), size(1)].map(|sum| (sum / count as f64).max(f64::MIN_POSITIVE)),
            windows: count as f64,
            products: products_of,
            ranges,
            differences,
        }
    }

    /// Returns the sum of the products of some sections, with forces and moments in units of the
    /// load.
    fn sum(&self, is_used: &[bool]) -> DMatrix<f64> {
        let mut sum = &self.differences[0] * 0.0;
        let used = self.products.iter().zip(is_used);
        for ([forces, moments], _) in used.filter(|(_, is_used)| **is_used) {
            sum += forces / self.sizes[0] + moments / self.sizes[1];
        }
        sum
    }

    /// Solves for the unknowns of some sections: their negatives, then 1, so that a product with an
    /// extended row is a residual.
    fn solve(&self, is_used: &[bool]) -> DVector<f64> {
        let sum = self.sum(is_used);
        let (scales, target) = (scales(&sum), sum.nrows() - 1);
        let of_target = sum.column(target).rows(0, target).component_mul(&scales);
        let mut scaled_solution = DVector::zeros(target);
        for (information, direction) in Spectrum::new(scaled(&sum, &scales)).observable() {
            scaled_solution -= &direction * (direction.dot(&of_target) / information);
        }
        scaled_solution.component_mul(&scales).push(1.0)
    }

    /// Returns the mean square of the residuals of windows with these products, relative to the
    /// largest one that noise and an error of a sound model explain: that of forces or of moments,
    /// whichever is larger.
    fn excess(&self, of: &Products, windows: usize, unknowns: &DVector<f64>) -> f64 {
        let noise = squares(&self.differences, unknowns).map(|sum| sum / self.windows);
        let left = squares(of, unknowns).map(|sum| sum / windows as f64);
        let of_unit = |unit: usize| {
            let of_model = MODEL_ERROR.powi(2) * self.sizes[unit];
            left[unit] / of_model.max(BEYOND_NOISE.powi(2) * noise[unit])
        };
        of_unit(0).max(of_unit(1))
    }

    /// Returns the excess of each section.
    fn excesses(&self, unknowns: &DVector<f64>) -> Vec<f64> {
        let sections = self.products.iter().zip(&self.ranges);
        sections
            .map(|(of, range)| self.excess(of, range.len(), unknowns))
            .collect()
    }

    /// Returns the unknowns that explain most sections; `None` where these are all, or less than a
    /// third, or excite too little.
    fn most_explained(&self) -> Option<DVector<f64>> {
        let explained = |used: &[bool]| -> Vec<bool> {
            let excesses = self.excesses(&self.solve(used)).into_iter();
            excesses.map(|excess| excess <= 1.0).collect()
        };
        let count = |used: &[bool]| used.iter().filter(|is_used| **is_used).count();
        if count(&explained(&[true; SECTIONS])) == SECTIONS {
            return None;
        }
        let tried = SECTIONS / HELD_OUT_EVERY;
        let grown = |first: usize| {
            let mut used: Vec<bool> = (0..SECTIONS)
                .map(|k| k >= first && k < first + tried)
                .collect();
            for _ in 0..MAX_PASSES {
                let next = explained(&used);
                if count(&next) < tried || next == used {
                    break;
                }
                used = next;
            }
            used
        };
        let best = (0..=SECTIONS - tried)
            .map(grown)
            .max_by_key(|used| count(used))?;
        (3 * count(&best) >= SECTIONS && self.is_excited(&best)).then(|| self.solve(&best))
    }

    /// Returns whether some sections have enough of the information of all.
    fn is_excited(&self, is_used: &[bool]) -> bool {
        let all = self.sum(&[true; SECTIONS]);
        let scales = scales(&all);
        let directions = Spectrum::new(scaled(&all, &scales));
        let directions = directions.observable();
        let whitened: Vec<DVector<f64>> = directions.map(|(i, each)| each / i.sqrt()).collect();
        let used = scaled(&self.sum(is_used), &scales);
        let entry = |i: usize, j: usize| whitened[i].dot(&(&used * &whitened[j]));
        let relative = DMatrix::from_fn(whitened.len(), whitened.len(), entry);
        relative.symmetric_eigenvalues().min() > LEAST_INFORMATION
    }

    /// Returns the windows, from one to another, whose residuals are far larger than what unknowns
    /// explain.
    fn spans(&self, equations: &[Equation], unknowns: &DVector<f64>) -> Vec<Range<usize>> {
        let is_other = |&k: &usize| {
            let of_window = products(&equations[k..=k], |each| &each.rows);
            self.excess(&of_window, 1, unknowns) > 1.0
        };
        let (mut spans, mut end) = (Vec::new(), 0);
        for run in self
            .excesses(unknowns)
            .chunk_by(|a, b| (*a > 1.0) == (*b > 1.0))
        {
            end += run.len();
            if !run.iter().any(|excess| *excess > OUTLIER * OUTLIER) {
                continue;
            }
            // It begins and ends within a section beside it.
            let sections = (end - run.len()).saturating_sub(1)..(end + 1).min(SECTIONS);
            let near = self.ranges[sections.start].start..self.ranges[sections.end - 1].end;
            let mut other = near.filter(is_other);
            let Some(begin) = other.next() else { continue };
            let span = begin..other.next_back().unwrap_or(begin) + 1;
            if span.len() >= LEAST_WINDOWS {
                spans.push(span);
            }
        }
        spans
    }
}

/// Returns the units of the unknowns in which their products with themselves are 1.
fn scales(sum: &DMatrix<f64>) -> DVector<f64> {
    let inverse = |square: f64| {
        if square > 0.0 {
            square.sqrt().recip()
        } else {
            0.0
        }
    };
    DVector::from_fn(sum.nrows() - 1, |k, _| inverse(sum[(k, k)]))
}

/// Returns the information on the unknowns in other units.
fn scaled(sum: &DMatrix<f64>, scales: &DVector<f64>) -> DMatrix<f64> {
    let count = scales.len();
    DMatrix::from_fn(count, count, |i, j| sum[(i, j)] * scales[i] * scales[j])
}
