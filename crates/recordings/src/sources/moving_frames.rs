//! Frames that only `/tf` has, such as the one in which a controller states its tool: which link
//! carries them.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use tactid_dynamics::{FrameId, FrameMotion, JointMotion, Manipulator, Workspace, motion};
use tactid_logs::RawMessage;
use tactid_logs::messages::{JointState, TFMessage, Time, TransformStamped};

use super::transforms::{Transforms, pose};
use crate::RecordingError;
use crate::angles::Angles;

/// Number of poses of a frame that are compared with the links.
const COMPARED: usize = 400;

/// Most poses that wait for the joints: more come where no joints are recorded.
const MOST_WAITING: usize = 1 << 12;

/// Largest rms change of the pose of a frame in the link that carries it, m and rad: stamps that
/// differ by some milliseconds from those of the joints reach this at 1 m/s and 3 rad/s.
const FIXED: [f64; 2] = [0.005, 0.015];

/// A link whose pose in the frame changes by less than so many times that of the best one could
/// carry it, too.
const DISTINCT: f64 = 3.0;

/// The link that carries a frame.
pub(super) struct MovingFrame {
    pub(super) link: String,
    pub(super) link_from_frame: Isometry3<f64>,
}

/// Returns the link that carries a frame by the transforms that may change, compared with the
/// motion of the joints; `None` where they show none.
pub(super) fn find_moving(
    transforms: &Transforms<'_>,
    robot: &Manipulator,
    frame: &str,
) -> Result<Option<MovingFrame>, RecordingError> {
    if transforms.changing().is_empty() {
        return Ok(None);
    }
    let mut search = Search::new(transforms, robot, frame);
    let topics = [transforms.changing(), transforms.joints()].concat();
    for message in transforms.log().messages_on(topics)? {
        search.push(transforms, &message?);
    }
    Ok(search.carrier())
}

/// A pose of the frame in a link, at a time that the joints have not yet reached.
struct Waiting {
    time_ns: i64,
    link: FrameId,
    link_from_frame: Isometry3<f64>,
    /// Place of the reading of the parent in [`Search::poses`].
    reading: usize,
}

/// Search of the link that carries a frame.
struct Search<'a> {
    robot: &'a Manipulator,
    workspace: Workspace,
    /// For each name that is fixed to the frame, the pose of the frame in it.
    fixed: BTreeMap<String, Isometry3<f64>>,
    /// One frame of each body of the robot.
    links: Vec<FrameId>,
    angles: Angles,
    /// Time, ns, and positions of the joints when all were last known.
    joints: Option<(i64, Vec<f64>)>,
    /// Newest position of each joint, from any publisher; NaN where there is none yet.
    newest: Vec<f64>,
    waiting: Vec<Waiting>,
    /// Only every so many poses is compared, and how many were met.
    every: usize,
    met: usize,
    /// Poses of the frame in each link, where its parent is the link of this name, and where it is
    /// the base of the robot: controllers and descriptions disagree by half a turn on which of the
    /// two they call `base`.
    poses: [Vec<Vec<Isometry3<f64>>>; 2],
}

impl<'a> Search<'a> {
    fn new(transforms: &Transforms<'_>, robot: &'a Manipulator, frame: &str) -> Self {
        let fixed = transforms.fixed_to(frame).into_iter();
        let mut fixed: BTreeMap<String, Isometry3<f64>> = fixed
            .map(|(name, frame_from_name)| (name.to_owned(), frame_from_name.inverse()))
            .collect();
        fixed.insert(frame.to_owned(), Isometry3::identity());
        let mut links: Vec<FrameId> = Vec::new();
        for link in robot
            .frame_names()
            .filter_map(|name| robot.frame(name).ok())
        {
            let is_same = |other: &FrameId| robot.fixed_transform(*other, link).is_some();
            if !links.iter().any(is_same) {
                links.push(link);
            }
        }
        Self {
            robot,
            workspace: Workspace::new(robot),
            fixed,
            links,
            angles: Angles::new(robot),
            joints: (robot.dof() == 0).then(|| (i64::MIN, Vec::new())),
            newest: vec![f64::NAN; robot.dof()],
            waiting: Vec::new(),
            every: 1,
            met: 0,
            poses: [Vec::new(), Vec::new()],
        }
    }

    /// Takes a message of transforms or of joint states; others, and those that cannot be decoded,
    /// are left out.
    fn push(&mut self, transforms: &Transforms<'_>, message: &RawMessage) {
        if let Ok(state) = message.decode::<JointState>() {
            self.push_joints(time_ns(message, state.header.stamp), &state);
        } else if let Ok(message_of_transforms) = message.decode::<TFMessage>() {
            for stamped in message_of_transforms.transforms {
                self.push_transform(transforms, message, &stamped);
            }
        }
    }

    fn push_transform(
        &mut self,
        transforms: &Transforms<'_>,
        message: &RawMessage,
        stamped: &TransformStamped,
    ) {
        let Some(child_from_frame) = self.fixed.get(&stamped.child_frame_id) else {
            return;
        };
        let parent_from_frame = pose(stamped) * child_from_frame;
        let parent = &stamped.header.frame_id;
        let Some((link, link_from_parent)) = transforms.link_of(self.robot, parent) else {
            return;
        };
        self.met += 1;
        if !self.met.is_multiple_of(self.every) {
            return;
        }
        if self.waiting.len() >= MOST_WAITING {
            self.waiting.clear();
        }
        let time_ns = time_ns(message, stamped.header.stamp);
        let base = self.robot.base_frame();
        let is_ground = self.robot.fixed_transform(base, link).is_some();
        let named = (link, link_from_parent * parent_from_frame);
        let readings = [Some(named), is_ground.then_some((base, parent_from_frame))];
        for (reading, (link, link_from_frame)) in readings.into_iter().flatten().enumerate() {
            self.waiting.push(Waiting {
                time_ns,
                link,
                link_from_frame,
                reading,
            });
        }
        if self.robot.dof() == 0 {
            self.compare(i64::MAX, &[]);
        }
    }

