//! From the samples of arrays to events.

use nalgebra::{Isometry3, Vector3};
use tactid_dynamics::Wrench;
use tactid_identify::BaseState;

use super::ArrayRecording;
use crate::alignment::{Event, JOINT_VELOCITY, JointValues, Measured};
use crate::fault::{FaultCounts, FaultKind, check};

/// Reads the samples of arrays in order. Values that cannot be used are counted under the array's name.
pub(super) struct ArrayReader<'a> {
    recording: &'a ArrayRecording<'a>,
    /// Indices of the robot's joints.
    joints: Vec<usize>,
    /// Longer times between two samples are gaps, s.
    max_gap_s: f64,
    /// Time of the first and the last usable sample, s.
    times_s: Option<(f64, f64)>,
    faults: FaultCounts,
}

impl<'a> ArrayReader<'a> {
    pub(super) fn new(recording: &'a ArrayRecording<'a>, max_gap_s: f64) -> Self {
        Self {
            joints: (0..recording.sources.robot.dof()).collect(),
            recording,
            max_gap_s,
            times_s: None,
            faults: FaultCounts::default(),
        }
    }

    /// Time of the last usable sample since the first one, s.
    pub(super) fn time_s(&self) -> Option<f64> {
        self.times_s.map(|(first_s, last_s)| last_s - first_s)
    }

    pub(super) fn into_faults(self) -> FaultCounts {
        self.faults
    }

    /// Adds the events of a sample, one for each stream, so that a delay between them can be subtracted.
    pub(super) fn read(&mut self, k: usize, events: &mut Vec<Event>) {
        let time_s = match self.check_time(self.recording.arrays.times_s[k]) {
            Ok(time_s) => time_s,
            Err(kind) => {
                let time_s = self.time_s().unwrap_or(f64::NAN);
                self.faults.add("times_s", kind, time_s);
                return;
            }
        };
        let mut add = |name, measured: Result<Measured, FaultKind>| match measured {
            Ok(measured) => events.push(Event { time_s, measured }),
            Err(kind) => self.faults.add(name, kind, time_s),
        };
        let base = &self.recording.bases[k];
        match check_base(base) {
            Ok(()) => add("poses", Ok(Measured::Base(*base))),
            Err((name, kind)) => add(name, Err(kind)),
        }
        let (joints, fault) = self.recording.joints(k, &self.joints);
        if let Some((name, kind)) = fault {
            add(name, Err(kind));
        }
        if let Some(joints) = joints {
            add("joint_position", Ok(Measured::Joints(joints)));
        }
        for sensor in 0..self.recording.sources.streams.wrenches {
            let wrench = self.recording.wrench(k, sensor);
            add(
                "wrenches",
                wrench.map(|wrench| Measured::Wrench(sensor, wrench)),
            );
        }
    }

    /// Returns the time of a sample since the first one, and counts a gap before it.
    fn check_time(&mut self, time_s: f64) -> Result<f64, FaultKind> {
        if !time_s.is_finite() {
            return Err(FaultKind::NotFinite);
        }
        let Some((first_s, last_s)) = self.times_s else {
            self.times_s = Some((time_s, time_s));
            return Ok(0.0);
        };
        if time_s <= last_s {
            return Err(FaultKind::OutOfOrder);
        }
        if time_s - last_s > self.max_gap_s {
            self.faults.add("times_s", FaultKind::Gap, last_s - first_s);
        }
        self.times_s = Some((first_s, time_s));
        Ok(time_s - first_s)
    }
}

impl ArrayRecording<'_> {
    /// Returns the joints of a sample, with the array and the kind of a fault.
    fn joints(
        &self,
        k: usize,
        joints: &[usize],
    ) -> (Option<JointValues>, Option<(&'static str, FaultKind)>) {
        let dof = joints.len();
        let row = |array: &[f64]| -> Vec<f64> {
            let row = array.get(k * dof..(k + 1) * dof);
            row.unwrap_or_default().to_vec()
        };
        let arrays = &self.arrays;
        let values = JointValues {
            position: row(arrays.joint_position),
            velocity: row(arrays.joint_velocity),
            effort: if self.uses_effort {
                row(arrays.joint_effort)
            } else {
                Vec::new()
            },
        };
        let names = self.sources.robot.joint_names();
        match values.check(joints, names, &self.effort_gains) {
            Ok((values, fault)) => (Some(values), fault.map(|kind| (JOINT_VELOCITY, kind))),
            Err(fault) => (None, Some(fault)),
        }
    }

    /// Returns the wrench of a sensor on the payload.
    fn wrench(&self, k: usize, sensor: usize) -> Result<Wrench, FaultKind> {
        let first = 6 * (k * self.sources.streams.wrenches + sensor);
        let six = &self.arrays.wrenches[first..first + 6];
        check(six)?;
        Ok(Wrench {
            force: Vector3::from_column_slice(&six[..3]) * self.wrench_sign,
            moment: Vector3::from_column_slice(&six[3..]) * self.wrench_sign,
        })
    }
}

/// Checks a state of the base. The error has the name of the array.
fn check_base(base: &BaseState) -> Result<(), (&'static str, FaultKind)> {
    let pose = check_pose(&base.pose);
    pose.map_err(|kind| ("poses", kind))?;
    let twist = base.velocity.iter().chain(&base.angular_velocity);
    check(twist).map_err(|kind| ("twists", kind))?;
    let measured = base.acceleration.iter().chain(&base.angular_acceleration);
    let measured = measured.flat_map(|vector| vector.iter());
    check(measured).map_err(|kind| ("accelerations", kind))
}

fn check_pose(pose: &Isometry3<f64>) -> Result<(), FaultKind> {
    let translation = pose.translation.vector.iter();
    check(translation.chain(pose.rotation.coords.iter()))
}

/// Returns whether a pose can be used.
pub(super) fn is_finite(pose: &Isometry3<f64>) -> bool {
    check_pose(pose).is_ok()
}
