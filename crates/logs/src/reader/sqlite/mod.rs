//! SQLite bags, the default of rosbag2 up to ROS 2 Humble: a database with a table of topics and
//! one of messages.

mod database;
mod index;
mod reader;
mod rows;

pub(super) use index::index;
