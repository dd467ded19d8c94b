//! What logs and arrays have in common: a source of events that can be read as often as needed.

use std::ops::ControlFlow;

use tactid_dynamics::Manipulator;
use tactid_identify::checks::TwistAxes;

use crate::alignment::{Event, Streams};
use crate::cut::Cut;
use crate::defaults::{Contents, Options};
use crate::fault::FaultCounts;
use crate::{Clock, Finding, Observer, RecordingError, Request};

/// Length of the beginning of a recording from which its filter and its delay are chosen, s.
const BEGINNING_S: f64 = 30.0;

impl Cut {
    /// Returns the part that a request asks for.
    pub(crate) fn of(request: &Request) -> Self {
        Self {
            begin_s: request.begin_s.unwrap_or(Self::WHOLE.begin_s),
            end_s: request.end_s.unwrap_or(Self::WHOLE.end_s),
        }
    }

    /// Returns whether events in the order of time reach the end of the beginning of the part.
    pub(crate) fn has_beginning(&self, events: &[Event]) -> bool {
        let from_s = self.begin_s.max(0.0);
        events
            .last()
            .is_some_and(|event| event.time_s > from_s + BEGINNING_S)
    }
}

/// What a recording measures, and of which robot.
#[derive(Clone, Debug)]
pub(crate) struct Sources {
    pub(crate) robot: Manipulator,
    /// Frame of each wrench, a frame of the robot.
    pub(crate) sensors: Vec<String>,
    /// Topic or array of each wrench.
    pub(crate) wrench_names: Vec<String>,
    pub(crate) contents: Contents,
    /// All options of the request, with their defaults for these contents.
    pub(crate) options: Options,
    /// All streams of events.
    pub(crate) streams: Streams,
    /// Name of the stream of measured accelerations that need not be used.
    pub(crate) optional_acceleration: Option<String>,
    /// Name of the topic or array that measures a twist besides the pose, and the axes of the twist
    /// there.
    pub(crate) measured_twist: Option<(String, TwistAxes)>,
    /// Topic or array of the joints.
    pub(crate) joints_name: String,
    /// Names of topics or arrays.
    pub(crate) names: Vec<String>,
    pub(crate) findings: Vec<Finding>,
    pub(crate) clock: Clock,
    /// Time zero, ns since the epoch.
    pub(crate) start_ns: i64,
    /// Time of the last event, s; of a log that of its logging.
    pub(crate) end_s: f64,
}

/// Which events of a recording are read.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Selection {
    /// Longer times between two events of a stream are counted as gaps, s.
    pub(crate) max_gap_s: f64,
    /// Whether accelerations are read.
    pub(crate) acceleration: bool,
}

/// What was noticed while a recording was read.
#[derive(Clone, Debug)]
pub(crate) struct Reading {
    pub(crate) faults: FaultCounts,
    pub(crate) findings: Vec<Finding>,
    pub(crate) damage: Vec<String>,
    pub(crate) interrupted: bool,
}

/// A source of events: a log, or arrays.
pub(crate) trait Recording {
    /// Returns what the recording measures.
    fn sources(&self) -> &Sources;

    /// Returns whether the joints have names, not only an order.
    fn names_joints(&self) -> bool;

    /// Returns whether poses of the tool or of the base are recorded.
    fn measures_poses(&self) -> bool;

    /// Returns the channels of each sensor that have no number: they are read as zero.
    fn without_numbers(&self) -> &[[bool; 6]];

    /// Returns the events of at least the first [`BEGINNING_S`].
    fn beginning(&self, observer: &mut Observer<'_>) -> Result<Vec<Event>, RecordingError>;

    /// Reads the events from beginning to end: calls `take` with each, and `progress` with the
    /// fraction that has been read, which may interrupt the reading.
    fn read(
        &self,
        selection: Selection,
        take: &mut dyn FnMut(Event) -> Result<(), RecordingError>,
        progress: &mut dyn FnMut(f64) -> ControlFlow<()>,
    ) -> Result<Reading, RecordingError>;
}
