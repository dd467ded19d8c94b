//! The estimate and its deferred update, stage by stage.

use tactid_dynamics::InertialParameters;
use tactid_nlms::SettingError;

use super::least_squares::{Assessment, OnlineLeastSquares};
use super::readout::Readout;
use super::stage::Stage;
use crate::equations::{Channels, Equation};
use crate::solve::consistency::ProjectionTracker;
use crate::{KnownBodies, KnownTool};

/// The online estimate with the one machine that updates it: a window is assessed at once, and the
/// [stages](Stage) of its update follow one by one.
///
/// Estimator, projection and report change in this order, so that what is reported is always of one
/// window. After the last stage, each further one refines the projection until it has settled.
#[derive(Clone, Debug)]
pub(crate) struct StagedUpdate {
    estimator: OnlineLeastSquares,
    projection: ProjectionTracker,
    /// The stage that runs next; `None` after the last one.
    stage: Option<Stage>,
    /// Links below the tool that are part of the estimated body, as of the end of the most recent
    /// window.
    gripper: Option<InertialParameters>,
    tool: Option<KnownTool>,
    readout: Readout,
    /// The report of the last estimate that nothing contradicted.
    trusted: Option<Readout>,
    /// The report of the payload before the last change; `None` before a change.
    before_change: Option<Readout>,
}

impl StagedUpdate {
    /// Creates an estimate of nothing.
    ///
    /// # Errors
    /// Returns [`SettingError`] if a setting of the change detectors is out of range.
    pub(crate) fn new(
        channels: &Channels,
        gripper: Option<InertialParameters>,
        tool: Option<KnownTool>,
    ) -> Result<Self, SettingError> {
        let mut update = Self {
            estimator: OnlineLeastSquares::new(channels)?,
            projection: ProjectionTracker::new(),
            stage: Some(Stage::StartProjection),
            gripper,
            tool,
            readout: Readout::unknown(),
            trusted: None,
            before_change: None,
        };
        update.finish();
        Ok(update)
    }

    /// Begins the update by a new window, and returns what the window means.
    pub(crate) fn begin(&mut self, equation: &Equation) -> Assessment {
        // The assessment needs the estimate of the previous window, but not its projection.
        while self.stage.is_some_and(Stage::is_estimation) {
            self.proceed();
        }
        if self.estimator.is_settled() {
            self.trusted = Some(self.readout);
        }
        let assessment = self.estimator.assess(equation);
        self.stage = Some(match assessment {
            Assessment::Accepted(first) => first,
            Assessment::PayloadChanged => {
                self.before_change = self.trusted;
                Stage::Solve
            }
            Assessment::Contradicted | Assessment::PayloadReturned => Stage::Solve,
        });
        assessment
    }

    /// Says that nothing touches the payload: see [`OnlineLeastSquares::confirm_payload`].
    pub(crate) fn confirm_payload(&mut self) -> bool {
        self.estimator.confirm_payload()
    }

    /// Holds the load and forgets the offsets, at once: see [`OnlineLeastSquares::forget_offsets`].
    pub(crate) fn forget_offsets(&mut self) -> Option<bool> {
        self.finish();
        let is_taken_back = self.estimator.forget_offsets()?;
        self.stage = Some(Stage::Solve);
        self.finish();
        Some(is_taken_back)
    }

    /// Sets the links below the tool that are part of the estimated body: their inertial parameters
    /// in the tool frame at the end of the most recent window.
    pub(crate) fn set_gripper(&mut self, gripper: Option<InertialParameters>) {
        self.gripper = gripper;
    }

    /// Runs the next stage.
    pub(crate) fn proceed(&mut self) {
        let Some(stage) = self.stage else {
            self.refine_projection();
            return;
        };
        match stage {
            Stage::AddRows => self.estimator.add_rows(),
            Stage::UpdateSquareRoot => self.estimator.update_square_root(),
            Stage::UpdateNoise => self.estimator.update_noise(),
            Stage::Solve => self.estimator.solve(),
            Stage::ComputeCovariance => self.estimator.compute_covariance(),
            Stage::StartProjection => self.start_projection(),
            Stage::StepProjection => self.projection.step(),
            Stage::Report => self.report(),
        }
        self.stage = stage.next(self.estimator.shows_noise());
    }

