//! Fits of poses, with gravity in a given direction or in one that they show.

use nalgebra::{RowSVector, SMatrix, Vector3};
use tactid_identify::equations::{
    Equation, Geometry, OffsetFrame, Unknowns, WRENCH, acceleration_columns,
};
use tactid_identify::solve::{Matrix, Vector};

use super::Rows;
use super::fit::{ANGLES, RestFit};
use super::visits::Visit;
use crate::GravityEstimate;
use crate::fit::CONVERGED_ENOUGH;
use crate::fit::elimination::tangents;
use crate::fit::further::{of_second_order, static_gravity, turned};
use crate::fit::least_squares::MAX_PASSES;

/// The mean equations of poses, and what is unknown beside the payload.
#[derive(Clone)]
pub(super) struct Poses<'a> {
    /// The equation of each pose in the tool frame.
    pub(super) equations: Vec<Equation>,
    /// Number of the attitude of each pose.
    pub(super) attitudes: Vec<usize>,
    /// The frame of the rows.
    pub(super) frame: &'a OffsetFrame,
    pub(super) has_offset: bool,
    /// Given gravity, m/s².
    pub(super) gravity: Vector3<f64>,
    pub(super) unknowns: Unknowns,
}

/// A fit of some poses.
pub(super) struct PoseFit {
    pub(super) fit: RestFit,
    /// The rows of all poses.
    pub(super) rows: Vec<Rows>,
    /// Gravity as the poses show it, m/s²; the given one where that is known.
    gravity: Vector3<f64>,
}

impl Poses<'_> {
    /// Fits the poses that are `kept`. An unknown gravity is found by Gauss-Newton iterations from
    /// that of forces alone, which are linear in it.
    pub(super) fn fit(&self, kept: &[bool]) -> PoseFit {
        if !self.unknowns.gravity {
            return self.fit_at(self.gravity, None, kept);
        }
        let some = self.kept(kept);
        let start = static_gravity(&some, &self.gravity, self.frame.projection().as_ref());
        let mut found = self.fit_at(start, None, kept);
        for pass in 0..MAX_PASSES {
            let step = tangents(&found.gravity) * found.fit.angles();
            let gravity = (found.gravity + step).normalize() * self.gravity.norm();
            found = self.fit_at(gravity, Some(&found.fit.parameters), kept);
            if pass > 0 && found.fit.angles_in_std_devs() < CONVERGED_ENOUGH {
                break;
            }
        }
        found
    }

    /// Returns the poses with gravity in a direction that is unknown; `None` where it is unknown
    /// already.
    pub(super) fn with_unknown_gravity(&self) -> Option<Self> {
        let mut unknown = self.clone();
        unknown.unknowns.gravity = true;
        (!self.unknowns.gravity).then_some(unknown)
    }

    /// Returns the equations of the poses that are `kept`.
    pub(super) fn kept(&self, kept: &[bool]) -> Vec<Equation> {
        let all = self.equations.iter().zip(kept);
        all.filter(|(_, kept)| **kept)
            .map(|(equation, _)| equation.clone())
            .collect()
    }

    /// Fits with a gravity; it may turn by small angles where there is a load, whose parameters are
    /// about known.
    fn fit_at(&self, gravity: Vector3<f64>, load: Option<&Vector>, kept: &[bool]) -> PoseFit {
        let equations = turned(
            &self.equations,
            &(gravity - self.gravity),
            self.frame.projection().as_ref(),
            true,
        );
        let rows: Vec<Rows> = equations
            .iter()
            .map(|equation| self.rows(equation, &gravity, load))
            .collect();
        let visits = rows.iter().zip(&self.attitudes).zip(kept);
        let visits: Vec<Visit> = visits
            .filter(|(_, kept)| **kept)
            .map(|((rows, attitude), _)| Visit {
                rows: *rows,
                attitude: *attitude,
            })
            .collect();
        PoseFit {
            fit: RestFit::new(&visits, self.has_offset, self.frame.measured()),
            rows,
            gravity,
        }
    }

    fn rows(&self, equation: &Equation, gravity: &Vector3<f64>, load: Option<&Vector>) -> Rows {
        let mut in_tool: Rows = std::array::from_fn(|channel| equation.rows[channel]);
        if let (Some(load), Some(geometry)) = (load, Geometry::new(&equation.geometry)) {
            let mut columns = SMatrix::<f64, WRENCH, 10>::zeros();
            set_angles(
                &mut columns,
                &-(geometry.tool_from_world() * tangents(gravity)),
                load,
            );
            for (row, angles) in in_tool.iter_mut().zip(columns.row_iter()) {
                row.regressor += angles.transpose();
            }
        }
        self.frame.mapped_rows(&in_tool)
    }
}

impl PoseFit {
    /// Returns gravity with the standard deviations of its entries, where its direction is unknown.
    pub(super) fn gravity_estimate(&self) -> Option<GravityEstimate> {
        let tangents = tangents(&self.gravity);
        let of_angle = |place: usize| self.fit.std_dev(&Matrix::identity().row(place).into());
        let of_angles = ANGLES.map(|place| of_angle(place).powi(2)).iter().sum();
        let std_dev = |entry: usize| {
            let mut gradient = RowSVector::<f64, 10>::zeros();
            gradient
                .fixed_columns_mut::<2>(ANGLES[0])
                .copy_from(&tangents.row(entry));
            let variance = self.fit.std_dev(&gradient).powi(2);
            (variance + of_second_order(self.gravity[entry], of_angles)).sqrt()
        };
        self.fit.has_angles().then(|| GravityEstimate {
            values: self.gravity.into(),
            std_devs: std::array::from_fn(std_dev),
        })
    }
}

/// Sets the columns of the [`ANGLES`], by which an acceleration changes along `across`, for a
/// payload with these parameters.
pub(super) fn set_angles(
    columns: &mut SMatrix<f64, WRENCH, 10>,
    across: &SMatrix<f64, 3, 2>,
    load: &Vector,
) {
    for (place, across) in ANGLES.into_iter().zip(across.column_iter()) {
        let of_angle = acceleration_columns(&across.into()) * load.fixed_rows::<4>(0);
        columns.set_column(place, &of_angle);
    }
}
