//! The unloaded reference of arrays: checked, and placed on the clock of the loaded arrays.

use std::path::Path;

use tactid_dynamics::Manipulator;

use super::base::Timeline;
use super::fields::UnloadedArrays;
use super::lengths::check_length;
use super::samples::Samples;
use crate::alignment::{Event, JointValues, Measured};
use crate::fault::{FaultCounts, FaultKind};
use crate::unloaded::{Motions, NO_LOAD};
use crate::{Method, RecordingError};

/// Name under which faults of the unloaded reference are counted.
const UNLOADED: &str = "unloaded";

/// The joints of an unloaded reference on the clock of the loaded arrays.
pub(super) struct UnloadedSamples {
    /// Times, s, which increase, with the joints.
    joints: Vec<(f64, JointValues)>,
    pub(super) faults: FaultCounts,
}

impl UnloadedSamples {
    /// Checks an unloaded reference, and finds the shift in time at which it has the same motion as
    /// the loaded samples.
    ///
    /// # Errors
    /// Returns [`RecordingError::Data`] if the method is another than effort or the two share too
    /// little motion, [`RecordingError::Arrays`] if a length does not fit, and
    /// [`RecordingError::Together`] if the reference has the positions and the efforts of the
    /// loaded samples.
    pub(super) fn new(
        unloaded: &UnloadedArrays<'_>,
        loaded: &Samples<'_>,
        timeline: &Timeline,
        robot: &Manipulator,
        method: Method,
    ) -> Result<Self, RecordingError> {
        if method != Method::Effort {
            return Err(RecordingError::unloaded_needs_effort());
        }
        let arrays = loaded.arrays;
        if (unloaded.q, unloaded.effort) == (arrays.q, arrays.effort) {
            let names = ["the arrays", "their unloaded reference"].map(Path::new);
            return Err(RecordingError::same_recording(names, NO_LOAD));
        }
        let mut found = Self {
            joints: Vec::new(),
            faults: FaultCounts::default(),
        };
        let mut theirs = Motions::new(robot);
        for (time_s, values) in found.read(unloaded, loaded) {
            theirs.add(time_s, &values.position);
            found.joints.push((time_s, values));
        }
        let mut ours = Motions::new(robot);
        let places: Vec<usize> = (0..loaded.joint_names.len()).collect();
        let first_s = timeline
            .usable
            .first()
            .map_or(0.0, |&k| loaded.arrays.time[k]);
        for &k in &timeline.usable {
            if let (Some(values), _) = loaded.joints(k, &places) {
                ours.add(loaded.arrays.time[k] - first_s, &values.position);
            }
        }
        let shift_s = ours.shift_s(&theirs)?;
        for (time_s, _) in &mut found.joints {
            *time_s += shift_s;
        }
        Ok(found)
    }

    /// Returns the samples that can be used, with times since the first of them, s.
    fn read(
        &mut self,
        unloaded: &UnloadedArrays<'_>,
        loaded: &Samples<'_>,
    ) -> Vec<(f64, JointValues)> {
        let dof = loaded.joint_names.len();
        let places: Vec<usize> = (0..dof).collect();
        let timeline = Timeline::new(unloaded.time);
        let first_s = timeline.usable.first().map_or(0.0, |&k| unloaded.time[k]);
        let left_out = unloaded.time.len() - timeline.usable.len();
        if left_out > 0 {
            let kind = FaultKind::OutOfOrder;
            self.faults
                .add_many(UNLOADED, kind, left_out as u64, f64::NAN);
        }
        let mut samples = Vec::new();
        for &k in &timeline.usable {
            let row = |array: &[f64]| array[k * dof..(k + 1) * dof].to_vec();
            let values = JointValues {
                position: row(unloaded.q),
                velocity: Vec::new(),
                effort: row(unloaded.effort),
            };
            match values.check(&places, &loaded.joint_names, &loaded.effort_gains) {
                Ok((values, _)) => samples.push((unloaded.time[k] - first_s, values)),
                Err((_, kind)) => self.faults.add(UNLOADED, kind, f64::NAN),
            }
        }
        samples
    }

    /// Adds the events from the index `next` on that are not later than a time, s, and returns the
    /// index of the first later one.
    pub(super) fn read_until(
        &self,
        time_s: f64,
        mut next: usize,
        events: &mut Vec<Event>,
    ) -> usize {
        while let Some((at_s, values)) = self.joints.get(next)
            && *at_s <= time_s
        {
            events.push(Event {
                time_s: *at_s,
                measured: Measured::Unloaded(values.clone()),
            });
            next += 1;
        }
        next
    }
}

impl UnloadedArrays<'_> {
    /// Checks the lengths of the arrays.
    ///
    /// # Errors
    /// Returns [`RecordingError::Arrays`] if a length does not fit the times and the robot.
    pub(super) fn check(&self, robot: &Manipulator) -> Result<(), RecordingError> {
        let factors = [(self.time.len(), "samples"), (robot.dof(), "joints")];
        check_length("unloaded.q", self.q.len(), &factors)?;
        check_length("unloaded.effort", self.effort.len(), &factors)
    }
}
