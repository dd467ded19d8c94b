//! Times of a recording with another load than in the rest: a contact, or another payload.
//!
//! The recording is cut into sections. From the load of each few neighbouring ones, all sections
//! are added that it explains, until none follows; the load that explains most of the recording is
//! that of the rest. Unlike the reweighting of windows, which starts from all of them, this finds
//! the payload behind a contact that lasts for half of a recording.

use std::ops::Range;

use nalgebra::{DMatrix, DVector, SMatrix, SVector};

use crate::checks::{BEYOND_NOISE, MODEL_ERROR};
use crate::equations::{Equation, EquationStream, Row, WRENCH};
use crate::finding::{Finding, OtherLoad};
use crate::fit::Fit;
use crate::solve::spectrum::Spectrum;

/// Number of sections of a recording.
const SECTIONS: usize = 25;

/// Number of neighbouring sections whose load is tried.
const TRIED_SECTIONS: usize = 5;

/// Most times that sections are added to those that were tried.
const MOST_PASSES: usize = 10;

/// Fewest windows of a section, and of a part that is reported.
const LEAST_WINDOWS: usize = 8;

/// Least fraction of the windows that are the rest.
const LEAST_REST: f64 = 0.3;

/// Least information in the rest, relative to that in all of the recording, in each direction of
/// the parameters: what is not excited there would be explained by any load.
const LEAST_INFORMATION: f64 = 0.01;

/// Mean square of residuals, relative to the largest one that is explained, from which a section
/// shows another load.
const FAR: f64 = 16.0;

/// Number of unknowns: the parameters, and the offset of the wrench.
const UNKNOWNS: usize = 10 + WRENCH;

/// A row of an equation: its unknowns, then its target.
type Extended = SVector<f64, { UNKNOWNS + 1 }>;

/// Products of the extended rows of forces, and of those of moments, summed over windows. A
/// quadratic form of them is a sum of squares of residuals.
type Products = [SMatrix<f64, { UNKNOWNS + 1 }, { UNKNOWNS + 1 }>; 2];

/// The parts of a recording that have another load.
pub(super) struct Parts {
    found: OtherLoad,
    /// Whether each window is part of the rest.
    is_rest: Vec<bool>,
}

impl Parts {
    /// Finds the parts; `None` where there are none, or where no load explains enough of the
    /// recording.
    pub(super) fn find(equations: &[Equation], stream: &EquationStream) -> Option<Self> {
        let has_wrench = stream.has_sensors() && stream.method().uses_wrench();
        if !has_wrench || equations.len() < SECTIONS * LEAST_WINDOWS {
            return None;
        }
        let sections = Sections::new(equations);
        let unknowns = sections.most_explained()?;
        let limits = sections.limits(&unknowns);
        let parts = sections.parts(equations, &unknowns, limits);
        if parts.is_empty() {
            return None;
        }
        let mut is_rest = vec![true; equations.len()];
        parts
            .iter()
            .for_each(|part| is_rest[part.clone()].fill(false));
        let windows: Vec<&Equation> = parts
            .iter()
            .flat_map(|part| &equations[part.clone()])
            .collect();
        let squares = squares(&products(&windows, |each| &each.rows), &unknowns);
        let [force_rms, moment_rms] = squares.map(|sum| (sum / windows.len() as f64).sqrt());
        let times =
            |part: &Range<usize>| [equations[part.start].time_s, equations[part.end - 1].time_s];
        Some(Self {
            found: OtherLoad {
                parts: parts.iter().map(times).collect(),
                fraction: windows.len() as f64 / equations.len() as f64,
                force_rms,
                moment_rms,
            },
            is_rest,
        })
    }

    /// Whether each window is part of the rest.
    pub(super) fn is_rest(&self) -> &[bool] {
        &self.is_rest
    }

    /// Reports the parts, and only the outliers besides them.
    pub(super) fn report(&self, fit: &Fit, findings: &mut Vec<Finding>) {
        findings.retain(|found| !matches!(found, Finding::Outliers { .. }));
        let windows = self.is_rest.len();
        let outliers = (0..windows)
            .filter(|&k| self.is_rest[k] && fit.is_outlier(k))
            .count();
        if outliers > 0 {
            findings.push(Finding::Outliers { outliers, windows });
        }
        findings.insert(0, Finding::OtherLoad(self.found.clone()));
    }
}

