//! Reading and writing of ROS 2 logs, as rosbag2 records and plays them. Both storages of rosbag2,
//! MCAP and SQLite, are read, compressed or not; MCAP is written.
//!
//! ```
//! use tactid_logs::{Durability, LogError, LogReader, LogWriter};
//! use tactid_logs::messages::{Header, JointState, Time};
//!
//! # let folder = tempfile::tempdir().unwrap();
//! # let path = folder.path().join("run.mcap");
//! let mut log = LogWriter::create(&path)?;
//! let joints = log.channel::<JointState>("/joint_states", Durability::Volatile)?;
//! for k in 0..100 {
//!     let time_ns = 1_000_000_000 + k * 1_000_000;
//!     let header = Header { stamp: Time::from_ns(time_ns), ..Header::default() };
//!     let state = JointState {
//!         header,
//!         name: vec!["elbow_joint".to_owned()],
//!         position: vec![0.01 * k as f64],
//!         velocity: vec![10.0],
//!         effort: vec![],
//!     };
//!     log.write(&joints, time_ns, &state)?;
//! }
//! log.finish()?;
//!
//! let log = LogReader::open(&path)?;
//! assert_eq!(log.topics()[0].frequency_hz(), Some(1000.0));
//! let mut last = 0.0;
//! for message in log.messages_on(["/joint_states"])? {
//!     last = message?.decode::<JointState>()?.position[0];
//! }
//! assert_eq!(last, 0.99);
//! # Ok::<(), LogError>(())
//! ```
//!
//! [`LogWriter`] writes a log that `ros2 bag play`, Foxglove, PlotJuggler and Rerun can open.
//! [`LogReader`] reads an `.mcap` or `.db3` file or the folder of a bag of any length and returns
//! the messages in the order of their log times.
//!
//! A damaged MCAP log, or the log of a killed writer, is readable up to the damage, which
//! [`LogReader::damage`] and [`Messages::damage`] report. A damaged database is an error: its
//! messages have no order in the file.
//!
//! # Conventions
//!
//! Times are nanoseconds since the epoch of the log's clock. The log time of a message is the time
//! at which it was recorded; the stamp in its header is the time of measurement.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

pub mod cdr;
mod error;
mod merge;
pub mod messages;
mod reader;
mod rosbag2;
mod system_file;
mod writer;

pub use error::LogError;
pub use merge::{Merged, merge_logs};
pub use messages::Message;
pub use reader::{
    DEFAULT_MEMORY_LIMIT, Damage, Definition, LogReader, Messages, Ranges, RawMessage, Topic,
    set_memory_limit,
};
pub use rosbag2::Durability;
pub use writer::{Channel, LogWriter};
