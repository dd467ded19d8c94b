//! The control points of a motion that a search may choose.

use crate::spline::{AT_REST, AT_STANDSTILL, Spline, SplineBasis};

/// Where a motion ends.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum End {
    /// In the posture in which it starts.
    #[default]
    Start,
    /// Anywhere within the limits.
    Free,
    /// In a given posture: a position for each joint of the robot, rad or m. Joints that do not
    /// move end where they start.
    At(Vec<f64>),
}

/// A control point of a joint.
#[derive(Clone, Copy, Debug)]
pub(crate) enum ControlPoint {
    /// The variable with this index.
    Variable(usize),
    /// A value that a condition at one of the ends gives, rad or m.
    Fixed(f64),
}

/// The control points of several joints as functions of the variables that the conditions at both
/// ends leave free.
#[derive(Clone, Debug)]
pub(crate) struct Variables {
    pub(crate) basis: SplineBasis,
    /// The first control points of each joint, which position, velocity and acceleration at the
    /// beginning determine.
    start: Vec<[f64; AT_REST]>,
    /// Positions at the end, where they are given.
    end: Option<Vec<f64>>,
    /// Number of equal control points at the end.
    at_end: usize,
}

impl Variables {
    /// Creates the variables of joints that start at rest at `start` and end at `end`, or anywhere.
    pub(crate) fn new(basis: SplineBasis, start: Vec<f64>, end: Option<Vec<f64>>) -> Self {
        Self {
            basis,
            start: start.into_iter().map(|at| [at; AT_REST]).collect(),
            end,
            at_end: AT_REST,
        }
    }

    /// Creates the variables of joints that start with position, velocity and acceleration of
    /// splines of the same basis, one for each joint, and stand still at the end, anywhere.
    pub(crate) fn continuing(basis: &SplineBasis, splines: &[Spline]) -> Self {
        let first = |spline: &Spline| std::array::from_fn(|k| spline.control_points[k]);
        Self {
            basis: basis.clone(),
            start: splines.iter().map(first).collect(),
            end: None,
            at_end: AT_STANDSTILL,
        }
    }

    /// Number of joints.
    pub(crate) fn joints(&self) -> usize {
        self.start.len()
    }

    /// Number of variables of one joint.
    pub(crate) fn of_joint(&self) -> usize {
        self.basis.count() - AT_REST - self.at_end + usize::from(self.end.is_none())
    }

    /// Number of all variables. The variables of one joint follow one another.
    pub(crate) fn count(&self) -> usize {
        self.joints() * self.of_joint()
    }

    /// Returns what a control point of a joint is.
    pub(crate) fn control_point(&self, joint: usize, point: usize) -> ControlPoint {
        let after = self.basis.count() - self.at_end;
        match &self.end {
            _ if point < AT_REST => ControlPoint::Fixed(self.start[joint][point]),
            Some(end) if point >= after => ControlPoint::Fixed(end[joint]),
            _ => ControlPoint::Variable(joint * self.of_joint() + point.min(after) - AT_REST),
        }
    }

    /// Returns the values of all variables for the control points of a motion from start to end
    /// without excursion: the joints rest, or move along one smooth step.
    pub(crate) fn direct(&self) -> Vec<f64> {
        let mut values = vec![0.0; self.count()];
        let last = (self.basis.count() - AT_REST - self.at_end + 1) as f64;
        for joint in 0..self.joints() {
            for point in AT_REST..self.basis.count() {
                if let ControlPoint::Variable(variable) = self.control_point(joint, point) {
                    let start = self.start[joint][0];
                    let end = self.end.as_ref().map_or(start, |end| end[joint]);
                    let fraction = ((point + 1 - AT_REST) as f64 / last).min(1.0);
                    let smooth = fraction * fraction * (3.0 - 2.0 * fraction);
                    values[variable] = start + (end - start) * smooth;
                }
            }
        }
        values
    }

    /// Returns the values of the variables of splines of all joints; splines of another basis are
    /// interpolated. `None` for another number of joints.
    pub(crate) fn values<'a>(&self, splines: impl Iterator<Item = &'a Spline>) -> Option<Vec<f64>> {
        let mut values = Vec::with_capacity(self.count());
        for spline in splines {
            let interpolated = (spline.control_points.len() != self.basis.count())
                .then(|| spline.in_basis(&self.basis));
            let spline = match &interpolated {
                Some(interpolated) => interpolated.as_ref()?,
                None => spline,
            };
            values.extend_from_slice(&spline.control_points[AT_REST..AT_REST + self.of_joint()]);
        }
        (values.len() == self.count()).then_some(values)
    }

    /// Returns the splines of all joints.
    pub(crate) fn splines(&self, values: &[f64]) -> Vec<Spline> {
        let spline = |joint| {
            let point = |k| match self.control_point(joint, k) {
                ControlPoint::Variable(variable) => values[variable],
                ControlPoint::Fixed(fixed) => fixed,
            };
            let points = (0..self.basis.count()).map(point);
            Spline::new(self.basis.clone(), points.collect())
        };
        (0..self.joints()).map(spline).collect()
    }
}
