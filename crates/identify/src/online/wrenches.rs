//! The wrenches of load and contact and the zero of the sensor, as a controller reads them.

use nalgebra::SMatrix;

use super::identifier::Identifier;
use crate::contact::{LoadAndContact, WrenchEstimate, WrenchFrame};
use crate::solve::offsets::joint_covariance;
use crate::{IdentifyError, WrenchOffset};

impl Identifier {
    /// Holds the payload, from when its estimate has settled until the gripper opens, or ends that.
    /// Windows with samples of such a time neither update the estimate nor show a payload change,
    /// and whatever the load does not explain is a [contact](Self::contact_wrench).
    ///
    /// Returns whether that is so: a payload that fewer than 32 windows determine is not held,
    /// because nothing more would be known of it. A payload that only a contact might explain
    /// instead is held, because the caller says that there is none.
    #[must_use]
    pub fn hold_payload(&mut self, is_held: bool) -> bool {
        if is_held && !self.update.confirm_payload() {
            return false;
        }
        if self.is_held && !is_held {
            self.stream.start_windows();
        }
        self.is_held = is_held;
        true
    }

    /// Returns whether the payload is [held](Self::hold_payload).
    #[must_use]
    pub fn is_payload_held(&self) -> bool {
        self.is_held
    }

    /// Sets the zero of the wrench sensor, as after its drift: windows that begin from now on
    /// determine the [offset](Self::wrench_offset) anew, the first of them within 0.2 s at a cutoff
    /// of 10 Hz. The payload is held at the last estimate that nothing contradicted, so that a zero
    /// which has moved is taken for nothing else, even where it was reported as a payload change.
    /// Nothing may touch the payload meanwhile. The arm may move.
    ///
    /// Returns `false`, and does nothing, where
    /// [`EquationSettings::wrench_offset`](crate::EquationSettings::wrench_offset) does not make
    /// the offset an unknown, before 32 windows determine the load for the first time, or while the
    /// payload is [held](Self::hold_payload), because no window then updates the estimate.
    pub fn tare(&mut self) -> bool {
        if self.is_held {
            return false;
        }
        let Some(is_taken_back) = self.update.forget_offsets() else {
            return false;
        };
        if is_taken_back {
            self.times.return_to_before();
        }
        self.stream.start_windows();
        self.recent.clear();
        true
    }

    /// Returns whether the motion has determined what the [contact](Self::contact_wrench) is
    /// measured against: mass and first moments of the load, and the offset where it is an unknown.
    /// Until then the wrench of a contact is one relative to the attitudes so far, and that of the
    /// load in another attitude is unknown.
    #[must_use]
    pub fn knows_weight(&self) -> bool {
        let trusted = self.update.estimator().trusted();
        trusted.is_some_and(|estimate| estimate.is_determined)
    }

    /// Returns the frame in which a wrench is to be expressed: about the origin of the link
    /// `point`, and along the axes of the link `axes` or of [`WORLD`](crate::WORLD), or of `point`
    /// where they are `None`.
    ///
    /// # Errors
    /// Returns [`IdentifyError::Option`] for a link that the robot does not have, if `point` moves
    /// relative to the end-effector, and if `axes` move relative to both the end-effector and the
    /// ground.
    pub fn wrench_frame(
        &self,
        point: &str,
        axes: Option<&str>,
    ) -> Result<WrenchFrame, IdentifyError> {
        WrenchFrame::new(self.stream.robot(), &self.frame, point, axes)
    }

    /// Returns the wrench by which the robot carries and accelerates the load, which is payload and
    /// known tool, at the sensor: what the sensors would measure of it without offset, noise and
    /// contact, with the sign of the measured wrenches. `None` as for
    /// [`contact_wrench`](Self::contact_wrench).
    #[must_use]
    pub fn load_wrench(&self, frame: &WrenchFrame) -> Option<WrenchEstimate> {
        Some(self.wrenches(frame)?.load)
    }

