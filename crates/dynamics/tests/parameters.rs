//! The ten inertial parameters against clouds of point masses.

use crate::common::{Cloud, assert_close, isometry, rng, vector};
use nalgebra::{Matrix3, Matrix4, Vector3};
use tactid_dynamics::{InertialParameters, MassProperties, symmetric_entries, symmetric_matrix};

const TOLERANCE: f64 = 1e-13;

fn box_of(mass_kg: f64, moments: [f64; 3]) -> InertialParameters {
    InertialParameters::from(MassProperties {
        mass_kg,
        center_of_mass: Vector3::new(0.3, -0.2, 0.1),
        inertia: Matrix3::from_diagonal(&Vector3::from(moments)),
    })
}

/// Conversion between the ten parameters and mass properties is exact in both directions.
#[test]
fn mass_properties_round_trip() {
    let rng = &mut rng(1);
    for _ in 0..100 {
        let body = Cloud::random(rng).mass_properties();
        let again = InertialParameters::from(body).mass_properties().unwrap();
        assert!((again.mass_kg - body.mass_kg).abs() <= TOLERANCE * body.mass_kg);
        assert_close(&again.center_of_mass, &body.center_of_mass, TOLERANCE, "a");
        assert_close(&again.inertia, &body.inertia, TOLERANCE, "I");
    }
    assert_eq!(InertialParameters::zero().mass_properties(), None);
}

/// The ten parameters of a cloud are sums over its points about the frame's origin: the
/// parallel-axis term has the right sign, and products of inertia are matrix entries.
#[test]
fn parameters_are_sums_over_points() {
    let rng = &mut rng(2);
    for _ in 0..100 {
        let cloud = Cloud::random(rng);
        let parameters = cloud.parameters();
        let about_origin = cloud.inertia_about(&Vector3::zeros());
        let first_moment = cloud.center() * cloud.mass();
        assert_close(
            &parameters.inertia_about_origin(),
            &about_origin,
            TOLERANCE,
            "I",
        );
        assert_close(&parameters.first_moment(), &first_moment, TOLERANCE, "m a");
        let made = InertialParameters::from_moments(cloud.mass(), &first_moment, &about_origin);
        assert_close(
            made.as_vector(),
            parameters.as_vector(),
            TOLERANCE,
            "from_moments",
        );
        let entries = symmetric_entries(&about_origin);
        assert_eq!(
            parameters.as_vector()[5],
            parameters.inertia_about_origin()[(0, 1)]
        );
        assert_close(
            &symmetric_matrix(entries),
            &about_origin,
            TOLERANCE,
            "six entries",
        );
    }
}

/// The pseudo-inertia is the sum of `m [x; 1][x; 1]ᵀ` over points; it determines the parameters.
#[test]
fn pseudo_inertia_is_the_second_moment_of_points() {
    let rng = &mut rng(3);
    for _ in 0..100 {
        let cloud = Cloud::random(rng);
        let second_moment = |(mass, at): &(f64, Vector3<f64>)| {
            let x = at.push(1.0);
            x * x.transpose() * *mass
        };
        let expected: Matrix4<f64> = cloud.0.iter().map(second_moment).sum();
        let parameters = cloud.parameters();
        assert_close(
            &parameters.pseudo_inertia(),
            &expected,
            TOLERANCE,
            "pseudo-inertia",
        );
        let back = InertialParameters::from_pseudo_inertia(&expected);
        assert_close(back.as_vector(), parameters.as_vector(), TOLERANCE, "back");
    }
}

/// A change of frame moves the points of the cloud, and the inverse change restores the parameters.
#[test]
fn change_of_frame_moves_the_points() {
    let rng = &mut rng(4);
    for _ in 0..100 {
        let (cloud, a_from_b) = (Cloud::random(rng), isometry(rng));
        let in_b = cloud.parameters();
        let in_a = in_b.expressed_in(&a_from_b);
        let moved = |(mass, at): &(f64, Vector3<f64>)| {
            (*mass, (a_from_b * nalgebra::Point3::from(*at)).coords)
        };
        let expected = Cloud(cloud.0.iter().map(moved).collect()).parameters();
        assert_close(in_a.as_vector(), expected.as_vector(), TOLERANCE, "there");
        let back = in_a.expressed_in(&a_from_b.inverse());
        assert_close(back.as_vector(), in_b.as_vector(), TOLERANCE, "and back");
    }
}

