//! A given motion of the joints, from the files that a designed motion is written as.

use std::path::{Path, PathBuf};

use tactid_logs::LogReader;
use tactid_logs::messages::JointTrajectory;

use crate::SimError;

/// The file that is read of the folder of a motion.
const FILE_IN_FOLDER: &str = "trajectory.mcap";

/// Largest table that is read, bytes: the longest motion that is designed, an hour, has 0.9 GB for
/// six joints at 1 kHz.
const MAX_BYTES: u64 = 1 << 30;

/// Column of the times, s.
const TIME: &str = "time_s";

/// Prefixes of the columns of a joint's positions and velocities, before its name.
const POSITION: &str = "q_";
const VELOCITY: &str = "qd_";

/// Motion of some joints as a table of positions and velocities over time. Between two rows the
/// position is the cubic with the positions and velocities of both, and after the last row the
/// joints rest.
#[derive(Clone, Debug, PartialEq)]
pub struct JointMotion {
    file: PathBuf,
    joints: Vec<String>,
    /// What a row is called in the file, and the number of the first one.
    first_row: (&'static str, usize),
    /// Times since the first row, s.
    times_s: Vec<f64>,
    /// Positions and velocities of the joints, row by row.
    states: Vec<Vec<(f64, f64)>>,
}

impl JointMotion {
    /// Reads a motion: a log with a message of the type `trajectory_msgs/msg/JointTrajectory`, a
    /// CSV file, or a folder with the log `trajectory.mcap`. A CSV file has the columns `time_s`
    /// (s, increasing), and `q_NAME` (rad or m) and `qd_NAME` (rad/s or m/s) for each joint;
    /// others, and lines that begin with `#`, are ignored.
    ///
    /// # Errors
    /// Returns [`SimError::File`] or [`SimError::Log`] if the file cannot be read, and
    /// [`SimError::Motion`] with the line or the point if it has no motion.
    pub fn read(path: &Path) -> Result<Self, SimError> {
        if path.is_dir() {
            Self::from_log(&path.join(FILE_IN_FOLDER))
        } else if path.extension().is_some_and(|ending| ending == "mcap") {
            Self::from_log(path)
        } else {
            Self::from_csv(path)
        }
    }

    /// Reads the first trajectory of a log.
    fn from_log(file: &Path) -> Result<Self, SimError> {
        let log = LogReader::open(file)?;
        let topics = log.topics_of::<JointTrajectory>();
        let topics: Vec<&str> = topics.map(|topic| topic.name.as_str()).collect();
        let Some(message) = log.messages_on(topics)?.next() else {
            return Err(SimError::Motion {
                path: file.to_owned(),
                what: "there is no trajectory_msgs/msg/JointTrajectory".to_owned(),
            });
        };
        let trajectory: JointTrajectory = message?.decode()?;
        let mut motion = Self::new(file, trajectory.joint_names, ("point", 1));
        for point in trajectory.points {
            let states = point.positions.iter().zip(&point.velocities);
            let states: Vec<_> = states.map(|(&q, &qd)| (q, qd)).collect();
            motion.push(point.time_from_start.as_s(), states)?;
        }
        motion.checked()
    }

    /// Reads a table.
    fn from_csv(file: &Path) -> Result<Self, SimError> {
        let text = tactid_dynamics::read_text_within(file, MAX_BYTES);
        let text = text.map_err(|source| SimError::File {
            path: file.to_owned(),
            source,
        })?;
        let fault = |what| SimError::Motion {
            path: file.to_owned(),
            what,
        };
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .comment(Some(b'#'))
            .from_reader(text.as_bytes());
        let header = reader.headers().map_err(|error| fault(error.to_string()))?;
        let header: Vec<String> = header.iter().map(str::to_owned).collect();
        let (joints, columns) = columns(&header).map_err(fault)?;
        // The header is the first line below the comments at the head.
        let comments = text.lines().take_while(|line| line.starts_with('#'));
        let mut motion = Self::new(file, joints, ("line", 2 + comments.count()));
        for record in reader.records() {
            let record = record.map_err(|error| fault(error.to_string()))?;
            let number = |column: usize| {
                let text = record.get(column).unwrap_or_default();
                let what = || format!("{} is {text:?}, which is no number", header[column]);
                text.parse::<f64>()
                    .map_err(|_| motion.fault(motion.times_s.len(), &what()))
            };
            let time_s = number(columns.time)?;
            let states = columns.joints.iter();
            let states = states.map(|&(q, qd)| Ok((number(q)?, number(qd)?)));
            let states = states.collect::<Result<_, SimError>>()?;
            motion.push(time_s, states)?;
        }
        motion.checked()
    }

