//! What the online identifier notices about the samples themselves, which an arm on a floating base
//! gives.

use nalgebra::Vector3;
use tactid_batch::Finding;
use tactid_dynamics::BaseKind;
use tactid_identify::checks::{TwistAxes, VelocityCause, VelocityContradiction};
use tactid_identify::{EquationSettings, Identifier, Sampling};

use crate::arm::{Instant, Run, TOOL, arm, body};

fn instants(rate_hz: f64, duration_s: f64) -> Vec<Instant> {
    let run = Run {
        base: BaseKind::Floating,
        rate_hz,
        payloads: vec![(0.0, body(2.1, [0.03, -0.02, 0.08], [0.2, 0.12, 0.16]))],
        duration_s,
        gap_s: None,
        motion_seed: 1,
    };
    run.instants()
}

/// Returns the findings of the online identifier after all instants, whose motion and wrench are
/// changed.
fn findings_after(rate_hz: f64, change: impl Fn(&mut Instant)) -> Vec<Finding> {
    findings_of(instants(rate_hz, 4.0), change)
}

fn findings_of(instants: Vec<Instant>, change: impl Fn(&mut Instant)) -> Vec<Finding> {
    let robot = arm(BaseKind::Floating);
    let settings = EquationSettings::default();
    let mut online = Identifier::new(&robot, TOOL, &[TOOL], &settings).unwrap();
    for mut instant in instants {
        change(&mut instant);
        let wrenches = [instant.wrench];
        online.push(&instant.sample(&wrenches)).unwrap();
    }
    tactid_batch::online_findings(&online.snapshot())
}

/// Samples that fit have no finding.
#[test]
fn samples_that_fit_have_no_finding() {
    assert_eq!(findings_after(200.0, |_| {}), []);
}

/// A twist in the axes of the body, or one of zero, is reported.
#[test]
fn a_twist_that_does_not_fit_the_pose_is_reported() {
    let in_body = |instant: &mut Instant| {
        let base = &mut instant.base;
        let body_from_world = base.pose.rotation.inverse();
        base.velocity = body_from_world * base.velocity;
        base.angular_velocity = body_from_world * base.angular_velocity;
    };
    let at_rest = |instant: &mut Instant| {
        instant.base.velocity = Vector3::zeros();
        instant.base.angular_velocity = Vector3::zeros();
    };
    let of_body = findings_after(200.0, in_body);
    let Finding::TwistContradicted { contradiction, .. } = &of_body[0] else {
        panic!("{of_body:?}");
    };
    assert_eq!(contradiction.better_axes, Some(TwistAxes::Body));
    let of_rest = findings_after(200.0, at_rest);
    let Finding::TwistContradicted { contradiction, .. } = &of_rest[0] else {
        panic!("{of_rest:?}");
    };
    assert_eq!(contradiction.better_axes, None);
}

/// Joint velocities in degrees per second, and those of two joints that are exchanged, are reported
/// with the cause.
#[test]
fn joint_velocities_that_do_not_fit_are_reported() {
    let degrees = findings_after(200.0, |instant| {
        instant.joints[1] = instant.joints[1].map(f64::to_degrees);
    });
    let Finding::VelocitiesContradicted(VelocityContradiction { joints, cause, .. }) = &degrees[0]
    else {
        panic!("{degrees:?}");
    };
    assert_eq!((joints.len(), cause), (6, &Some(VelocityCause::Degrees)));
    let exchanged = findings_after(200.0, |instant| instant.joints[1].swap(1, 2));
    for (k, (joint, other)) in [("joint_1", "joint_2"), ("joint_2", "joint_1")]
        .into_iter()
        .enumerate()
    {
        let Finding::VelocitiesContradicted(found) = &exchanged[k] else {
            panic!("{exchanged:?}");
        };
        assert_eq!(found.joints, [joint]);
        assert_eq!(found.cause, Some(VelocityCause::OtherJoint));
        assert_eq!(found.other.as_deref(), Some(other));
    }
}

/// A channel that is always zero is reported with the frame of its sensor.
#[test]
fn a_constant_channel_is_reported() {
    let findings = findings_after(200.0, |instant| instant.wrench.moment.y = 0.0);
    let constant = Finding::ConstantChannels {
        source: "wrench".to_owned(),
        frame: TOOL.to_owned(),
        channels: vec!["moment y".into()],
        is_zero: true,
        is_left_out: false,
        without_moments: false,
        since_s: None,
        is_most: false,
    };
    assert!(findings.contains(&constant), "{findings:?}");
}

