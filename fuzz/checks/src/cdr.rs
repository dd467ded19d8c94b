//! Decodes any bytes as each of the messages. What is decoded is encoded to bytes that decode to
//! the same message.

use tactid_logs::cdr;
use tactid_logs::messages::{
    AccelStamped, Float64MultiArray, Header, Imu, InertiaStamped, JointState, JointTrajectory,
    Message, Odometry, PointCloud2, PoseStamped, StringMsg, TFMessage, TYPES, Time,
    TransformStamped, TwistStamped, WrenchStamped,
};

/// A check for each type: the number of [`TYPES`] makes a missing one an error of the compiler.
const CHECKS: [fn(&[u8]); TYPES.len()] = [
    round_trip::<AccelStamped>,
    round_trip::<Float64MultiArray>,
    round_trip::<Imu>,
    round_trip::<InertiaStamped>,
    round_trip::<JointState>,
    round_trip::<Odometry>,
    round_trip::<PointCloud2>,
    round_trip::<PoseStamped>,
    round_trip::<TFMessage>,
    round_trip::<TwistStamped>,
    round_trip::<WrenchStamped>,
    round_trip::<Header>,
    round_trip::<JointTrajectory>,
    round_trip::<StringMsg>,
    round_trip::<Time>,
    round_trip::<TransformStamped>,
];

/// Checks one input.
///
/// # Panics
/// Panics if a property does not hold.
pub fn run(bytes: &[u8]) {
    if let Some((kind, bytes)) = bytes.split_first() {
        CHECKS[usize::from(*kind) % CHECKS.len()](bytes);
    }
}

/// Compares encodings instead of messages, because a message may have NaN.
fn round_trip<M: Message + Default>(bytes: &[u8]) {
    let Ok(message) = cdr::decode::<M>(bytes) else {
        return;
    };
    let (mut once, mut again, mut in_place) = (Vec::new(), Vec::new(), Vec::new());
    cdr::encode(&message, &mut once).expect("a decoded message");
    let decoded = cdr::decode::<M>(&once).expect("an encoded message");
    cdr::encode(&decoded, &mut again).expect("a decoded message");
    assert_eq!(once, again);
    // What a message had before does not show in the next one, also where the decoding of another
    // one has failed.
    let mut reused = M::default();
    for used in [bytes.split_at(bytes.len() / 2).0, bytes, &once] {
        let _ = cdr::decode_into(used, &mut reused);
        cdr::decode_into(bytes, &mut reused).expect("decoded before");
        cdr::encode(&reused, &mut in_place).expect("a decoded message");
        assert_eq!(once, in_place);
    }
}