    /// Returns the wrench of a contact: the measured wrench less offset and load, without
    /// allocation.
    ///
    /// It has the sign of the measured wrenches. Where these act on the payload, it is what the
    /// payload exerts on what it touches; where they act on the [sensor](crate::ActsOn::Sensor), it
    /// is what acts on the payload from outside. Measured wrench and motion pass the same causal
    /// low-pass of fourth order with the cutoff
    /// [`EquationSettings::cutoff_hz`](crate::EquationSettings::cutoff_hz);
    /// [`contact_latency_s`](Self::contact_latency_s) is its delay.
    ///
    /// What the load does not explain may be a contact or a payload change, and the first samples
    /// do not show which. The load is then held at the last estimate that nothing contradicted, the
    /// state is [`Changing`](crate::ContactState::Changing), and the covariance contains the
    /// contact itself, so that the interval contains both its value and zero. It remains so until
    /// the load explains the measurements again, or 32 windows show a [new
    /// payload](Self#payload-changes) by its inertia: a constant vertical force on an arm at rest
    /// remains ambiguous until the arm moves. [`hold_payload`](Self::hold_payload) says that the
    /// payload cannot have changed: the uncertainty is then that of noise and load alone.
    ///
    /// Channels that the sensor does not [measure](crate::EquationSettings::unmeasured) are not a
    /// number, with an infinite variance. `None` before 32 windows determine the load for the first
    /// time, after a gap, and for methods without wrenches.
    #[must_use]
    pub fn contact_wrench(&self, frame: &WrenchFrame) -> Option<WrenchEstimate> {
        Some(self.wrenches(frame)?.contact)
    }

    /// Returns [`load_wrench`](Self::load_wrench) and [`contact_wrench`](Self::contact_wrench) in
    /// one computation.
    #[must_use]
    pub fn wrenches(&self, frame: &WrenchFrame) -> Option<LoadAndContact> {
        let estimator = self.update.estimator();
        let wrenches = self.contact.wrenches(estimator, frame, self.is_held)?;
        Some(wrenches.with_sign(self.sign))
    }

    /// Returns the time by which [`contact_wrench`](Self::contact_wrench) lags the last sample, s:
    /// some samples for the differentiation, and the delay of the low-pass, 28 ms at a cutoff of 10
    /// Hz. `None` before the first instant.
    #[must_use]
    pub fn contact_latency_s(&self) -> Option<f64> {
        Some(self.newest_s() - self.contact.time_s()?)
    }

    /// Returns the constant offset of the wrenches with its standard deviations, without
    /// allocation; `None` unless
    /// [`EquationSettings::wrench_offset`](crate::EquationSettings::wrench_offset) makes it an
    /// unknown, and before the first window. It is the sensor's, so that what is known of it
    /// outlives a payload change, and neither a contact nor a payload change moves it.
    #[must_use]
    pub fn wrench_offset(&self) -> Option<WrenchOffset> {
        let estimator = self.update.estimator();
        let estimate = estimator.joint_estimate();
        let frame = self.stream.offset_frame();
        let offsets = estimator.known_offsets()?.mapped(frame.map());
        let std_devs = offsets.std_devs(&estimate.covariance, &estimator.null_space());
        Some(frame.offset(&(offsets.values * self.sign), Some(std_devs)))
    }

    /// Returns the joint covariance of the payload's linear parameters and of the wrench's offset
    /// in the end-effector frame, 16x16: the parameters as in [`covariance`](Self::covariance),
    /// then force, N, and moment, N m; without allocation. `None` where there is no
    /// [offset](Self::wrench_offset), or the noise is not known yet.
    #[must_use]
    pub fn joint_covariance(&self) -> Option<SMatrix<f64, 16, 16>> {
        let estimator = self.update.estimator();
        let offsets = estimator.joint_estimate().offsets?;
        let mut joint = joint_covariance(&estimator.covariance()?, Some(&offsets), self.sign);
        let mut of_payload = joint.fixed_view_mut::<10, 10>(0, 0);
        of_payload += self.update.known().covariance;
        Some(joint)
    }
}
