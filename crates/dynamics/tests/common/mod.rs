//! Random bodies, states and robots, the same in every run.

#![allow(dead_code, reason = "each test file uses its own part")]

use std::fmt::Write;

use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3, Vector6};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use tactid_dynamics::{
    BaseKind, FrameMotion, InertialParameters, JointMotion, Manipulator, MassProperties, Workspace,
    Wrench, motion,
};

pub(crate) fn rng(seed: u64) -> StdRng {
    StdRng::seed_from_u64(seed)
}

/// Returns a vector with entries within `±size`.
pub(crate) fn vector(rng: &mut StdRng, size: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| rng.random_range(-size..size))
}

pub(crate) fn numbers(rng: &mut StdRng, count: usize, size: f64) -> Vec<f64> {
    (0..count).map(|_| rng.random_range(-size..size)).collect()
}

pub(crate) fn isometry(rng: &mut StdRng) -> Isometry3<f64> {
    Isometry3::from_parts(
        Translation3::from(vector(rng, 1.0)),
        UnitQuaternion::from_scaled_axis(vector(rng, 2.0)),
    )
}

/// A rigid body of point masses `(kg, m)`, an independent reference for inertial parameters.
pub(crate) struct Cloud(pub(crate) Vec<(f64, Vector3<f64>)>);

impl Cloud {
    pub(crate) fn random(rng: &mut StdRng) -> Self {
        let points = (0..6).map(|_| (rng.random_range(0.1..2.0), vector(rng, 0.5)));
        Self(points.collect())
    }

    pub(crate) fn mass(&self) -> f64 {
        self.0.iter().map(|(mass, _)| mass).sum()
    }

    pub(crate) fn center(&self) -> Vector3<f64> {
        let moment: Vector3<f64> = self.0.iter().map(|(mass, at)| at * *mass).sum();
        moment / self.mass()
    }

    /// Returns the inertia `Σ m (x² 1 - x xᵀ)` about a point.
    pub(crate) fn inertia_about(&self, point: &Vector3<f64>) -> Matrix3<f64> {
        let of_one = |(mass, at): &(f64, Vector3<f64>)| {
            let x = at - point;
            (Matrix3::identity() * x.norm_squared() - x * x.transpose()) * *mass
        };
        self.0.iter().map(of_one).sum()
    }

    pub(crate) fn mass_properties(&self) -> MassProperties {
        MassProperties {
            mass_kg: self.mass(),
            center_of_mass: self.center(),
            inertia: self.inertia_about(&self.center()),
        }
    }

    pub(crate) fn parameters(&self) -> InertialParameters {
        self.mass_properties().into()
    }
}

/// A state of a robot at time zero, which also defines a motion through it.
#[derive(Clone)]
pub(crate) struct State {
    pub(crate) base: FrameMotion,
    pub(crate) position: Vec<f64>,
    pub(crate) velocity: Vec<f64>,
    pub(crate) acceleration: Vec<f64>,
}

impl State {
    pub(crate) fn random(rng: &mut StdRng, dof: usize) -> Self {
        Self {
            base: FrameMotion {
                pose: isometry(rng),
                velocity: vector(rng, 1.0),
                angular_velocity: vector(rng, 1.0),
                acceleration: vector(rng, 2.0),
                angular_acceleration: vector(rng, 2.0),
            },
            position: numbers(rng, dof, 2.0),
            velocity: numbers(rng, dof, 1.0),
            acceleration: numbers(rng, dof, 2.0),
        }
    }

    pub(crate) fn joints(&self) -> JointMotion<'_> {
        JointMotion {
            position: &self.position,
            velocity: &self.velocity,
            acceleration: &self.acceleration,
        }
    }

    pub(crate) fn moved(&self, robot: &Manipulator) -> Workspace {
        let mut workspace = Workspace::new(robot);
        motion(&mut workspace, &self.base, self.joints()).unwrap();
        workspace
    }

    /// Returns pose and velocity a short time later or earlier. The base turns by `Exp(φ)` with
    /// `φ = ω t + ω̇ t²/2`, so that its angular velocity is the left Jacobian of `Exp` times `φ̇`.
    pub(crate) fn at(&self, t: f64) -> Self {
        let base = &self.base;
        let (w, dw) = (base.angular_velocity, base.angular_acceleration);
        let (phi, phi_dot) = (w * t + dw * (0.5 * t * t), w + dw * t);
        let turned = UnitQuaternion::from_scaled_axis(phi);
        let slid = base.velocity * t + base.acceleration * (0.5 * t * t);
        let angle = phi.norm_squared();
        let once = phi.cross(&phi_dot);
        let mut later = self.clone();
        later.base.pose = Isometry3::from_parts(
            Translation3::from(base.pose.translation.vector + slid),
            turned * base.pose.rotation,
        );
        later.base.velocity += base.acceleration * t;
        later.base.angular_velocity =
            phi_dot + once * (0.5 - angle / 24.0) + phi.cross(&once) * (1.0 / 6.0 - angle / 120.0);
        for joint in 0..self.position.len() {
            let (velocity, acceleration) = (self.velocity[joint], self.acceleration[joint]);
            later.position[joint] += velocity * t + 0.5 * acceleration * t * t;
            later.velocity[joint] += acceleration * t;
        }
        later
    }
}

