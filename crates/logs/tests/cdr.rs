//! Encoded messages have the bytes of other implementations, and damaged ones are refused.

use std::fmt::Debug;

use crate::common;
use proptest::{collection::vec, prelude::*};
use tactid_logs::{
    Message,
    cdr::{self, CdrError},
    messages::*,
};

fn encoded<M: Message>(message: &M) -> Vec<u8> {
    let mut bytes = Vec::new();
    cdr::encode(message, &mut bytes).unwrap();
    bytes
}

/// Returns a message as `rosbags` encodes it, in little and in big endian.
fn golden_bytes(name: &str) -> [Vec<u8>; 2] {
    let text = std::fs::read_to_string(common::golden("cdr.txt")).unwrap();
    let bytes = |order: &str| {
        let start = format!("{name} {order} ");
        let hex = text
            .lines()
            .find_map(|line| line.strip_prefix(&start))
            .unwrap();
        let byte = |i| u8::from_str_radix(&hex[i..i + 2], 16).unwrap();
        (0..hex.len()).step_by(2).map(byte).collect()
    };
    ["little", "big"].map(bytes)
}

fn golden<M: Message + PartialEq + Debug>() -> M {
    let [little, big] = golden_bytes(M::TYPE);
    let message: M = cdr::decode(&little).unwrap();
    assert_eq!(cdr::decode::<M>(&big).unwrap(), message, "{}", M::TYPE);
    assert_eq!(encoded(&message), little, "{}", M::TYPE);
    message
}

/// Every type is decoded from another implementation's bytes in both orders and encoded to them.
#[test]
fn every_type_has_the_bytes_of_another_implementation() {
    golden::<Time>();
    golden::<StringMsg>();
    golden::<Header>();
    golden::<Float64MultiArray>();
    golden::<Imu>();
    golden::<PointCloud2>();
    golden::<PoseStamped>();
    golden::<TwistStamped>();
    golden::<AccelStamped>();
    golden::<InertiaStamped>();
    golden::<TransformStamped>();
}

/// Returns the header of the golden messages, with numbers that count upwards from 1 in the order
/// of the fields.
fn golden_header() -> Header {
    Header {
        stamp: Time { sec: 1, nanosec: 2 },
        frame_id: "text 3".to_owned(),
    }
}

fn counted<const N: usize>(first: u32) -> [f64; N] {
    std::array::from_fn(|i| f64::from(first + i as u32) + 0.25)
}

#[test]
fn joint_state_is_decoded() {
    let expected = JointState {
        header: golden_header(),
        name: ["text 4", "text 5", "text 6"].map(str::to_owned).into(),
        position: counted::<3>(7).into(),
        velocity: counted::<3>(10).into(),
        effort: counted::<3>(13).into(),
    };
    assert_eq!(golden::<JointState>(), expected);
}

#[test]
fn wrench_is_decoded() {
    let wrench = Wrench {
        force: counted(4).into(),
        torque: counted(7).into(),
    };
    assert_eq!(
        golden::<WrenchStamped>(),
        WrenchStamped {
            header: golden_header(),
            wrench
        }
    );
}

fn counted_quaternion(first: u32) -> Quaternion {
    let [x, y, z, w] = counted(first);
    Quaternion { x, y, z, w }
}

#[test]
fn odometry_is_decoded() {
    let pose = Pose {
        position: counted(5).into(),
        orientation: counted_quaternion(8),
    };
    let twist = Twist {
        linear: counted(48).into(),
        angular: counted(51).into(),
    };
    let expected = Odometry {
        header: golden_header(),
        child_frame_id: "text 4".to_owned(),
        pose: PoseWithCovariance {
            pose,
            covariance: counted(12),
        },
        twist: TwistWithCovariance {
            twist,
            covariance: counted(54),
        },
    };
    assert_eq!(golden::<Odometry>(), expected);
}

#[test]
fn transforms_are_decoded() {
    let transforms = golden::<TFMessage>().transforms;
    assert_eq!(transforms.len(), 3);
    // Each of the three transforms has eleven numbers and texts.
    let last = Transform {
        translation: counted(27).into(),
        rotation: counted_quaternion(30),
    };
    assert_eq!(transforms[2].child_frame_id, "text 26");
    assert_eq!(
        transforms[2].header.stamp,
        Time {
            sec: 23,
            nanosec: 24
        }
    );
    assert_eq!(transforms[2].transform, last);
}

/// Returns the field names of a schema's first definition, without constants.
fn schema_fields(schema: &str) -> Vec<&str> {
    let own = schema.split("====").next().unwrap();
    let fields = own.lines().filter(|line| !line.contains('='));
    fields
        .filter_map(|line| line.split_whitespace().nth(1))
        .collect()
}

/// Returns the field names of a struct from its `Debug` output.
fn debug_fields(value: &impl Debug) -> Vec<String> {
    let text = format!("{value:#?}");
    let own = text.lines().filter_map(|line| line.strip_prefix("    "));
    own.filter(|line| !line.starts_with([' ', '}', ']']))
        .map(|line| line.split(':').next().unwrap().to_owned())
        .collect()
}

