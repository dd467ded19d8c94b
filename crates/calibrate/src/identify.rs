//! Identification of a payload with a calibration.

use tactid_batch::diagnosis::{
    CONTRADICTION, mass_finding, nearest_consistent, nothing_held, without_repetition,
};
use tactid_batch::solve::information;
use tactid_batch::{
    BatchResult, BatchSettings, Finding, FitReport, GainErrors, LinearEstimate, MotionEstimate,
    SharedErrors, Table, UnexplainedLoad,
};
use tactid_identify::equations::{Channel, window};
use tactid_identify::solve::value_jacobian;
use tactid_identify::solve::{Matrix, Vector};
use tactid_identify::{
    IdentifyError, KnownBodies, KnownMass, Method, PayloadEstimate, fingerprint,
};

use super::compare::{EffortComparison, compare};
use super::estimate::{ArmChange, CalibratedEstimate};
use super::layout::Group;
use super::model::Calibration;
use super::posterior::{Posterior, posterior};
use super::recording::EffortRecording;
use super::rows::EffortModel;
use super::student::WIDENING;
use super::unloaded::{Update, update};
use crate::CalibrateError;

/// Fewest windows of the loaded recordings: 1 s at 2 Hz.
const MIN_WINDOWS: usize = 6;

/// A load counts as unexplained where the residual of a joint is five times the noise of the
/// calibration, and a tenth of its effort. Smaller residuals come from friction at a few reversals
/// that the calibration did not see; intervals grow with them.
const UNEXPLAINED: f64 = 5.0 * 5.0;
const UNEXPLAINED_FRACTION: f64 = 0.1;

/// Log odds from which on the arm counts as changed: a change is 150 times as probable as none.
const CHANGED_EVIDENCE: f64 = 5.0;

impl Calibration {
    /// Identifies the payload that the arm holds in all of the `loaded` recordings, together with
    /// the arm. `unloaded` are recordings of the same day without payload, which update the
    /// calibration first; there may be none. Friction and, where they were uncertain, gains may
    /// have changed since the calibration, by as much as the recordings show. A small change of the
    /// gains is hidden by the payload unless there is an unloaded recording: on simulated arms, one
    /// of 1 % changes the mass by up to 5 %, by more than its interval.
    ///
    /// Unloaded recordings that do not fit, as of another robot or a colder day, are left out.
    ///
    /// The field `delay` of the settings is ignored. Cost: eight passes over all windows, eight
    /// more with a known mass, and up to sixteen more where unloaded recordings may hold a payload
    /// or do not fit.
    ///
    /// # Errors
    /// Returns [`IdentifyError::TooLittle`] if the loaded recordings have fewer than six windows,
    /// [`CalibrateError::Robot`] if a recording is of another robot or has another cutoff or
    /// gravity, [`CalibrateError::Data`] if the efforts of a joint are constant while it moves or
    /// have the opposite sign of the efforts that calibrated the arm, or if numbers are too large
    /// to be solved for, [`CalibrateError::Field`] for data that do not fit together, the errors of
    /// [`BatchSettings::check`], and [`CalibrateError::UnloadedHolds`] if the unloaded recordings
    /// show a payload.
    pub fn identify(
        &self,
        loaded: &[EffortRecording],
        unloaded: &[EffortRecording],
        settings: &BatchSettings,
    ) -> Result<CalibratedEstimate, CalibrateError> {
        settings.check()?;
        self.check_data()?;
        for recording in loaded.iter().chain(unloaded) {
            self.check_recording(recording)?;
        }
        let windows = loaded.iter().map(EffortRecording::windows).sum();
        if windows < MIN_WINDOWS {
            let window_s = window::length_s(self.cutoff_hz);
            return Err(IdentifyError::too_few_windows(windows, window_s).into());
        }
        let (model, prior) = self.model()?;
        for (recordings, may_hold) in [(loaded, true), (unloaded, false)] {
            for recording in recordings {
                recording.check_signs(&model, &self.parameters, may_hold)?;
            }
        }
        let known = KnownBodies::new(None, settings.known_tool);
        let solve = |recordings, mass| posterior(&model, &prior, &self.noise, recordings, mass);
        let together = solve((loaded, unloaded), None)?;
        let alone = |recordings| solve((recordings, &[]), None);
        let Update {
            free,
            unloaded,
            left_out,
        } = update(together, loaded, unloaded, alone)?;
        let mass_of_load = settings.known_mass.map(|mass| known.mass_of_load(mass));
        let with_mass = match mass_of_load {
            Some(_) => Some(solve((loaded, unloaded), mass_of_load)?),
            None => None,
        };
        let solution = Solution {
            calibrated: self,
            model: &model,
            loaded,
            known,
            mass_of_load,
            settings,
            free: &free,
            best: with_mass.as_ref().unwrap_or(&free),
            source: self.source(),
            day: self.day(unloaded),
        };
        Ok(CalibratedEstimate {
            unloaded_left_out: left_out,
            ..solution.estimate()
        })
    }