/// Returns the derivative at zero by central differences of fourth order.
pub(crate) fn derivative<T>(f: impl Fn(f64) -> T) -> T
where
    T: std::ops::Sub<Output = T> + std::ops::Mul<f64, Output = T>,
{
    let h = 2e-3;
    ((f(h) - f(-h)) * 8.0 - (f(2.0 * h) - f(-2.0 * h))) * (1.0 / (12.0 * h))
}

/// Returns the second derivative at zero by central differences of fourth order.
pub(crate) fn second_derivative<T>(f: impl Fn(f64) -> T) -> T
where
    T: std::ops::Sub<Output = T> + std::ops::Add<Output = T> + std::ops::Mul<f64, Output = T>,
{
    let h = 4e-3;
    ((f(h) + f(-h)) * 16.0 - (f(2.0 * h) + f(-2.0 * h)) - f(0.0) * 30.0) * (1.0 / (12.0 * h * h))
}

/// One link of a random tree and the joint above it.
pub(crate) struct RandomLink {
    pub(crate) parent: usize,
    pub(crate) kind: &'static str,
    /// Link of the joint that the joint mimics, with multiplier and offset.
    pub(crate) mimic: Option<(usize, f64, f64)>,
    /// Parameters in the link's frame.
    pub(crate) parameters: InertialParameters,
    joint: String,
    inertial: String,
}

/// A random tree with branches, every kind of joint, random axes and origins. Link `i` is `link_i`
/// below `joint_i`, and `link_0` is the base.
pub(crate) struct RandomTree(pub(crate) Vec<RandomLink>);

impl RandomTree {
    pub(crate) fn new(seed: u64) -> Self {
        let mut rng = rng(seed);
        let count = rng.random_range(5..12);
        let mut links: Vec<RandomLink> = Vec::new();
        for index in 0..count {
            let kinds = ["revolute", "continuous", "prismatic", "fixed"];
            let kind = kinds[rng.random_range(0..if index == 1 { 3 } else { 4 })];
            // Most links are added to the last one, so that chains grow long.
            let last: usize = index.max(1) - 1;
            let parent = if rng.random_bool(0.6) {
                last
            } else {
                rng.random_range(0..=last)
            };
            let weighs = kind != "fixed" || rng.random_bool(0.5);
            let (inertial, parameters) = if weighs {
                random_inertial(&mut rng)
            } else {
                (String::new(), InertialParameters::zero())
            };
            links.push(RandomLink {
                parent,
                kind,
                mimic: None,
                parameters,
                joint: random_joint(&mut rng),
                inertial,
            });
        }
        links[0].kind = "fixed"; // The base has no joint.
        if links[0].inertial.is_empty() {
            (links[0].inertial, links[0].parameters) = random_inertial(&mut rng);
        }
        let mut tree = Self(links);
        tree.add_mimics(&mut rng);
        tree
    }

    /// Makes about every fourth moving joint mimic the first one.
    fn add_mimics(&mut self, rng: &mut StdRng) {
        let moving: Vec<_> = (1..self.0.len())
            .filter(|&link| self.0[link].kind != "fixed")
            .collect();
        for &link in &moving[1..] {
            if rng.random_bool(0.25) {
                let (ratio, offset) = (rng.random_range(-2.0..2.0), rng.random_range(-0.5..0.5));
                self.0[link].mimic = Some((moving[0], ratio, offset));
            }
        }
    }

