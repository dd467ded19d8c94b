//! The beginning of a recording, which identifies it.

use std::collections::HashSet;

use nalgebra::Vector3;
use tactid_identify::fingerprint;

use crate::alignment::{Event, JointValues, Measured};

/// Number of different measurements that identify a recording: those of some seconds of motion,
/// which no two recordings share.
const IDENTIFYING: usize = 500;

/// Returns a number that identifies the first measurements of a recording. Times, and measurements
/// that repeat an earlier one, as of a simulated arm at rest, tell nothing.
pub(crate) fn identifying(events: &[Event]) -> String {
    let mut seen = HashSet::new();
    let measured = events.iter().map(|event| words(&event.measured));
    let different = measured.filter(|measured| seen.insert(measured.clone()));
    let words = different.take(IDENTIFYING).flatten();
    format!("{:016x}", fingerprint(words))
}

/// Returns the number of the stream of a measurement, with the bits of its values.
fn words(measured: &Measured) -> Vec<u64> {
    let of_two = |a: &Vector3<f64>, b: &Vector3<f64>| [a.as_slice(), b.as_slice()].concat();
    let (stream, values) = match measured {
        Measured::Joints(joints) => (0, of_joints(joints)),
        Measured::Unloaded(joints) => (1, of_joints(joints)),
        Measured::Acceleration(base) => (2, of_two(&base.linear, &base.angular)),
        Measured::BaseImu(imu) => (3, of_two(&imu.linear, &imu.angular_velocity)),
        Measured::Base(base) => {
            let rotation = base.pose.rotation.coords.as_slice();
            let place = of_two(&base.pose.translation.vector, &base.velocity);
            (
                4,
                [&place, rotation, base.angular_velocity.as_slice()].concat(),
            )
        }
        Measured::Wrench(sensor, wrench) => (5 + 2 * sensor, of_two(&wrench.force, &wrench.moment)),
        Measured::MoreJoints(publisher, joints) => (6 + 2 * publisher, of_joints(joints)),
    };
    let bits = values.into_iter().map(f64::to_bits);
    std::iter::once(stream as u64).chain(bits).collect()
}

fn of_joints(joints: &JointValues) -> Vec<f64> {
    [&joints.position[..], &joints.velocity, &joints.effort].concat()
}

#[cfg(test)]
mod tests {
    use tactid_dynamics::Wrench;

    use super::*;

    fn at_rest_then(moving: f64) -> Vec<Event> {
        let event = |k: usize| {
            let mut wrench = Wrench::zero();
            wrench.force.z = if k < 2000 { 5.0 } else { moving * k as f64 };
            Event {
                time_s: k as f64 * 1e-3,
                measured: Measured::Wrench(0, wrench),
            }
        };
        (0..4000).map(event).collect()
    }

    /// Two recordings without noise that begin at the same rest are two; a recording that was cut
    /// is the same.
    #[test]
    fn a_rest_does_not_identify_a_recording() {
        let events = at_rest_then(1.0);
        assert_ne!(identifying(&events), identifying(&at_rest_then(2.0)));
        assert_eq!(identifying(&events), identifying(&events[..3000]));
        // The number is stored, so that it must stay the same in every version.
        assert_eq!(identifying(&events), "cc95d2ffda0ce0fd");
    }
}