    /// Runs all stages that are left.
    pub(crate) fn finish(&mut self) {
        while self.stage.is_some() {
            self.proceed();
        }
    }

    /// The reported estimate.
    pub(crate) fn readout(&self) -> &Readout {
        &self.readout
    }

    /// The report of the payload before the last change; `None` before a change, and where the
    /// payload before it was not known.
    pub(crate) fn before_change(&self) -> Option<&Readout> {
        self.before_change.as_ref()
    }

    /// The estimator.
    pub(crate) fn estimator(&self) -> &OnlineLeastSquares {
        &self.estimator
    }

    /// The known bodies that the estimated load contains besides the payload.
    pub(crate) fn known(&self) -> KnownBodies {
        KnownBodies::new(self.gripper, self.tool)
    }

    /// Sets the estimated payload as the target of the projection.
    fn start_projection(&mut self) {
        let payload = self.estimator.parameters() - self.known().parameters;
        self.projection
            .set_estimate(&payload, &self.estimator.information());
    }

    fn report(&mut self) {
        let known = self.known();
        let has_gripper = self.gripper.is_some();
        self.readout = Readout::of_estimate(&self.estimator, &self.projection, &known, has_gripper);
    }

    /// Takes one more step of the projection, unless it has settled or the estimate is consistent,
    /// and reports the body that it leads to.
    fn refine_projection(&mut self) {
        if self.projection.is_settled() || !self.projection.moves_estimate() {
            return;
        }
        let was_far = self.projection.is_far();
        self.projection.step();
        if was_far && !self.projection.is_far() {
            self.report();
        } else {
            self.readout.set_projection(&self.projection);
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng, rngs::SmallRng};

    use super::*;
    use crate::Identifier;
    use crate::solve::subspace::Vector;

    /// A window with random regressors, and targets of a body of 2 kg with noise.
    fn window(random: &mut SmallRng) -> Equation {
        let body = Vector::from([2.0, 0.2, -0.1, 0.1, 0.5, 0.1, 0.0, 0.6, 0.0, 0.4]);
        let mut equation = Equation::new(6);
        equation.instants = 90;
        for row in &mut equation.rows {
            row.regressor
                .apply(|entry| *entry = random.random_range(-1.0..1.0));
            row.target = row.regressor.dot(&body) + random.random_range(-0.01..0.01);
        }
        equation
    }

    /// The report of a window changes with the last of as many stages as the constant says, all at
    /// once, and is then what `finish` leads to.
    #[test]
    fn the_report_changes_after_the_deferred_stages() {
        let mut random = SmallRng::seed_from_u64(4);
        let mut update = StagedUpdate::new(&Channels::of_wrench(), None, None).unwrap();
        for count in 0..100 {
            let assessment = update.begin(&window(&mut random));
            assert!(matches!(assessment, Assessment::Accepted(_)), "{count}");
            let mut finished = update.clone();
            finished.finish();
            let before = *update.readout();
            let is_initial = count < 40;
            for stage in 1..=Identifier::DEFERRED_STAGES {
                update.proceed();
                let is_last = stage == Identifier::DEFERRED_STAGES;
                let has_changed =
                    update.readout().uncertainty.covariance != before.uncertainty.covariance;
                assert!(is_initial || has_changed == is_last, "{count} {stage}");
            }
            assert!(is_initial || update.stage.is_none());
            let (now, expected) = (update.readout(), finished.readout());
            assert_eq!(now.uncertainty.covariance, expected.uncertainty.covariance);
            assert!(is_initial || now.body == expected.body);
        }
        let mass_kg = update.readout().body.mass_kg;
        assert!((mass_kg - 2.0).abs() < 0.01, "{mass_kg}");
    }
}
