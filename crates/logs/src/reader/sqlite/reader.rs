//! Reading of the messages of an SQLite bag.

use std::{fmt::Write, sync::Arc};

use rusqlite::{Row, types::ValueRef};

use super::{
    database::{Database, Problem},
    rows::{MessageRow, Order, Rows, unexpected},
};
use crate::{
    error::LogError,
    reader::{
        source::Source,
        storage::{Block, Entry, MemoryBudget, SegmentReader, Selected, Stop, Storage},
    },
};

/// An indexed bag.
#[derive(Debug)]
pub(super) struct SqliteStorage {
    pub(super) source: Source,
    pub(super) order: Order,
    /// Largest `rowid` when the bag was opened. Rows that are added later are ignored.
    pub(super) last_row: i64,
    /// Rows of each segment.
    pub(super) ranges: Arc<[Rows]>,
}

impl Storage for SqliteStorage {
    fn open(&self) -> Result<Box<dyn SegmentReader>, LogError> {
        Ok(Box::new(SqliteReader {
            database: Database::open(&self.source)?,
            order: self.order,
            last_row: self.last_row,
            ranges: self.ranges.clone(),
        }))
    }
}

#[derive(Debug)]
struct SqliteReader {
    database: Database,
    order: Order,
    last_row: i64,
    ranges: Arc<[Rows]>,
}

impl SegmentReader for SqliteReader {
    fn read(
        &mut self,
        segment: usize,
        selected: &Selected,
        budget: MemoryBudget,
    ) -> Result<Block, Stop> {
        let Some(&range) = self.ranges.get(segment) else {
            return Ok(Block::default());
        };
        // SQLite has a copy of the message that is added to the block.
        if range.bytes.saturating_mul(2) > budget.remaining {
            return Err(budget.exceeded_error(self.database.path()));
        }
        self.block(range, selected)
            .map_err(|problem| Stop::Error(self.database.error(problem)))
    }
}

impl SqliteReader {
    /// Reads a range of rows. Between two ranges a recorder can write.
    fn block(&self, range: Rows, selected: &Selected) -> Result<Block, Problem> {
        let mut block = Block::default();
        for condition in self.order.within(range) {
            // The plus sign as in `Order::select`.
            let condition = format!("{condition} AND +topic_id IN ({})", listed(selected));
            let columns = "rowid, timestamp, topic_id, data";
            let query = self.order.select(columns, &condition, self.last_row);
            let mut query = self.database.connection.prepare(&query)?;
            let mut rows = query.query([])?;
            while let Some(row) = rows.next()? {
                add(&mut block, row)?;
            }
        }
        Ok(block)
    }
}

/// Adds the message of a row to a block.
fn add(block: &mut Block, row: &Row<'_>) -> Result<(), Problem> {
    let message = MessageRow::of(row)?;
    let value = row.get_ref(3)?;
    let ValueRef::Blob(data) = value else {
        let number = message.key.row;
        return Err(unexpected("messages", number, ("data", value), "bytes"));
    };
    let start = block.bytes.len();
    block.bytes.extend_from_slice(data);
    block.entries.push(Entry {
        channel: message.topic,
        sequence: 0,
        log_time_ns: message.log_time_ns,
        publish_time_ns: message.log_time_ns,
        data: start..block.bytes.len(),
    });
    Ok(())
}

fn listed(selected: &Selected) -> String {
    let mut list = String::new();
    for channel in selected.keys() {
        let separator = if list.is_empty() { "" } else { ", " };
        // Writing to a string cannot fail.
        let _ = write!(list, "{separator}{channel}");
    }
    list
}
