//! Arrays whose lengths fit, as a recording.

use std::ops::ControlFlow;

use tactid_dynamics::Manipulator;
use tactid_identify::checks::TwistAxes;

use super::base::{Timeline, base_states};
use super::fields::Arrays;
use super::samples::{SampleReader, Samples};
use super::unloaded::UnloadedSamples;
use crate::alignment::{Event, Streams};
use crate::cut::Cut;
use crate::defaults::{Contents, Motion, Options, check_tip, effort_gains};
use crate::fault::FaultCounts;
use crate::recording::{Reading, Recording, Selection, Sources};
use crate::sources::{SENSOR_FRAME, place_sensor};
use crate::wrench_channels::ChannelAxes;
use crate::{Clock, Observer, RecordingError, Request};

/// Number of samples between two calls of the observer.
const OBSERVE_EVERY: usize = 4096;

/// Arrays whose lengths fit, with what a request asks for.
pub(crate) struct ArrayRecording<'a> {
    samples: Samples<'a>,
    unloaded: Option<UnloadedSamples>,
    sources: Sources,
    cut: Cut,
}

impl<'a> ArrayRecording<'a> {
    /// Checks the lengths of arrays, and that they have what a request asks for.
    pub(crate) fn new(arrays: &Arrays<'a>, request: &Request) -> Result<Self, RecordingError> {
        request.check_arrays()?;
        let mut robot = arrays.resolve_robot(request)?;
        arrays.check_motion(&robot, arrays.has_robot(request))?;
        let timeline = Timeline::new(arrays.time);
        let contents = contents(arrays, arrays.has_robot(request), &timeline);
        let options = Options::resolve(request, &contents);
        check_tip(&robot, &options.tip)?;
        if request.method.is_none() {
            arrays.check_load()?;
        }
        arrays.check_method(options.method(), &robot)?;
        let mut sensors = sensors(arrays, &options.tip);
        arrays.check_wrenches(sensors.len())?;
        if !options.method().uses_wrench() {
            sensors.clear();
        } else if let Some(given) = &request.sensor_frame {
            let (placed, sensor) = place_sensor(&robot, given, &sensors)?;
            (robot, sensors) = (placed, vec![sensor]);
        }
        request.check_counts(&robot, sensors.len())?;
        let samples = samples(arrays, request, &options, &robot, &sensors, &timeline);
        let unloaded = arrays.unloaded.as_ref().map(|unloaded| {
            unloaded.check(&robot)?;
            UnloadedSamples::new(unloaded, &samples, &timeline, &robot, options.method())
        });
        let unloaded = unloaded.transpose()?;
        Ok(Self {
            samples,
            sources: Sources {
                robot,
                streams: Streams {
                    base: true,
                    wrenches: sensors.len(),
                    unloaded: unloaded.is_some(),
                    ..Streams::default()
                },
                wrench_names: vec!["wrench".to_owned(); sensors.len()],
                sensors,
                contents,
                options,
                optional_acceleration: None,
                measured_twist: measured_twist(arrays),
                joints_name: "q".to_owned(),
                names: names(arrays),
                findings: Vec::new(),
                clock: Clock::Given,
                start_ns: 0,
                end_s: timeline.length_s,
            },
            unloaded,
            cut: Cut::of(request),
        })
    }
}

impl ArrayRecording<'_> {
    /// Calls `take` with the events of each sample in turn, and returns the faults.
    ///
    /// # Errors
    /// Returns the first error of `take`.
    pub(crate) fn each_sample(
        &self,
        mut take: impl FnMut(&[Event]) -> Result<(), RecordingError>,
    ) -> Result<FaultCounts, RecordingError> {
        let mut reader = SampleReader::new(&self.samples, f64::INFINITY, self.cut);
        let mut events = Vec::new();
        for k in 0..self.samples.count() {
            events.clear();
            reader.read(k, &mut events);
            take(&events)?;
        }
        Ok(reader.into_faults())
    }
}

