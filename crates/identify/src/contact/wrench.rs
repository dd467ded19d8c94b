//! A wrench with its uncertainty, and what the load explains of a measured one.

use nalgebra::{Matrix6, SMatrix, SVector, UnitQuaternion, Vector4, Vector6};
use tactid_dynamics::Wrench;

use super::frame::WrenchFrame;
use crate::equations::{MOTION_TERMS, Model, WRENCH, WrenchRegressor, columns_expressed_in};
use crate::solve::subspace::PIVOT_ROUNDING;

/// Whether a wrench is what it says, or may be a payload that has changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ContactState {
    /// The estimate of the load is that of the payload that is held, as far as the measurements
    /// show.
    Settled,
    /// The measurements contradict the load: something touches the payload, or the payload has
    /// changed. The load is held at its last estimate that nothing contradicted, and the standard
    /// deviations of the contact contain all of it.
    Changing,
}

/// A wrench with its uncertainty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WrenchEstimate {
    /// Time to which the wrench belongs, on the clock of the samples, s: online, that of the last
    /// sample less the [latency](crate::Identifier::contact_latency_s); in a recording, that of its
    /// sample.
    pub time_s: f64,
    /// Force, N, and moment, N m, with the sign of the measured wrenches.
    pub wrench: Wrench,
    /// Covariance of force, N, then moment, N m.
    pub covariance: Matrix6<f64>,
    /// Whether the payload may have changed: in a recording, whose load is given, it has not.
    pub state: ContactState,
}

impl WrenchEstimate {
    /// Marks as unknown each channel to which an unmeasured one contributes: its variance is
    /// infinite, and it is correlated with no other. `unmeasured` maps a wrench in the tool frame
    /// to what is not measured of it, in the frame of this estimate.
    fn hide(&mut self, unmeasured: &Matrix6<f64>) {
        let mut values = Vector6::from(self.wrench.entries());
        for (channel, share) in unmeasured.row_iter().enumerate() {
            if share.amax() > PIVOT_ROUNDING {
                values[channel] = f64::NAN;
                self.covariance.row_mut(channel).fill(0.0);
                self.covariance.column_mut(channel).fill(0.0);
                self.covariance[(channel, channel)] = f64::INFINITY;
            }
        }
        self.wrench = wrench_of(&values);
    }

    /// Returns the same wrench times a sign.
    #[must_use]
    pub fn with_sign(self, sign: f64) -> Self {
        Self {
            wrench: Wrench {
                force: self.wrench.force * sign,
                moment: self.wrench.moment * sign,
            },
            ..self
        }
    }

    /// Returns the standard deviations of force, N, then moment, N m.
    #[must_use]
    pub fn std_devs(&self) -> [f64; 6] {
        std::array::from_fn(|k| self.covariance[(k, k)].max(0.0).sqrt())
    }
}

/// The wrenches of the load and of the contact at one time, in one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoadAndContact {
    /// Wrench by which the robot carries and accelerates payload and known tool.
    pub load: WrenchEstimate,
    /// Measured wrench less offset and load.
    pub contact: WrenchEstimate,
}

impl LoadAndContact {
    /// Returns the same wrenches times a sign.
    pub fn with_sign(self, sign: f64) -> Self {
        Self {
            load: self.load.with_sign(sign),
            contact: self.contact.with_sign(sign),
        }
    }
}

/// Entries of an instant, or means of them: the wrench in the tool frame, the terms of the motion,
/// and the quaternion of the tool. A load explains a mean wrench by the mean terms.
#[derive(Clone, Copy, Debug)]
pub struct Entries(pub SVector<f64, { WRENCH + MOTION_TERMS + 4 }>);

impl Entries {
    /// Entries that are all zero.
    pub fn zeros() -> Self {
        Self(SVector::zeros())
    }

    /// Returns the entries of the last instant of a model, with the quaternion on the side of that
    /// of other entries. `None` where the method uses no wrenches, or where an entry is no number.
    pub fn of_instant(model: &Model, before: &Self) -> Option<Self> {
        let (wrench, terms, rotation) = model.wrench_terms()?;
        let rotation = rotation.coords;
        let side = 1f64.copysign(rotation.dot(&before.quaternion()));
        let Self(mut entries) = Self::zeros();
        entries.fixed_rows_mut::<WRENCH>(0).copy_from_slice(wrench);
        entries
            .fixed_rows_mut::<MOTION_TERMS>(WRENCH)
            .copy_from_slice(terms);
        entries
            .fixed_rows_mut::<4>(WRENCH + MOTION_TERMS)
            .copy_from(&(rotation * side));
        // Zero times what is not finite is no number. All entries are summed without a branch.
        let is_finite = (entries * 0.0).sum() == 0.0;
        is_finite.then_some(Self(entries))
    }