#[test]
fn fields_are_named_as_in_the_definitions() {
    fn check<M: Message + Default + Debug>() {
        assert_eq!(
            debug_fields(&M::default()),
            schema_fields(M::schema()),
            "{}",
            M::TYPE
        );
    }
    check::<Time>();
    check::<StringMsg>();
    check::<Header>();
    check::<Float64MultiArray>();
    check::<JointState>();
    check::<Imu>();
    check::<PointCloud2>();
    check::<PoseStamped>();
    check::<TwistStamped>();
    check::<AccelStamped>();
    check::<WrenchStamped>();
    check::<InertiaStamped>();
    check::<TransformStamped>();
    check::<Odometry>();
    check::<TFMessage>();
}

/// A message without its last bytes is refused, as is one with more than three bytes of padding.
#[test]
fn lengths_are_checked() {
    let whole = encoded(&common::joint_state(1));
    for length in 0..whole.len() {
        let error = cdr::decode::<JointState>(&whole[..length]).unwrap_err();
        let expected = if length < 4 {
            "does not start as CDR"
        } else {
            "ends within its fields"
        };
        assert!(error.to_string().contains(expected), "{length}: {error}");
    }
    for padding in 1..9 {
        let padded = [whole.clone(), vec![0; padding]].concat();
        match cdr::decode::<JointState>(&padded) {
            Ok(_) => assert!(padding <= 3),
            Err(error) => assert!(matches!(error, CdrError::Trailing(n) if n == padding)),
        }
    }
}

/// Lengths far beyond the number of bytes are refused without allocating memory for them.
#[test]
fn impossible_lengths_cost_nothing() {
    let whole = encoded(&common::joint_state(1));
    for at in (4..whole.len() - 4).step_by(4) {
        for length in [0x7fff_ffff_u32, 0x8000_0000, u32::MAX] {
            let mut bytes = whole.clone();
            bytes[at..at + 4].copy_from_slice(&length.to_le_bytes());
            let _ = cdr::decode::<JointState>(&bytes);
            let _ = cdr::decode::<PointCloud2>(&bytes);
            let _ = cdr::decode::<TFMessage>(&bytes);
        }
    }
    let mut cloud = encoded(&PointCloud2::default());
    let data_length = cloud.len() - 5 - 3;
    cloud[data_length..data_length + 4].copy_from_slice(&u32::MAX.to_le_bytes());
    assert!(cdr::decode::<PointCloud2>(&cloud).is_err());
}

#[test]
fn other_encapsulations_are_refused() {
    // Version 2 of CDR aligns differently; reading it as version 1 would give wrong numbers.
    let mut bytes = encoded(&common::joint_state(1));
    bytes[1] = 7;
    assert!(matches!(
        cdr::decode::<JointState>(&bytes),
        Err(CdrError::Header(_))
    ));
}

fn any_header() -> impl Strategy<Value = Header> {
    (any::<i32>(), any::<u32>(), ".*").prop_map(|(sec, nanosec, frame_id)| Header {
        stamp: Time { sec, nanosec },
        frame_id,
    })
}

fn any_vector() -> impl Strategy<Value = Vector3> {
    any::<[f64; 3]>().prop_map(Vector3::from)
}

proptest! {
    /// Decoding returns the encoded message for any values, also for texts that need padding.
    #[test]
    fn joint_states_survive(
        header in any_header(),
        name in vec(".*", 0..4),
        position in vec(any::<f64>(), 0..4),
        effort in vec(any::<f64>(), 0..4),
    ) {
        let message = JointState { header, name, position, velocity: vec![], effort };
        prop_assert_eq!(cdr::decode::<JointState>(&encoded(&message)).unwrap(), message);
    }

    #[test]
    fn odometry_survives(
        header in any_header(),
        child_frame_id in ".*",
        linear in any_vector(),
        covariance in vec(any::<f64>(), 36),
    ) {
        let mut message = Odometry { header, child_frame_id, ..Odometry::default() };
        message.twist.twist.linear = linear;
        message.pose.covariance = covariance.try_into().unwrap();
        prop_assert_eq!(cdr::decode::<Odometry>(&encoded(&message)).unwrap(), message);
    }

    #[test]
    fn clouds_survive(header in any_header(), data in vec(any::<u8>(), 0..50), name in ".*") {
        let field =
            PointField { name, offset: 4, datatype: PointField::FLOAT32, count: 1 };
        let message = PointCloud2 { header, fields: vec![field; 3], data, ..Default::default() };
        prop_assert_eq!(cdr::decode::<PointCloud2>(&encoded(&message)).unwrap(), message);
    }

    /// Decoding any bytes returns a message or an error.
    #[test]
    fn any_bytes_are_read_or_refused(mut bytes in vec(any::<u8>(), 4..200)) {
        bytes[..2].copy_from_slice(&[0, 1]);
        let _ = cdr::decode::<JointState>(&bytes);
        let _ = cdr::decode::<PointCloud2>(&bytes);
        let _ = cdr::decode::<TFMessage>(&bytes);
        let _ = cdr::decode::<Float64MultiArray>(&bytes);
    }
}