    /// Returns a number that identifies this calibration.
    fn source(&self) -> u64 {
        let numbers = self.parameters.iter().chain(&self.precision);
        fingerprint(numbers.map(|number| number.to_bits()))
    }

    /// Returns a number that identifies this calibration, updated by unloaded recordings.
    fn day(&self, unloaded: &[EffortRecording]) -> u64 {
        let each = unloaded.iter().map(EffortRecording::fingerprint);
        fingerprint(each.chain([self.source()]))
    }
}

/// A payload with and without its known mass, and what the result is made of.
struct Solution<'a> {
    calibrated: &'a Calibration,
    model: &'a EffortModel,
    loaded: &'a [EffortRecording],
    /// The known tool.
    known: KnownBodies,
    /// Mass of the whole load, where that of the payload is known.
    mass_of_load: Option<KnownMass>,
    settings: &'a BatchSettings,
    free: &'a Posterior,
    best: &'a Posterior,
    /// Numbers that identify the calibration, and what is known of the arm on the recordings' day.
    source: u64,
    day: u64,
}

impl Solution<'_> {
    /// Returns what the recordings say about the payload without its known mass. All payloads that
    /// are identified with one calibration share its errors. Those with the same unloaded
    /// recordings share the change of the arm and the noise of these recordings, too. Without
    /// unloaded recordings nothing says when the arm changed: the change counts as shared, so that
    /// the number of recordings of one day does not reduce it.
    fn linear(&self) -> LinearEstimate {
        let free = self.free;
        let groups = [
            (self.source, &free.arm_errors.calibration),
            (self.day, &free.arm_errors.change),
            (!self.day, &free.unloaded_errors),
        ];
        let shared = shared_errors(groups, &[]);
        let covariance = free.covariance * (WIDENING * WIDENING);
        let (parameters, of_payload) = self.known.payload(&free.parameters, &covariance, None);
        let scales = free.null_space.scales();
        let widening = nearest_consistent(parameters, &of_payload, scales, None).widening;
        let own = covariance - &shared.changes * shared.changes.transpose();
        LinearEstimate {
            parameters,
            information: information(&covariance, &free.null_space),
            covariance: own * widening.powi(2),
            shared: shared_errors(groups, &self.known.errors().collect::<Vec<_>>()),
            degrees_of_freedom: f64::INFINITY, // the covariance is widened already
        }
    }

    fn estimate(&self) -> CalibratedEstimate {
        let best = self.best;
        let of_load = best.covariance * (WIDENING * WIDENING);
        let (known, mass) = (&self.known, self.mass_of_load);
        let (parameters, covariance) = known.payload(&best.parameters, &of_load, mass);
        let bounding_box = self.settings.bounding_box.as_ref();
        let scales = best.null_space.scales();
        let nearest = nearest_consistent(parameters, &covariance, scales, bounding_box);
        let consistent = nearest.parameters;
        let posterior = tactid_batch::solve::Posterior::of_load(
            (&best.parameters, &of_load, mass),
            known,
            (consistent, nearest.widening),
            &best.null_space,
        );
        let report = posterior.report(&self.loaded[0].arm.tool, &self.settings.prior());
        let noise_fraction = noise_fraction(best, &consistent, &known.covariance);
        let fit = self.fit_report(noise_fraction);
        let of_data = self.data_findings(&fit);
        let of_mass = self.settings.known_mass.and_then(|mass| {
            let found = (
                self.free.parameters[0] - known.mass_kg().0,
                self.mass_std_dev_kg(),
            );
            mass_finding(mass, found, consistent[0], bounding_box.is_some(), &of_data)
        });
        let findings = without_repetition(of_mass, nearest.contradiction, of_data);
        let of_model = self.loaded[0].arm.findings.iter().cloned();
        let of_model = of_model.map(Finding::Model);
        CalibratedEstimate {
            result: BatchResult {
                load: None,
                linear: self.linear(),
                estimate: self.counted(report.estimate),
                principal_moments: report.principal_moments,
                history: Vec::new(),
                fit,
                delay: None,
                findings: findings.into_iter().chain(of_model).collect(),
                forecast: None,
            },
            parameters,
            covariance,
            noise_fraction,
            misfit: best.misfit.clone(),
            friction_change: self.friction_change(),
            gain_change: self.gain_change(),
            // A known mass that is wrong would look like a zero.
            moved_zero: self.free.moved_zero.clone(),
            unloaded_left_out: None,
        }
    }

    /// Returns the standard deviation of the payload's mass without its known mass, kg.
    fn mass_std_dev_kg(&self) -> f64 {
        self.free.mass_std_dev().hypot(self.known.mass_kg().1)
    }

    /// Returns how friction has changed, where the recordings show that it has.
    fn friction_change(&self) -> Option<ArmChange> {
        let log_evidence = self.best.change.friction_evidence;
        let of_joint = |joint: usize| {
            let (mut products, mut squares) = (0.0, 0.0);
            for recording in self.loaded {
                for window in 0..recording.windows() {
                    let columns = recording.columns(window, joint);
                    let friction = |arm| self.model.dry_and_viscous_friction(joint, &columns, arm);
                    let before = friction(&self.calibrated.parameters);
                    products += before * friction(&self.best.changed);
                    squares += before * before;
                }
            }
            if squares > 0.0 {
                products / squares - 1.0
            } else {
                0.0
            }
        };
        (log_evidence > CHANGED_EVIDENCE).then(|| ArmChange {
            by_joint: (0..self.model.layout.joints).map(of_joint).collect(),
            log_evidence,
        })
    }

    /// Returns how gains have changed, where the recordings show that they have.
    fn gain_change(&self) -> Option<ArmChange> {
        let log_evidence = self.best.change.gain_evidence;
        let inverse_gains = self.model.layout.range(Group::InverseGain);
        let of_gain = |k: usize| self.calibrated.parameters[k] / self.best.changed[k] - 1.0;
        (log_evidence > CHANGED_EVIDENCE).then(|| ArmChange {
            by_joint: inverse_gains.map(of_gain).collect(),
            log_evidence,
        })
    }

    /// Returns an estimate with the counts of the loaded recordings.
    fn counted(&self, estimate: PayloadEstimate) -> PayloadEstimate {
        let loaded = self.loaded.iter();
        let windows = loaded.clone().map(EffortRecording::windows);
        PayloadEstimate {
            windows: windows.sum::<usize>() as u64,
            rejected: loaded.clone().map(|recording| recording.rejected).sum(),
            gaps: loaded.map(|recording| recording.gaps).sum(),
            ..estimate
        }
    }

    /// Returns how well arm and payload explain the loaded recordings.
    fn fit_report(&self, noise_fraction: [f64; 10]) -> FitReport {
        let arm = &self.loaded[0].arm;
        let names = arm.joints.iter().zip(&arm.units);
        let channels: Vec<Channel> = names
            .map(|(joint, &unit)| Channel {
                name: format!("effort {joint}"),
                unit,
            })
            .collect();
        let compared = self
            .loaded
            .iter()
            .map(|recording| compare(self.model, recording, &self.best.arm, &self.best.parameters));
        let compared: Vec<EffortComparison> = compared.collect();
        let all = |of: fn(&EffortComparison) -> &Vec<f64>| -> Vec<f64> {
            compared
                .iter()
                .flat_map(|c| of(c).iter().copied())
                .collect()
        };
        let (measured, predicted) = (all(|c| &c.measured), all(|c| &c.calibrated));
        let times_s = all(|c| &c.times_s);
        let count = times_s.len();
        let rms = |joint: usize| {
            let pairs = measured.iter().zip(&predicted).skip(joint);
            let squares = pairs.step_by(channels.len()).map(|(a, b)| (a - b).powi(2));
            (squares.sum::<f64>() / count as f64).sqrt()
        };
        let excitation = &self.best.excitation;
        let table = |values| Table {
            columns: channels.len(),
            values,
        };
        FitReport {
            residual_rms: (0..channels.len()).map(rms).collect(),
            held_out_rms: vec![f64::NAN; channels.len()],
            held_out_plain_rms: vec![f64::NAN; channels.len()],
            noise_fraction,
            weights: vec![1.0; count],
            held_out: vec![false; count],
            excitation: excitation.strengths.clone(),
            excitation_directions: excitation.directions.iter().map(|v| (*v).into()).collect(),
            wrench_offset: None,
            gravity: None,
            subtracted_weight: None,
            motion: MotionEstimate::Smoothed,
            motion_until_s: None,
            stride_s: window::stride_s(arm.cutoff_hz),
            cutoff_hz: arm.cutoff_hz,
            measured: table(measured),
            predicted: table(predicted),
            channels,
            times_s,
        }
    }

    /// Returns findings about the sign of the load and about joints that the model does not
    /// explain, the worst first.
    fn data_findings(&self, fit: &FitReport) -> Vec<Finding> {
        let mut findings = Vec::new();
        let method = Method::Effort;
        let (load_kg, known_kg) = (self.free.parameters[0], self.known.mass_kg().0);
        let least_kg = -CONTRADICTION * self.mass_std_dev_kg();
        if let Some(nothing) = nothing_held(load_kg - known_kg, self.mass_std_dev_kg()) {
            findings.push(nothing);
        } else if load_kg < least_kg {
            findings.push(Finding::NegativeMass {
                method,
                or_gravity: false,
            });
        } else if load_kg - known_kg < least_kg {
            findings.push(Finding::KnownBodiesTooHeavy {
                known_bodies_kg: known_kg,
                load_kg,
            });
        }
        let joints = self.best.misfit.iter().copied().enumerate();
        let unexplained = joints.map(|(joint, misfit)| {
            let loads = fit.measured.rows().map(|row| row[joint]);
            let squares: f64 = loads.map(|x| x * x).sum();
            (joint, misfit, (squares / fit.times_s.len() as f64).sqrt())
        });
        let unexplained = unexplained.filter(|(joint, misfit, load_rms)| {
            let is_large = fit.residual_rms[*joint] > UNEXPLAINED_FRACTION * load_rms;
            is_large && *misfit > UNEXPLAINED
        });
        let mut unexplained: Vec<_> = unexplained.collect();
        unexplained.sort_by(|a, b| b.1.total_cmp(&a.1));
        findings.extend(unexplained.into_iter().map(|(joint, misfit, load_rms)| {
            Finding::LoadUnexplained(UnexplainedLoad {
                joint: Some(self.loaded[0].arm.joints[joint].clone()),
                unit: fit.channels[joint].unit.into(),
                residual_rms: fit.residual_rms[joint],
                load_rms,
                noise_rms: fit.residual_rms[joint] / misfit.sqrt(),
                method,
                has_unloaded: false,
            })
        }));
        findings
    }
}

