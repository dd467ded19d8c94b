//! Times that cannot be used: in other units than seconds, reversed, constant, or with gaps
//! everywhere. Each error says what is wrong.

use crate::recorded_arrays::carried;
use tactid_recordings::Request;

/// Times in other units than seconds are named by the unit.
#[test]
fn times_in_another_unit_are_named() {
    for (unit, in_one_second) in [
        ("milliseconds", 1e3),
        ("microseconds", 1e6),
        ("nanoseconds", 1e9),
    ] {
        let error = carried().error(|r| r.times_s.iter_mut().for_each(|t| *t *= in_one_second));
        let text = error.to_string();
        let every = format!("they come every {} s", 0.002 * in_one_second);
        assert!(text.contains(&every), "{text}");
        assert!(text.contains(&format!("seem to be in {unit}")), "{text}");
        assert_eq!(error.option(), None);
    }
}

/// Samples that come too seldom for the given cutoff are an error with their period.
#[test]
fn rare_samples_are_named_with_their_period() {
    let request = Request {
        cutoff_hz: Some(100.0),
        ..Request::default()
    };
    let error = carried().identify(&request).unwrap_err();
    assert!(
        error.to_string().contains("they come every 0.002 s"),
        "{error}"
    );
    assert_eq!(error.option(), Some("cutoff_hz"));
}

/// Times that run backwards or stand still are an error with their number.
#[test]
fn times_that_do_not_increase_are_counted_in_the_error() {
    let reversed = carried().error(|r| r.times_s.reverse());
    let constant = carried().error(|r| r.times_s.fill(3.0));
    for error in [reversed, constant] {
        let expected =
            "1999 times of `time` are not later than the ones before them, and 1 could be used";
        assert!(error.to_string().starts_with(expected), "{error}");
    }
}

/// A longest bridged time that is shorter than the time between two samples is an error with both.
#[test]
fn gaps_everywhere_are_named_with_the_longest_bridged_time() {
    let request = Request {
        max_gap_s: Some(0.001),
        ..Request::default()
    };
    let error = carried().identify(&request).unwrap_err();
    assert_eq!(error.option(), Some("max_gap_s"), "{error}");
    let text = error.to_string();
    for part in [
        "longer than 0.001 s, the longest time that is bridged",
        "(number of gaps: 1999); samples come every 0.002 s",
    ] {
        assert!(text.contains(part), "{text}");
    }
    // Every tenth sample comes late.
    let cut = carried().error(|r| {
        for (k, time_s) in r.times_s.iter_mut().enumerate() {
            *time_s += 0.5 * (k / 10) as f64;
        }
    });
    assert!(cut.to_string().contains("(number of gaps: 199)"), "{cut}");
}
