//! The log of a run: topics that such a robot would record, and truth and experiment as metadata.

mod truth;
mod writing;

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use serde::Serialize;
use tactid_dynamics::BaseKind;
use tactid_logs::messages::{
    Header, Imu, JointState, Odometry, PointCloud2, PointField, StringMsg, TFMessage, Time,
    Transform, TransformStamped, WrenchStamped,
};
use tactid_logs::{Channel, Durability, LogWriter, messages};

use crate::experiment::{Noise, StdDev};
use crate::robot::{LinkFrame, Robot};
use crate::sample::{Contact, FingerSample, Sample};
use crate::scene::State;
use crate::{SimError, Simulation};
use truth::truth_json;
pub(crate) use writing::RecorderThread;

/// Time stamp of the first sample, ns. ROS interprets a stamp of zero as a missing stamp.
const START_NS: u64 = 1_000_000_000;
/// Rate of the contact clouds, Hz.
const CONTACTS_HZ: f64 = 10.0;
/// Rate of the transforms, Hz.
const TF_HZ: f64 = 50.0;

/// Name of the inertial frame.
const WORLD: &str = "world";
/// Name of the frame at the payload's centre of mass.
const PAYLOAD: &str = "payload";

/// Name of the metadata record with the true payload.
const TRUTH: &str = "tactid.truth";
/// Name of the metadata record with the experiment as TOML.
const EXPERIMENT: &str = "tactid.experiment";
/// Name of the metadata record with the run's report.
const REPORT: &str = "tactid.report";

/// A channel and its message. Each sample uses the memory of the message again.
struct Topic<M> {
    channel: Channel<M>,
    message: M,
}

impl<M: messages::Message> Topic<M> {
    fn new(writer: &mut Writer, name: &str, message: M) -> Result<Self, SimError> {
        Ok(Self {
            channel: writer.channel(name, Durability::Volatile)?,
            message,
        })
    }

    fn write(&self, writer: &mut Writer, time_ns: u64) -> Result<(), SimError> {
        Ok(writer.write(&self.channel, time_ns, &self.message)?)
    }
}

type Writer = LogWriter<BufWriter<File>>;

/// Topics of a floating base.
struct BaseTopics {
    odometry: Topic<Odometry>,
    imu: Topic<Imu>,
}

struct FingerTopics {
    wrench: Topic<WrenchStamped>,
    contacts: Topic<PointCloud2>,
}

/// Writer of the samples of one simulation.
pub(crate) struct Recorder {
    writer: Writer,
    joints: Topic<JointState>,
    base: Option<BaseTopics>,
    fingers: [FingerTopics; 2],
    tf: Topic<TFMessage>,
    moving: Vec<MovingFrame>,
    step_ns: u64,
    contacts_every: u64,
    tf_every: u64,
}

/// A link that a joint moves, and its parent link.
struct MovingFrame {
    link: LinkFrame,
    parent: LinkFrame,
}

impl Recorder {
    pub(crate) fn create(path: &Path, simulation: &Simulation) -> Result<Self, SimError> {
        let (robot, experiment) = (simulation.robot(), simulation.experiment());
        let mut writer = LogWriter::create(path)?;
        let [left, right] = simulation
            .roles()
            .fingers
            .map(|body| robot.moved_link(body));
        let mut recorder = Self {
            joints: Topic::new(&mut writer, "/joint_states", joint_state(simulation))?,
            base: match robot.base {
                BaseKind::Floating => Some(base_topics(&mut writer, simulation)?),
                BaseKind::Fixed => None,
            },
            fingers: [
                finger_topics(&mut writer, left)?,
                finger_topics(&mut writer, right)?,
            ],
            tf: Topic::new(&mut writer, "/tf", TFMessage::default())?,
            moving: moving_frames(robot),
            step_ns: (experiment.step_s * 1e9).round() as u64,
            contacts_every: steps_between(CONTACTS_HZ, experiment.step_s),
            tf_every: steps_between(TF_HZ, experiment.step_s),
            writer,
        };
        recorder.write_once(simulation)?;
        Ok(recorder)
    }

    fn write_once(&mut self, simulation: &Simulation) -> Result<(), SimError> {
        let writer = &mut self.writer;
        let experiment = simulation.experiment();
        writer.metadata(EXPERIMENT, record("toml", experiment.to_toml()?))?;
        writer.metadata(TRUTH, record("json", truth_json(simulation)))?;
        let channel = writer.channel("/robot_description", Durability::TransientLocal)?;
        let data = simulation.urdf().to_owned();
        writer.write(&channel, START_NS, &StringMsg { data })?;
        let channel = writer.channel("/tf_static", Durability::TransientLocal)?;
        writer.write(&channel, START_NS, &static_transforms(simulation.robot()))?;
        Ok(())
    }

