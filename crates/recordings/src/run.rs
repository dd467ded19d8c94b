//! One passage through a recording: events in, equations kept.

use nalgebra::Vector3;
use tactid_dynamics::{JointKind, Manipulator};

use super::decode::Decoder;
use super::faults::FaultCounts;
use super::feed::Feed;
use super::outcome::HistoryPoint;
use super::probe::sample;
use super::records::EquationBatch;
use super::request::Request;
use super::streams::{Aligned, Aligner, Event, Layout};
use crate::{Identifier, IdentifyError, Settings};

/// Between two points of the history of the paper's filter, s.
const HISTORY_STEP_S: f64 = 0.1;
/// The same within the last part of the log, which is looked at closely.
const FINE_STEP_S: f64 = 0.01;
/// How long that last part is, s.
const FINE_SPAN_S: f64 = 10.0;

/// By how much the motions of a loaded and a bare recording may differ, rms of a joint, rad or m.
const SAME_MOTION: f64 = 0.02;

/// How a recording is to be run through.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    pub(crate) robot: Manipulator,
    pub(crate) tool: String,
    pub(crate) sensors: Vec<String>,
    pub(crate) settings: Settings,
    pub(crate) layout: Layout,
    /// Taken off the wrenches' times, s.
    pub(crate) delay_s: f64,
    /// What was estimated, and its standard deviation, s.
    pub(crate) found_delay: Option<(f64, f64)>,
    pub(crate) least_squares: bool,
}

impl Plan {
    pub(crate) fn new(decoder: &Decoder, settings: Settings, request: &Request) -> Self {
        let sources = decoder.sources();
        Self {
            robot: sources.robot.clone(),
            tool: sources.tool.clone(),
            sensors: sources.sensors.clone(),
            layout: Layout {
                felt_gravity: sources
                    .base_imu
                    .as_ref()
                    .map(|_| settings.gravity_for(sources.robot.base_kind())),
                ..decoder.layout()
            },
            delay_s: 0.0,
            found_delay: None,
            least_squares: request.is_least_squares(),
            settings,
        }
    }
}

/// How far a bare recording's joints are from the loaded one's.
#[derive(Clone, Debug)]
struct Mismatch {
    squares: Vec<f64>,
    count: u64,
}

/// The state of running through a recording.
pub(crate) struct Run {
    pub(crate) plan: Plan,
    pub(crate) identifier: Identifier,
    aligner: Aligner,
    pub(crate) records: EquationBatch,
    pub(crate) history: Vec<HistoryPoint>,
    next_point_s: f64,
    first_s: Option<f64>,
    pub(crate) last_s: f64,
    end_s: f64,
    epoch: u32,
    mismatch: Mismatch,
    pub(crate) faults: FaultCounts,
    pub(crate) damage: Vec<String>,
    pub(crate) remarks: Vec<String>,
}

impl Run {
    pub(crate) fn new(plan: Plan) -> Result<Self, IdentifyError> {
        let sensors: Vec<&str> = plan.sensors.iter().map(String::as_str).collect();
        let settings = plan.settings.clone();
        Ok(Self {
            identifier: Identifier::new(&plan.robot, &plan.tool, &sensors, settings)?,
            aligner: Aligner::new(plan.layout.clone(), 0.0, plan.settings.max_gap_s),
            records: EquationBatch::default(),
            history: Vec::new(),
            next_point_s: 0.0,
            first_s: None,
            last_s: 0.0,
            end_s: f64::INFINITY,
            epoch: 0,
            mismatch: Mismatch {
                squares: vec![0.0; plan.robot.dof()],
                count: 0,
            },
            faults: FaultCounts::default(),
            damage: Vec::new(),
            remarks: Vec::new(),
            plan,
        })
    }

    /// How often the recording is presented: least squares over all equations needs no second time.
    pub(crate) fn epochs(&self) -> u32 {
        if self.plan.least_squares {
            1
        } else {
            self.plan.settings.epochs
        }
    }