    /// Measured wrench in the tool frame, N and N m.
    pub fn measured(&self) -> Vector6<f64> {
        self.0.fixed_rows::<WRENCH>(0).into()
    }

    /// Regressor of the wrench in the tool frame.
    pub fn regressor(&self) -> SMatrix<f64, 6, 10> {
        let terms = self.0.fixed_rows::<MOTION_TERMS>(WRENCH).into_owned();
        WrenchRegressor::new(&terms).parameters
    }

    fn quaternion(&self) -> Vector4<f64> {
        self.0.fixed_rows::<4>(WRENCH + MOTION_TERMS).into()
    }

    /// Returns the matrix that maps wrenches in the tool frame to a frame.
    pub fn map_to(&self, frame: &WrenchFrame) -> Matrix6<f64> {
        let world_from_tool = UnitQuaternion::new_normalize(self.quaternion().into());
        let frame_from_tool = frame.frame_from_tool(&world_from_tool);
        columns_expressed_in(&Matrix6::identity(), &frame_from_tool)
    }
}

/// A measured wrench with what the load explains of it, in the tool frame.
pub struct Parts {
    /// Wrench that carries and accelerates the load, N and N m.
    pub load: Vector6<f64>,
    /// Covariance of `load`.
    pub of_load: Matrix6<f64>,
    /// Measured wrench less offset and load, N and N m.
    pub contact: Vector6<f64>,
    /// Covariance of `contact`.
    pub of_contact: Matrix6<f64>,
}

impl Parts {
    /// Returns the squared Mahalanobis distance of the contact from zero.
    pub(crate) fn distance(&self) -> f64 {
        let root = self.of_contact.cholesky();
        root.map_or(f64::INFINITY, |root| {
            self.contact.dot(&root.solve(&self.contact))
        })
    }

    /// Returns the wrench of the load and that of the contact in the frame to which a matrix maps.
    /// Of the contact, what is not measured is unknown: what a `projection` in the tool frame
    /// leaves out.
    pub fn mapped(
        &self,
        map: &Matrix6<f64>,
        projection: Option<&Matrix6<f64>>,
        time_s: f64,
        state: ContactState,
    ) -> LoadAndContact {
        let expressed = |wrench: &Vector6<f64>, covariance: &Matrix6<f64>| WrenchEstimate {
            time_s,
            wrench: wrench_of(&(map * wrench)),
            covariance: map * covariance * map.transpose(),
            state,
        };
        let mut contact = expressed(&self.contact, &self.of_contact);
        if let Some(measured) = projection {
            contact.hide(&(map * (Matrix6::identity() - measured)));
        }
        LoadAndContact {
            load: expressed(&self.load, &self.of_load),
            contact,
        }
    }
}

/// Returns the wrench with these entries.
pub fn wrench_of(entries: &Vector6<f64>) -> Wrench {
    Wrench {
        force: entries.fixed_rows::<3>(0).into(),
        moment: entries.fixed_rows::<3>(3).into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A channel that is not measured hides those of the frame to which it contributes, and these
    /// alone.
    #[test]
    fn unmeasured_channels_are_unknown_in_the_frame() {
        let parts = Parts {
            load: Vector6::repeat(1.0),
            of_load: Matrix6::identity(),
            contact: Vector6::repeat(2.0),
            of_contact: Matrix6::repeat(0.5) + Matrix6::identity(),
        };
        let mut measured = Matrix6::identity();
        measured[(2, 2)] = 0.0;
        // The axes x and z change places.
        let mut map = Matrix6::identity();
        map.swap_rows(0, 2);
        let LoadAndContact { load, contact } =
            parts.mapped(&map, Some(&measured), 0.0, ContactState::Settled);
        assert_eq!(load.covariance, Matrix6::identity());
        assert!(contact.wrench.force.x.is_nan() && contact.std_devs()[0].is_infinite());
        assert_eq!(
            (contact.wrench.force.z, contact.std_devs()[2]),
            (2.0, 1.5f64.sqrt())
        );
        assert_eq!(contact.covariance[(0, 1)], 0.0);
        assert_eq!(contact.covariance[(1, 2)], 0.5);
    }
}
