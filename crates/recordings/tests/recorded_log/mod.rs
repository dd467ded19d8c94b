//! A log of the common experiment, with what a test changes in it.

use std::path::Path;

use tactid_logs::messages::{
    Header, JointState, Odometry, Quaternion, StringMsg, Time, Wrench, WrenchStamped,
};
use tactid_logs::{Durability, LogWriter};

use crate::common::{Instant, SENSORS, URDF};

/// A log of an experiment, with what a test wants to change in it.
pub(crate) struct Recording<'a> {
    pub(crate) instants: &'a [Instant],
    pub(crate) description: Option<&'a str>,
    pub(crate) joint_topics: &'a [&'a str],
    pub(crate) joint_names: Vec<&'a str>,
    pub(crate) odometry: bool,
    pub(crate) sensors: &'a [&'a str],
    pub(crate) velocities: bool,
    pub(crate) stamps: bool,
    /// Time that passes on the clock of logging in a second of the stamps, s.
    pub(crate) logged_rate: f64,
    /// Whether the recorder logs messages in pairs, 50 µs apart.
    pub(crate) in_pairs: bool,
    /// Time of logging of one more joint state at the end, ns.
    pub(crate) logged_late_ns: Option<u64>,
}

impl<'a> Recording<'a> {
    pub(crate) fn of(instants: &'a [Instant]) -> Self {
        Self {
            instants,
            description: Some(URDF),
            joint_topics: &["/joint_states"],
            joint_names: [
                "joint_1",
                "joint_2",
                "joint_3",
                "joint_4",
                "joint_5",
                "joint_6",
                "finger_left_joint",
                "finger_right_joint",
            ]
            .to_vec(),
            odometry: true,
            sensors: &SENSORS,
            velocities: true,
            stamps: true,
            logged_rate: 1.0,
            in_pairs: false,
            logged_late_ns: None,
        }
    }

    /// Writes the log, at an epoch of today's clocks: seconds in an f64 would lose a quarter of a
    /// microsecond.
    pub(crate) fn write(&self, path: &Path) {
        let mut log = LogWriter::create(path).unwrap();
        if let Some(urdf) = self.description {
            let data = urdf.to_owned();
            let latched = Durability::TransientLocal;
            let topic = log.channel("/robot_description", latched).unwrap();
            log.write(&topic, 1, &StringMsg { data }).unwrap();
        }
        let volatile = Durability::Volatile;
        let mut channel = |topic: &&str| log.channel(topic, volatile).unwrap();
        let joints: Vec<_> = self.joint_topics.iter().map(&mut channel).collect();
        let odometry = self
            .odometry
            .then(|| log.channel("/base/odom", volatile).unwrap());
        let wrenches = (0..self.sensors.len()).map(|k| format!("/finger_{k}/wrench"));
        let wrenches: Vec<_> = wrenches
            .map(|topic| log.channel(&topic, volatile).unwrap())
            .collect();
        for (k, instant) in self.instants.iter().enumerate() {
            let at = |instant: &Instant| time_at(instant.time_s);
            let time_ns = at(instant);
            let logged_ns = if self.in_pairs && k % 2 == 0 {
                self.instants.get(k + 1).map_or(time_ns, at) - 50_000
            } else {
                time_at(self.logged_rate * instant.time_s)
            };
            let header = |frame_id: &str| Header {
                stamp: if self.stamps {
                    Time::from_ns(time_ns)
                } else {
                    Time::default()
                },
                frame_id: frame_id.to_owned(),
            };
            for topic in &joints {
                log.write(topic, logged_ns, &self.joint_state(instant, header("")))
                    .unwrap();
            }
            if let Some(topic) = &odometry {
                log.write(
                    topic,
                    logged_ns,
                    &odometry_message(instant, header("world")),
                )
                .unwrap();
            }
            for (k, topic) in wrenches.iter().enumerate() {
                let message = wrench_message(&instant.wrenches[k], header(self.sensors[k]));
                log.write(topic, logged_ns, &message).unwrap();
            }
        }
        if let (Some(late_ns), Some(last)) = (self.logged_late_ns, self.instants.last()) {
            let state = self.joint_state(last, Header::default());
            log.write(&joints[0], late_ns, &state).unwrap();
        }
        log.finish().unwrap();
    }

    /// The joints in reversed order: their order is by name.
    fn joint_state(&self, instant: &Instant, header: Header) -> JointState {
        let count = self.joint_names.len();
        let reversed = |values: &[f64]| values[..count].iter().rev().copied().collect();
        let names = self.joint_names.iter().rev();
        JointState {
            header,
            name: names.map(|&name| name.to_owned()).collect(),
            position: reversed(&instant.position),
            velocity: if self.velocities {
                reversed(&instant.velocity)
            } else {
                vec![]
            },
            effort: vec![],
        }
    }
}

/// Returns the time, ns, of a time since the beginning of the log, s.
fn time_at(time_s: f64) -> u64 {
    1_800_000_000_000_000_000 + (time_s * 1e9).round() as u64
}

fn wrench_message(wrench: &tactid_dynamics::Wrench, header: Header) -> WrenchStamped {
    WrenchStamped {
        header,
        wrench: Wrench {
            force: <[f64; 3]>::from(wrench.force).into(),
            torque: <[f64; 3]>::from(wrench.moment).into(),
        },
    }
}

fn odometry_message(instant: &Instant, header: Header) -> Odometry {
    let base = &instant.base;
    let q = base.pose.rotation.coords;
    let to_child = |v| <[f64; 3]>::from(base.pose.rotation.inverse() * v).into();
    let mut message = Odometry {
        header,
        child_frame_id: "base_link".to_owned(),
        ..Odometry::default()
    };
    message.pose.pose.position = <[f64; 3]>::from(base.pose.translation.vector).into();
    message.pose.pose.orientation = Quaternion {
        x: q.x,
        y: q.y,
        z: q.z,
        w: q.w,
    };
    message.twist.twist.linear = to_child(base.velocity);
    message.twist.twist.angular = to_child(base.angular_velocity);
    message
}
