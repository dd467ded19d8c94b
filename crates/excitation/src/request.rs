//! Requests: which motion to design. All options but an identification's are declared here, once.

use std::collections::BTreeMap;

use tactid_dynamics::MassProperties;
use tactid_identify::{BoundingBox, Range};
use tactid_options::{Kind, Use, options};

use crate::grip::Grip;
use crate::problem::{Criterion, LEAST_DISTANCE};
use crate::start::Start;

/// Range of rates, Hz, and of accelerations, rad/s² or m/s²: a larger one is a mistake.
const MODERATE: Range = Range {
    contains: |given| given > 0.0 && given <= 1e5,
    expected: "more than 0, and at most 100000",
};

/// Range of the factor on the limits of the URDF, which must not be exceeded.
const SCALE: Range = Range {
    contains: |given| given > 0.0 && given <= 1.0,
    expected: "more than 0, and at most 1",
};

/// Range of a target.
const FRACTION: Range = Range {
    contains: |given| given > 0.0 && given < 1.0,
    expected: "a fraction above 0 and below 1; 0.01 is 1 %",
};

/// Range of a mass.
const MASS_KG: Range = Range {
    contains: |given| given > 0.0 && given.is_finite(),
    expected: "more than 0 kg, and finite",
};

const DESIGN: &[Use] = &[Use::Design];

const MOTION: &str = "Motion";
const LIMITS: &str = "Limits";
const SENSORS: &str = "Sensors";

options! {
    /// Which motion to design, and within which limits. Every field is optional. The equations and
    /// the noise of the sensors have the options of an identification.
    pub struct MotionRequest {
        /// Positions at the beginning and the end: one for each joint, or one for each joint that
        /// moves the tip.
        #[option(
            MOTION, DESIGN,
            unit = "rad or m",
            default = "0, or the middle of a range that excludes it",
            python = "A mapping from names of joints gives some of them."
        )]
        pub start: Option<Start>,
        /// Duration of the motion, unless ``within`` is given. A motion of 15 s or more passes
        /// several times along the same path, in turn forth and back.
        #[option(MOTION, DESIGN, unit = "s", default = "10")]
        pub duration: Option<f64>,
        /// Target for half of each 95 % interval, relative to the largest value of its kind: a
        /// fraction in Python, 0.01, and a percentage on the command line, 1%. The motion is the
        /// shortest that reaches it. Not with ``duration``. A centre of mass that is nearer to the
        /// tip than a tenth of the radius of gyration counts as at that distance.
        #[option(MOTION, DESIGN, kind = Kind::Percentage, range = FRACTION)]
        pub within: Option<f64>,
        /// Longest duration that is tried for ``within``.
        #[option(MOTION, DESIGN, unit = "s", default = "60")]
        pub longest: Option<f64>,
        /// Seed of the search: the same seed gives the same motion.
        #[option(MOTION, DESIGN, default = "0")]
        pub seed: Option<u64>,
        /// Rate of the states of the motion.
        #[option(MOTION, DESIGN, unit = "Hz", default = "1000", range = MODERATE)]
        pub rate: Option<f64>,
        /// What is minimised: the largest interval relative to its target, or the volume of the
        /// confidence ellipsoid.
        #[option(MOTION, DESIGN, default = "largest-interval")]
        pub criterion: Option<Criterion>,
        /// The expected payload: mass, centre of mass in the tip's frame, and inertia about it.
        #[option(MOTION, DESIGN, unit = "kg, m, kg m²")]
        pub payload: Option<MassProperties>,
        /// Largest mass of a payload of which only a box is known. Half of it, filling the box
        /// evenly, is expected; and all limits hold with all of it at any corner, and without a
        /// payload.
        #[option(MOTION, DESIGN, unit = "kg", range = MASS_KG)]
        pub payload_mass_max: Option<f64>,
        /// Least and largest corner of the box, in the tip's frame, (2, 3). It must not touch the
        /// robot, either; with ``payload``, it serves for this only.
        #[option(MOTION, DESIGN, unit = "m")]
        pub payload_box: Option<BoundingBox>,
        /// Factor on the velocity limits of the URDF and on ``acceleration``, at most 1.
        #[option(LIMITS, DESIGN, default = "1", range = SCALE)]
        pub limit_scale: Option<f64>,
        /// Largest acceleration of a joint.
        #[option(LIMITS, DESIGN, unit = "rad/s² or m/s²", default = "2", range = MODERATE)]
        pub acceleration: Option<f64>,
        /// Largest magnitudes of the wrench on the payload in the tip's frame, (6,).
        #[option(LIMITS, DESIGN, unit = "N and N m")]
        pub wrench_limit: Option<[f64; 6]>,
        /// The grip whose friction must hold the payload, two flat pads. On the command line: the
        /// point between them, the direction from one to the other, their distance, the force of
        /// each, friction, and the torsion radius; of the friction, 70 % is used.
        #[option(LIMITS, DESIGN, unit = "m, N")]
        pub grip: Option<Grip>,
        /// Largest angle by which the base, which floats, may turn: in rad in Python, and in
        /// degrees on the command line.
        #[option(LIMITS, DESIGN, kind = Kind::Degrees)]
        pub base_attitude: Option<f64>,
        /// Largest distance by which the origin of the base, which floats, may move.
        #[option(LIMITS, DESIGN, unit = "m")]
        pub base_position: Option<f64>,
        /// Whether the links of the robot must not touch one another, the payload's box or a
        /// keep-out box. It is an error if a link that could be hit has a collision shape that
        /// cannot be tested, such as a mesh that is not found or is neither STL, OBJ nor PLY: without
        /// the test, a motion may run the robot through itself. Links to which the URDF gives no
        /// collision shape are not tested; the result lists them.
        #[option(LIMITS, DESIGN, default = "true", kind = Kind::Switch)]
        pub collisions: Option<bool>,
        /// Least and largest corner of a box that the tip and the payload's box must stay in, in
        /// the frame of the base, (2, 3).
        #[option(LIMITS, DESIGN, unit = "m")]
        pub workspace: Option<BoundingBox>,
        /// Boxes that must not be entered, by their names: least and largest corner in the frame of
        /// the base, (2, 3). On the command line, a box such as table=-1,-1,-0.5,1,1,0.
        #[option(LIMITS, DESIGN, unit = "m")]
        pub keep_out: Option<BTreeMap<String, BoundingBox>>,
        /// Least distance of links, payload and keep-out boxes, at most 0.06. A pair that is closer
        /// than twice that at the start keeps half of its distance there, unless it is a keep-out
        /// box; the result lists those pairs.
        #[option(LIMITS, DESIGN, unit = "m", default = "0.01", range = LEAST_DISTANCE)]
        pub least_distance: Option<f64>,
        /// Links in which wrenches are measured.
        #[option(SENSORS, DESIGN, default = "the tip")]
        pub sensors: Option<Vec<String>>,
        /// Samples of the sensors per second.
        #[option(SENSORS, DESIGN, unit = "Hz", default = "that of ``rate``")]
        pub sample_rate: Option<f64>,
        /// Standard deviations of the wrench that follows from the motion of a floating base, (6,):
        /// for the methods joint-sensing and combined.
        #[option(SENSORS, DESIGN, unit = "N and N m")]
        pub base_noise: Option<[f64; 6]>,
    }
}
