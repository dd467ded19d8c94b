//! The messages of one topic as a table of numbers.

use std::collections::BTreeMap;
use std::iter::repeat_n;

use pyo3::prelude::*;
use tactid_logs::Message;

use crate::arrays::output;
use crate::errors::LogError;
use crate::samples::Samples;

/// A message as rows of numbers.
pub(crate) trait Rows: Message {
    /// Names and widths of the arrays.
    const ARRAYS: &'static [(&'static str, usize)];

    /// Adds a row to each array, in their order.
    fn put(&self, table: &mut Table);

    /// What distinguishes the publishers of one topic.
    fn publisher(&self) -> &[String] {
        &[]
    }

    /// The frame whose motion the message reports.
    fn child_frame(&self) -> &str {
        ""
    }

    /// The frame in whose axes the numbers are.
    fn frame(&self) -> &str {
        self.header().map_or("", |header| &header.frame_id)
    }
}

/// Rows of one width, one after the other.
pub(crate) struct Rectangle {
    name: &'static str,
    width: usize,
    values: Vec<f64>,
}

impl Rectangle {
    /// Adds a row.
    pub(crate) fn put(&mut self, row: impl IntoIterator<Item = f64>) {
        self.values.extend(row);
    }

    /// Adds a column that no row has had so far.
    fn widen(&mut self, rows: usize) {
        let row = |row: usize| &self.values[row * self.width..(row + 1) * self.width];
        let wider = |k: usize| row(k).iter().copied().chain(repeat_n(f64::NAN, 1));
        self.values = (0..rows).flat_map(wider).collect();
        self.width += 1;
    }
}

/// The rows of one topic that were read so far.
pub(crate) struct Table {
    topic: String,
    type_name: String,
    time_ns: Vec<i64>,
    pub(crate) arrays: Vec<Rectangle>,
    pub(crate) names: Vec<String>,
    /// The joints of the last message, and the column of each.
    pub(crate) last_names: Vec<String>,
    pub(crate) order: Vec<usize>,
    /// The frames of the first message.
    frames: Option<(String, String)>,
    pub(crate) text: Vec<String>,
    /// When each publisher's last message was kept.
    kept_ns: BTreeMap<Vec<String>, i64>,
    pub(crate) damage: Vec<String>,
}

impl Table {
    /// An empty table for the messages of a topic.
    pub(crate) fn new<M: Rows>(topic: &str) -> Self {
        let array = |&(name, width): &(&'static str, usize)| Rectangle {
            name,
            width,
            values: Vec::new(),
        };
        Self {
            topic: topic.to_owned(),
            type_name: M::TYPE.to_owned(),
            time_ns: Vec::new(),
            arrays: M::ARRAYS.iter().map(array).collect(),
            names: Vec::new(),
            last_names: Vec::new(),
            order: Vec::new(),
            frames: None,
            text: Vec::new(),
            kept_ns: BTreeMap::new(),
            damage: Vec::new(),
        }
    }

    /// The column of a joint, a new one where it is named for the first time.
    pub(crate) fn joint(&mut self, name: &str) -> usize {
        let found = self.names.iter().position(|known| known == name);
        found.unwrap_or_else(|| {
            for array in &mut self.arrays {
                array.widen(self.time_ns.len());
            }
            self.names.push(name.to_owned());
            self.names.len() - 1
        })
    }

    /// Whether this message is due; where time goes back, it begins anew.
    fn is_due(&mut self, publisher: &[String], time_ns: i64, every_ns: i64) -> bool {
        if every_ns == 0 {
            return true;
        }
        match self.kept_ns.get_mut(publisher) {
            Some(kept) => {
                let due = time_ns < *kept || time_ns >= kept.saturating_add(every_ns);
                if due {
                    *kept = time_ns;
                }
                due
            }
            None => {
                self.kept_ns.insert(publisher.to_vec(), time_ns);
                true
            }
        }
    }

    /// Adds a message, if it is due.
    pub(crate) fn add<M: Rows>(
        &mut self,
        message: &M,
        log_time_ns: u64,
        every_ns: i64,
    ) -> PyResult<()> {
        let time_ns = match message.stamp().map_or(0, |stamp| stamp.as_ns()) {
            0 => i64::try_from(log_time_ns).unwrap_or(i64::MAX),
            stamp_ns => stamp_ns,
        };
        if !self.is_due(message.publisher(), time_ns, every_ns) {
            return Ok(());
        }
        let given = (message.frame(), message.child_frame());
        let (frame, child) = self
            .frames
            .get_or_insert_with(|| (given.0.to_owned(), given.1.to_owned()));
        if (frame.as_str(), child.as_str()) != given {
            return Err(LogError::new_err(format!(
                "topic {} begins in the frame `{frame}` `{child}` and goes on in `{}` `{}`: \
                 one array cannot hold both",
                self.topic, given.0, given.1
            )));
        }
        message.put(self);
        self.time_ns.push(time_ns);
        Ok(())
    }

    /// Turns the rows into arrays.
    pub(crate) fn into_samples(self, py: Python<'_>) -> PyResult<Samples> {
        let rows = Some(self.time_ns.len());
        let start_ns = self.time_ns.first().copied().unwrap_or(0);
        let seconds = |ns: &i64| ns.saturating_sub(start_ns) as f64 * 1e-9;
        let time = self.time_ns.iter().map(seconds).collect();
        let (frame_id, child_frame_id) = self.frames.unwrap_or_default();
        let mut arrays = BTreeMap::new();
        for array in self.arrays {
            let values = output(py, array.values, rows, &[array.width])?;
            arrays.insert(array.name, values.unbind());
        }
        Ok(Samples {
            topic: self.topic,
            type_name: self.type_name,
            start_ns,
            time: output(py, time, rows, &[])?.unbind(),
            names: self.names,
            frame_id,
            child_frame_id,
            text: self.text,
            damage: self.damage,
            arrays,
        })
    }
}
