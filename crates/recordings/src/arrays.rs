//! Identification from samples that are in memory already.

use tactid_dynamics::Manipulator;

use super::Observer;
use super::outcome::{self, Identification, Origin, Progress};
use super::request::Request;
use super::run::{Plan, Run};
use super::streams::{Event, JointValues, Layout, Measured};
use crate::{IdentifyError, Sample};

/// How many samples are taken between two calls of the observer.
const OBSERVE_EVERY: usize = 4096;

/// Identifies the payload from samples on one clock: the same as [`identify_log`](super::identify_log)
/// for those who read their logs themselves.
///
/// `sensors` are the links in whose frames the wrenches are. Of the request its settings, its cutoff,
/// gap and delay and what it knows of tool and payload count. A sensor whose own motion is known is
/// [`Manipulator::lone_body`], with its motion as the base's.
///
/// # Errors
/// As [`Identifier::push`](crate::Identifier::push), and where there are too few samples.
pub fn identify_samples<'a>(
    robot: &Manipulator,
    tool: &str,
    sensors: &[&str],
    samples: impl Fn() -> Box<dyn Iterator<Item = Sample<'a>> + 'a>,
    request: &Request,
    observer: &mut Observer<'_>,
) -> Result<Identification, IdentifyError> {
    request.check_knowledge()?;
    let mut settings = request.settings.clone();
    if let Some(method) = request.method {
        settings.method = method;
    }
    let times: Vec<f64> = samples().map(|sample| sample.time_s).collect();
    let length_s = times.last().zip(times.first()).map_or(0.0, |(b, a)| b - a);
    let period_s = length_s / (times.len().max(2) - 1) as f64;
    settings.max_gap_s = request
        .max_gap_s
        .unwrap_or(super::GAP_PERIODS * period_s.max(1e-9));
    let mut plan = Plan {
        robot: robot.clone(),
        tool: tool.to_owned(),
        sensors: sensors.iter().map(|&name| name.to_owned()).collect(),
        layout: Layout {
            base: true,
            wrenches: sensors.len(),
            ..Layout::default()
        },
        delay_s: 0.0,
        found_delay: None,
        least_squares: request.is_least_squares(),
        settings,
    };
    let begin_s = times.first().copied().unwrap_or(0.0);
    let effort = plan.settings.method.uses_effort();
    let events = |sample: Sample<'_>| to_events(&sample, begin_s, effort);
    let beginning: Vec<Event> = samples()
        .take_while(|sample| sample.time_s - begin_s < super::LENGTH_S)
        .flat_map(events)
        .collect();
    plan.look_at(&beginning, period_s, request)?;
    drop(beginning);
    let mut run = Run::new(plan)?;
    run.set_end_s(length_s);
    let mut interrupted = false;
    'epochs: for epoch in 0..run.epochs() {
        run.begin(epoch);
        for (k, sample) in samples().enumerate() {
            if k % OBSERVE_EVERY == 0 {
                let part = k as f64 / times.len() as f64;
                let fraction = (f64::from(epoch) + part) / f64::from(run.epochs());
                if observer(Progress { fraction }).is_break() {
                    interrupted = true;
                    break 'epochs;
                }
            }
            for event in events(sample) {
                run.take(event)?;
            }
        }
        run.end_streams();
    }
    outcome::conclude(run, request, interrupted, Origin::default())
}

/// What a sample says, each stream by itself, so that a delay between them can be taken off.
fn to_events(sample: &Sample<'_>, begin_s: f64, effort: bool) -> Vec<Event> {
    let time_s = sample.time_s - begin_s;
    let event = |what| Event { time_s, what };
    let joints = JointValues {
        position: sample.joint_position.to_vec(),
        velocity: sample.joint_velocity.to_vec(),
        effort: if effort {
            sample.joint_effort.to_vec()
        } else {
            Vec::new()
        },
    };
    let numbers = [&joints.position, &joints.velocity, &joints.effort];
    let mut events = Vec::with_capacity(2 + sample.wrenches.len());
    if sample.base.is_finite() {
        events.push(event(Measured::Base(sample.base)));
    }
    if numbers.iter().all(|all| all.iter().all(|x| x.is_finite())) {
        events.push(event(Measured::Joints(joints)));
    }
    for (k, wrench) in sample.wrenches.iter().enumerate() {
        if wrench.is_finite() {
            events.push(event(Measured::Wrench(k, *wrench)));
        }
    }
    events
}
