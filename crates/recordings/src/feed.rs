//! The events of a recording in the order of its log times, a batch at a time.

use std::iter::Peekable;
use std::ops::ControlFlow;
use std::sync::mpsc::sync_channel;
use std::thread;

use tactid_logs::{LogReader, Messages};

use super::decode::Decoder;
use super::streams::{Event, Measured};
use crate::IdentifyError;

/// Events that go from the reading to the computing thread at a time.
const BATCH: usize = 4096;
/// Batches that may wait.
const BATCHES: usize = 8;

/// One log, decoded as it is read; with the bare recording of the same motion, if there is one.
pub(crate) struct Feed {
    messages: Messages,
    pub(crate) decoder: Decoder,
    unloaded: Option<Unloaded>,
    /// Of the log's times, s.
    begin_s: f64,
    end_s: f64,
}

/// The recording without the payload.
struct Unloaded {
    messages: Peekable<Messages>,
    decoder: Decoder,
    /// To be added to its times to have those of the loaded recording, s.
    shift_s: f64,
    events: Vec<Event>,
}

impl Feed {
    pub(crate) fn new(log: &LogReader, decoder: Decoder) -> Result<Self, IdentifyError> {
        let (begin_ns, end_ns) = decoder.sources().times_ns(log);
        Ok(Self {
            messages: log.messages_on(decoder.sources().measured())?,
            decoder,
            unloaded: None,
            begin_s: begin_ns as f64 * 1e-9,
            end_s: end_ns as f64 * 1e-9,
        })
    }

    /// The same with a bare recording.
    pub(crate) fn with_unloaded(
        mut self,
        log: &LogReader,
        decoder: Decoder,
        shift_s: f64,
    ) -> Result<Self, IdentifyError> {
        self.unloaded = Some(Unloaded {
            messages: log.messages_on(decoder.sources().measured())?.peekable(),
            decoder,
            shift_s,
            events: Vec::new(),
        });
        Ok(self)
    }

    /// Adds the events of the next messages; gives the part of the log that has been read, or `None`
    /// at its end.
    pub(crate) fn read(&mut self, events: &mut Vec<Event>) -> Result<Option<f64>, IdentifyError> {
        let enough = events.len() + BATCH;
        let mut read_s = None;
        while events.len() < enough {
            let Some(message) = self.messages.next() else {
                break;
            };
            let message = message?;
            if let Some(unloaded) = &mut self.unloaded {
                unloaded.read_until(self.decoder.log_time_s(&message), events)?;
            }
            self.decoder.decode(&message, events);
            read_s = Some(message.log_time_ns as f64 * 1e-9);
        }
        let length_s = (self.end_s - self.begin_s).max(1e-9);
        Ok(read_s.map(|now_s| ((now_s - self.begin_s) / length_s).clamp(0.0, 1.0)))
    }

    /// Reads to the end on a thread of its own, while `take` is called here with each event, and
    /// `progress` with the part that has been read; whether `progress` stopped it.
    pub(crate) fn run(
        mut self,
        take: &mut dyn FnMut(Event) -> Result<(), IdentifyError>,
        progress: &mut dyn FnMut(f64) -> ControlFlow<()>,
    ) -> Result<(Self, bool), IdentifyError> {
        let (sender, receiver) = sync_channel::<(Vec<Event>, f64)>(BATCHES);
        thread::scope(|scope| {
            let reading = scope.spawn(move || -> Result<Self, IdentifyError> {
                loop {
                    let mut events = Vec::with_capacity(BATCH + 2);
                    let Some(fraction) = self.read(&mut events)? else {
                        return Ok(self);
                    };
                    if sender.send((events, fraction)).is_err() {
                        return Ok(self); // the other side has heard enough
                    }
                }
            });
            let mut interrupted = false;
            let mut outcome = Ok(());
            'batches: for (events, fraction) in receiver {
                if progress(fraction).is_break() {
                    interrupted = true;
                    break;
                }
                for event in events {
                    outcome = take(event);
                    if outcome.is_err() {
                        break 'batches;
                    }
                }
            }
            match reading.join() {
                Ok(feed) => outcome.and(feed).map(|feed| (feed, interrupted)),
                Err(panic) => std::panic::resume_unwind(panic),
            }
        })
    }

    /// Where the log could not be read further.
    pub(crate) fn damage(&self) -> Vec<String> {
        let damage = self.messages.damage().iter();
        damage.map(ToString::to_string).collect()
    }
}

impl Unloaded {
    /// Adds the events up to a time of the loaded recording.
    fn read_until(&mut self, time_s: f64, events: &mut Vec<Event>) -> Result<(), IdentifyError> {
        loop {
            let due = match self.messages.peek() {
                Some(Ok(message)) => self.decoder.log_time_s(message) + self.shift_s <= time_s,
                Some(Err(_)) => true,
                None => false,
            };
            if !due {
                return Ok(());
            }
            let Some(message) = self.messages.next() else {
                return Ok(());
            };
            self.decoder.decode(&message?, &mut self.events);
            events.extend(self.events.drain(..).filter_map(|event| match event.what {
                Measured::Joints(values) => Some(Event {
                    time_s: event.time_s + self.shift_s,
                    what: Measured::Unloaded(values),
                }),
                _ => None,
            }));
        }
    }
}
