//! Faults of a wrist sensor, of gravity and of the joints, put into recordings.

use nalgebra::{Matrix3, Rotation3, UnitVector3, Vector3};
use rand::{RngExt, SeedableRng, rngs::SmallRng};
use rand_distr::StandardNormal;
use tactid_batch::Hypothesis;
use tactid_dynamics::Wrench;

use crate::setups::{DOWN, Recording};

/// What is wrong in a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Fault {
    Offset,
    Weight,
    Gravity,
    Place,
    Turn,
    QuarterTurn,
    Gain,
    Sign,
    Exchanged,
    Delay,
    JointZero,
}

impl Fault {
    pub(crate) const ALL: [Self; 11] = [
        Self::Offset,
        Self::Weight,
        Self::Gravity,
        Self::Place,
        Self::Turn,
        Self::QuarterTurn,
        Self::Gain,
        Self::Sign,
        Self::Exchanged,
        Self::Delay,
        Self::JointZero,
    ];

    /// The hypotheses that say the same.
    pub(crate) fn causes(self) -> &'static [Hypothesis] {
        match self {
            Self::Offset => &[Hypothesis::Offset],
            Self::Weight => &[Hypothesis::Weight],
            Self::Gravity => &[Hypothesis::Gravity],
            Self::Place => &[Hypothesis::SensorPlace],
            Self::Turn => &[Hypothesis::SensorRotation],
            Self::QuarterTurn => &[Hypothesis::SensorRotation, Hypothesis::Axes],
            Self::Gain => &[Hypothesis::AxisGains],
            Self::Sign | Self::Exchanged => &[Hypothesis::Axes],
            Self::Delay => &[Hypothesis::Delay],
            Self::JointZero => &[Hypothesis::JointZeros],
        }
    }
}

/// Random numbers of a fault.
pub(crate) struct Draws(SmallRng);

impl Draws {
    pub(crate) fn new(seed: u64) -> Self {
        Self(SmallRng::seed_from_u64(seed))
    }

    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0.random_range(low..high)
    }

    fn normal(&mut self) -> f64 {
        self.0.sample(StandardNormal)
    }

    pub(crate) fn vector(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.normal())
    }

    fn direction(&mut self) -> Vector3<f64> {
        UnitVector3::new_normalize(self.vector()).into_inner()
    }

    fn axis(&mut self) -> usize {
        self.0.random_range(0..3)
    }
}

impl Fault {
    /// Puts the fault into a recording.
    pub(crate) fn put(self, given: &mut Recording, draws: &mut Draws) {
        match self {
            Self::Offset | Self::Weight | Self::Gravity => self.add(given, draws),
            Self::Delay | Self::JointZero => self.shift(given, draws),
            _ => self.mount(given, draws),
        }
    }

    /// Adds a force and a moment.
    fn add(self, given: &mut Recording, draws: &mut Draws) {
        match self {
            Self::Offset => {
                let force = draws.direction() * draws.between(2.0, 12.0);
                let moment = draws.direction() * draws.between(0.05, 0.5);
                change(given, |_, w| (w.force + force, w.moment + moment));
            }
            Self::Weight => {
                let mass_kg = draws.between(0.4, 1.5);
                let at = draws.direction() * 0.06;
                let gravity = given.in_tool(DOWN * mass_kg);
                change(given, |k, w| {
                    (w.force + gravity[k], w.moment + at.cross(&gravity[k]))
                });
            }
            Self::Gravity => {
                let axis = Vector3::new(draws.normal(), draws.normal(), 0.0).normalize();
                let angle = draws.between(5.0, 90.0).to_radians();
                let tilted = Rotation3::new(axis * angle) * DOWN;
                let less = given.in_tool(DOWN - tilted);
                let (mass_kg, com) = (
                    given.setup.payload().mass_kg,
                    given.setup.payload().center_of_mass,
                );
                change(given, |k, w| {
                    let force = less[k] * mass_kg;
                    (w.force + force, w.moment + com.cross(&force))
                });
            }
            _ => {}
        }
    }

