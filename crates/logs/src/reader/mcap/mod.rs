//! MCAP files: chunks of records, of which the summary at the end of the file is the index.

mod chunk;
mod file;
mod index;
mod scan;
mod summary;

pub(super) use index::index;
