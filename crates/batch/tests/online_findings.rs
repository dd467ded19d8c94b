//! What an online identifier has noticed.

use nalgebra::Vector3;
use rand::{RngExt, SeedableRng, rngs::SmallRng};
use rand_distr::StandardNormal;
use tactid_batch::{Finding, online_findings};
use tactid_dynamics::{BaseKind, Wrench};
use tactid_identify::{ActsOn, EquationSettings, Identifier, OnlineSettings};

use crate::arm::{Run, TOOL, arm, body};
use crate::handling;

/// Returns an identifier that has seen 4 s of a motion with an offset, N, of the measured wrenches.
/// `degrees` is the factor on the joint velocities.
fn seen(
    acts_on: ActsOn,
    offset: Vector3<f64>,
    degrees: f64,
) -> (Identifier, tactid_identify::Snapshot) {
    let run = Run {
        base: BaseKind::Fixed,
        rate_hz: 500.0,
        payloads: vec![(0.0, body(3.2, [0.03, -0.02, 0.09], [0.2, 0.15, 0.25]))],
        duration_s: 4.0,
        gap_s: None,
        motion_seed: 4,
    };
    let mut random = SmallRng::seed_from_u64(4);
    let mut draw =
        |std_dev: f64| Vector3::from_fn(|_, _| std_dev * random.sample::<f64, _>(StandardNormal));
    let (settings, online) = (
        EquationSettings::default(),
        OnlineSettings {
            wrench_acts_on: acts_on,
            ..OnlineSettings::default()
        },
    );
    let robot = arm(BaseKind::Fixed);
    let mut identifier =
        Identifier::with_settings(&robot, TOOL, &[TOOL], &settings, &online).unwrap();
    let mut snapshot = identifier.snapshot();
    for instant in handling::stopping(&run, 100.0, |_, _| Wrench::zero()) {
        let wrench = Wrench {
            force: (instant.wrench.force + draw(0.3)) * acts_on.sign() + offset,
            moment: (instant.wrench.moment + draw(0.02)) * acts_on.sign(),
        };
        let wrenches = [wrench];
        let mut sample = instant.sample(&wrenches);
        let velocity: Vec<f64> = sample.joint_velocity.iter().map(|v| degrees * v).collect();
        sample.joint_velocity = &velocity;
        identifier.push(&sample).unwrap();
        identifier.update_snapshot(&mut snapshot);
    }
    (identifier, snapshot)
}

/// A snapshot that was updated has the findings of a new one.
#[test]
fn an_updated_snapshot_has_the_findings_of_a_new_one() {
    let (identifier, updated) = seen(ActsOn::Payload, Vector3::zeros(), 57.3);
    let findings = online_findings(&updated);
    let contradicts = |finding: &Finding| matches!(finding, Finding::VelocitiesContradicted(_));
    assert!(findings.iter().any(contradicts), "{findings:?}");
    assert_eq!(findings, online_findings(&identifier.snapshot()));
}

/// An offset that is reported has the sign of the measured wrenches, whatever these act on.
#[test]
fn a_reported_offset_has_the_sign_of_the_wrenches() {
    let offset = Vector3::new(18.0, -12.0, 25.0);
    for acts_on in [ActsOn::Payload, ActsOn::Sensor] {
        let (_, snapshot) = seen(acts_on, offset, 1.0);
        let findings = online_findings(&snapshot);
        let found = findings.iter().find_map(|finding| match finding {
            Finding::WrongAssumption(found) => Some(&found.values),
            _ => None,
        });
        let found = found.unwrap_or_else(|| panic!("{findings:?}"));
        let error = Vector3::from_column_slice(&found[..3]) - offset;
        assert!(error.norm() < 2.0, "{findings:?}");
    }
}
