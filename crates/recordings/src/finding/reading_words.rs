//! How frames, axes and efforts are read, and how they should be, in words.

use tactid_batch::p_equals;
use tactid_dynamics::Reader;
use tactid_dynamics::words::{abridged, general, listed, percent, with_interval};
use tactid_identify::EffortContent;

use super::Finding;
use crate::OrientationReading;

/// The order in which quaternions are read.
const ORDER: &str = ", quaternions in the order x, y, z, w";

impl Finding {
    /// Says how frames, axes and efforts are read, or should be; nothing for other findings.
    pub(super) fn of_readings(&self, reader: Reader) -> String {
        match self {
            Self::FrameFollowed {
                frame,
                link,
                origin_m,
            } => frame_followed(frame, link, *origin_m),
            Self::AxesAssumed { topic, axes, point } => axes_assumed([topic, axes, point], reader),
            Self::TopicRecognized {
                topic,
                content,
                option,
                value,
            } => format!(
                "By its name, {topic} is {content}: if so, give `{value}` as {}.",
                reader.option(option)
            ),
            Self::AxesContradicted {
                axes,
                residual_ratio,
            } => axes_contradicted(axes.as_deref(), *residual_ratio, reader),
            Self::PointContradicted {
                frame,
                residual_ratio,
            } => point_contradicted(frame, *residual_ratio, reader),
            Self::EffortContentContradicted {
                content,
                residual_ratio,
            } => effort_content_contradicted(*content, *residual_ratio, reader),
            Self::JointsExchanged {
                joints,
                residual_ratio,
            } => joints_exchanged(joints, *residual_ratio, reader),
            Self::JointSignContradicted {
                joint,
                residual_ratio,
            } => joint_sign(joint, *residual_ratio),
            Self::OrientationContradicted {
                reading,
                of_base,
                residual_ratio,
            } => orientation_contradicted(*reading, *of_base, *residual_ratio),
            Self::HeavyLoad {
                mass_kg,
                std_dev_kg,
            } => heavy_load(*mass_kg, *std_dev_kg, reader),
            Self::ShapeContradicted { .. } => self.of_shape(reader),
            Self::UnloadedEffortsScaled {
                joints,
                ratios,
                has_gains,
            } => efforts_scaled(joints, ratios, *has_gains, reader),
            Self::ForcesAndMomentsExchanged { residual_ratio } => {
                forces_and_moments_exchanged(*residual_ratio)
            }
            _ => String::new(),
        }
    }

    /// Says that the measurements contradict a shape, and without which mass or in which unit of its
    /// file they do not; nothing for other findings.
    fn of_shape(&self, reader: Reader) -> String {
        let Self::ShapeContradicted {
            p_value,
            scale,
            is_of_mass,
        } = self
        else {
            return String::new();
        };
        let cause = match scale {
            _ if *is_of_mass => format!(
                "without the known mass ({}) they agree, so that the mass is wrong",
                reader.option("known_mass_kg")
            ),
            Some(unit_m) => format!(
                "with {unit_m} m as the unit of its file ({}) they agree",
                reader.option("shape_scale")
            ),
            None => format!(
                "another object is held, or the shape has another pose ({})",
                reader.option("shape_pose")
            ),
        };
        format!(
            "The measurements contradict the shape ({}, {}): {cause}. The result does not use it.",
            reader.option("shape"),
            p_equals(*p_value)
        )
    }
}

fn efforts_scaled(joints: &[String], ratios: &[f64], has_gains: bool, reader: Reader) -> String {
    let of_joints = joints.iter().zip(ratios);
    let of_joints: Vec<String> = of_joints
        .map(|(joint, ratio)| format!("{} ({joint})", general(*ratio, 2)))
        .collect();
    let (share, option) = (abridged(&of_joints), reader.option("effort_gain"));
    if has_gains {
        return format!(
            "The gains of the efforts ({option}) may be wrong: with them, the efforts of the \
             unloaded arm are {share} times what its weight needs by the URDF, and the load is wrong \
             by the same factor. If the masses of the URDF are wrong, the result is right."
        );
    }
    let gains = joints.iter().zip(ratios);
    let gains: Vec<String> = gains
        .map(|(joint, ratio)| format!("{} ({joint})", general(ratio.recip(), 2)))
        .collect();
    format!(
        "The efforts of the unloaded arm are {share} times what its weight needs by the URDF: they \
         may be motor currents, or have another unit, and the load is wrong by the same factor. Give \
         {option} for every joint, about {}, or calibrate the arm. If they are in N m, the masses of \
         the URDF are wrong and the result is right: a gain of 1 for every joint says so.",
        abridged(&gains)
    )
}

fn axes_assumed([topic, axes, point]: [&str; 3], reader: Reader) -> String {
    format!(
        "{topic} is in `{axes}`, which does not move with the tool: its wrenches are taken to have \
         the axes of `{axes}`, and moments about the origin of `{point}`. {} and {} state other ones.",
        reader.option("wrench_axes"),
        reader.option("sensor_frame")
    )
}

