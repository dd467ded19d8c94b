//! Motions of joints as tables of states over time, read from the files of a designed motion.

use std::path::{Path, PathBuf};

use tactid_logs::LogReader;
use tactid_logs::messages::JointTrajectory;

use crate::SimError;
use crate::experiment::read;

/// File of a folder of a motion that is read.
const FILE_IN_FOLDER: &str = "trajectory.mcap";

/// Column of the times in a CSV file, and what the columns of positions and velocities begin with.
const TIME: &str = "time_s";
const POSITION: &str = "q_";
const VELOCITY: &str = "qd_";

/// States of some joints over time.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct JointTable {
    /// Names of the joints.
    pub(crate) names: Vec<String>,
    /// Times since the start in increasing order, s; the first is zero.
    times_s: Vec<f64>,
    /// For each time, a position for each joint, rad or m.
    positions: Vec<Vec<f64>>,
    /// For each time, a velocity for each joint, rad/s or m/s.
    velocities: Vec<Vec<f64>>,
}

impl JointTable {
    /// Reads the folder of a motion, a log with one `trajectory_msgs/msg/JointTrajectory`, or a CSV file.
    ///
    /// # Errors
    /// Returns [`SimError::File`] or [`SimError::Log`] for a file that cannot be read, and [`SimError::Motion`] for one that
    /// has no motion.
    pub(crate) fn read(path: &Path) -> Result<Self, SimError> {
        let path = if path.is_dir() {
            path.join(FILE_IN_FOLDER)
        } else {
            path.to_owned()
        };
        let is_csv = path.extension().is_some_and(|ending| ending == "csv");
        let table = if is_csv {
            Self::from_csv(&read(&path)?)
        } else {
            from_log(&path)?
        };
        table
            .and_then(Self::checked)
            .map_err(|why| motion_error(path, why))
    }

    /// Reads the columns of times, positions and velocities.
    fn from_csv(text: &str) -> Result<Self, String> {
        let mut lines = text.lines();
        let columns: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
        let place = |name: &str| {
            let found = columns.iter().position(|column| *column == name);
            found.ok_or_else(|| format!("there is no column {name}"))
        };
        let time = place(TIME)?;
        let with_prefix = |column: &&str| column.strip_prefix(POSITION).map(str::to_owned);
        let names: Vec<String> = columns.iter().filter_map(with_prefix).collect();
        let places = |prefix: &str| -> Result<Vec<usize>, String> {
            let each = names.iter().map(|name| place(&format!("{prefix}{name}")));
            each.collect()
        };
        let (q, qd) = (places(POSITION)?, places(VELOCITY)?);
        let mut table = Self {
            names,
            times_s: Vec::new(),
            positions: Vec::new(),
            velocities: Vec::new(),
        };
        for (index, line) in lines.enumerate() {
            let numbers: Result<Vec<f64>, _> = line.split(',').map(str::parse).collect();
            let numbers = numbers.unwrap_or_default();
            if numbers.len() != columns.len() {
                let expected = columns.len();
                return Err(format!("line {} has not {expected} numbers", index + 2));
            }
            table.times_s.push(numbers[time]);
            table
                .positions
                .push(q.iter().map(|&k| numbers[k]).collect());
            table
                .velocities
                .push(qd.iter().map(|&k| numbers[k]).collect());
        }
        Ok(table)
    }

    /// Checks that there are two states at least, at increasing times from zero, all of them finite.
    fn checked(self) -> Result<Self, String> {
        let joints = self.names.len();
        if joints == 0 || self.times_s.len() < 2 {
            return Err("it has not two states of a joint".to_owned());
        }
        let is_row = |row: &Vec<f64>| row.len() == joints && row.iter().all(|x| x.is_finite());
        if !self.positions.iter().all(is_row) || !self.velocities.iter().all(is_row) {
            return Err("a state lacks a finite position or velocity of a joint".to_owned());
        }
        let increases = self.times_s.windows(2).all(|pair| pair[0] < pair[1]);
        if self.times_s[0] != 0.0 || !increases {
            return Err("its times do not increase from zero".to_owned());
        }
        Ok(self)
    }