/// Returns the widened errors of groups of unknowns, each with its source's number, and those of a
/// known tool.
fn shared_errors(groups: [(u64, &GainErrors); 3], of_tool: &[(u64, Vector)]) -> SharedErrors {
    let columns = |(source, changes): (u64, &GainErrors)| {
        let unknowns = (0..changes.ncols() as u64).map(move |k| fingerprint([source, k]));
        let changes = changes.column_iter().map(|change| change * WIDENING);
        unknowns.zip(changes.collect::<Vec<_>>())
    };
    let of_arm = groups.into_iter().flat_map(columns);
    let (unknowns, changes): (_, Vec<_>) = of_arm.chain(of_tool.iter().copied()).unzip();
    SharedErrors {
        unknowns,
        changes: GainErrors::from_columns(&changes),
    }
}

/// Returns the fraction of the variance of each of the ten values that is noise, given the
/// covariance of the known tool; zero where the mass is zero or a value is not determined.
fn noise_fraction(best: &Posterior, parameters: &Vector, of_tool: &Matrix) -> [f64; 10] {
    let Some(jacobian) = value_jacobian(parameters) else {
        return [0.0; 10];
    };
    let variances = |covariance: &Matrix| (jacobian * covariance * jacobian.transpose()).diagonal();
    let (all, noise) = (
        variances(&(best.covariance + of_tool / (WIDENING * WIDENING))),
        variances(&best.noise_covariance),
    );
    std::array::from_fn(|k| {
        if all[k] > 0.0 {
            (noise[k] / all[k]).clamp(0.0, 1.0)
        } else {
            0.0
        }
    })
}