    fn new(file: &Path, joints: Vec<String>, first_row: (&'static str, usize)) -> Self {
        Self {
            file: file.to_owned(),
            joints,
            first_row,
            times_s: Vec::new(),
            states: Vec::new(),
        }
    }

    /// Adds a row: a time, s, and the position and velocity of each joint.
    fn push(&mut self, time_s: f64, states: Vec<(f64, f64)>) -> Result<(), SimError> {
        let row = self.times_s.len();
        if states.len() != self.joints.len() {
            return Err(self.fault(row, "the position or the velocity of a joint is missing"));
        }
        let is_finite = states.iter().all(|(q, qd)| q.is_finite() && qd.is_finite());
        if !(time_s.is_finite() && is_finite) {
            return Err(self.fault(row, "a number is not finite"));
        }
        if self.times_s.last().is_some_and(|&last_s| time_s <= last_s) {
            return Err(self.fault(row, "the times do not increase"));
        }
        self.times_s.push(time_s);
        self.states.push(states);
        Ok(())
    }

    /// Returns the motion with the first row at time zero, if it has two rows.
    fn checked(mut self) -> Result<Self, SimError> {
        let &[first_s, _, ..] = &*self.times_s else {
            return Err(self.refused("a motion needs two rows or more"));
        };
        for time_s in &mut self.times_s {
            *time_s -= first_s;
        }
        Ok(self)
    }

    /// Returns the motion of some joints alone, in their order.
    ///
    /// # Errors
    /// Returns [`SimError::Motion`] if one of them has no columns.
    pub(crate) fn of_joints(&self, names: &[&str]) -> Result<Self, SimError> {
        let place = |name: &&str| {
            let place = self.joints.iter().position(|joint| joint == name);
            place.ok_or_else(|| {
                let joints = self.joints.join(", ");
                self.refused(&format!(
                    "the arm has the joint {name}, which the motion lacks; it moves {joints}"
                ))
            })
        };
        let places: Vec<usize> = names.iter().map(place).collect::<Result<_, _>>()?;
        let selected = |row: &Vec<(f64, f64)>| places.iter().map(|&place| row[place]).collect();
        Ok(Self {
            joints: names.iter().map(|&name| name.to_owned()).collect(),
            states: self.states.iter().map(selected).collect(),
            ..self.clone()
        })
    }

    /// Returns the names of the joints, in the order of the positions.
    #[must_use]
    pub fn joint_names(&self) -> &[String] {
        &self.joints
    }

    /// Returns the time from the first row to the last, s.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.times_s.last().copied().unwrap_or_default()
    }

    /// Returns where the motion begins: the positions of all joints, rad or m.
    pub(crate) fn start(&self) -> Vec<f64> {
        self.rows().next().unwrap_or_default()
    }

    /// Returns the positions of all joints, rad or m, row by row.
    pub(crate) fn rows(&self) -> impl Iterator<Item = Vec<f64>> {
        let rows = self.states.iter();
        rows.map(|row| row.iter().map(|state| state.0).collect())
    }

    /// Returns the position of a joint, by its index in [`joint_names`](Self::joint_names), at a
    /// time since the first row, rad or m.
    ///
    /// # Panics
    /// Panics if there is no such joint.
    #[must_use]
    pub fn position(&self, joint: usize, time_s: f64) -> f64 {
        let after = self.times_s.partition_point(|&time| time <= time_s);
        let (Some(before), true) = (after.checked_sub(1), after < self.times_s.len()) else {
            let end = if after == 0 {
                self.states.first()
            } else {
                self.states.last()
            };
            return end.map_or(0.0, |row| row[joint].0);
        };
        let length_s = self.times_s[after] - self.times_s[before];
        let fraction = (time_s - self.times_s[before]) / length_s;
        let ((p0, v0), (p1, v1)) = (self.states[before][joint], self.states[after][joint]);
        // Cubic Hermite interpolation.
        let rest = 1.0 - fraction;
        rest * rest * ((1.0 + 2.0 * fraction) * p0 + fraction * length_s * v0)
            + fraction * fraction * ((1.0 + 2.0 * rest) * p1 - rest * length_s * v1)
    }

