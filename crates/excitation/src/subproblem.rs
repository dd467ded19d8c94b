//! The conic program of one step of a design.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};

use crate::ExcitationError;
use crate::cones::LinearCone;

/// What an exceeded limit costs, in units of the logarithm of an interval per fraction of the
/// limit. Limits that all grow by one percent shorten the intervals by about two percent, so this
/// is more than they are worth. With a larger penalty the search follows curved limits in small
/// steps: 20 gave intervals almost three times as wide on the built-in spacecraft.
pub(crate) const PENALTY: f64 = 3.0;

/// Curvature along each variable, which makes the step unique where the program is degenerate.
const CURVATURE: f64 = 1e-4;

/// Tolerance of the solver. What steps achieve corrects them, and limits are checked afterwards.
const TOLERANCE: f64 = 1e-7;

/// A linear inequality `constant + gradient · δ >= 0` of the step `δ`.
#[derive(Clone, Debug)]
pub(crate) struct Inequality {
    pub(crate) constant: f64,
    pub(crate) gradient: Vec<(usize, f64)>,
}

/// The program: minimise the largest function plus the penalty of the largest excess of a cone.
#[derive(Debug)]
pub(crate) struct Subproblem<'a> {
    /// Values of the functions and their gradients.
    pub(crate) functions: &'a [(f64, Vec<f64>)],
    /// Inequalities that hold strictly.
    pub(crate) inequalities: &'a [Inequality],
    /// Cones that hold up to their excess.
    pub(crate) cones: &'a [&'a LinearCone],
    /// Largest magnitude of each entry of the step.
    pub(crate) radius: f64,
    /// Number of entries of the step.
    pub(crate) variables: usize,
}

/// Rows of a conic program, each of which belongs to one cone: `constant + gradient · x`.
#[derive(Default)]
struct Rows {
    rows: Vec<usize>,
    columns: Vec<usize>,
    values: Vec<f64>,
    constants: Vec<f64>,
}

impl Rows {
    fn push(&mut self, constant: f64, gradient: impl IntoIterator<Item = (usize, f64)>) {
        let row = self.constants.len();
        self.constants.push(constant);
        for (column, value) in gradient {
            if value != 0.0 {
                self.rows.push(row);
                self.columns.push(column);
                self.values.push(-value);
            }
        }
    }
}

/// Returns the product of a gradient and a step.
pub(crate) fn along(gradient: &[f64], step: &[f64]) -> f64 {
    gradient.iter().zip(step).map(|(a, b)| a * b).sum()
}

impl LinearCone {
    /// Returns head and tail after a step.
    pub(crate) fn after(&self, step: &[f64]) -> (f64, Vec<f64>) {
        let tail = self.value.tail.iter().zip(&self.tail);
        (
            self.value.head + along(&self.head, step),
            tail.map(|(value, g)| value + along(g, step)).collect(),
        )
    }

    /// Returns by how much the limit is exceeded after a step; negative where it holds.
    pub(crate) fn excess_after(&self, step: &[f64]) -> f64 {
        let (head, tail) = self.after(step);
        tail.iter().map(|x| x * x).sum::<f64>().sqrt() - head
    }
}

fn dense(gradient: &[f64], sign: f64) -> impl Iterator<Item = (usize, f64)> + '_ {
    gradient.iter().map(move |x| sign * x).enumerate()
}

impl Subproblem<'_> {
    /// Returns the step.
    pub(crate) fn solve(&self) -> Result<Vec<f64>, ExcitationError> {
        let count = self.variables;
        let (largest, excess) = (count, count + 1);
        let mut rows = Rows::default();
        for (value, gradient) in self.functions {
            rows.push(-value, dense(gradient, -1.0).chain([(largest, 1.0)]));
        }
        for inequality in self.inequalities {
            rows.push(inequality.constant, inequality.gradient.iter().copied());
        }
        for variable in 0..count {
            rows.push(self.radius, [(variable, 1.0)]);
            rows.push(self.radius, [(variable, -1.0)]);
        }
        rows.push(0.0, [(excess, 1.0)]);
        for cone in self.cones.iter().filter(|cone| cone.tail.len() == 1) {
            for sign in [-1.0, 1.0] {
                let constant = cone.value.head + sign * cone.value.tail[0];
                let gradient = dense(&cone.head, 1.0).zip(dense(&cone.tail[0], sign));
                let sum = gradient.map(|((k, a), (_, b))| (k, a + b));
                rows.push(constant, sum.chain([(excess, 1.0)]));
            }
        }
        for cone in self.cones.iter().filter(|cone| cone.tail.is_empty()) {
            let head = dense(&cone.head, 1.0).chain([(excess, 1.0)]);
            rows.push(cone.value.head, head);
        }
        let mut kinds = vec![SupportedConeT::NonnegativeConeT(rows.constants.len())];
        for cone in self.cones.iter().filter(|cone| cone.tail.len() > 1) {
            let head = dense(&cone.head, 1.0).chain([(excess, 1.0)]);
            rows.push(cone.value.head, head);
            for (value, gradient) in cone.value.tail.iter().zip(&cone.tail) {
                rows.push(*value, dense(gradient, 1.0));
            }
            kinds.push(SupportedConeT::SecondOrderConeT(1 + cone.tail.len()));
        }
        self.run(rows, &kinds)
    }

    fn run(&self, rows: Rows, kinds: &[SupportedConeT<f64>]) -> Result<Vec<f64>, ExcitationError> {
        let count = self.variables;
        let all = count + 2;
        let diagonal: Vec<usize> = (0..count).collect();
        let curvature = vec![CURVATURE; count];
        let quadratic =
            CscMatrix::new_from_triplets(all, all, diagonal.clone(), diagonal, curvature);
        let matrix = CscMatrix::new_from_triplets(
            rows.constants.len(),
            all,
            rows.rows,
            rows.columns,
            rows.values,
        );
        let mut linear = vec![0.0; all];
        (linear[count], linear[count + 1]) = (1.0, PENALTY);
        let settings = DefaultSettings {
            verbose: false,
            tol_gap_abs: TOLERANCE,
            tol_gap_rel: TOLERANCE,
            tol_feas: TOLERANCE,
            max_threads: 1,
            ..DefaultSettings::default()
        };
        let failed = |message: String| ExcitationError::Solver(message);
        let mut solver = DefaultSolver::new(
            &quadratic,
            &linear,
            &matrix,
            &rows.constants,
            kinds,
            settings,
        )
        .map_err(|error| failed(error.to_string()))?;
        solver.solve();
        let solution = &solver.solution;
        match solution.status {
            SolverStatus::Solved | SolverStatus::AlmostSolved => Ok(solution.x[..count].to_vec()),
            status => Err(failed(format!("{status:?}"))),
        }
    }
}