    /// Writes the sample of the step with number `index`; `state` is the state at its time.
    pub(crate) fn write(
        &mut self,
        index: u64,
        sample: &Sample,
        state: &State,
    ) -> Result<(), SimError> {
        let time_ns = START_NS + index * self.step_ns;
        let stamp = Time::from_ns(time_ns);
        let writer = &mut self.writer;

        let joints = &mut self.joints.message;
        joints.header.stamp = stamp;
        joints.position.copy_from_slice(&sample.joint_position);
        joints.velocity.copy_from_slice(&sample.joint_velocity);
        joints.effort.copy_from_slice(&sample.joint_torque);
        self.joints.write(writer, time_ns)?;

        if let Some(base) = &mut self.base {
            fill_odometry(&mut base.odometry.message, stamp, sample);
            base.odometry.write(writer, time_ns)?;
            fill_imu(&mut base.imu.message, stamp, sample);
            base.imu.write(writer, time_ns)?;
        }

        let with_contacts = index.is_multiple_of(self.contacts_every);
        if with_contacts {
            // Rerun's checker calls two clouds in a chunk unordered. Flushing also limits losses.
            writer.flush()?;
        }
        for (topics, finger) in self.fingers.iter_mut().zip(&sample.fingers) {
            fill_wrench(&mut topics.wrench.message, stamp, finger);
            topics.wrench.write(writer, time_ns)?;
            if with_contacts {
                fill_cloud(&mut topics.contacts.message, stamp, &finger.contacts);
                topics.contacts.write(writer, time_ns)?;
            }
        }
        if index.is_multiple_of(self.tf_every) {
            let transforms = &mut self.tf.message.transforms;
            transforms.clear();
            transforms.extend(
                self.moving
                    .iter()
                    .map(|frame| frame.transform(stamp, state)),
            );
            if let Some(base) = &self.base {
                let link = &base.odometry.message.child_frame_id;
                transforms.push(transform(stamp, WORLD, link, &sample.base.pose));
            }
            transforms.push(transform(stamp, WORLD, PAYLOAD, &state.payload.pose));
            self.tf.write(writer, time_ns)?;
        }
        Ok(())
    }

    /// Writes the run's report and finishes the log.
    pub(crate) fn finish(mut self, report: &impl Serialize) -> Result<(), SimError> {
        let json = serde_json::to_string(report).unwrap_or_default();
        self.writer.metadata(REPORT, record("json", json))?;
        self.writer.finish()?;
        Ok(())
    }
}

fn steps_between(rate_hz: f64, step_s: f64) -> u64 {
    (1.0 / (rate_hz * step_s)).round().max(1.0) as u64
}

fn record(key: &str, value: String) -> BTreeMap<String, String> {
    BTreeMap::from([(key.to_owned(), value)])
}

fn moving_frames(robot: &Robot) -> Vec<MovingFrame> {
    let frame = |link: &LinkFrame| {
        let parent = robot.link(link.carried_by.as_ref()?)?;
        Some(MovingFrame {
            link: link.clone(),
            parent: parent.clone(),
        })
    };
    robot.links.iter().filter_map(frame).collect()
}

impl MovingFrame {
    fn transform(&self, stamp: Time, state: &State) -> TransformStamped {
        let pose = |link: &LinkFrame| state.bodies[link.body].pose * link.body_from_link;
        let parent_from_link = pose(&self.parent).inverse() * pose(&self.link);
        transform(stamp, &self.parent.name, &self.link.name, &parent_from_link)
    }
}

fn static_transforms(robot: &Robot) -> TFMessage {
    let stamp = Time::from_ns(START_NS);
    let fixed = robot.links.iter().filter_map(|link| {
        let (parent, parent_from_link) = link.fixed_to.as_ref()?;
        Some(transform(stamp, parent, &link.name, parent_from_link))
    });
    let base = &robot.links[0];
    let on_the_ground = (robot.base == BaseKind::Fixed)
        .then(|| transform(stamp, WORLD, &base.name, &base.body_from_link));
    TFMessage {
        transforms: on_the_ground.into_iter().chain(fixed).collect(),
    }
}

fn header(frame_id: &str) -> Header {
    Header {
        stamp: Time::default(),
        frame_id: frame_id.to_owned(),
    }
}

fn vector(v: &Vector3<f64>) -> messages::Vector3 {
    messages::Vector3::from([v.x, v.y, v.z])
}

fn quaternion(rotation: &UnitQuaternion<f64>) -> messages::Quaternion {
    messages::Quaternion {
        x: rotation.i,
        y: rotation.j,
        z: rotation.k,
        w: rotation.w,
    }
}

fn transform(stamp: Time, parent: &str, child: &str, pose: &Isometry3<f64>) -> TransformStamped {
    TransformStamped {
        header: Header {
            stamp,
            frame_id: parent.to_owned(),
        },
        child_frame_id: child.to_owned(),
        transform: Transform {
            translation: vector(&pose.translation.vector),
            rotation: quaternion(&pose.rotation),
        },
    }
}

fn joint_state(simulation: &Simulation) -> JointState {
    let name = simulation.joint_names().to_vec();
    let zeros = vec![0.0; name.len()];
    JointState {
        header: header(""),
        name,
        position: zeros.clone(),
        velocity: zeros.clone(),
        effort: zeros,
    }
}