    /// Returns the error of a row, by its index.
    pub(crate) fn fault(&self, row: usize, what: &str) -> SimError {
        let (name, first) = self.first_row;
        self.refused(&format!("{name} {}: {what}", first + row))
    }

    /// Returns the error of the whole motion.
    fn refused(&self, what: &str) -> SimError {
        SimError::Motion {
            path: self.file.clone(),
            what: what.to_owned(),
        }
    }
}

/// Indices of columns.
struct Columns {
    time: usize,
    /// Positions and velocities of each joint.
    joints: Vec<(usize, usize)>,
}

/// Finds the columns of the times and of the joints, with the names of the joints.
fn columns(header: &[String]) -> Result<(Vec<String>, Columns), String> {
    let place = |name: &str| header.iter().position(|column| column == name);
    let time = place(TIME).ok_or_else(|| format!("there is no column {TIME}"))?;
    let (mut names, mut joints) = (Vec::new(), Vec::new());
    for (q, column) in header.iter().enumerate() {
        let Some(name) = column.strip_prefix(POSITION) else {
            continue;
        };
        let velocity = format!("{VELOCITY}{name}");
        let qd = place(&velocity)
            .ok_or_else(|| format!("there is a column {column}, but none {velocity}"))?;
        names.push(name.to_owned());
        joints.push((q, qd));
    }
    if names.is_empty() {
        return Err(format!(
            "there is no joint: expected columns {POSITION}NAME and {VELOCITY}NAME"
        ));
    }
    Ok((names, Columns { time, joints }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<JointMotion, SimError> {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("trajectory.csv");
        std::fs::write(&file, text).unwrap();
        JointMotion::read(&file)
    }

    /// A cubic is interpolated exactly, the joints rest before the first and after the last row,
    /// and columns may be in any order.
    #[test]
    fn positions_between_rows_are_cubic() {
        let q = |t: f64| 0.3 - t + 2.0 * t * t - 0.7 * t * t * t;
        let qd = |t: f64| -1.0 + 4.0 * t - 2.1 * t * t;
        let mut text = "qd_b, time_s, qdd_b, q_a, q_b, qd_a\n".to_owned();
        for t in [0.0, 0.5, 0.8, 2.0] {
            text += &format!("{}, {}, 7, 1.5, {}, 0\n", qd(t), t + 10.0, q(t));
        }
        let motion = read(&text).unwrap().of_joints(&["b", "a"]).unwrap();
        assert!((motion.duration_s() - 2.0).abs() < 1e-15);
        for t in [0.0, 0.1, 0.5, 0.6, 1.3, 1.999] {
            assert!((motion.position(0, t) - q(t)).abs() < 1e-14, "{t}");
            assert!((motion.position(1, t) - 1.5).abs() < 1e-15);
        }
        assert!((motion.position(0, -1.0) - q(0.0)).abs() < 1e-14);
        assert!((motion.position(0, 3.0) - q(2.0)).abs() < 1e-14);
    }

    /// Each fault of a file is reported with its line.
    #[test]
    fn faults_name_their_line() {
        for (text, expected) in [
            ("", "trajectory.csv: there is no column time_s"),
            ("t,q_a,qd_a\n0,0,0\n", "there is no column time_s"),
            (
                "time_s,a\n0,0\n1,0\n",
                "there is no joint: expected columns q_NAME",
            ),
            (
                "time_s,q_a\n0,0\n1,0\n",
                "there is a column q_a, but none qd_a",
            ),
            ("time_s,q_a,qd_a\n0,0,0\n", "a motion needs two rows"),
            (
                "time_s,q_a,qd_a\n0,0,0\n0,0,0\n",
                "line 3: the times do not increase",
            ),
            (
                "time_s,q_a,qd_a\n0,0,0\n1,x,0\n",
                "line 3: q_a is \"x\", which is no number",
            ),
            (
                "time_s,q_a,qd_a\n0,0,inf\n1,0,0\n",
                "line 2: a number is not finite",
            ),
            ("time_s,q_a,qd_a\n0,0,0\n1,0\n", "line: 3"),
            (
                "# at 50 %\n# untested\ntime_s,q_a,qd_a\n0,0,0\n1,x,0\n",
                "line 5: q_a is \"x\"",
            ),
        ] {
            let message = read(text).unwrap_err().to_string();
            assert!(message.contains(expected), "{text}: {message}");
        }
    }
}