    /// Returns the time of the last state, s.
    pub(crate) fn duration_s(&self) -> f64 {
        self.times_s[self.times_s.len() - 1]
    }

    /// Returns the positions at a time, rad or m: cubic between two states, at rest after the last.
    pub(crate) fn positions_at(&self, time_s: f64) -> Vec<f64> {
        let last = self.times_s.len() - 1;
        let next = self.times_s.partition_point(|&time| time <= time_s);
        if next > last {
            return self.positions[last].clone();
        }
        let now = next.saturating_sub(1);
        let next = now + 1;
        let step_s = self.times_s[next] - self.times_s[now];
        let x = ((time_s - self.times_s[now]) / step_s).clamp(0.0, 1.0);
        // Cubic Hermite polynomials.
        let (x2, x3) = (x * x, x * x * x);
        let of_velocity = [x3 - 2.0 * x2 + x, x3 - x2].map(|weight| weight * step_s);
        let of_end = 3.0 * x2 - 2.0 * x3;
        let position = |joint: usize| {
            let (from, to) = (self.positions[now][joint], self.positions[next][joint]);
            let slopes = [self.velocities[now][joint], self.velocities[next][joint]];
            from + of_end * (to - from) + of_velocity[0] * slopes[0] + of_velocity[1] * slopes[1]
        };
        (0..self.names.len()).map(position).collect()
    }
}

/// Reads the trajectory of a log.
fn from_log(path: &Path) -> Result<Result<JointTable, String>, SimError> {
    let log = LogReader::open(path)?;
    let topics: Vec<&str> = log
        .topics_of::<JointTrajectory>()
        .map(|topic| topic.name.as_str())
        .collect();
    let Some(message) = log.messages_on(topics)?.next() else {
        return Ok(Err(
            "it has no trajectory_msgs/msg/JointTrajectory".to_owned()
        ));
    };
    let trajectory: JointTrajectory = message?.decode()?;
    let mut table = JointTable {
        names: trajectory.joint_names,
        times_s: Vec::new(),
        positions: Vec::new(),
        velocities: Vec::new(),
    };
    for point in trajectory.points {
        table.times_s.push(point.time_from_start.as_s());
        table.positions.push(point.positions);
        table.velocities.push(point.velocities);
    }
    Ok(Ok(table))
}

fn motion_error(path: PathBuf, why: String) -> SimError {
    SimError::Motion { path, why }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cubic motion is interpolated exactly from states that are far apart, and rests after its end.
    #[test]
    fn positions_between_states_are_cubic() {
        let cubic = |t: f64| (t * t * t - t, 3.0 * t * t - 1.0);
        let rows: Vec<String> = (0..3)
            .map(|k| {
                let (q, qd) = cubic(f64::from(k));
                format!("{k},{q},{qd}")
            })
            .collect();
        let text = format!("time_s,q_a,qd_a\n{}\n", rows.join("\n"));
        let table = JointTable::from_csv(&text).unwrap().checked().unwrap();
        for time_s in [0.0, 0.3, 1.0, 1.7, 2.0] {
            assert!((table.positions_at(time_s)[0] - cubic(time_s).0).abs() < 1e-12);
        }
        assert_eq!(table.positions_at(5.0), [6.0]);
        assert_eq!(table.duration_s(), 2.0);
    }

    /// Files without a motion are errors.
    #[test]
    fn tables_without_a_motion_are_errors() {
        for (text, expected) in [
            ("", "there is no column time_s"),
            ("time_s,q_a\n0,1\n", "there is no column qd_a"),
            ("time_s,q_a,qd_a\n0,1,2\n", "it has not two states"),
            ("time_s,q_a,qd_a\n0,1,2\n1,2\n", "line 3 has not 3 numbers"),
            ("time_s,q_a,qd_a\n0,1,2\n0,1,2\n", "do not increase"),
            ("time_s,q_a,qd_a\n0,1,2\n1,nan,2\n", "lacks a finite"),
        ] {
            let error = JointTable::from_csv(text).and_then(JointTable::checked);
            assert!(error.clone().unwrap_err().contains(expected), "{error:?}");
        }
    }
}