    /// Before each presentation of the recording.
    pub(crate) fn begin(&mut self, epoch: u32) {
        let plan = &self.plan;
        if epoch > 0 {
            self.end_s = self.last_s;
        }
        self.epoch = epoch;
        self.aligner = Aligner::new(plan.layout.clone(), plan.delay_s, plan.settings.max_gap_s);
        self.identifier.rewind();
        self.records = EquationBatch::default();
        self.first_s = None;
        self.next_point_s = f64::NEG_INFINITY;
    }

    pub(crate) fn take(&mut self, event: Event) -> Result<(), IdentifyError> {
        self.aligner.push(event);
        while let Some(mut aligned) = self.aligner.next() {
            if self.plan.layout.unloaded {
                self.subtract_unloaded(&mut aligned);
            }
            let sample = sample(&aligned);
            if self.plan.least_squares {
                let records = &mut self.records;
                self.identifier
                    .filter(&sample, |_, equation| records.push(equation))?;
            } else {
                self.identifier.push(&sample)?;
            }
            self.first_s.get_or_insert(aligned.time_s);
            self.last_s = aligned.time_s;
            self.record(aligned.time_s);
        }
        Ok(())
    }

    /// After each presentation.
    pub(crate) fn end(&mut self, feed: &Feed) {
        self.faults = feed.decoder.faults.clone();
        self.damage = feed.damage();
        self.remarks = feed.decoder.unequal_ends();
        self.end_streams();
    }

    /// Counts what could not be aligned.
    pub(crate) fn end_streams(&mut self) {
        if self.aligner.incomplete > 0 {
            let kind = "sample of the motion for which another stream has no value, left out";
            self.faults
                .add_many("samples", kind, self.aligner.incomplete, f64::NAN);
        }
    }

    /// From the first sample to the last, s.
    pub(crate) fn duration_s(&self) -> f64 {
        self.first_s.map_or(0.0, |first_s| self.last_s - first_s)
    }

    pub(crate) fn gravity(&self) -> Vector3<f64> {
        self.identifier.gravity()
    }

    /// Takes off what the arm alone exerted at the same point of the same motion.
    fn subtract_unloaded(&mut self, aligned: &mut Aligned) {
        let Some(unloaded) = &aligned.unloaded else { return };
        let pairs = aligned.joints.effort.iter_mut().zip(&unloaded.effort);
        for (effort, unloaded) in pairs {
            *effort -= unloaded;
        }
        self.mismatch.count += 1;
        let positions = aligned.joints.position.iter().zip(&unloaded.position);
        for (square, (loaded, unloaded)) in self.mismatch.squares.iter_mut().zip(positions) {
            *square += (loaded - unloaded).powi(2);
        }
    }

    /// That the bare recording had the same motion.
    ///
    /// # Errors
    /// With the joint that differs most.
    pub(crate) fn check_unloaded(&self) -> Result<(), IdentifyError> {
        let count = self.mismatch.count.max(1) as f64;
        let worst = self
            .mismatch
            .squares
            .iter()
            .enumerate()
            .max_by(|a, b| a.1.total_cmp(b.1));
        match worst {
            Some((joint, square)) if (square / count).sqrt() > SAME_MOTION => {
                Err(IdentifyError::OtherMotion {
                    joint: self.plan.robot.joint_names()[joint].clone(),
                    unit: match self.plan.robot.joint_kind(joint) {
                        Some(JointKind::Prismatic) => "m",
                        Some(JointKind::Revolute) | None => "rad",
                    },
                    rms: (square / count).sqrt(),
                    allowed: SAME_MOTION,
                })
            }
            _ => Ok(()),
        }
    }

    /// A point of the history of the paper's filter.
    fn record(&mut self, time_s: f64) {
        if self.plan.least_squares || time_s < self.next_point_s {
            return;
        }
        let fine = time_s > self.end_s - FINE_SPAN_S;
        self.next_point_s = time_s + if fine { FINE_STEP_S } else { HISTORY_STEP_S };
        self.history.push(HistoryPoint {
            epoch: self.epoch,
            time_s,
            values: self.identifier.latest_values(),
            std_devs: None,
        });
    }

    pub(crate) fn set_end_s(&mut self, end_s: f64) {
        self.end_s = end_s;
    }
}
