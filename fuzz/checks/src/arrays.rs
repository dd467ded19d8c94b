//! Identifies from arrays of any lengths and numbers: one error, or a finite result.

use std::ops::ControlFlow;

use crate::{Number, arm_urdf, estimate::assert_identified, numbers, parsed, robot};
use arbitrary::Arbitrary;
use nalgebra::{Isometry3, Vector3};
use tactid_dynamics::{BaseKind, Urdf};
use tactid_recordings::{
    ActsOn, Arrays, BoundingBox, EstimatorKind, GravityChoice, Method, OffsetChoice, Request,
    UnloadedArrays, identify_arrays,
};

#[derive(Arbitrary, Debug)]
struct Input {
    method: u8,
    robot: u8,
    paper: bool,
    period_s: Option<Number>,
    count: u16,
    times: Vec<Number>,
    position: Vec<Number>,
    velocity: Vec<Number>,
    effort: Vec<Number>,
    wrenches: Vec<Number>,
    poses: Vec<[Number; 6]>,
    twists: Vec<Number>,
    accelerations: Vec<Number>,
    unloaded: Option<(Vec<Number>, Vec<Number>, Vec<Number>)>,
    cutoff_hz: Option<Number>,
    max_gap_s: Option<Number>,
    delay_s: Option<Number>,
    gravity: Option<[Number; 3]>,
    wrench_noise: Option<Vec<[Number; 6]>>,
    effort_gain: Option<Vec<Number>>,
    wrench_offset: Option<bool>,
    acts_on_sensor: bool,
    known_mass: Option<[Number; 2]>,
    bounding_box: Option<[Number; 6]>,
}

/// Checks one input.
///
/// # Panics
/// Panics if a property does not hold.
pub fn run(bytes: &[u8]) {
    let Some(input) = parsed::<Input>(bytes) else {
        return;
    };
    let count = usize::from(input.count % 512);
    let regular = |k: usize| k as f64 * input.period_s.map_or(0.01, |period| period.0);
    let times: Vec<f64> = if input.times.is_empty() {
        (0..count).map(regular).collect()
    } else {
        numbers(&input.times)
    };
    // A single row repeats with a motion, so that the lengths fit often enough.
    let filled = |all: &[Number], columns: usize| -> Vec<f64> {
        let given = numbers(all);
        if given.len() != columns {
            return given;
        }
        let moved = |row: usize, column: usize| {
            given[column] + (0.05 * row as f64 * (1.0 + column as f64)).sin()
        };
        (0..times.len())
            .flat_map(|row| {
                (0..columns)
                    .map(move |column| moved(row, column))
                    .collect::<Vec<_>>()
            })
            .collect()
    };
    let robot = match input.robot % 4 {
        0 => None,
        1 => Some(robot(BaseKind::Floating)),
        _ => Some(robot(BaseKind::Fixed)),
    };
    let pose = |all: &[Number; 6]| {
        let [x, y, z, a, b, c] = all.map(|number| number.0);
        Isometry3::new(Vector3::new(x, y, z), Vector3::new(a, b, c))
    };
    let poses: Vec<Isometry3<f64>> = input.poses.iter().map(pose).collect();
    let (position, velocity, effort) = (
        filled(&input.position, 2),
        filled(&input.velocity, 2),
        filled(&input.effort, 2),
    );
    let (wrenches, twists) = (filled(&input.wrenches, 6), filled(&input.twists, 6));
    let accelerations = filled(&input.accelerations, 6);
    let unloaded = input
        .unloaded
        .as_ref()
        .map(|(t, q, e)| (numbers(t), numbers(q), numbers(e)));
    let arrays = Arrays {
        robot,
        sensors: None,
        time: &times,
        q: &position,
        qd: &velocity,
        effort: &effort,
        wrench: &wrenches,
        pose: &poses,
        twist: &twists,
        acceleration: &accelerations,
        unloaded: unloaded
            .as_ref()
            .map(|(time, q, effort)| UnloadedArrays { time, q, effort }),
    };
    let mut observer = |_| ControlFlow::Continue(());
    if let Ok(result) = identify_arrays(&arrays, &request(&input), &mut observer) {
        assert_identified(&result);
    }
}

fn request(input: &Input) -> Request {
    let methods = [
        Method::Tactile,
        Method::JointSensing,
        Method::Effort,
        Method::Combined { effort: true },
    ];
    Request {
        method: methods.get(usize::from(input.method % 5)).copied(),
        estimator: input.paper.then_some(EstimatorKind::Nlms),
        urdf: (input.robot % 8 == 4)
            .then(|| Urdf::from_xml(arm_urdf()).ok())
            .flatten(),
        wrench_acts_on: input.acts_on_sensor.then_some(ActsOn::Sensor),
        gravity: input
            .gravity
            .map(|all| GravityChoice::Given(all.map(|number| number.0).into())),
        cutoff_hz: input.cutoff_hz.map(|number| number.0),
        max_gap_s: input.max_gap_s.map(|number| number.0),
        delay_s: input.delay_s.map(|number| number.0),
        wrench_offset: input.wrench_offset.map(|offset| match offset {
            true => OffsetChoice::Yes,
            false => OffsetChoice::No,
        }),
        known_mass_kg: input.known_mass.map(|[mass, _]| mass.0),
        known_mass_std_dev_kg: input.known_mass.map(|[_, std_dev]| std_dev.0),
        bounding_box: input.bounding_box.map(|corners| {
            let [a, b, c, d, e, f] = corners.map(|number| number.0);
            BoundingBox {
                min: Vector3::new(a, b, c),
                max: Vector3::new(d, e, f),
            }
        }),
        wrench_noise: input
            .wrench_noise
            .as_ref()
            .map(|all| all.iter().map(|one| one.map(|number| number.0)).collect()),
        effort_gain: input.effort_gain.as_ref().map(|all| numbers(all)),
        ..Request::default()
    }
}