    fn push_joints(&mut self, time_ns: i64, state: &JointState) {
        for (name, position) in state.name.iter().zip(&state.position) {
            let names = self.robot.joint_names();
            if let Some(place) = names.iter().position(|joint| joint == name) {
                self.newest[place] = *position;
            }
        }
        if self.newest.iter().all(|position| position.is_finite()) {
            let positions = self.newest.clone();
            self.compare(time_ns, &positions);
            self.joints = Some((time_ns, positions));
        }
    }

    /// Compares the poses up to the time of new joint positions with the links, which move between
    /// those before and these.
    fn compare(&mut self, time_ns: i64, positions: &[f64]) {
        if self.waiting.is_empty() {
            return;
        }
        let Some((before_ns, before)) = self.joints.clone() else {
            return;
        };
        let (due, waiting): (Vec<_>, Vec<_>) = std::mem::take(&mut self.waiting)
            .into_iter()
            .partition(|pose| pose.time_ns <= time_ns);
        self.waiting = waiting;
        for pose in due.iter().filter(|pose| pose.time_ns >= before_ns) {
            let length_ns = (time_ns.saturating_sub(before_ns) as f64).max(1.0);
            let fraction = pose.time_ns.saturating_sub(before_ns) as f64 / length_ns;
            let steps = self.angles.changes(&before, positions);
            let at = before
                .iter()
                .zip(steps)
                .map(|(a, step)| a + step * fraction);
            let at: Vec<f64> = at.collect();
            self.add(pose, &at);
        }
    }

    fn add(&mut self, waiting: &Waiting, position: &[f64]) {
        let still = vec![0.0; position.len()];
        let joints = JointMotion {
            position,
            velocity: &still,
            acceleration: &still,
        };
        let base = FrameMotion::at_rest(Isometry3::identity());
        if motion(&mut self.workspace, &base, joints).is_err() {
            return;
        }
        let world_from_frame = self.workspace.pose(waiting.link) * waiting.link_from_frame;
        let links = self.links.iter();
        let poses = links.map(|&link| self.workspace.pose(link).inv_mul(&world_from_frame));
        let all = &mut self.poses[waiting.reading];
        all.push(poses.collect());
        if all.len() >= COMPARED {
            for all in &mut self.poses {
                let mut is_kept = false;
                all.retain(|_| {
                    is_kept = !is_kept;
                    is_kept
                });
            }
            self.every *= 2;
        }
    }

    /// Returns the link in which the frame stays; `None` where there is none, or several.
    fn carrier(&self) -> Option<MovingFrame> {
        self.poses.iter().find_map(|poses| self.carrier_of(poses))
    }

    fn carrier_of(&self, poses: &[Vec<Isometry3<f64>>]) -> Option<MovingFrame> {
        let spreads = (0..self.links.len()).map(|link| Spread::new(poses, link));
        let mut spreads: Vec<_> = spreads.collect::<Option<_>>()?;
        spreads.sort_by(|a, b| a.change.total_cmp(&b.change));
        let best = spreads.first()?;
        let is_distinct = |other: &Spread| other.change > (DISTINCT * best.change).max(1.0);
        if best.change > 1.0 || !spreads.get(1).is_none_or(is_distinct) {
            return None;
        }
        Some(MovingFrame {
            link: self.robot.frame_name(self.links[best.link]).to_owned(),
            link_from_frame: best.mean,
        })
    }
}

/// How much the pose of the frame in a link changes.
struct Spread {
    link: usize,
    /// Rms change relative to what a carrier may show.
    change: f64,
    mean: Isometry3<f64>,
}

impl Spread {
    /// Returns the mean pose of the frame in a link, and its change.
    fn new(all: &[Vec<Isometry3<f64>>], link: usize) -> Option<Self> {
        let poses = || all.iter().map(|poses| poses[link]);
        let first = poses().next()?;
        let count = all.len() as f64;
        let turn = |pose: Isometry3<f64>| first.rotation.rotation_to(&pose.rotation).scaled_axis();
        let origin = poses()
            .map(|pose| pose.translation.vector)
            .sum::<Vector3<f64>>()
            / count;
        let mean_turn = poses().map(turn).sum::<Vector3<f64>>() / count;
        let rms = |squares: f64| (squares / count).sqrt();
        let shift = |pose: Isometry3<f64>| (pose.translation.vector - origin).norm_squared();
        let shift_m = rms(poses().map(shift).sum());
        let turned = rms(poses().map(|p| (turn(p) - mean_turn).norm_squared()).sum());
        let rotation = UnitQuaternion::from_scaled_axis(mean_turn) * first.rotation;
        Some(Self {
            link,
            change: (shift_m / FIXED[0]).max(turned / FIXED[1]),
            mean: Isometry3::from_parts(origin.into(), rotation),
        })
    }
}

/// Returns the stamp of a message, or its time of logging where it has none, ns.
fn time_ns(message: &RawMessage, stamp: Time) -> i64 {
    match stamp.as_ns() {
        0 => i64::try_from(message.log_time_ns).unwrap_or(i64::MAX),
        stamp_ns => stamp_ns,
    }
}
