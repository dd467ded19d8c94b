//! What was wrong with a recording's messages, counted.

use std::collections::BTreeMap;

/// No quantity of a robot is larger in SI units: an absurd value is a fault of a driver or a file.
const ABSURD: f64 = 1e9;

/// Something wrong with a topic's messages, and what was done about it.
#[derive(Clone, Debug, PartialEq)]
pub struct Dirt {
    /// Where.
    pub topic: String,
    /// What is wrong, in the singular.
    pub what: String,
    /// How often.
    pub count: u64,
    /// When first, s since the start.
    pub first_s: f64,
}

/// Counts by topic and kind.
#[derive(Clone, Debug, Default)]
pub(crate) struct DirtCounts(BTreeMap<(String, String), (u64, f64)>);

impl DirtCounts {
    pub(crate) fn add(&mut self, topic: &str, what: &str, time_s: f64) {
        self.add_many(topic, what, 1, time_s);
    }

    pub(crate) fn add_many(&mut self, topic: &str, what: &str, count: u64, first_s: f64) {
        let entry = self.0.entry((topic.to_owned(), what.to_owned()));
        entry.or_insert((0, first_s)).0 += count;
    }

    pub(crate) fn to_vec(&self) -> Vec<Dirt> {
        let entries = self.0.iter();
        entries
            .map(|((topic, what), &(count, first_s))| Dirt {
                topic: topic.clone(),
                what: what.clone(),
                count,
                first_s,
            })
            .collect()
    }
}

/// What is wrong with a set of numbers, if anything.
pub(crate) fn fault<'a>(values: impl IntoIterator<Item = &'a f64>) -> Option<&'static str> {
    values.into_iter().find_map(|value| {
        if !value.is_finite() {
            Some("message with a value that is not finite, left out")
        } else if value.abs() > ABSURD {
            Some("message with an absurd value (beyond 1e9), left out")
        } else {
            None
        }
    })
}
