//! Identifies from a log whose messages have any numbers, names, frames and times: one error, or a
//! finite result.

use std::ops::ControlFlow;
use std::path::Path;

use arbitrary::Arbitrary;
use tactid_logs::messages::{Header, JointState, StringMsg, Time, Wrench, WrenchStamped};
use tactid_logs::{Durability, LogError, LogWriter};
use tactid_recordings::{Request, identify_log};

use crate::{Number, arm_urdf, estimate::assert_identified, in_folder, numbers, parsed};

#[derive(Arbitrary, Debug)]
struct Input {
    has_robot: bool,
    frame: Name,
    joints: Vec<Name>,
    period_ns: u32,
    /// How often each of the messages repeats, with positions that move on.
    repeats: u8,
    messages: Vec<Measured>,
}

#[derive(Arbitrary, Debug)]
struct Measured {
    /// Time of the message's stamp after its log time, ns.
    later_ns: i32,
    position: Vec<Number>,
    velocity: Vec<Number>,
    effort: Vec<Number>,
    wrench: Option<[Number; 6]>,
}

/// A name: one of the robot's, or any.
#[derive(Arbitrary, Debug)]
enum Name {
    Known(u8),
    Any(String),
}

impl Name {
    fn text(&self) -> String {
        const KNOWN: [&str; 4] = ["turn", "slide", "tool0", "base"];
        match self {
            Self::Known(number) => KNOWN[usize::from(*number) % KNOWN.len()].to_owned(),
            Self::Any(text) => text.clone(),
        }
    }
}

/// Checks one input.
///
/// # Panics
/// Panics if a property does not hold, or if the log cannot be written.
pub fn run(bytes: &[u8]) {
    let Some(input) = parsed::<Input>(bytes) else {
        return;
    };
    in_folder(|folder| check(&input, &folder.join("recording.mcap")));
}

fn check(input: &Input, path: &Path) {
    if write(input, path).is_err() {
        return;
    }
    let mut observer = |_| ControlFlow::Continue(());
    if let Ok(result) = identify_log(path, &Request::default(), &mut observer) {
        assert_identified(&result);
    }
}

/// Writes the log.
fn write(input: &Input, path: &Path) -> Result<(), LogError> {
    let mut log = LogWriter::create(path)?;
    let joints = log.channel::<JointState>("/joint_states", Durability::Volatile)?;
    let wrenches = log.channel::<WrenchStamped>("/wrench", Durability::Volatile)?;
    if input.has_robot {
        let robot = log.channel::<StringMsg>("/robot_description", Durability::TransientLocal)?;
        let data = arm_urdf().to_owned();
        log.write(&robot, 0, &StringMsg { data })?;
    }
    let names: Vec<String> = input.joints.iter().map(Name::text).collect();
    let mut time_ns = 0_u64;
    for measured in &input.messages {
        for repeat in 0..=input.repeats {
            time_ns += u64::from(input.period_ns % 100_000_000);
            let stamp_ns = time_ns.saturating_add_signed(measured.later_ns.into());
            let header = Header {
                stamp: Time::from_ns(stamp_ns),
                frame_id: input.frame.text(),
            };
            log.write(
                &joints,
                time_ns,
                &measured.state(header.clone(), &names, repeat),
            )?;
            if let Some(wrench) = measured.wrench {
                let [x, y, z, a, b, c] = wrench.map(|number| number.0);
                let wrench = Wrench {
                    force: [x, y, z].into(),
                    torque: [a, b, c].into(),
                };
                log.write(&wrenches, time_ns, &WrenchStamped { header, wrench })?;
            }
        }
    }
    log.finish().map(drop)
}

impl Measured {
    fn state(&self, header: Header, names: &[String], repeat: u8) -> JointState {
        let moved = |all: &[Number], by: f64| -> Vec<f64> {
            let moved = |(k, x): (usize, &f64)| x + by * (0.1 * f64::from(repeat) + k as f64).sin();
            numbers(all).iter().enumerate().map(moved).collect()
        };
        JointState {
            header,
            name: names.to_vec(),
            position: moved(&self.position, 0.5),
            velocity: moved(&self.velocity, 0.0),
            effort: moved(&self.effort, 1.0),
        }
    }
}
