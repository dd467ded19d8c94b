//! Events of a log in the order of the times of logging, a batch at a time.

use std::iter::Peekable;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::mpsc::sync_channel;
use std::thread;

use tactid_logs::{LogReader, Messages, RawMessage};

use crate::RecordingError;
use crate::alignment::{Event, Measured};
use crate::clock::LONGEST_STAMP_DELAY_S;
use crate::cut::Cut;
use crate::decode::{Decoder, Decoding};
use crate::recording::Reading;
use crate::sources::times_ns;

/// Number of events that go from the reading to the aligning thread at a time.
const BATCH: usize = 4096;
/// Number of batches that may wait.
const BATCHES: usize = 2;

/// One log, decoded while it is read, with the unloaded recording of the same motion if there is
/// one.
pub(crate) struct Feed {
    messages: Messages,
    decoder: Decoder,
    unloaded: Option<UnloadedFeed>,
    /// Time of the last event that is used, s.
    last_s: f64,
    /// First and last time of logging of what is read, s.
    begin_s: f64,
    end_s: f64,
}

/// An unloaded recording of the same motion, and where it lies on the loaded one's clock.
pub(crate) struct Unloaded {
    pub(crate) log: LogReader,
    pub(crate) topics: Vec<String>,
    pub(crate) decoding: Arc<Decoding>,
    /// Time to add to the unloaded recording's times, s.
    pub(crate) shift_s: f64,
}

/// The unloaded recording, read alongside.
struct UnloadedFeed {
    messages: Peekable<Messages>,
    decoder: Decoder,
    /// Time to add to its times for those of the loaded recording, s.
    shift_s: f64,
    events: Vec<Event>,
}

impl Feed {
    /// Begins to read a part of some topics of a log, alongside an unloaded recording.
    pub(crate) fn new(
        log: &LogReader,
        topics: &[String],
        decoding: &Arc<Decoding>,
        max_gap_s: f64,
        unloaded: Option<&Unloaded>,
        cut: Cut,
    ) -> Result<Self, RecordingError> {
        let (first_ns, last_ns) = times_ns(log, topics);
        let logged_ns = |time_s| decoding.clock().logged_ns(time_s);
        let begin_ns = logged_ns(cut.begin_s - LONGEST_STAMP_DELAY_S).unwrap_or(0);
        let end_ns = logged_ns(cut.end_s + LONGEST_STAMP_DELAY_S).unwrap_or(u64::MAX);
        let (begin_ns, end_ns) = (begin_ns.max(first_ns), end_ns.min(last_ns));
        let unloaded = unloaded.map(|unloaded| UnloadedFeed::new(unloaded, cut.begin_s));
        Ok(Self {
            messages: log.messages_on(topics)?.since(begin_ns),
            decoder: Decoder::new(decoding.clone(), max_gap_s, cut),
            unloaded: unloaded.transpose()?,
            last_s: cut.end_s,
            begin_s: begin_ns as f64 * 1e-9,
            end_s: end_ns as f64 * 1e-9,
        })
    }

    /// Adds the events of the next messages. Returns the fraction that has been read, or `None` at
    /// the end.
    pub(crate) fn read(&mut self, events: &mut Vec<Event>) -> Result<Option<f64>, RecordingError> {
        let before = events.len();
        let enough = before + BATCH;
        let (mut read_s, mut messages) = (None, 0);
        // Messages before the part have no events, but the work can be interrupted there, too.
        while events.len() < enough && (messages < BATCH || events.len() > before) {
            messages += 1;
            let message = self.messages.next().transpose()?;
            let is_used = |message: &RawMessage| {
                let logged_s = self.decoder.log_time_s(message);
                logged_s - LONGEST_STAMP_DELAY_S <= self.last_s
            };
            let Some(message) = message.filter(is_used) else {
                return Ok(self.read_end(before, enough, events).then_some(1.0));
            };
            if let Some(unloaded) = &mut self.unloaded {
                unloaded.read_until(self.decoder.log_time_s(&message), events)?;
            }
            self.decoder.decode(&message, events);
            read_s = Some(message.log_time_ns as f64 * 1e-9);
        }
        let length_s = (self.end_s - self.begin_s).max(1e-9);
        Ok(read_s.map(|now_s| ((now_s - self.begin_s) / length_s).clamp(0.0, 1.0)))
    }