/// Returns the row-major 6x6 covariance of two uncorrelated vectors with these standard deviations.
fn covariance(first: &StdDev, last: &StdDev) -> [f64; 36] {
    let mut covariance = [0.0; 36];
    for i in 0..3 {
        covariance[7 * i] = first.of(i).powi(2);
        covariance[7 * (i + 3)] = last.of(i).powi(2);
    }
    covariance
}

fn base_topics(writer: &mut Writer, simulation: &Simulation) -> Result<BaseTopics, SimError> {
    let link = &simulation.robot().links[0].name;
    let noise = &simulation.experiment().noise;
    Ok(BaseTopics {
        odometry: Topic::new(writer, "/base/odom", odometry(link, noise))?,
        imu: Topic::new(writer, "/base/imu", imu(link, noise))?,
    })
}

fn odometry(base: &str, noise: &Noise) -> Odometry {
    let mut message = Odometry {
        header: header(WORLD),
        child_frame_id: base.to_owned(),
        ..Odometry::default()
    };
    message.pose.covariance = covariance(&noise.base_position_m, &noise.base_orientation_rad);
    message.twist.covariance =
        covariance(&noise.base_velocity_m_s, &noise.base_angular_velocity_rad_s);
    message
}

/// Fills an odometry message. Its twist is expressed in the child's frame.
fn fill_odometry(message: &mut Odometry, stamp: Time, sample: &Sample) {
    let base = &sample.base;
    message.header.stamp = stamp;
    let position = base.pose.translation.vector;
    message.pose.pose.position = messages::Point::from([position.x, position.y, position.z]);
    message.pose.pose.orientation = quaternion(&base.pose.rotation);
    let base_from_world = base.pose.rotation.inverse();
    message.twist.twist.linear = vector(&(base_from_world * base.velocity));
    message.twist.twist.angular = vector(&(base_from_world * base.angular_velocity));
}

fn imu(base: &str, noise: &Noise) -> Imu {
    let diagonal = |std_dev: &StdDev| {
        let mut covariance = [0.0; 9];
        for i in 0..3 {
            covariance[4 * i] = std_dev.of(i).powi(2);
        }
        covariance
    };
    let mut message = Imu {
        header: header(base),
        angular_velocity_covariance: diagonal(&noise.imu_angular_velocity_rad_s),
        linear_acceleration_covariance: diagonal(&noise.imu_acceleration_m_s2),
        ..Imu::default()
    };
    message.orientation_covariance[0] = -1.0; // not measured
    message
}

/// Fills a message of the base's IMU, which has the frame of the base link.
fn fill_imu(message: &mut Imu, stamp: Time, sample: &Sample) {
    message.header.stamp = stamp;
    message.angular_velocity = vector(&sample.imu.angular_velocity);
    message.linear_acceleration = vector(&sample.imu.acceleration);
}

/// Returns the topics of a finger: the link `finger_left_link` has the topics `/finger_left/...`.
fn finger_topics(writer: &mut Writer, link: &str) -> Result<FingerTopics, SimError> {
    let name = link.strip_suffix("_link").unwrap_or(link);
    let wrench = WrenchStamped {
        header: header(link),
        ..WrenchStamped::default()
    };
    Ok(FingerTopics {
        wrench: Topic::new(writer, &format!("/{name}/wrench"), wrench)?,
        contacts: Topic::new(writer, &format!("/{name}/contacts"), cloud(link))?,
    })
}

fn fill_wrench(message: &mut WrenchStamped, stamp: Time, finger: &FingerSample) {
    message.header.stamp = stamp;
    message.wrench.force = vector(&finger.wrench.force);
    message.wrench.torque = vector(&finger.wrench.moment);
}

/// Fields of a contact point in a cloud: position (m) and force (N), as `f32`.
const CLOUD_FIELDS: [&str; 6] = ["x", "y", "z", "fx", "fy", "fz"];
const CLOUD_POINT_BYTES: u32 = 4 * CLOUD_FIELDS.len() as u32;

fn cloud(link: &str) -> PointCloud2 {
    let field = |(i, name): (usize, &&str)| PointField {
        name: (*name).to_owned(),
        offset: 4 * i as u32,
        datatype: PointField::FLOAT32,
        count: 1,
    };
    PointCloud2 {
        header: header(link),
        height: 1,
        fields: CLOUD_FIELDS.iter().enumerate().map(field).collect(),
        point_step: CLOUD_POINT_BYTES,
        is_dense: true,
        ..PointCloud2::default()
    }
}

fn fill_cloud(message: &mut PointCloud2, stamp: Time, contacts: &[Contact]) {
    message.header.stamp = stamp;
    message.data.clear();
    for contact in contacts {
        for value in contact.position.iter().chain(contact.force.iter()) {
            message.data.extend((*value as f32).to_le_bytes());
        }
    }
    message.width = contacts.len() as u32;
    message.row_step = message.data.len() as u32;
}
