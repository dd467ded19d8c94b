//! Wrenches on an arm with a fixed base, on which no orientation is measured, and with sensors that
//! do not measure every channel.

use std::ops::ControlFlow;

use nalgebra::{Rotation3, Vector3};
use rand::{RngExt, SeedableRng, rngs::SmallRng};
use rand_distr::StandardNormal;
use tactid_batch::Finding as Data;
use tactid_dynamics::{BaseKind, Manipulator};
use tactid_recordings::{Arrays, Finding, GravityChoice, Request, identify_arrays, identify_poses};

/// Three joints about x, y and z in one point, with two sensors at the last link.
const WRIST: &str = r#"<robot name="wrist">
  <link name="base"/><link name="a"/><link name="b"/><link name="tool0"/><link name="side"/>
  <joint name="x" type="revolute"><parent link="base"/><child link="a"/><axis xyz="1 0 0"/>
    <limit lower="-9" upper="9" velocity="9" effort="9"/></joint>
  <joint name="y" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 1 0"/>
    <limit lower="-9" upper="9" velocity="9" effort="9"/></joint>
  <joint name="z" type="revolute"><parent link="b"/><child link="tool0"/><axis xyz="0 0 1"/>
    <limit lower="-9" upper="9" velocity="9" effort="9"/></joint>
  <joint name="fixed" type="fixed"><parent link="tool0"/><child link="side"/></joint>
</robot>"#;

const MASS_KG: f64 = 1.2;
const CENTER: Vector3<f64> = Vector3::new(0.02, -0.03, 0.06);

fn wrist() -> Manipulator {
    Manipulator::from_urdf(WRIST, BaseKind::Fixed).unwrap()
}

/// The wrench at rest with noise, at these angles, on which a gravity acts, m/s².
fn wrench(q: [f64; 3], gravity: Vector3<f64>, random: &mut SmallRng) -> [f64; 6] {
    let [x, y, z] = [0, 1, 2].map(|k| Rotation3::new(Vector3::ith(k, q[k])));
    let force = -MASS_KG * ((x * y * z).inverse() * gravity);
    let moment = CENTER.cross(&force);
    let mut noise = || random.sample::<f64, _>(StandardNormal);
    std::array::from_fn(|k| match k {
        0..3 => force[k] + 0.05 * noise(),
        _ => moment[k - 3] + 0.002 * noise(),
    })
}

fn angles(random: &mut SmallRng) -> [f64; 3] {
    [0.0; 3].map(|_| random.random_range(-2.0..2.0))
}

/// Where x and y of gravity have the wrong sign, as on a tilted mount, no orientation is blamed:
/// none is given.
#[test]
fn a_fixed_base_has_no_orientation_in_another_form() {
    let mut random = SmallRng::seed_from_u64(1);
    let (mut q, mut wrenches) = (Vec::new(), Vec::new());
    for _ in 0..12 {
        let joints = angles(&mut random);
        wrenches.extend(wrench(joints, Vector3::new(4.0, 3.0, -8.43), &mut random));
        q.extend(joints);
    }
    let robot = wrist();
    let arrays = Arrays {
        robot: Some(&robot),
        q: &q,
        wrench: &wrenches,
        ..Arrays::default()
    };
    let request = Request {
        gravity: Some(GravityChoice::Given(Vector3::new(-4.0, -3.0, -8.43))),
        ..Request::default()
    };
    let findings = identify_poses(&arrays, &request)
        .unwrap()
        .recording
        .findings;
    let is_gravity = |finding: &Finding| matches!(finding, Finding::Data(Data::WrongAssumption(_)));
    assert!(findings.iter().any(is_gravity), "{findings:?}");
    let is_blamed = |finding: &Finding| matches!(finding, Finding::OrientationContradicted { .. });
    assert!(!findings.iter().any(is_blamed), "{findings:?}");
}

/// Returns the frames and the numbers of channels that are left out, and whether they are zero in
/// all samples.
fn left_out(findings: &[Finding]) -> Vec<(&str, usize, bool)> {
    let left_out = findings.iter().filter_map(|finding| match finding {
        Finding::Data(Data::ConstantChannels {
            frame,
            channels,
            is_left_out: true,
            is_zero,
            ..
        }) => Some((frame.as_ref(), channels.len(), *is_zero)),
        _ => None,
    });
    left_out.collect()
}

/// The channels that are left out at rest are those of the sensor that does not measure them.
#[test]
fn the_sensor_without_moments_is_named() {
    let mut random = SmallRng::seed_from_u64(2);
    let (mut q, mut wrenches) = (Vec::new(), Vec::new());
    for _ in 0..8 {
        let joints = angles(&mut random);
        let whole = wrench(joints, Vector3::new(0.0, 0.0, -9.81), &mut random);
        let half = whole.map(|value| 0.5 * value);
        wrenches.extend(half);
        wrenches.extend([half[0], half[1], half[2], f64::NAN, f64::NAN, f64::NAN]);
        q.extend(joints);
    }
    let robot = wrist();
    let arrays = Arrays {
        robot: Some(&robot),
        sensors: Some(&["tool0", "side"]),
        q: &q,
        wrench: &wrenches,
        ..Arrays::default()
    };
    let found = identify_poses(&arrays, &Request::default()).unwrap();
    assert_eq!(left_out(&found.recording.findings), [("side", 3, true)]);
}

/// A finger that touches nothing in the beginning, and whose moments are no numbers or zero until
/// it touches, is the one whose moments are left out, or not.
#[test]
fn a_finger_without_moments_is_named_although_it_touches_late() {
    for (moments, forces_begin, expected) in [
        // No number at any time.
        ([f64::NAN; 2], false, ("side", 3, true)),
        // Zero in the beginning, but not later.
        ([0.0, 1.0], true, ("side", 3, false)),
    ] {
        let mut random = SmallRng::seed_from_u64(3);
        let (mut q, mut wrenches, mut times_s) = (Vec::new(), Vec::new(), Vec::new());
        for k in 0..1800 {
            let time_s = f64::from(k) / 30.0;
            let joints = [0.7, 1.1, 0.5].map(|rate| 1.2 * (rate * time_s + rate).sin());
            let whole = wrench(joints, Vector3::new(0.0, 0.0, -9.81), &mut random);
            let is_late = time_s > 40.0;
            let share = if is_late || forces_begin { 0.5 } else { 0.0 };
            wrenches.extend(whole.map(|value| (1.0 - share) * value));
            let moment = moments[usize::from(is_late)] * share;
            wrenches.extend([0, 1, 2].map(|channel| share * whole[channel]));
            wrenches.extend([3, 4, 5].map(|channel| moment * whole[channel]));
            q.extend(joints);
            times_s.push(time_s);
        }
        let robot = wrist();
        let arrays = Arrays {
            robot: Some(&robot),
            sensors: Some(&["tool0", "side"]),
            time: &times_s,
            q: &q,
            wrench: &wrenches,
            ..Arrays::default()
        };
        let found = identify_arrays(&arrays, &Request::default(), &mut |_| {
            ControlFlow::Continue(())
        });
        let found = found.unwrap().into_least_squares().unwrap();
        assert_eq!(left_out(&found.recording.findings), [expected]);
    }
}