fn frame_followed(frame: &str, link: &str, origin_m: [f64; 3]) -> String {
    let origin = origin_m
        .map(|x| format!("{:.1}", (1e4 * x).round() / 10.0 + 0.0))
        .join(", ");
    format!(
        "The frame `{frame}` is in no description of the robot: /tf shows it fixed to `{link}`, at \
         ({origin}) mm."
    )
}

fn forces_and_moments_exchanged(residual_ratio: f64) -> String {
    format!(
        "Forces and moments are exchanged: read so, residuals are {} as large. Of a wrench, the \
         three forces come first.",
        percent(residual_ratio)
    )
}

fn heavy_load(mass_kg: f64, std_dev_kg: f64, reader: Reader) -> String {
    format!(
        "The load weighs {} kg, more than most arms lift: the forces may be in another unit, as in mN. \
         Give forces in N and moments in N m; of a table, {} states other units.",
        with_interval(mass_kg, std_dev_kg),
        reader.option("columns")
    )
}

fn axes_contradicted(axes: Option<&str>, residual_ratio: f64, reader: Reader) -> String {
    let option = reader.option("wrench_axes");
    let (whose, remedy) = match axes {
        Some(axes) => (
            format!("`{axes}`, not of the sensor"),
            format!("give `{axes}` as {option}"),
        ),
        None => (
            "the sensor itself".to_owned(),
            format!("identify without {option}"),
        ),
    };
    format!(
        "The wrenches have the axes of {whose}: {}, {remedy}.",
        read_so(residual_ratio)
    )
}

fn joint_sign(joint: &str, residual_ratio: f64) -> String {
    format!(
        "The values of the joint {joint} have the opposite sign: read so, residuals are {} as \
         large. Negate them, or turn the axis of this joint in the URDF.",
        percent(residual_ratio)
    )
}

fn joints_exchanged(joints: &[String], residual_ratio: f64, reader: Reader) -> String {
    let next = joints.iter().cycle().skip(1);
    let places = joints.iter().zip(next);
    let places = places.map(|(given, true_joint)| format!("of {true_joint} as {given}"));
    let order = match joints {
        [_, _] => String::new(),
        _ => format!(" (those {})", listed(&places.collect::<Vec<_>>())),
    };
    format!(
        "The values of the joints {} are exchanged{order}: read so, residuals are {} as large. \
         Messages often list joints by the alphabet; bring the columns into the order of the robot, \
         or, of a log, give each value its joint by {}.",
        listed(joints),
        percent(residual_ratio),
        reader.option("rename_joints")
    )
}

fn orientation_contradicted(
    reading: OrientationReading,
    of_base: bool,
    residual_ratio: f64,
) -> String {
    let body = if of_base { "base" } else { "tool" };
    let inverse = format!("the inverse, `{body}_from_world`");
    let (order, meant, remedy) = match reading {
        OrientationReading::Inverse => (
            "",
            inverse,
            "invert them (of a quaternion, negate x, y and z)",
        ),
        OrientationReading::ScalarFirst => (
            ORDER,
            "quaternions in the order w, x, y, z".to_owned(),
            "give w as the last of the four",
        ),
        OrientationReading::InverseScalarFirst => (
            ORDER,
            format!("{inverse}, by quaternions in the order w, x, y, z"),
            "negate x, y and z, and give w as the last of the four",
        ),
    };
    format!(
        "The orientations are read as `world_from_{body}`{order}, but they seem to be {meant}: read \
         so, residuals are {} as large; {remedy}.",
        percent(residual_ratio)
    )
}

fn point_contradicted(frame: &str, residual_ratio: f64, reader: Reader) -> String {
    format!(
        "The moments of the wrenches are about the origin of `{frame}`: {}, give `{frame}` with the \
         origin 0, 0, 0 and the quaternion 0, 0, 0, 1 as {}.",
        read_so(residual_ratio),
        reader.option("sensor_frame")
    )
}

fn effort_content_contradicted(
    content: EffortContent,
    residual_ratio: f64,
    reader: Reader,
) -> String {
    let (contains, value) = match content {
        EffortContent::Measured => ("all that moves and holds arm and payload", "measured"),
        EffortContent::WithoutGravity => (
            "no part that holds the arm itself against gravity",
            "without-gravity",
        ),
        EffortContent::External => (
            "only what the payload needs, nothing of the arm's own",
            "external",
        ),
    };
    format!(
        "The joint efforts contain {contains}: {}, give `{value}` as {}.",
        read_so(residual_ratio),
        reader.option("efforts_are")
    )
}

/// Says how well another reading fits, and begins to say what to do.
fn read_so(residual_ratio: f64) -> String {
    format!(
        "read so, their residuals are {} as large. To accept this",
        percent(residual_ratio)
    )
}