/// A force that is cut off at the range of its sensor is reported with its sign.
#[test]
fn a_saturated_channel_is_reported() {
    let saturated = |limit: f64| {
        let findings = findings_after(200.0, |instant| {
            instant.wrench.force.x = instant.wrench.force.x.max(-limit);
        });
        findings.into_iter().find_map(|finding| match finding {
            Finding::Saturated { source, saturation } => Some((source, saturation)),
            _ => None,
        })
    };
    assert_eq!(saturated(1e3), None);
    let (source, found) = saturated(1.0).unwrap();
    assert_eq!(source, "wrench");
    assert_eq!(
        (found.channels, found.limits),
        (vec!["force x".to_owned()], vec![-1.0])
    );
}

/// Angles that start again after a turn change nothing, and are reported; a second source of
/// positions is, too.
#[test]
fn steps_of_positions_are_reported() {
    let turn = |instant: &mut Instant| {
        let angle = &mut instant.joints[0];
        angle[0] -= std::f64::consts::TAU * f64::from(instant.time_s > 1.0);
    };
    let continued = |f: &Finding| matches!(f, Finding::AnglesContinued { count: 1, .. });
    assert!(findings_after(200.0, turn).iter().any(continued));
    let mixed = findings_after(200.0, |instant| {
        let sample = (200.0 * instant.time_s).round() as i32;
        if sample % 10 == 0 {
            instant.joints[0][1] += 2.0;
        }
    });
    let jump = |f: &Finding| matches!(f, Finding::PositionsJump(j) if j.are_of_two_sources());
    assert!(mixed.iter().any(jump), "{mixed:?}");
}

/// Only the last 10 s count: what was wrong before is no finding any more, and what is wrong since
/// is one.
#[test]
fn the_last_ten_seconds_are_checked() {
    let degrees =
        |instant: &mut Instant| instant.joints[1] = instant.joints[1].map(f64::to_degrees);
    let dead = |instant: &mut Instant| instant.wrench.moment.y = 0.25;
    let of_part = |is_wrong: &dyn Fn(f64) -> bool| {
        let findings = findings_of(instants(100.0, 25.0), |instant| {
            if is_wrong(instant.time_s) {
                degrees(instant);
                dead(instant);
            }
        });
        let velocities = |f: &Finding| matches!(f, Finding::VelocitiesContradicted(_));
        let constant = |f: &Finding| matches!(f, Finding::ConstantChannels { is_zero: false, .. });
        (
            findings.iter().any(velocities),
            findings.iter().any(constant),
        )
    };
    assert_eq!(of_part(&|time_s| time_s < 14.0), (false, false));
    assert_eq!(of_part(&|time_s| time_s > 14.0), (true, true));
}

/// Noise that has ended does not hide a contradiction.
#[test]
fn noise_of_the_past_hides_nothing() {
    let mut sign = 1.0;
    let mut all = instants(100.0, 25.0);
    for instant in &mut all {
        sign = -sign;
        if instant.time_s < 10.0 {
            instant.joints[0] = instant.joints[0].map(|position| position + 0.5 * sign);
        } else {
            instant.joints[1] = instant.joints[1].map(|velocity| -velocity);
        }
    }
    let findings = findings_of(all, |_| {});
    let Some(Finding::VelocitiesContradicted(VelocityContradiction { joints, cause, .. })) =
        findings.first()
    else {
        panic!("{findings:?}");
    };
    assert_eq!(
        (joints.len(), cause),
        (6, &Some(VelocityCause::OppositeSign))
    );
}

/// Samples that fill no window are reported: too few for the cutoff, with times in nanoseconds, or
/// not finite.
#[test]
fn samples_without_an_equation_are_reported() {
    let sparse = findings_after(40.0, |_| {});
    let nanoseconds = findings_after(200.0, |instant| instant.time_s *= 1e9);
    let not_finite = findings_after(200.0, |instant| instant.wrench.force.x = f64::NAN);
    let counts = [sparse, nanoseconds, not_finite].map(|findings| match findings[..] {
        [
            Finding::NoEquations(Sampling {
                samples,
                rejected,
                gaps,
                period_s,
                ..
            }),
        ] => (samples, rejected, gaps, period_s),
        _ => panic!("{findings:?}"),
    });
    let [
        (sparse, 0, 0, period_s),
        (all, 0, gaps, _),
        (0, rejected, 0, _),
    ] = counts
    else {
        panic!("{counts:?}");
    };
    assert!((period_s - 0.025).abs() < 1e-6, "{period_s}");
    assert_eq!((sparse, all, gaps, rejected), (160, 800, 799, 800));
}
