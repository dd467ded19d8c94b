//! The integration tests of this crate, as one program.

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

mod common;

mod cdr;
mod compressed;
mod damage;
mod limits;
mod ranges;
mod reading;
mod sqlite;
mod sqlite_faults;
mod write_faults;
mod writing;
