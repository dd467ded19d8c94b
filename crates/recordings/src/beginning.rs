//! The beginning of a recording, which identifies it.

use std::collections::HashSet;

use tactid_identify::fingerprint;

use crate::alignment::Event;

/// Number of different measurements that identify a recording: those of some seconds of motion, which no two recordings share.
const IDENTIFYING: usize = 500;

/// Returns a number that identifies the first measurements of a recording. Times, and measurements that repeat an earlier
/// one, as of a simulated arm at rest, tell nothing.
pub(crate) fn identifying(events: &[Event]) -> String {
    let mut seen = HashSet::new();
    let measured = events.iter().map(|event| format!("{:?}", event.measured));
    let different = measured.filter(|measured| seen.insert(measured.clone()));
    let bytes = different.take(IDENTIFYING).collect::<String>().into_bytes();
    format!("{:016x}", fingerprint(bytes.into_iter().map(u64::from)))
}

#[cfg(test)]
mod tests {
    use tactid_dynamics::Wrench;

    use super::*;
    use crate::alignment::Measured;

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

    /// Two recordings without noise that begin at the same rest are two; a recording that was cut is the same.
    #[test]
    fn a_rest_does_not_identify_a_recording() {
        let events = at_rest_then(1.0);
        assert_ne!(identifying(&events), identifying(&at_rest_then(2.0)));
        assert_eq!(identifying(&events), identifying(&events[..3000]));
    }
}
