//! Faults of messages and samples, counted by topic and kind.

use std::collections::BTreeMap;
use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::cut::Cut;

/// Largest value of a quantity in SI units. No quantity of a robot comes near it: a larger value is
/// a fault of a driver or of a file.
const LARGEST: f64 = 1e9;

/// What is wrong with a message or a sample, and what was done about it.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum FaultKind {
    /// A time between two messages of a publisher that is longer than the longest bridged gap. It
    /// is not bridged.
    Gap,
    /// A publisher's clock was set back by more than the longest bridged gap. Its messages are left
    /// out until they are later than the last one used by the length of the set-back, at most 1 s;
    /// the gap is not bridged.
    ClockBack,
    /// A message that is not later than the one before of its publisher, or too late to be put in
    /// order. It is left out.
    OutOfOrder,
    /// A message that comes less than a second after later ones of its publisher. It is put in
    /// order.
    PutInOrder,
    /// A message that cannot be decoded. It is left out.
    Undecodable,
    /// A value that is not finite. The message is left out.
    NotFinite,
    /// A point of a tactile array without a finite position or force. It is left out of the sum.
    PointNotFinite,
    /// A value beyond 1e9 in SI units. The message is left out.
    OutOfRange,
    /// A message that has only some of its publisher's joints. It is left out.
    PartialJoints,
    /// A message whose positions are not as many as its names. It is left out.
    PositionCount,
    /// A velocity that is not finite. The velocities are derived from the positions.
    VelocityNotFinite,
    /// A message without velocities. They are derived from the positions.
    NoVelocity,
    /// A message without efforts. It is left out.
    NoEffort,
    /// An effort of this joint that is not finite. The message is left out.
    EffortNotFinite {
        /// Name of the joint.
        joint: String,
    },
    /// An orientation that is no unit quaternion. The message is left out.
    NotUnitQuaternion,
    /// A message without a stamp among others that have one. The time of logging is used.
    NoStamp,
    /// A stamp far from the time of logging. The message is left out.
    FarStamp,
    /// A sample of the motion at which another stream has no value. It is left out.
    Incomplete,
}

/// A kind of fault on one topic.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DataFault {
    /// Topic of the messages, name of the field of [`Arrays`](crate::Arrays), or `samples` for
    /// samples that could not be aligned.
    pub topic: String,
    /// What is wrong.
    #[serde(flatten)]
    pub kind: FaultKind,
    /// Number of occurrences.
    pub count: u64,
    /// Time of the first occurrence on the recording's clock, s; NaN where it is not known.
    pub first_s: f64,
}

impl FaultKind {
    /// Says how often the fault occurred, and what was done about it.
    fn words(&self, count: u64) -> String {
        let one = count == 1;
        let (was, has) = if one {
            ("was", "has")
        } else {
            ("were", "have")
        };
        let many = |noun: &str| format!("{count} {noun}{}", if one { "" } else { "s" });
        let (message, sample) = (many("message"), many("sample"));
        match self {
            Self::Gap => format!("{} {was} not bridged", many("gap")),
            Self::ClockBack => format!("the clock of the stamps went back {}", many("time")),
            Self::OutOfOrder => format!("{sample} out of order {was} left out"),
            Self::PutInOrder => format!("{sample} out of order {was} put in order"),
            Self::Undecodable => format!("{message} that cannot be decoded {was} left out"),
            Self::NotFinite => format!("{sample} with a value that is not finite {was} left out"),
            Self::PointNotFinite => {
                format!(
                    "{} without finite numbers {was} left out of the sum, which lacks their force",
                    many("point")
                )
            }
            Self::OutOfRange => {
                format!("{sample} with a value out of range (beyond 1e9) {was} left out")
            }
            Self::PartialJoints => {
                format!("{message} with only some of the publisher's joints {was} left out")
            }
            Self::PositionCount => {
                format!("{message} with another number of positions than of names {was} left out")
            }
            Self::VelocityNotFinite => {
                let velocity = if one {
                    "velocity that is"
                } else {
                    "velocities that are"
                };
                format!("{count} {velocity} not finite {was} derived from the positions")
            }
            Self::NoVelocity => {
                format!("{message} {has} no velocities, which were derived from the positions")
            }
            Self::NoEffort => format!("{message} without efforts {was} left out"),
            Self::EffortNotFinite { joint } => {
                format!("{sample} with an effort of {joint} that is not finite {was} left out")
            }
            Self::NotUnitQuaternion => {
                format!("{sample} with an orientation that is no unit quaternion {was} left out")
            }
            Self::NoStamp => format!("{message} {has} no stamp: the time of logging is used"),
            Self::FarStamp => {
                format!("{message} with a stamp far from the time of logging {was} left out")
            }
            Self::Incomplete => {
                format!("{sample} at which another stream has no value {was} left out")
            }
        }
    }
}

/// The topic, how often the fault occurred, what was done about it, and the first time.
impl fmt::Display for DataFault {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.topic != "samples" {
            write!(formatter, "{}: ", self.topic)?;
        }
        formatter.write_str(&self.kind.words(self.count))?;
        if self.first_s.is_finite() {
            let place = if self.count > 1 { "the first at" } else { "at" };
            write!(formatter, ", {place} {:.3} s", self.first_s)?;
        }
        Ok(())
    }
}

/// Counts of faults by topic and kind, in a part of a recording.
#[derive(Clone, Debug, Default)]
pub(crate) struct FaultCounts {
    counts: BTreeMap<(String, FaultKind), (u64, f64)>,
    cut: Cut,
}

impl FaultCounts {
    /// Counts the faults whose times lie in a part of a recording, or are not known.
    pub(crate) fn within(cut: Cut) -> Self {
        Self {
            counts: BTreeMap::new(),
            cut,
        }
    }

    pub(crate) fn add(&mut self, topic: &str, kind: FaultKind, time_s: f64) {
        self.add_many(topic, kind, 1, time_s);
    }

    pub(crate) fn add_many(&mut self, topic: &str, kind: FaultKind, count: u64, first_s: f64) {
        if self.cut.leaves_out(first_s) {
            return;
        }
        let entry = self.counts.entry((topic.to_owned(), kind));
        entry.or_insert((0, first_s)).0 += count;
    }

    /// Adds the counts of others.
    pub(crate) fn add_all(&mut self, others: &Self) {
        for ((topic, kind), &(count, first_s)) in &others.counts {
            self.add_many(topic, kind.clone(), count, first_s);
        }
    }

    /// Returns the counts without the times of first occurrences, for samples that have none.
    pub(crate) fn without_times(mut self) -> Self {
        for (_, first_s) in self.counts.values_mut() {
            *first_s = f64::NAN;
        }
        self
    }

    pub(crate) fn to_vec(&self) -> Vec<DataFault> {
        let entries = self.counts.iter();
        entries
            .map(|((topic, kind), &(count, first_s))| DataFault {
                topic: topic.clone(),
                kind: kind.clone(),
                count,
                first_s,
            })
            .collect()
    }
}

/// Checks that values are finite and in range.
pub(crate) fn check<'a>(values: impl IntoIterator<Item = &'a f64>) -> Result<(), FaultKind> {
    let fault = values.into_iter().find_map(|value| {
        if !value.is_finite() {
            Some(FaultKind::NotFinite)
        } else if value.abs() > LARGEST {
            Some(FaultKind::OutOfRange)
        } else {
            None
        }
    });
    fault.map_or(Ok(()), Err)
}