impl Recording for ArrayRecording<'_> {
    fn sources(&self) -> &Sources {
        &self.sources
    }

    fn names_joints(&self) -> bool {
        false
    }

    fn measures_poses(&self) -> bool {
        !self.samples.arrays.pose.is_empty()
    }

    fn without_numbers(&self) -> &[[bool; 6]] {
        &self.samples.unmeasured
    }

    fn beginning(&self, _: &mut Observer<'_>) -> Result<Vec<Event>, RecordingError> {
        let mut reader = SampleReader::new(&self.samples, f64::INFINITY, self.cut);
        let mut events = Vec::new();
        for k in 0..self.samples.count() {
            reader.read(k, &mut events);
            if self.cut.has_beginning(&events) {
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
        let count = self.samples.count();
        let mut reader = SampleReader::new(&self.samples, selection.max_gap_s, self.cut);
        let mut events = Vec::new();
        let mut interrupted = false;
        let mut unloaded = 0;
        for k in 0..count {
            if k % OBSERVE_EVERY == 0 && progress(k as f64 / count as f64).is_break() {
                interrupted = true;
                break;
            }
            reader.read(k, &mut events);
            if let (Some(reference), Some(time_s)) = (&self.unloaded, reader.time_s()) {
                unloaded = reference.read_until(time_s, unloaded, &mut events);
            }
            events.drain(..).try_for_each(&mut *take)?;
        }
        let mut faults = reader.into_faults();
        if let Some(reference) = &self.unloaded {
            // The last samples wait for what follows them.
            reference.read_until(f64::INFINITY, unloaded, &mut events);
            events.drain(..).try_for_each(&mut *take)?;
            faults.add_all(&reference.faults);
        }
        Ok(Reading {
            faults,
            findings: Vec::new(),
            damage: Vec::new(),
            interrupted,
        })
    }
}

fn contents(arrays: &Arrays<'_>, has_robot: bool, timeline: &Timeline) -> Contents {
    let period_s = timeline.period_s;
    let has_wrenches = !arrays.wrench.is_empty();
    Contents {
        motion: if has_robot {
            Motion::Joints
        } else {
            Motion::Carried
        },
        has_wrenches,
        has_efforts: !arrays.effort.is_empty(),
        has_unloaded: arrays.unloaded.is_some(),
        sensor_frame: SENSOR_FRAME.to_owned(),
        motion_period_s: period_s,
        acceleration_period_s: period_s.filter(|_| !arrays.acceleration.is_empty()),
        wrench_period_s: period_s.filter(|_| has_wrenches),
    }
}

/// Returns the samples with what it takes to make events of them.
fn samples<'a>(
    arrays: &Arrays<'a>,
    request: &Request,
    options: &Options,
    robot: &Manipulator,
    sensors: &[String],
    timeline: &Timeline,
) -> Samples<'a> {
    let axes = ChannelAxes::new(robot, sensors, &options.tip, &options.equations);
    let unmeasured = |sensor| {
        let wrenches = arrays.wrench.chunks_exact(6);
        let wrenches = wrenches.filter_map(|six| six.try_into().ok());
        axes.without_numbers(wrenches.skip(sensor).step_by(sensors.len()))
    };
    Samples {
        arrays: *arrays,
        order: timeline.order.clone(),
        is_late: timeline.is_late.clone(),
        is_ahead: timeline.is_ahead.clone(),
        bases: base_states(arrays, timeline),
        sensors: sensors.len(),
        unmeasured: (0..sensors.len()).map(unmeasured).collect(),
        wrench_sign: options.wrench_sign,
        joint_names: robot.joint_names().to_vec(),
        effort_gains: effort_gains(request, robot.joint_names()),
        uses_effort: options.method().uses_effort(),
    }
}

/// Returns the links of the wrench sensors.
fn sensors(arrays: &Arrays<'_>, tip: &str) -> Vec<String> {
    match arrays.sensors {
        Some(sensors) => sensors.iter().map(|&name| name.to_owned()).collect(),
        None if arrays.wrench.is_empty() => Vec::new(),
        None => vec![tip.to_owned()],
    }
}

/// Returns the array of the twists, where these are measured besides the pose.
fn measured_twist(arrays: &Arrays<'_>) -> Option<(String, TwistAxes)> {
    let is_measured = !arrays.pose.is_empty() && !arrays.twist.is_empty();
    is_measured.then(|| ("twist".to_owned(), TwistAxes::World))
}

/// Returns the names of the arrays that are aligned.
fn names(arrays: &Arrays<'_>) -> Vec<String> {
    let all = [
        ("q", arrays.q.is_empty()),
        ("wrench", arrays.wrench.is_empty()),
        ("pose", arrays.pose.is_empty()),
    ];
    let given = all.into_iter().filter(|(_, is_empty)| !is_empty);
    given.map(|(name, _)| name.to_owned()).collect()
}
