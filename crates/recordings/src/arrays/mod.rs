//! Recordings in arrays.

mod lengths;
mod reader;

use std::ops::ControlFlow;

use nalgebra::{Isometry3, Vector3};
use tactid_dynamics::Manipulator;
use tactid_identify::{BaseState, states_of_poses};

use crate::alignment::{Event, Streams};
use crate::defaults::{Contents, Motion, Options, effort_gains};
use crate::recording::{BEGINNING_S, Reading, Recording, Selection, Sources};
use crate::sources::SENSOR_FRAME;
use crate::{Clock, Observer, RecordingError, Request};
use reader::{ArrayReader, is_finite};

/// Number of samples between two calls of the observer.
const OBSERVE_EVERY: usize = 4096;

/// A recording in arrays on one clock.
///
/// Matrices are flat, row by row; a row is one of N samples. An array that is empty was not measured.
#[derive(Clone, Copy, Debug, Default)]
pub struct Arrays<'a> {
    /// Robot with n joints; `None` for a sensor that is carried about, whose motion is that of the base.
    pub robot: Option<&'a Manipulator>,
    /// Links of the S wrench sensors. Default (`None`): one sensor in the end-effector frame where there are
    /// wrenches, else none.
    pub sensors: Option<&'a [&'a str]>,
    /// Time of each sample, s: N, increasing.
    pub times_s: &'a [f64],
    /// Joint positions, rad or m: N x n.
    pub joint_position: &'a [f64],
    /// Joint velocities, rad/s or m/s: N x n, or empty to derive them from the positions.
    pub joint_velocity: &'a [f64],
    /// Joint efforts, N m or N, which include those for gravity and payload: N x n, or empty.
    pub joint_effort: &'a [f64],
    /// Force, N, and moment, N m, of each sensor, in its own frame and about that frame's origin: N x S x 6,
    /// or empty.
    pub wrenches: &'a [f64],
    /// `world_from_base`: N poses, one for a base that does not move, or none for the identity.
    pub poses: &'a [Isometry3<f64>],
    /// Velocity of the base frame's origin, m/s, and angular velocity, rad/s, along the axes of the world:
    /// N x 6, or empty to derive them from the poses.
    pub twists: &'a [f64],
    /// Classical acceleration of the base frame's origin without gravity, m/s², and angular acceleration,
    /// rad/s², along the axes of the world: N x 6, or empty to derive them from the velocities.
    pub accelerations: &'a [f64],
}

/// Arrays whose lengths fit, with what a request asks for.
pub(crate) struct ArrayRecording<'a> {
    arrays: Arrays<'a>,
    sources: Sources,
    /// State of the base at each sample.
    bases: Vec<BaseState>,
    uses_effort: bool,
    /// 1, or -1 where wrenches act on the sensor.
    wrench_sign: f64,
    effort_gains: Vec<f64>,
}

impl<'a> ArrayRecording<'a> {
    /// Checks the lengths of arrays, and that they have what a request asks for.
    pub(crate) fn new(arrays: &Arrays<'a>, request: &Request) -> Result<Self, RecordingError> {
        check_request(request)?;
        let robot = match arrays.robot {
            Some(robot) => robot.clone(),
            None => Manipulator::lone_body(SENSOR_FRAME),
        };
        arrays.check_robot(&robot)?;
        let usable = arrays.usable_samples();
        let contents = arrays.contents(&usable);
        let options = Options::resolve(request, &contents);
        arrays.check_method(options.method)?;
        let sensors = arrays.sensors(&options);
        arrays.check_wrenches(sensors.len())?;
        let uses_wrench = options.method.uses_wrench();
        let times_s = usable.iter().map(|&k| arrays.times_s[k]);
        let first_last = times_s.clone().next().zip(times_s.last());
        Ok(Self {
            uses_effort: options.method.uses_effort(),
            wrench_sign: options.wrench_sign,
            effort_gains: effort_gains(request, robot.joint_names())?,
            bases: arrays.bases(&usable),
            sources: Sources {
                robot,
                streams: Streams {
                    base: true,
                    wrenches: if uses_wrench { sensors.len() } else { 0 },
                    ..Streams::default()
                },
                sensors: if uses_wrench { sensors } else { Vec::new() },
                contents,
                optional_acceleration: None,
                names: arrays.names(),
                findings: Vec::new(),
                clock: Clock::Stamps,
                start_ns: 0,
                end_s: first_last.map(|(first_s, last_s)| last_s - first_s),
            },
            arrays: *arrays,
        })
    }
}

impl Recording for ArrayRecording<'_> {
    fn sources(&self) -> &Sources {
        &self.sources
    }

    fn beginning(&self, _: &mut Observer<'_>) -> Result<Vec<Event>, RecordingError> {
        let mut reader = ArrayReader::new(self, f64::INFINITY);
        let mut events = Vec::new();
        for k in 0..self.arrays.times_s.len() {
            reader.read(k, &mut events);
            if reader.time_s().is_some_and(|time_s| time_s > BEGINNING_S) {
                break;
            }
        }
        Ok(events)
    }

    fn read(
        &self,
        selection: Selection,
        take: &mut dyn FnMut(Event) -> Result<(), RecordingError>,
        progress: &mut dyn FnMut(f64) -> ControlFlow<()>,
    ) -> Result<Reading, RecordingError> {
        let count = self.arrays.times_s.len();
        let mut reader = ArrayReader::new(self, selection.max_gap_s);
        let mut events = Vec::new();
        let mut interrupted = false;
        for k in 0..count {
            if k % OBSERVE_EVERY == 0 && progress(k as f64 / count as f64).is_break() {
                interrupted = true;
                break;
            }
            reader.read(k, &mut events);
            events.drain(..).try_for_each(&mut *take)?;
        }
        Ok(Reading {
            faults: reader.into_faults(),
            findings: Vec::new(),
            damage: Vec::new(),
            interrupted,
        })
    }
}