/// Takes the weight of the parts with another load, if there are any, from a fit to the rest.
pub(super) fn leave_out(parts: Option<&Parts>, fit: &mut Fit) {
    let is_rest = parts.iter().flat_map(|parts| &parts.is_rest);
    for (weight, is_rest) in fit.weights.iter_mut().zip(is_rest) {
        *weight = if *is_rest { *weight } else { 0.0 };
    }
}

/// Returns the products of the wrench's rows of windows.
fn products(windows: &[&Equation], rows: impl Fn(&Equation) -> &[Row]) -> Products {
    let mut products: Products = [SMatrix::zeros(); 2];
    for window in windows {
        for (channel, row) in rows(window).iter().take(WRENCH).enumerate() {
            let mut extended = Extended::zeros();
            extended.fixed_rows_mut::<10>(0).copy_from(&row.regressor);
            extended[10 + channel] = 1.0;
            extended[UNKNOWNS] = row.target;
            products[channel / 3].ger(1.0, &extended, &extended, 1.0);
        }
    }
    products
}

/// Returns the sums of squares of the residuals of forces and moments that unknowns leave.
fn squares(products: &Products, unknowns: &Extended) -> [f64; 2] {
    products.map(|of_unit| (of_unit * unknowns).dot(unknowns).max(0.0))
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
        let all: Vec<&Equation> = equations.iter().collect();
        let of_range = |range: &Range<usize>| products(&all[range.clone()], |each| &each.rows);
        let products_of: Vec<Products> = ranges.iter().map(of_range).collect();
        let mut differences = products(&all, |each| &each.differences);
        for of_unit in &mut differences {
            // A difference has no offset.
            of_unit
                .fixed_view_mut::<WRENCH, { UNKNOWNS + 1 }>(10, 0)
                .fill(0.0);
            of_unit
                .fixed_view_mut::<{ UNKNOWNS + 1 }, WRENCH>(0, 10)
                .fill(0.0);
        }
        let target = |unit: usize| {
            products_of
                .iter()
                .map(move |of| of[unit][(UNKNOWNS, UNKNOWNS)])
        };
        let windows = count as f64;
        Self {
            sizes: [0, 1].map(|unit| target(unit).sum::<f64>() / windows),
            products: products_of,
            ranges,
            differences,
            windows,
        }
    }

    /// Returns the sum of the products of some sections, with forces and moments in units of the
    /// load.
    fn sum(&self, is_used: &[bool]) -> DMatrix<f64> {
        let mut sum = SMatrix::<f64, { UNKNOWNS + 1 }, { UNKNOWNS + 1 }>::zeros();
        let used = self
            .products
            .iter()
            .zip(is_used)
            .filter(|(_, is_used)| **is_used);
        for ([forces, moments], _) in used {
            let [of_force, of_moment] = self.sizes.map(|size| size.max(f64::MIN_POSITIVE).recip());
            sum += forces * of_force + moments * of_moment;
        }
        DMatrix::from_fn(UNKNOWNS + 1, UNKNOWNS + 1, |i, j| sum[(i, j)])
    }

    /// Solves for the unknowns of some sections: their negatives, then 1, so that a product with an
    /// extended row is a residual.
    fn solve(&self, is_used: &[bool]) -> Extended {
        let sum = self.sum(is_used);
        let scales = scales(&sum);
        let target = DVector::from_fn(UNKNOWNS, |k, _| sum[(k, UNKNOWNS)] * scales[k]);
        let mut solution = Extended::zeros();
        for (information, direction) in Spectrum::new(scaled(&sum, &scales)).observable() {
            let step = direction.dot(&target) / information;
            for k in 0..UNKNOWNS {
                solution[k] -= step * direction[k] * scales[k];
            }
        }
        solution[UNKNOWNS] = 1.0;
        solution
    }

    /// Returns the largest mean squares of residuals of forces and moments that noise and an error
    /// of a sound model explain.
    fn limits(&self, unknowns: &Extended) -> [f64; 2] {
        let noise = squares(&self.differences, unknowns);
        std::array::from_fn(|unit| {
            let of_noise = BEYOND_NOISE.powi(2) * noise[unit] / self.windows;
            of_noise
                .max(MODEL_ERROR.powi(2) * self.sizes[unit])
                .max(f64::MIN_POSITIVE)
        })
    }

    /// Returns the mean square of the residuals of a section relative to the limits: that of forces
    /// or moments, whichever is larger.
    fn excess(&self, section: usize, unknowns: &Extended, limits: [f64; 2]) -> f64 {
        let windows = self.ranges[section].len() as f64;
        excess(&self.products[section], windows, unknowns, limits)
    }

    /// Returns the unknowns that explain most sections; `None` where these are all, or too few, or
    /// excite too little.
    fn most_explained(&self) -> Option<Extended> {
        let explained = |unknowns: &Extended| -> Vec<bool> {
            let limits = self.limits(unknowns);
            let all = 0..SECTIONS;
            all.map(|k| self.excess(k, unknowns, limits) <= 1.0)
                .collect()
        };
        let count = |used: &[bool]| used.iter().filter(|is_used| **is_used).count();
        if count(&explained(&self.solve(&[true; SECTIONS]))) == SECTIONS {
            return None;
        }
        let grown = |first: usize| {
            let tried = first..first + TRIED_SECTIONS;
            let mut used: Vec<bool> = (0..SECTIONS).map(|k| tried.contains(&k)).collect();
            for _ in 0..MOST_PASSES {
                let next = explained(&self.solve(&used));
                if count(&next) < TRIED_SECTIONS || next == used {
                    break;
                }
                used = next;
            }
            used
        };
        let best = (0..=SECTIONS - TRIED_SECTIONS)
            .map(grown)
            .max_by_key(|used| count(used))?;
        let is_enough = count(&best) as f64 >= LEAST_REST * SECTIONS as f64;
        (is_enough && self.is_excited(&best)).then(|| self.solve(&best))
    }

    /// Returns whether some sections have enough of the information of all.
    fn is_excited(&self, is_used: &[bool]) -> bool {
        let all = self.sum(&[true; SECTIONS]);
        let scales = scales(&all);
        let whitened: Vec<DVector<f64>> = Spectrum::new(scaled(&all, &scales))
            .observable()
            .map(|(information, direction)| direction / information.sqrt())
            .collect();
        let used = scaled(&self.sum(is_used), &scales);
        let entry = |i: usize, j: usize| whitened[i].dot(&(&used * &whitened[j]));
        let relative = DMatrix::from_fn(whitened.len(), whitened.len(), entry);
        relative.symmetric_eigenvalues().min() > LEAST_INFORMATION
    }

    /// Returns the parts in which the residuals are far larger than what unknowns explain.
    fn parts(
        &self,
        equations: &[Equation],
        unknowns: &Extended,
        limits: [f64; 2],
    ) -> Vec<Range<usize>> {
        let of_window = |k: usize| {
            excess(
                &products(&[&equations[k]], |each| &each.rows),
                1.0,
                unknowns,
                limits,
            )
        };
        let excesses: Vec<f64> = (0..SECTIONS)
            .map(|k| self.excess(k, unknowns, limits))
            .collect();
        let (mut parts, mut end) = (Vec::new(), 0);
        for run in excesses.chunk_by(|a, b| (*a > 1.0) == (*b > 1.0)) {
            end += run.len();
            if !run.iter().any(|excess| *excess > FAR) {
                continue;
            }
            // It begins and ends within a section beside it.
            let sections = (end - run.len()).saturating_sub(1)..(end + 1).min(SECTIONS);
            let near = self.ranges[sections.start].start..self.ranges[sections.end - 1].end;
            let mut other = near.filter(|&k| of_window(k) > 1.0);
            let Some(begin) = other.next() else { continue };
            let part = begin..other.last().unwrap_or(begin) + 1;
            if part.len() >= LEAST_WINDOWS {
                parts.push(part);
            }
        }
        parts
    }
}

/// Returns the mean square of residuals relative to the limits: that of forces or moments,
/// whichever is larger.
fn excess(of: &Products, windows: f64, unknowns: &Extended, limits: [f64; 2]) -> f64 {
    let [forces, moments] = squares(of, unknowns);
    (forces / limits[0]).max(moments / limits[1]) / windows
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
    DVector::from_fn(UNKNOWNS, |k, _| inverse(sum[(k, k)]))
}

/// Returns the information on the unknowns in other units.
fn scaled(sum: &DMatrix<f64>, scales: &DVector<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(UNKNOWNS, UNKNOWNS, |i, j| {
        sum[(i, j)] * scales[i] * scales[j]
    })
}
