//! Identification from a log, through `tactid-logs` alone.

#![allow(clippy::unwrap_used, clippy::panic)]

mod common;

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use common::{Experiment, Instant, SENSORS, TOOL, URDF, identifier, worst_percent};
use tactid_identify::{Identification, IdentifyError, Request, Settings, identify_log};
use tactid_logs::messages::{
    Header, JointState, Odometry, Quaternion, StringMsg, Time, Wrench, WrenchStamped,
};
use tactid_logs::{Durability, LogWriter};

/// A log of an experiment, with what a test wants to change in it.
struct Recording<'a> {
    instants: &'a [Instant],
    description: Option<&'a str>,
    joint_topics: &'a [&'a str],
    joint_names: Vec<&'a str>,
    odometry: bool,
    sensors: &'a [&'a str],
    velocities: bool,
    stamps: bool,
}

impl<'a> Recording<'a> {
    fn of(instants: &'a [Instant]) -> Self {
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
        }
    }

    fn write(&self, path: &Path) {
        let mut log = LogWriter::create(path).unwrap();
        if let Some(urdf) = self.description {
            let topic = log
                .channel("/robot_description", Durability::TransientLocal)
                .unwrap();
            log.write(
                &topic,
                1,
                &StringMsg {
                    data: urdf.to_owned(),
                },
            )
            .unwrap();
        }
        let joints: Vec<_> = self
            .joint_topics
            .iter()
            .map(|topic| {
                log.channel::<JointState>(topic, Durability::Volatile)
                    .unwrap()
            })
            .collect();
        let odometry = self.odometry.then(|| {
            log.channel::<Odometry>("/base/odom", Durability::Volatile)
                .unwrap()
        });
        let wrenches: Vec<_> = (0..self.sensors.len())
            .map(|k| {
                log.channel::<WrenchStamped>(&format!("/finger_{k}/wrench"), Durability::Volatile)
                    .unwrap()
            })
            .collect();
        for instant in self.instants {
            // An epoch of today's clocks: seconds in an f64 would lose a quarter of a microsecond.
            let time_ns = 1_800_000_000_000_000_000 + (instant.time_s * 1e9).round() as u64;
            let stamp = if self.stamps {
                Time::from_ns(time_ns)
            } else {
                Time::default()
            };
            let header = |frame_id: &str| Header {
                stamp,
                frame_id: frame_id.to_owned(),
            };
            for topic in &joints {
                // Turned round: order is by name.
                let reversed = |values: &[f64]| values.iter().rev().copied().collect::<Vec<_>>();
                let message = JointState {
                    header: header(""),
                    name: self
                        .joint_names
                        .iter()
                        .rev()
                        .map(|&name| name.to_owned())
                        .collect(),
                    position: reversed(&instant.position[..self.joint_names.len()]),
                    velocity: if self.velocities {
                        reversed(&instant.velocity[..self.joint_names.len()])
                    } else {
                        vec![]
                    },
                    effort: vec![],
                };
                log.write(topic, time_ns, &message).unwrap();
            }
            if let Some(topic) = &odometry {
                log.write(topic, time_ns, &odometry_message(instant, header("world")))
                    .unwrap();
            }
            for (k, topic) in wrenches.iter().enumerate() {
                let wrench = &instant.wrenches[k];
                let message = WrenchStamped {
                    header: header(self.sensors[k]),
                    wrench: Wrench {
                        force: <[f64; 3]>::from(wrench.force).into(),
                        torque: <[f64; 3]>::from(wrench.moment).into(),
                    },
                };
                log.write(topic, time_ns, &message).unwrap();
            }
        }
        log.finish().unwrap();
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

fn identify(path: &Path, settings: &Settings) -> Result<Identification, IdentifyError> {
    identify_log(path, &request(settings), &mut |_| ControlFlow::Continue(()))
}

/// With the filter of the online identifier and no delay.
fn request(settings: &Settings) -> Request {
    Request {
        settings: settings.clone(),
        method: Some(settings.method),
        tool: Some(TOOL.to_owned()),
        ..Request::paper()
    }
}

fn recorded(change: impl FnOnce(&mut Recording<'_>)) -> (tempfile::TempDir, PathBuf, Vec<Instant>) {
    let instants = Experiment {
        duration_s: 2.0,
        ..Experiment::default()
    }
    .run();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let mut recording = Recording::of(&instants);
    change(&mut recording);
    recording.write(&path);
    (folder, path, instants)
}

/// The log feeds the same identifier: its result is that of the samples pushed by hand, but for the
/// rounding of the base's twist into its own frame and back.
#[test]
fn a_log_gives_what_its_samples_give() {
    let (_folder, path, instants) = recorded(|_| {});
    for settings in [Settings::paper(), Settings::default()] {
        let from_log = identify(&path, &settings).unwrap();
        let mut online = identifier(&Experiment::default(), settings);
        for _ in 0..from_log.settings.epochs {
            online.rewind();
            for instant in &instants {
                online.push(&instant.sample()).unwrap();
            }
        }
        let online = online.estimate();
        assert_eq!(from_log.estimate.intervals, online.intervals);
        for (a, b) in from_log.estimate.values().iter().zip(online.values()) {
            assert!((a - b).abs() < 2e-7 * (1.0 + b.abs()), "{a} {b}");
        }
    }
}

/// The history ends at the end of the log with the latest estimate, and is fine in its last part.
#[test]
fn the_history_tells_the_estimate_over_time() {
    let (_folder, path, _) = recorded(|_| {});
    let result = identify(&path, &Settings::default()).unwrap();
    let last = result.history.last().unwrap();
    assert!((last.time_s - 1.95).abs() < 0.05, "{}", last.time_s);
    assert!((result.duration_s - 2.0).abs() < 1e-9);
    assert_eq!(result.history.len(), 62);
    let std_devs = last.std_devs.unwrap();
    assert!(
        std_devs.iter().all(|std_dev| *std_dev < 0.01),
        "{std_devs:?}"
    );
    assert!((last.values[0] - 100.0).abs() < 0.01);
    assert!(!result.interrupted && result.damage.is_empty());
}

/// Stamps of zero fall back on the log's time.
#[test]
fn log_time_stands_in_for_a_missing_stamp() {
    let (_folder, path, _) = recorded(|recording| recording.stamps = false);
    let result = identify(&path, &Settings::default()).unwrap();
    assert!(worst_percent(&result.estimate.body) < 1e-2);
}

/// A log that was cut is used up to the cut, which is told.
#[test]
fn a_cut_log_is_used_up_to_the_cut() {
    let (_folder, path, _) = recorded(|_| {});
    let bytes = std::fs::read(&path).unwrap();
    std::fs::write(&path, &bytes[..bytes.len() * 2 / 3]).unwrap();
    let result = identify(&path, &Settings::default()).unwrap();
    assert!(
        result.duration_s > 0.2 && result.duration_s < 2.0,
        "{}",
        result.duration_s
    );
    assert_eq!(result.damage.len(), 1);
}

/// The observer can stop the reading; what was learnt until then is returned.
#[test]
fn the_observer_can_stop() {
    let (_folder, path, _) = recorded(|_| {});
    for settings in [Settings::paper(), Settings::default()] {
        let request = request(&settings);
        let mut reports = 0;
        let result = identify_log(&path, &request, &mut |progress| {
            assert!((0.0..=1.0).contains(&progress.fraction));
            reports += u32::from(progress.fraction > 0.0);
            if reports == 2 {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        });
        let result = result.unwrap();
        assert!(result.interrupted && result.estimate.intervals > 0);
        let result = identify_log(&path, &request, &mut |_| ControlFlow::Break(()));
        assert!(matches!(result, Err(IdentifyError::Interrupted)));
    }
}

/// What the log lacks, or has twice, is said by topic and type.
#[test]
fn a_log_that_lacks_something_says_what() {
    type Change = fn(&mut Recording<'_>);
    let cases: [(&str, Change); 7] = [
        ("no robot description: give a URDF with --urdf", |r| {
            r.description = None
        }),
        ("not a URDF", |r| r.description = Some("<robot")),
        (
            "the frame `finger_left_link` of /finger_0/wrench is neither a link nor fixed to one",
            |r| r.joint_topics = &[],
        ),
        (
            "several topics of joint states of the same joints: /a, /b; choose with --joints",
            |r| r.joint_topics = &["/a", "/b"],
        ),
        ("no wrench (type geometry_msgs/msg/WrenchStamped)", |r| {
            r.sensors = &[]
        }),
        ("the frame `thumb` of /finger_1/wrench is neither", |r| {
            r.sensors = &["finger_left_link", "thumb"]
        }),
        (
            "joint `finger_right_joint` of the URDF is not in the log",
            |r| {
                r.joint_names.pop();
            },
        ),
    ];
    for (expected, change) in cases {
        let (_folder, path, _) = recorded(change);
        let error = identify(&path, &Settings::paper()).unwrap_err().to_string();
        assert!(
            error.contains(expected),
            "target `{expected}`, got `{error}`"
        );
    }
    let (_folder, path, _) = recorded(|r| r.odometry = false);
    let settings = Settings {
        method: tactid_identify::Method::JointSensing,
        ..Settings::paper()
    };
    let error = identify(&path, &settings).unwrap_err().to_string();
    assert!(
        error.contains("no motion of the base (type nav_msgs/msg/Odometry)"),
        "{error}"
    );
}

/// A path without a log is an error that names it.
#[test]
fn no_log_no_panic() {
    let error = identify(Path::new("/nonexistent/run.mcap"), &Settings::paper()).unwrap_err();
    assert!(
        error.to_string().contains("/nonexistent/run.mcap"),
        "{error}"
    );
}
