//! What a calibration noticed in words: assumptions that its recordings contradict, and what their
//! motion lacks.

use std::fmt;

use tactid_dynamics::words::{HALF_WIDTH_95, general, two_figures};
use tactid_dynamics::{Notice, Reader, Severity, Subject};

use crate::{Assumption, Contradiction, MotionShortage};

impl Notice for Contradiction {
    fn severity(&self) -> Severity {
        match self.assumption {
            Assumption::Links => Severity::Doubts,
            _ => Severity::Contradicts,
        }
    }

    fn subject(&self) -> Subject {
        Subject::Assumption
    }

    fn words(&self, reader: Reader) -> String {
        let (what, advice) = match self.assumption {
            Assumption::Gravity => self.tilted_gravity(reader),
            Assumption::JointZero => self.joint_zero(reader),
            Assumption::Gains => self.gains(reader),
            Assumption::PayloadCenter { payload } => self.payload_center(payload, reader),
            Assumption::GainPrior { prior_std_dev } => {
                return self.gain_prior(prior_std_dev, reader);
            }
            Assumption::Links => return self.links(reader),
        };
        format!(
            "The efforts fit far better {what}. The error is in the calibration, and its intervals \
             do not contain it. {advice}, and calibrate anew."
        )
    }
}

/// With what the efforts fit better, and what to check.
type WhatAndAdvice = (String, String);

impl Contradiction {
    fn tilted_gravity(&self, reader: Reader) -> WhatAndAdvice {
        let (degrees, instead, most) = (self.degrees(), self.instead("m/s²"), self.most());
        let option = reader.option("gravity");
        (
            format!("with gravity tilted by {degrees}{instead}{most}"),
            format!("Check {option}, and how the arm is mounted"),
        )
    }

    fn joint_zero(&self, reader: Reader) -> WhatAndAdvice {
        let (joint, degrees) = (&self.joint, self.degrees());
        let direction = if self.size > 0.0 { "larger" } else { "smaller" };
        (
            format!("with positions of {joint} that are {direction} by {degrees}"),
            format!(
                "Check the zero of this joint, the origin of the joint in the URDF, the order of \
                 the joints and {}, of which a wrong one can look the same",
                reader.option("payload_com")
            ),
        )
    }

    fn gains(&self, reader: Reader) -> WhatAndAdvice {
        let joint = &self.joint;
        if self.size <= -1.0 {
            return (
                format!("with a gain of {joint} that is negative, which no gain is"),
                "Usual causes are an unloaded recording that holds a payload, exchanged joints, \
                 and the URDF of another robot. Check these"
                    .to_owned(),
            );
        }
        let sign = if self.size < 0.0 { '-' } else { '+' };
        let size = interval(self.size.abs(), self.std_dev, 100.0);
        let (loaded, mass) = (reader.option("loaded"), reader.option("payload_mass_kg"));
        (
            format!("with other gains, most at {joint} ({sign}{size} %)"),
            format!("Find the gains with {loaded} and {mass}"),
        )
    }

    fn payload_center(&self, payload: usize, reader: Reader) -> WhatAndAdvice {
        let size = interval(self.size, self.std_dev, 1e3);
        let (number, instead, most) = (payload + 1, self.instead("m"), self.most());
        (
            format!(
                "with the centre of mass of the payload of loaded recording {number} {size} mm \
                 from the given one{instead}{most}"
            ),
            format!(
                "Check {} and the zeros of the joints",
                reader.option("payload_com")
            ),
        )
    }

    fn gain_prior(&self, prior_std_dev: f64, reader: Reader) -> String {
        let gain = 1.0 + self.size;
        // As far from one as its inverse is, whichever is farther.
        let distance = self.size.abs().max((1.0 / gain - 1.0).abs()) / prior_std_dev;
        format!(
            "The gain of {} is {} times the given one, which is {distance:.1} standard deviations \
             away ({} {} %). Usual causes are the URDF of another robot, efforts in another unit, \
             and a wrong {}. The intervals of the calibration do not contain such an error. Check \
             these, and calibrate anew.",
            self.joint,
            two_figures(gain),
            reader.option("gain_std_dev"),
            two_figures(100.0 * prior_std_dev),
            reader.option("payload_mass_kg")
        )
    }

    fn links(&self, reader: Reader) -> String {
        format!(
            "The torques of {} are {} times those that the masses of the URDF need: is this the \
             URDF of this robot? With that of a similar one the masses of payloads are wrong by \
             tens of percent. Other causes are a tool that the URDF does not have, placeholders \
             instead of its masses, and efforts that are no torques. Check these and {}, and \
             calibrate anew if one is wrong.",
            self.joint,
            two_figures(1.0 + self.size),
            reader.option("urdf")
        )
    }

    /// Returns the size and half of its 95 % interval, an angle.
    fn degrees(&self) -> String {
        format!(
            "{} degrees",
            interval(self.size.abs(), self.std_dev, 1f64.to_degrees())
        )
    }

    /// Says what the efforts show instead, as the option takes it.
    fn instead(&self, unit: &str) -> String {
        self.shown.map_or_else(String::new, |vector| {
            let [x, y, z] = vector.map(|entry| general(entry, 3));
            format!(", at {x} {y} {z} {unit}")
        })
    }

    fn most(&self) -> String {
        format!(", which the efforts of {} show most", self.joint)
    }
}

/// Returns a size with half of its 95 % interval, both in another unit.
fn interval(size: f64, std_dev: f64, unit: f64) -> String {
    format!(
        "{} ± {}",
        two_figures(unit * size),
        two_figures(unit * HALF_WIDTH_95 * std_dev)
    )
}

impl fmt::Display for Contradiction {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.words(Reader::Rust))
    }
}

impl Notice for MotionShortage {
    fn severity(&self) -> Severity {
        Severity::Notes
    }

    fn words(&self, _: Reader) -> String {
        match self {
            Self::Still {
                joint,
                max_velocity,
            } => format!(
                "{joint} does not move (at most {} rad/s or m/s): its friction is not known. \
                 Record a motion of this joint in both directions.",
                general(*max_velocity, 2)
            ),
            Self::OneDirection { joint, is_positive } => {
                let direction = if *is_positive { "positive" } else { "negative" };
                format!(
                    "{joint} moves in the {direction} direction only: its offset and its Coulomb \
                     friction cannot be distinguished. Record a motion in both directions."
                )
            }
            Self::Gain { joint, std_dev } => format!(
                "The gain of {joint} stays uncertain, ± {} %: record a heavier payload of known \
                 mass, in postures in which this joint carries it.",
                general(100.0 * HALF_WIDTH_95 * std_dev, 2)
            ),
        }
    }
}

impl fmt::Display for MotionShortage {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.words(Reader::Rust))
    }
}
