//! The wrenches of load and contact, as a controller reads them.

use super::contact::{WrenchEstimate, WrenchFrame};
use super::identifier::Identifier;
use crate::IdentifyError;

impl Identifier {
    /// Says whether the payload stays what it is, as while a gripper is closed. Windows of such a time neither update the
    /// estimate nor show a payload change, and whatever the load does not explain is a
    /// [contact](Self::contact_wrench).
    pub fn hold_payload(&mut self, is_held: bool) {
        self.is_held = is_held;
    }

    /// Returns the frame in which a wrench is to be expressed: about the origin of the link `point`, and along the axes of
    /// the link `axes` or of [`WORLD`](crate::WORLD), or of `point` where they are `None`.
    ///
    /// # Errors
    /// Returns [`IdentifyError::Model`] if the robot does not have a link, and [`IdentifyError::Option`] if `point` moves
    /// relative to the end-effector, or `axes` relative to both the end-effector and the ground.
    pub fn wrench_frame(
        &self,
        point: &str,
        axes: Option<&str>,
    ) -> Result<WrenchFrame, IdentifyError> {
        let tool = self.stream.model().tool();
        WrenchFrame::new(self.stream.robot(), tool, point, axes)
    }

    /// Returns the wrench by which the robot carries and accelerates the load, which is payload and known tool, at the
    /// sensor: what the sensors would measure of it without offset, noise and contact, with the sign of the measured
    /// wrenches. `None` as for [`contact_wrench`](Self::contact_wrench).
    #[must_use]
    pub fn load_wrench(&self, frame: &WrenchFrame) -> Option<WrenchEstimate> {
        self.wrenches(frame).map(|[load, _]| load)
    }

    /// Returns the wrench of a contact: the measured wrench less offset and load, without allocation.
    ///
    /// It has the sign of the measured wrenches, which act on the payload: it is what the payload exerts on what it
    /// touches, and its negative acts on the payload from outside. Measured wrench and motion pass the same causal
    /// low-pass of fourth order with the cutoff [`EquationSettings::cutoff_hz`](crate::EquationSettings::cutoff_hz); [`contact_latency_s`](Self::contact_latency_s)
    /// is its delay.
    ///
    /// What the load does not explain may be a contact or a payload change, and the first samples do not show which. The
    /// load is then held at the last estimate that nothing contradicted, the state is [`ContactState::Changing`], and the
    /// covariance contains the contact itself, so that the interval contains both its value and zero. It remains so until
    /// the load explains the measurements again, or 32 windows determine the new payload.
    /// [`hold_payload`](Self::hold_payload) says that the payload cannot have changed: the uncertainty is then that of
    /// noise and load alone.
    ///
    /// `None` before 32 windows determine the load for the first time, after a gap, and for methods without wrenches.
    #[must_use]
    pub fn contact_wrench(&self, frame: &WrenchFrame) -> Option<WrenchEstimate> {
        self.wrenches(frame).map(|[_, contact]| contact)
    }

    fn wrenches(&self, frame: &WrenchFrame) -> Option<[WrenchEstimate; 2]> {
        let estimator = self.update.estimator();
        self.contact.wrenches(estimator, frame, self.is_held)
    }

    /// Returns the time by which [`contact_wrench`](Self::contact_wrench) lags the last sample, s: some samples for the
    /// differentiation, and the delay of the low-pass, 28 ms at a cutoff of 10 Hz. `None` before the first instant.
    #[must_use]
    pub fn contact_latency_s(&self) -> Option<f64> {
        Some(self.stream.time_s() - self.contact.time_s()?)
    }
}
