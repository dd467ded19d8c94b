//! How frames, axes and efforts are read, and how they should be, in words.

use tactid_dynamics::Reader;
use tactid_dynamics::words::percent;
use tactid_identify::EffortContent;

use super::Finding;

impl Finding {
    /// Says how frames, axes and efforts are read, or should be; nothing for other findings.
    pub(super) fn of_readings(&self, reader: Reader) -> String {
        match self {
            Self::FrameFollowed {
                frame,
                link,
                origin_m,
            } => {
                let origin = origin_m
                    .map(|x| format!("{:.1}", (1e4 * x).round() / 10.0 + 0.0))
                    .join(", ");
                format!(
                    "The frame `{frame}` is in no description of the robot: /tf shows it fixed to \
                     `{link}`, at ({origin}) mm."
                )
            }
            Self::AxesAssumed { topic, axes, point } => format!(
                "{topic} is in `{axes}`, which does not move with the tool: its wrenches are taken \
                 to have the axes of `{axes}`, and moments about the origin of `{point}`. {} and \
                 {} state other ones.",
                reader.option("wrench_axes"),
                reader.option("sensor_frame")
            ),
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
            } => format!(
                "The moments of the wrenches are about the origin of `{frame}`: {}, give `{frame}` \
                 with the origin 0, 0, 0 and the quaternion 0, 0, 0, 1 as {}.",
                read_so(*residual_ratio),
                reader.option("sensor_frame")
            ),
            Self::EffortContentContradicted {
                content,
                residual_ratio,
            } => effort_content_contradicted(*content, *residual_ratio, reader),
            Self::JointsExchanged {
                joints,
                residual_ratio,
            } => joints_exchanged(joints, *residual_ratio),
            _ => String::new(),
        }
    }
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

fn joints_exchanged(joints: &[String], residual_ratio: f64) -> String {
    format!(
        "The values of the joints {} are exchanged: read so, residuals are {} as large. Messages \
         often list joints by the alphabet; bring the columns into the order of the robot.",
        joints.join(" and "),
        percent(residual_ratio)
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
