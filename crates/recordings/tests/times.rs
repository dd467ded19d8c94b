//! Times that cannot be used: in other units than seconds, reversed, constant, or with gaps everywhere. Each error says
//! what is wrong.

#![allow(clippy::unwrap_used, clippy::panic)]

mod recorded_arrays;

use recorded_arrays::carried;
use tactid_recordings::{RecordingError, Request, TimeUnit};

/// Times in other units than seconds are named by the unit.
#[test]
fn times_in_another_unit_are_named() {
    for (unit, in_one_second) in [
        (TimeUnit::Milliseconds, 1e3),
        (TimeUnit::Microseconds, 1e6),
        (TimeUnit::Nanoseconds, 1e9),
    ] {
        let error = carried().error(|r| r.times_s.iter_mut().for_each(|t| *t *= in_one_second));
        match &error {
            RecordingError::RareSamples {
                period_s,
                unit: seen,
                ..
            } => {
                assert_eq!(*seen, Some(unit));
                assert!(
                    (period_s / in_one_second - 0.002).abs() < 1e-9,
                    "{period_s}"
                );
            }
            other => panic!("{unit}: {other}"),
        }
        let text = error.to_string();
        assert!(text.contains(&format!("seem to be in {unit}")), "{text}");
    }
}

/// Samples that come too seldom for the given cutoff are an error with their period.
#[test]
fn rare_samples_are_named_with_their_period() {
    let request = Request {
        cutoff_hz: Some(100.0),
        ..Request::default()
    };
    match carried().identify(&request) {
        Err(RecordingError::RareSamples {
            period_s,
            unit: None,
            ..
        }) => {
            assert!((period_s - 0.002).abs() < 1e-9, "{period_s}");
        }
        other => panic!("{other:?}"),
    }
}

/// Times that run backwards or stand still are an error with their number.
#[test]
fn times_that_do_not_increase_are_counted_in_the_error() {
    let reversed = carried().error(|r| r.times_s.reverse());
    let constant = carried().error(|r| r.times_s.fill(3.0));
    for error in [reversed, constant] {
        match error {
            RecordingError::TimesNotIncreasing {
                name,
                unordered,
                used,
            } => {
                assert_eq!((name.as_str(), unordered, used), ("time", 1999, 1));
            }
            other => panic!("{other}"),
        }
    }
}

/// A longest bridged time that is shorter than the time between two samples is an error with both.
#[test]
fn gaps_everywhere_are_named_with_the_longest_bridged_time() {
    let request = Request {
        max_gap_s: Some(0.001),
        ..Request::default()
    };
    match carried().identify(&request) {
        Err(RecordingError::TooManyGaps {
            gaps,
            max_gap_s,
            period_s,
        }) => {
            assert_eq!((gaps, max_gap_s), (1999, 0.001));
            assert!((period_s - 0.002).abs() < 1e-9, "{period_s}");
        }
        other => panic!("{other:?}"),
    }
    // Every tenth sample comes late.
    let cut = carried().error(|r| {
        for (k, time_s) in r.times_s.iter_mut().enumerate() {
            *time_s += 0.5 * (k / 10) as f64;
        }
    });
    assert!(
        matches!(cut, RecordingError::TooManyGaps { gaps: 199, .. }),
        "{cut}"
    );
}
