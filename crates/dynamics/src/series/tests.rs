//! Every vector unit that the processor has, not only the widest, gives what the baseline gives.

#![allow(clippy::unwrap_used)]

use nalgebra::Isometry3;
use rand::{RngExt, SeedableRng, rngs::SmallRng};

use super::*;
use crate::BaseKind;
use crate::real::{bounded_angle, sin_cos};

/// Returns the vector units of this processor by name.
fn units() -> Vec<(&'static str, pulp::Arch)> {
    let units = vec![("widest", pulp::Arch::new())];
    #[cfg(target_arch = "x86_64")]
    let units = {
        let avx2 = pulp::x86::V3::try_new().map(|unit| ("AVX2", pulp::Arch::V3(unit)));
        let avx512 = pulp::x86::V4::try_new().map(|unit| ("AVX-512", pulp::Arch::V4(unit)));
        units.into_iter().chain(avx2).chain(avx512).collect()
    };
    units
}

/// Torques, base wrenches and rows of the tool of all states, one number after another.
fn results(dynamics: &BatchDynamics, numbers: &[f64], count: usize) -> Vec<f64> {
    let dof = dynamics.robot.dof();
    let part = |k: usize| &numbers[k * dof * count..(k + 1) * dof * count];
    let states = StateSeries {
        base: &[FrameMotion::at_rest(Isometry3::identity())],
        joints: JointMotion {
            position: part(0),
            velocity: part(1),
            acceleration: part(2),
        },
    };
    let gravity = Vector3::new(1.0, 2.0, -9.0);
    let (mut torques, mut wrenches) = (vec![0.0; dof * count], vec![[0.0; 6]; count]);
    let mut rows = vec![SMatrix::zeros(); count];
    let tool = dynamics.robot.frame("tool0").unwrap();
    dynamics
        .inverse_dynamics(&states, &gravity, &mut torques, &mut wrenches)
        .unwrap();
    dynamics
        .wrench_regressors(tool, &states, &gravity, &mut rows)
        .unwrap();
    let rows = rows.iter().flat_map(|rows| rows.iter().copied());
    torques
        .into_iter()
        .chain(wrenches.into_iter().flatten())
        .chain(rows)
        .collect()
}

#[test]
fn each_vector_unit_agrees_with_the_baseline() {
    let urdf = include_str!("../../../sim/robots/tactid.urdf");
    let robot = Manipulator::from_urdf(urdf, BaseKind::Fixed).unwrap();
    let mut random = SmallRng::seed_from_u64(5);
    for count in 1..=17 {
        let numbers: Vec<f64> = (0..3 * robot.dof() * count)
            .map(|_| random.random_range(-3.0..3.0))
            .collect();
        let dynamics = BatchDynamics::new(&robot).with_unit(VectorUnit::Baseline);
        let expected = results(&dynamics, &numbers, count);
        for (name, arch) in units() {
            let dynamics = BatchDynamics {
                arch,
                ..dynamics.clone()
            };
            let given = results(&dynamics, &numbers, count);
            for (given, expected) in given.iter().zip(&expected) {
                let error = (given - expected).abs();
                let bound = 1e-11 * (1.0 + expected.abs());
                assert!(error <= bound, "{name}, {count} states: {error:e}");
            }
        }
    }
}

/// Sine and cosine of angles in the lanes of a register.
struct Angles<'a> {
    angles: &'a [f64],
    found: &'a mut Vec<(f64, f64)>,
}

impl Computation for Angles<'_> {
    #[inline(always)]
    fn run<T: Lanes>(self, zero: T) {
        for angles in self.angles.chunks(T::COUNT) {
            let mut numbers = [[0.0; MOST_LANES]; 3];
            for (number, angle) in numbers[0].iter_mut().zip(angles) {
                *number = bounded_angle(*angle);
            }
            let (sin, cos) = sin_cos(zero.read(&numbers[0]));
            sin.write(&mut numbers[1]);
            cos.write(&mut numbers[2]);
            let [_, sin, cos] = numbers;
            self.found
                .extend(sin.into_iter().zip(cos).take(angles.len()));
        }
    }
}

/// Fused products change the last digit of sine and cosine and no more.
#[test]
fn sine_and_cosine_in_lanes_are_those_of_the_standard_library() {
    let angles: Vec<f64> = (-40_000..40_000).map(|k| f64::from(k) * 0.01237).collect();
    for (name, arch) in units() {
        let mut found = Vec::new();
        arch.dispatch(OnUnit(Angles {
            angles: &angles,
            found: &mut found,
        }));
        assert_eq!(found.len(), angles.len());
        for (angle, (sin, cos)) in angles.iter().zip(found) {
            let expected = angle.sin_cos();
            let error = (sin - expected.0).abs().max((cos - expected.1).abs());
            assert!(error <= 2.3e-16, "{name}, {angle}: off by {error:e}");
        }
    }
}