    /// Adds the events of the messages that are held at the end of the log, until these are
    /// `enough`. Returns whether there were any beyond the first `before`.
    fn read_end(&mut self, before: usize, enough: usize, events: &mut Vec<Event>) -> bool {
        if let Some(unloaded) = &mut self.unloaded {
            unloaded.finish(events);
        }
        self.decoder.finish(enough, events);
        events.len() > before
    }

    /// Reads to the end on a thread of its own, while `take` is called on this one with each event,
    /// and `progress` with the fraction that has been read.
    pub(crate) fn run(
        mut self,
        take: &mut dyn FnMut(Event) -> Result<(), RecordingError>,
        progress: &mut dyn FnMut(f64) -> ControlFlow<()>,
    ) -> Result<Reading, RecordingError> {
        let (sender, receiver) = sync_channel::<(Vec<Event>, f64)>(BATCHES);
        thread::scope(|scope| {
            let reading = scope.spawn(move || -> Result<Self, RecordingError> {
                loop {
                    let mut events = Vec::with_capacity(BATCH + 2);
                    let Some(fraction) = self.read(&mut events)? else {
                        return Ok(self);
                    };
                    if sender.send((events, fraction)).is_err() {
                        return Ok(self); // interrupted, or an error on the other side
                    }
                }
            });
            let mut interrupted = false;
            let mut outcome = Ok(());
            for (events, fraction) in receiver {
                interrupted = progress(fraction).is_break();
                if !interrupted {
                    outcome = events.into_iter().try_for_each(&mut *take);
                }
                if interrupted || outcome.is_err() {
                    break;
                }
            }
            match reading.join() {
                Ok(feed) => outcome.and(feed).map(|feed| feed.reading(interrupted)),
                Err(panic) => std::panic::resume_unwind(panic),
            }
        })
    }

    fn reading(&self, interrupted: bool) -> Reading {
        let damage = self.messages.damage().iter();
        Reading {
            faults: self.decoder.faults().clone(),
            findings: self.decoder.unequal_ends(),
            damage: damage.map(ToString::to_string).collect(),
            interrupted,
        }
    }
}

impl UnloadedFeed {
    /// Begins to read before a time of the loaded recording, s.
    fn new(unloaded: &Unloaded, begin_s: f64) -> Result<Self, RecordingError> {
        let messages = unloaded.log.messages_on(&unloaded.topics)?;
        let begin_s = begin_s - unloaded.shift_s - LONGEST_STAMP_DELAY_S;
        let begin_ns = unloaded.decoding.clock().logged_ns(begin_s).unwrap_or(0);
        Ok(Self {
            messages: messages.since(begin_ns).peekable(),
            decoder: Decoder::new(unloaded.decoding.clone(), f64::INFINITY, Cut::WHOLE),
            shift_s: unloaded.shift_s,
            events: Vec::new(),
        })
    }

    /// Adds the events up to a time of the loaded recording.
    fn read_until(&mut self, time_s: f64, events: &mut Vec<Event>) -> Result<(), RecordingError> {
        let (decoder, shift_s) = (&self.decoder, self.shift_s);
        let is_due = |message: &Result<_, _>| match message {
            Ok(message) => decoder.log_time_s(message) + shift_s <= time_s,
            Err(_) => true,
        };
        let mut due = Vec::new();
        while let Some(message) = self.messages.next_if(is_due) {
            due.push(message?);
        }
        for message in due {
            self.decoder.decode(&message, &mut self.events);
        }
        if self.messages.peek().is_none() {
            self.decoder.finish(usize::MAX, &mut self.events);
        }
        self.shift(events);
        Ok(())
    }

    /// Adds the events of the messages that are held at the end of the loaded recording.
    fn finish(&mut self, events: &mut Vec<Event>) {
        self.decoder.finish(usize::MAX, &mut self.events);
        self.shift(events);
    }

    /// Brings events onto the clock of the loaded recording.
    fn shift(&mut self, events: &mut Vec<Event>) {
        for event in self.events.drain(..) {
            if let Measured::Joints(values) = event.measured {
                events.push(Event {
                    time_s: event.time_s + self.shift_s,
                    measured: Measured::Unloaded(values),
                });
            }
        }
    }
}
