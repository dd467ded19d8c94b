//! Writes a log with messages of every type, which any ROS 2 tool can open.
//!
//! `cargo run --example write_log -- run.mcap`

use std::{env, error::Error};

use tactid_logs::{
    Channel, Durability, LogError, LogWriter, Message,
    messages::{
        AccelStamped, Float64MultiArray, Header, Imu, InertiaStamped, JointState, Odometry,
        PointCloud2, PointField, PoseStamped, StringMsg, TFMessage, Time, TransformStamped,
        TwistStamped, WrenchStamped,
    },
};

const STEPS: u64 = 3000;
const STEP_NS: u64 = 1_000_000;
const CONTACT_NS: u64 = 1_000_000_000;

const URDF: &str = r#"<robot name="one_link"><link name="base_link"/></robot>"#;

fn main() -> Result<(), Box<dyn Error>> {
    let path = env::args()
        .nth(1)
        .ok_or("give the path of the log to write")?;
    let mut log = LogWriter::create(path)?;

    let urdf = log.channel("/robot_description", Durability::TransientLocal)?;
    log.write(
        &urdf,
        STEP_NS,
        &StringMsg {
            data: URDF.to_owned(),
        },
    )?;
    let tf_static = log.channel("/tf_static", Durability::TransientLocal)?;
    log.write(&tf_static, STEP_NS, &transforms(Header::default()))?;

    let topics = Topics::new(&mut log)?;
    for step in 1..=STEPS {
        topics.write(&mut log, step * STEP_NS)?;
    }
    log.metadata("example", [("steps".to_owned(), STEPS.to_string())].into())?;
    log.finish()?;
    Ok(())
}

fn transforms(header: Header) -> TFMessage {
    let child_frame_id = "base_link".to_owned();
    TFMessage {
        transforms: vec![TransformStamped {
            header,
            child_frame_id,
            ..Default::default()
        }],
    }
}

/// A topic of each type with a header, and two topics of types without.
struct Topics {
    tf: Channel<TFMessage>,
    joints: Channel<JointState>,
    odometry: Channel<Odometry>,
    imu: Channel<Imu>,
    wrench: Channel<WrenchStamped>,
    accel: Channel<AccelStamped>,
    pose: Channel<PoseStamped>,
    twist: Channel<TwistStamped>,
    inertia: Channel<InertiaStamped>,
    contacts: Channel<PointCloud2>,
    numbers: Channel<Float64MultiArray>,
}

type Log = LogWriter<std::io::BufWriter<std::fs::File>>;

impl Topics {
    fn new(log: &mut Log) -> Result<Self, LogError> {
        Ok(Self {
            tf: log.channel("/tf", Durability::Volatile)?,
            joints: log.channel("/joint_states", Durability::Volatile)?,
            odometry: log.channel("/base/odom", Durability::Volatile)?,
            imu: log.channel("/base/imu", Durability::Volatile)?,
            wrench: log.channel("/finger_left/wrench", Durability::Volatile)?,
            accel: log.channel("/base/accel", Durability::Volatile)?,
            pose: log.channel("/base/pose", Durability::Volatile)?,
            twist: log.channel("/base/twist", Durability::Volatile)?,
            inertia: log.channel("/payload/inertia", Durability::Volatile)?,
            contacts: log.channel("/finger_left/contacts", Durability::Volatile)?,
            numbers: log.channel("/payload/covariance", Durability::Volatile)?,
        })
    }

    fn write(&self, log: &mut Log, time_ns: u64) -> Result<(), LogError> {
        let angle = time_ns as f64 * 1e-9;
        let header = Header {
            stamp: Time::from_ns(time_ns),
            frame_id: "world".to_owned(),
        };
        let joints = JointState {
            header: header.clone(),
            name: vec!["elbow_joint".to_owned()],
            position: vec![angle.sin()],
            velocity: vec![angle.cos()],
            effort: vec![f64::NAN],
        };
        log.write(&self.joints, time_ns, &joints)?;
        let mut odometry = Odometry {
            header: header.clone(),
            ..Odometry::default()
        };
        odometry.child_frame_id = "base_link".to_owned();
        odometry.twist.twist.angular.z = 1.0;
        log.write(&self.odometry, time_ns, &odometry)?;
        log.write(&self.tf, time_ns, &transforms(header.clone()))?;
        if time_ns.is_multiple_of(CONTACT_NS) {
            log.write(&self.contacts, time_ns, &contact(header.clone()))?;
        }
        let data = vec![angle; 100];
        log.write(
            &self.numbers,
            time_ns,
            &Float64MultiArray {
                data,
                ..Default::default()
            },
        )?;
        self.write_plain(log, header)
    }

    /// Writes the messages that have a header and nothing else.
    fn write_plain(&self, log: &mut Log, header: Header) -> Result<(), LogError> {
        plain(
            log,
            &self.imu,
            Imu {
                header: header.clone(),
                ..Default::default()
            },
        )?;
        plain(
            log,
            &self.wrench,
            WrenchStamped {
                header: header.clone(),
                ..Default::default()
            },
        )?;
        plain(
            log,
            &self.accel,
            AccelStamped {
                header: header.clone(),
                ..Default::default()
            },
        )?;
        plain(
            log,
            &self.pose,
            PoseStamped {
                header: header.clone(),
                ..Default::default()
            },
        )?;
        plain(
            log,
            &self.twist,
            TwistStamped {
                header: header.clone(),
                ..Default::default()
            },
        )?;
        plain(
            log,
            &self.inertia,
            InertiaStamped {
                header,
                ..Default::default()
            },
        )
    }
}

/// Writes a message at the time of its stamp.
fn plain<M: Message>(log: &mut Log, channel: &Channel<M>, message: M) -> Result<(), LogError> {
    let time_ns = message.stamp().map_or(0, Time::as_ns).unsigned_abs();
    log.write(channel, time_ns, &message)
}

/// Returns a cloud of one point at the frame's origin.
fn contact(header: Header) -> PointCloud2 {
    let field = |(i, name): (u32, &str)| PointField {
        name: name.to_owned(),
        offset: 4 * i,
        datatype: PointField::FLOAT32,
        count: 1,
    };
    PointCloud2 {
        header,
        height: 1,
        width: 1,
        fields: (0..).zip(["x", "y", "z"]).map(field).collect(),
        is_bigendian: false,
        point_step: 12,
        row_step: 12,
        data: vec![0; 12],
        is_dense: true,
    }
}