/// The sum of two bodies has the parameters of all points, and subtraction removes one body again.
#[test]
fn bodies_add_and_subtract() {
    let rng = &mut rng(5);
    for _ in 0..100 {
        let (one, other) = (Cloud::random(rng), Cloud::random(rng));
        let both = Cloud(one.0.iter().chain(&other.0).copied().collect()).parameters();
        let sum: InertialParameters = [one.parameters(), other.parameters()].into_iter().sum();
        assert_close(sum.as_vector(), both.as_vector(), TOLERANCE, "sum");
        let rest = both - other.parameters();
        assert_close(
            rest.as_vector(),
            one.parameters().as_vector(),
            TOLERANCE,
            "rest",
        );
        let rest = both + -other.parameters();
        assert_close(
            rest.as_vector(),
            one.parameters().as_vector(),
            TOLERANCE,
            "negated",
        );
    }
}

/// Every three-dimensional cloud of positive masses is physical in any frame.
#[test]
fn clouds_of_positive_mass_are_physical() {
    let rng = &mut rng(6);
    for _ in 0..100 {
        let cloud = Cloud::random(rng);
        assert!(cloud.parameters().is_physical());
        let elsewhere = cloud.parameters().expressed_in(&isometry(rng));
        assert!(elsewhere.is_physical());
    }
}

/// A negative mass, a principal moment above the sum of the two others, a negative moment and a
/// number that is not finite are not physical.
#[test]
fn impossible_bodies_are_not_physical() {
    assert!(box_of(2.0, [1.0, 2.0, 2.9]).is_physical());
    assert!(
        !box_of(2.0, [1.0, 2.0, 3.1]).is_physical(),
        "triangle inequality"
    );
    assert!(
        !box_of(2.0, [3.1, 2.0, 1.0]).is_physical(),
        "triangle inequality"
    );
    assert!(
        !box_of(-2.0, [1.0, 2.0, 2.0]).is_physical(),
        "negative mass"
    );
    assert!(
        !(-box_of(2.0, [1.0, 2.0, 2.0])).is_physical(),
        "negated body"
    );
    assert!(
        !box_of(2.0, [-0.1, 2.0, 2.0]).is_physical(),
        "negative moment"
    );
    assert!(!box_of(f64::NAN, [1.0, 2.0, 2.0]).is_physical(), "NaN");
    assert!(
        !box_of(2.0, [1.0, 2.0, f64::INFINITY]).is_physical(),
        "infinite"
    );
    assert!(!InertialParameters::zero().is_physical(), "nothing");
}

/// Bodies on the boundary are physical in any frame: points, rods and plates such as the paper's
/// payload. A test for a positive definite pseudo-inertia would depend on rounding.
#[test]
fn plates_rods_and_points_are_physical() {
    let rng = &mut rng(8);
    for moments in [[10.0, 20.0, 10.0], [0.0, 3.0, 3.0], [0.0, 0.0, 0.0]] {
        for _ in 0..100 {
            let body = box_of(100.0, moments).expressed_in(&isometry(rng));
            assert!(body.is_physical(), "{moments:?}");
        }
    }
    let missed = box_of(100.0, [9.95, 20.05, 10.0]);
    assert!(!missed.is_physical() && missed.is_physical_within(0.01));
}

/// A body is impossible if its inertia satisfies the triangle inequality about the origin, but not
/// about the centre of mass.
#[test]
fn first_moment_counts_in_physical_consistency() {
    let inertia = Matrix3::identity() * 2.0;
    let near = InertialParameters::from_moments(1.0, &Vector3::new(0.5, 0.0, 0.0), &inertia);
    let far = InertialParameters::from_moments(1.0, &Vector3::new(1.1, 0.0, 0.0), &inertia);
    assert!(near.is_physical());
    assert!(!far.is_physical());
}

/// Principal moments ascend and do not depend on the frame in which a body is expressed.
#[test]
fn principal_moments_do_not_depend_on_the_frame() {
    let rng = &mut rng(7);
    let expected = Vector3::new(1.0, 2.0, 2.5);
    let body = InertialParameters::from(MassProperties {
        mass_kg: 3.0,
        center_of_mass: vector(rng, 1.0),
        inertia: Matrix3::from_diagonal(&Vector3::new(2.5, 1.0, 2.0)),
    });
    for _ in 0..100 {
        let moved = body.expressed_in(&isometry(rng));
        assert_close(
            &moved.principal_moments().unwrap(),
            &expected,
            1e-12,
            "moments",
        );
    }
}