    /// Mounts the sensor elsewhere, or changes its axes.
    fn mount(self, given: &mut Recording, draws: &mut Draws) {
        match self {
            Self::Place => {
                let place = draws.direction() * draws.between(0.02, 0.05);
                change(given, |_, w| (w.force, w.moment - place.cross(&w.force)));
            }
            Self::Turn => {
                let turn =
                    Rotation3::new(draws.direction() * draws.between(4.0, 60.0).to_radians());
                change(given, |_, w| (turn * w.force, turn * w.moment));
            }
            Self::QuarterTurn => {
                let quarter = f64::to_radians(90.0);
                let turn = Rotation3::new(Vector3::ith(draws.axis(), quarter));
                change(given, |_, w| (turn * w.force, turn * w.moment));
            }
            Self::Gain => {
                let (axis, gain) = (draws.axis(), draws.between(1.1, 1.4));
                change(given, |_, mut w| {
                    w.force[axis] *= gain;
                    (w.force, w.moment)
                });
            }
            Self::Sign => {
                let (axis, of_moment) = (draws.axis(), draws.normal() > 0.0);
                change(given, |_, mut w| {
                    let vector = if of_moment {
                        &mut w.moment
                    } else {
                        &mut w.force
                    };
                    vector[axis] *= -1.0;
                    (w.force, w.moment)
                });
            }
            Self::Exchanged => {
                // The forces, the moments, or both.
                let (axis, which) = (draws.axis(), draws.axis());
                change(given, |_, mut w| {
                    if which != 1 {
                        w.force.swap_rows(axis, (axis + 1) % 3);
                    }
                    if which != 0 {
                        w.moment.swap_rows(axis, (axis + 1) % 3);
                    }
                    (w.force, w.moment)
                });
            }
            _ => {}
        }
    }

    /// Delays the wrenches, or moves the zero of a joint.
    fn shift(self, given: &mut Recording, draws: &mut Draws) {
        match self {
            Self::Delay => {
                let before = given.wrenches.clone();
                let late = draws.between(4.0, 8.0) as usize;
                for (k, wrench) in given.wrenches.iter_mut().enumerate() {
                    *wrench = before[k.saturating_sub(late)];
                }
            }
            Self::JointZero => {
                let joint = 1 + (draws.axis() + 2 * draws.axis()) % (given.setup.table.len() - 2);
                let zero = draws.between(2.0, 6.0).to_radians();
                for joints in &mut given.joints {
                    joints[0][joint] += zero;
                }
            }
            _ => {}
        }
    }
}

fn change(given: &mut Recording, of: impl Fn(usize, Wrench) -> (Vector3<f64>, Vector3<f64>)) {
    for (k, wrench) in given.wrenches.iter_mut().enumerate() {
        let (force, moment) = of(k, *wrench);
        *wrench = Wrench { force, moment };
    }
}

/// Cross-talk of half a percent between all channels, with noise that stays for a tenth of a second
/// in every second recording.
pub(crate) fn of_a_real_sensor(given: &mut Recording, draws: &mut Draws) {
    let mut talk = |scale: f64| Matrix3::from_fn(|_, _| scale * draws.between(-0.005, 0.005));
    let (ff, fm, mf, mm) = (talk(1.0), talk(1.0), talk(0.05), talk(1.0));
    change(given, |_, w| {
        (
            w.force + ff * w.force + fm * w.moment,
            w.moment + mf * w.force + mm * w.moment,
        )
    });
    if draws.normal() > 0.0 {
        let (noise, mut state) = (given.setup.noise, [Vector3::zeros(); 2]);
        for wrench in &mut given.wrenches {
            for vector in &mut state {
                *vector = *vector * 0.95 + draws.vector() * 0.3;
            }
            wrench.force += state[0] * noise[0];
            wrench.moment += state[1] * noise[1];
        }
    }
}
