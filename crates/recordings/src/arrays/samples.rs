//! From the samples of arrays to events.

use nalgebra::Vector3;
use tactid_dynamics::Wrench;
use tactid_identify::BaseState;

use super::base::{check_base, is_later};
use super::fields::Arrays;
use crate::alignment::{Event, JOINT_VELOCITY, JointValues, Measured};
use crate::cut::Cut;
use crate::fault::{FaultCounts, FaultKind, check};

/// Arrays whose lengths fit, with what it takes to make events of them.
pub(super) struct Samples<'a> {
    pub(super) arrays: Arrays<'a>,
    /// Indices of the samples in the order of their times.
    pub(super) order: Vec<usize>,
    /// Whether each sample was put in order.
    pub(super) is_late: Vec<bool>,
    /// Whether the time of each sample is far ahead of those that follow it.
    pub(super) is_ahead: Vec<bool>,
    /// State of the base at each sample.
    pub(super) bases: Vec<BaseState>,
    /// Number of wrench sensors that are used.
    pub(super) sensors: usize,
    /// Channels of each sensor that have no number in any sample: they are set to zero.
    pub(super) unmeasured: Vec<[bool; 6]>,
    /// 1, or -1 where wrenches act on the sensor.
    pub(super) wrench_sign: f64,
    /// Names of the robot's joints.
    pub(super) joint_names: Vec<String>,
    pub(super) effort_gains: Vec<f64>,
    pub(super) uses_effort: bool,
}

impl Samples<'_> {
    /// Number of samples.
    pub(super) fn count(&self) -> usize {
        self.arrays.time.len()
    }

    /// Returns the joints of a sample, with the array and the kind of a fault.
    pub(super) fn joints(
        &self,
        k: usize,
        joints: &[usize],
    ) -> (Option<JointValues>, Option<(&'static str, FaultKind)>) {
        let dof = joints.len();
        let row = |array: &[f64]| -> Vec<f64> {
            let row = array.get(k * dof..(k + 1) * dof);
            row.unwrap_or_default().to_vec()
        };
        let values = JointValues {
            position: row(self.arrays.q),
            velocity: row(self.arrays.qd),
            effort: if self.uses_effort {
                row(self.arrays.effort)
            } else {
                Vec::new()
            },
        };
        match values.check(joints, &self.joint_names, &self.effort_gains) {
            Ok((values, fault)) => (Some(values), fault.map(|kind| (JOINT_VELOCITY, kind))),
            Err(fault) => (None, Some(fault)),
        }
    }

    /// Returns the wrench of a sensor on the payload.
    fn wrench(&self, k: usize, sensor: usize) -> Result<Wrench, FaultKind> {
        let first = 6 * (k * self.sensors + sensor);
        let six = std::array::from_fn::<f64, 6, _>(|k| match self.unmeasured[sensor][k] {
            true => 0.0,
            false => self.arrays.wrench[first + k],
        });
        check(&six)?;
        Ok(Wrench {
            force: Vector3::from_column_slice(&six[..3]) * self.wrench_sign,
            moment: Vector3::from_column_slice(&six[3..]) * self.wrench_sign,
        })
    }
}

/// Reads samples in order. Values that cannot be used are counted under the name of their array.
pub(super) struct SampleReader<'a> {
    samples: &'a Samples<'a>,
    /// Indices of the robot's joints.
    joints: Vec<usize>,
    /// Longer times between two samples are gaps, s.
    max_gap_s: f64,
    /// The samples that are used.
    cut: Cut,
    /// Times of the first and the last usable sample, s.
    times_s: Option<(f64, f64)>,
    faults: FaultCounts,
}

impl<'a> SampleReader<'a> {
    pub(super) fn new(samples: &'a Samples<'a>, max_gap_s: f64, cut: Cut) -> Self {
        Self {
            joints: (0..samples.joint_names.len()).collect(),
            samples,
            max_gap_s,
            cut,
            times_s: None,
            faults: FaultCounts::within(cut),
        }
    }

    /// Time of the last usable sample since the first one, s.
    pub(super) fn time_s(&self) -> Option<f64> {
        self.times_s.map(|(first_s, last_s)| last_s - first_s)
    }

    pub(super) fn into_faults(self) -> FaultCounts {
        self.faults
    }

    /// Adds the events of the sample at a place in the order of time, one for each stream, so that
    /// a delay between them can be subtracted.
    pub(super) fn read(&mut self, place: usize, events: &mut Vec<Event>) {
        let k = self.samples.order[place];
        let time_s = match self.check_time(k) {
            Ok(time_s) if self.cut.leaves_out(time_s) => return,
            Ok(time_s) => time_s,
            Err(kind) => {
                let time_s = self.time_s().unwrap_or(f64::NAN);
                self.faults.add("time", kind, time_s);
                return;
            }
        };
        if self.samples.is_late[k] {
            self.faults.add("time", FaultKind::PutInOrder, time_s);
        }
        let mut push = |measured| events.push(Event { time_s, measured });
        let base = &self.samples.bases[k];
        match check_base(base) {
            Ok(()) => push(Measured::Base(Box::new(*base))),
            Err((name, kind)) => self.faults.add(name, kind, time_s),
        }
        let (joints, fault) = self.samples.joints(k, &self.joints);
        if let Some((name, kind)) = fault {
            self.faults.add(name, kind, time_s);
        }
        if let Some(joints) = joints {
            push(Measured::Joints(joints));
        }
        for sensor in 0..self.samples.sensors {
            match self.samples.wrench(k, sensor) {
                Ok(wrench) => push(Measured::Wrench(sensor, wrench)),
                Err(kind) => self.faults.add("wrench", kind, time_s),
            }
        }
    }

    /// Returns the time of a sample since the first one, and counts a gap before it.
    fn check_time(&mut self, k: usize) -> Result<f64, FaultKind> {
        let time_s = self.samples.arrays.time[k];
        if !time_s.is_finite() {
            return Err(FaultKind::NotFinite);
        }
        if self.samples.is_ahead[k] {
            return Err(FaultKind::OutOfOrder);
        }
        let Some((first_s, last_s)) = self.times_s else {
            self.times_s = Some((time_s, time_s));
            return Ok(0.0);
        };
        if !is_later(time_s, last_s) {
            return Err(FaultKind::OutOfOrder);
        }
        if time_s - last_s > self.max_gap_s && !self.cut.leaves_out(time_s - first_s) {
            self.faults.add("time", FaultKind::Gap, last_s - first_s);
        }
        self.times_s = Some((first_s, time_s));
        Ok(time_s - first_s)
    }
}
