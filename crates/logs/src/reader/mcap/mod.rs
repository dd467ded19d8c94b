//! MCAP files: chunks of records, of which the summary at the end of the file is the index.

mod chunk;
mod file;
mod index;
mod record;
mod scan;
mod storage;
mod summary;

pub(super) use storage::index;