    /// Returns the tree as a URDF. Without `honour_mimic` every joint is independent.
    pub(crate) fn urdf(&self, honour_mimic: bool) -> String {
        let mut xml = String::from("<robot name='random'>\n");
        for (index, link) in self.0.iter().enumerate() {
            let inertial = &link.inertial;
            writeln!(xml, "<link name='link_{index}'>{inertial}</link>").unwrap();
            if index == 0 {
                continue;
            }
            let (kind, parent, joint) = (link.kind, link.parent, &link.joint);
            write!(
                xml,
                "<joint name='joint_{index}' type='{kind}'><parent link='link_{parent}'/>\
                 <child link='link_{index}'/>{joint}"
            )
            .unwrap();
            if let (Some((leader, ratio, offset)), true) = (link.mimic, honour_mimic) {
                write!(
                    xml,
                    "<mimic joint='joint_{leader}' multiplier='{ratio}' offset='{offset}'/>"
                )
                .unwrap();
            }
            xml.push_str("</joint>\n");
        }
        xml + "</robot>"
    }

    pub(crate) fn robot(&self) -> Manipulator {
        Manipulator::from_urdf(&self.urdf(true), BaseKind::Floating).unwrap()
    }

    /// Removes the mass of a link.
    pub(crate) fn remove_mass(&mut self, link: usize) {
        self.0[link].inertial.clear();
        self.0[link].parameters = InertialParameters::zero();
    }

    /// Returns the links below a link, which itself is not included.
    pub(crate) fn below(&self, link: usize) -> Vec<usize> {
        let is_below = |&index: &usize| {
            let mut above = index;
            while above != 0 && above != link {
                above = self.0[above].parent;
            }
            index != link && above == link
        };
        (0..self.0.len()).filter(is_below).collect()
    }
}

fn triple(v: Vector3<f64>) -> String {
    format!("{} {} {}", v.x, v.y, v.z)
}

fn random_joint(rng: &mut StdRng) -> String {
    format!(
        "<origin xyz='{}' rpy='{}'/><axis xyz='{}'/><limit lower='-1' upper='1' effort='1' velocity='1'/>",
        triple(vector(rng, 0.6)),
        triple(vector(rng, 2.0)),
        triple(vector(rng, 3.0)),
    )
}

/// Returns an `<inertial>` element with a random origin and its parameters in the link's frame.
fn random_inertial(rng: &mut StdRng) -> (String, InertialParameters) {
    let body = Cloud::random(rng).mass_properties();
    let (xyz, rpy) = (vector(rng, 0.3), vector(rng, 2.0));
    let (mass_kg, i) = (body.mass_kg, body.inertia);
    let turned = UnitQuaternion::from_euler_angles(rpy.x, rpy.y, rpy.z);
    let rotation = turned.to_rotation_matrix();
    let parameters = InertialParameters::from(MassProperties {
        mass_kg,
        center_of_mass: xyz,
        inertia: rotation * i * rotation.transpose(),
    });
    let xml = format!(
        "<inertial><origin xyz='{}' rpy='{}'/><mass value='{mass_kg}'/><inertia ixx='{}' ixy='{}' ixz='{}' iyy='{}' iyz='{}' izz='{}'/></inertial>",
        triple(xyz),
        triple(rpy),
        i.m11,
        i.m12,
        i.m13,
        i.m22,
        i.m23,
        i.m33,
    );
    (xml, parameters)
}

/// Returns force and moment as one vector.
pub(crate) fn six(wrench: Wrench) -> Vector6<f64> {
    let (f, n) = (wrench.force, wrench.moment);
    Vector6::new(f.x, f.y, f.z, n.x, n.y, n.z)
}

/// Returns the project's own robot with a floating base.
pub(crate) fn tactid() -> Manipulator {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../sim/robots/tactid.urdf");
    Manipulator::from_urdf_file(path.as_ref(), BaseKind::Floating).unwrap()
}

/// Returns the project's robot and twenty random trees.
pub(crate) fn robots() -> Vec<Manipulator> {
    let trees = (0..20).map(|seed| RandomTree::new(seed).robot());
    std::iter::once(tactid()).chain(trees).collect()
}

/// Asserts that two values agree within `tolerance` times one plus the norm of `expected`.
#[track_caller]
pub(crate) fn assert_close<const R: usize, const C: usize>(
    given: &nalgebra::SMatrix<f64, R, C>,
    expected: &nalgebra::SMatrix<f64, R, C>,
    tolerance: f64,
    what: &str,
) {
    let error = (given - expected).norm();
    let bound = tolerance * (1.0 + expected.norm());
    assert!(
        error <= bound,
        "{what}: off by {error:e}, allowed {bound:e}\ngiven {given}expected {expected}"
    );
}