/// Checks that a request asks for nothing that only a log has.
fn check_request(request: &Request) -> Result<(), RecordingError> {
    let topics = &request.topics;
    let given = [
        ("urdf", request.urdf.is_some()),
        ("topics.joints", !topics.joints.is_empty()),
        ("topics.wrenches", !topics.wrenches.is_empty()),
        ("topics.odometry", topics.odometry.is_some()),
        ("topics.acceleration", topics.acceleration.is_some()),
        ("topics.imu", topics.imu.is_some()),
        ("unloaded", request.unloaded.is_some()),
    ];
    match given.into_iter().find(|(_, given)| *given) {
        Some((name, _)) => Err(RecordingError::NotForArrays(name)),
        None => Ok(()),
    }
}

impl Arrays<'_> {
    /// Returns the samples that come later than all usable ones before them.
    fn usable_samples(&self) -> Vec<usize> {
        let mut last_s = f64::NEG_INFINITY;
        let mut usable = Vec::with_capacity(self.times_s.len());
        for (k, &time_s) in self.times_s.iter().enumerate() {
            if time_s.is_finite() && time_s > last_s {
                last_s = time_s;
                usable.push(k);
            }
        }
        usable
    }

    fn contents(&self, usable: &[usize]) -> Contents {
        let ends = usable.first().zip(usable.last());
        let period_s = ends.map(|(&first, &last)| {
            let length_s = self.times_s[last] - self.times_s[first];
            length_s / (usable.len().max(2) - 1) as f64
        });
        let period_s = period_s.filter(|period_s| *period_s > 0.0 && period_s.is_finite());
        let has_wrenches = !self.wrenches.is_empty();
        Contents {
            motion: match self.robot {
                Some(_) => Motion::Joints,
                None => Motion::Carried,
            },
            has_wrenches,
            has_efforts: !self.joint_effort.is_empty(),
            sensor_frame: SENSOR_FRAME.to_owned(),
            motion_period_s: period_s,
            acceleration_period_s: period_s.filter(|_| !self.accelerations.is_empty()),
            wrench_period_s: period_s.filter(|_| has_wrenches),
        }
    }

    /// Returns the links of the wrench sensors.
    fn sensors(&self, options: &Options) -> Vec<String> {
        match self.sensors {
            Some(sensors) => sensors.iter().map(|&name| name.to_owned()).collect(),
            None if self.wrenches.is_empty() => Vec::new(),
            None => vec![options.tip.clone()],
        }
    }

    /// Returns the state of the base at each sample. Where no twists are measured, they follow from the poses
    /// of the samples that can be used.
    fn bases(&self, usable: &[usize]) -> Vec<BaseState> {
        let vector = |values: &[f64], at: usize| Vector3::from_column_slice(&values[at..at + 3]);
        let pose = |k: usize| match self.poses {
            [] => Isometry3::identity(),
            [single] => *single,
            poses => poses[k],
        };
        let mut bases: Vec<BaseState> = (0..self.times_s.len())
            .map(|k| BaseState {
                pose: pose(k),
                ..BaseState::fixed()
            })
            .collect();
        if !self.twists.is_empty() {
            for (base, twist) in bases.iter_mut().zip(self.twists.chunks_exact(6)) {
                base.velocity = vector(twist, 0);
                base.angular_velocity = vector(twist, 3);
            }
        } else if self.poses.len() > 1 {
            let usable = usable.iter().copied();
            let known: Vec<usize> = usable.filter(|&k| is_finite(&self.poses[k])).collect();
            let times_s: Vec<f64> = known.iter().map(|&k| self.times_s[k]).collect();
            let poses: Vec<_> = known.iter().map(|&k| self.poses[k]).collect();
            for (&k, state) in known.iter().zip(states_of_poses(&times_s, &poses)) {
                bases[k] = state;
            }
        }
        let accelerations = self.accelerations.chunks_exact(6);
        for (base, measured) in bases.iter_mut().zip(accelerations) {
            base.acceleration = Some(vector(measured, 0));
            base.angular_acceleration = Some(vector(measured, 3));
        }
        bases
    }

    /// Returns the names of the arrays that are not empty.
    fn names(&self) -> Vec<String> {
        let arrays = [
            ("joint_position", self.joint_position.is_empty()),
            ("wrenches", self.wrenches.is_empty()),
            ("poses", self.poses.is_empty()),
        ];
        let given = arrays.into_iter().filter(|(_, is_empty)| !is_empty);
        given.map(|(name, _)| name.to_owned()).collect()
    }
}
