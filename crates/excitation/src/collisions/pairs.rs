//! Pairs of solids that are tested for collisions.

use std::collections::HashMap;

use tactid_dynamics::{FrameId, Manipulator};

use crate::ExcitationError;
use crate::problem::Problem;
use crate::shapes::{CollisionFinding, NotTested, Placed, Solid};
use crate::untested::UntestedLinks;

/// Two solids that must keep a distance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pair {
    /// Indices of the solids.
    pub(crate) first: usize,
    pub(crate) second: usize,
    /// Least distance, m.
    pub(crate) least_m: f64,
    /// Whether one of them is a keep-out box: contact at the start is found by the check of the
    /// posture there.
    pub(crate) is_with_keep_out: bool,
    /// Whether the pair is the payload and a link that neither holds it nor is next to its holder.
    pub(crate) is_link_in_payload: bool,
}

/// What a problem asks to keep apart.
pub(super) struct Tested {
    pub(super) solids: Vec<Solid>,
    pub(super) pairs: Vec<Pair>,
    /// Which pairs are not tested.
    pub(super) findings: Vec<CollisionFinding>,
}

/// Whose shapes a solid has.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Link,
    Payload,
    Tool,
    KeepOut,
}

/// Returns the solids of a problem, the pairs that are tested, and a finding for adjacent ones.
///
/// Pairs are neither tested nor reported where no joint of the motion changes their relative pose.
///
/// # Errors
/// Returns [`ExcitationError::Untested`] if shapes are missing of links that could touch.
pub(super) fn pairs(problem: &Problem) -> Result<Tested, ExcitationError> {
    let robot = &problem.robot;
    let (solids, kinds): (Vec<Solid>, Vec<Kind>) = solids(problem)?.into_iter().unzip();
    let moving = problem.moving_joints()?;
    let all: Vec<usize> = (0..robot.dof()).collect();
    let between = |joints: &[usize], a: FrameId, b: FrameId| -> usize {
        let moves_one = |&&joint: &&usize| robot.moves(joint, a) != robot.moves(joint, b);
        joints.iter().filter(moves_one).count()
    };
    check_shapes(problem, &|a, b| {
        between(&moving, a, b) > 0 && between(&all, a, b) > 1
    })?;
    let (mut pairs, mut adjacent) = (Vec::new(), Vec::new());
    for second in 0..solids.len() {
        for first in 0..second {
            let frames = [&solids[first], &solids[second]].map(|solid| solid.frame);
            let is_tested = match [kinds[first], kinds[second]] {
                [Kind::Link, Kind::Link | Kind::Payload] => true,
                [_, Kind::KeepOut] => kinds[first] != Kind::KeepOut,
                _ => false,
            };
            if !is_tested || between(&moving, frames[0], frames[1]) == 0 {
                continue;
            }
            let are_adjacent = between(&all, frames[0], frames[1]) == 1;
            if kinds[second] == Kind::Link && are_adjacent {
                adjacent.push([first, second].map(|k| solids[k].name.clone()));
                continue;
            }
            pairs.push(Pair {
                first,
                second,
                least_m: problem.least_distance_m,
                is_with_keep_out: kinds[second] == Kind::KeepOut,
                is_link_in_payload: kinds[second] == Kind::Payload && !are_adjacent,
            });
        }
    }
    let mut findings = Vec::new();
    if !adjacent.is_empty() {
        findings.push(CollisionFinding::PairsNotTested {
            pairs: adjacent,
            because: NotTested::Adjacent,
        });
    }
    Ok(Tested {
        solids,
        pairs,
        findings,
    })
}

/// Checks that no shape is missing of a link that another link, the payload or a keep-out box can
/// touch. `can_touch` tells whether the motion changes the relative pose of two links that are no
/// neighbours.
///
/// A link of the base counts like any other, because the arm can hit it.
fn check_shapes(
    problem: &Problem,
    can_touch: &dyn Fn(FrameId, FrameId) -> bool,
) -> Result<(), ExcitationError> {
    let Some(model) = problem
        .collisions
        .as_ref()
        .filter(|model| !model.accepts_untested)
    else {
        return Ok(());
    };
    let robot = &problem.robot;
    let (base, tool) = (robot.base_frame(), robot.frame(&problem.tool)?);
    // Links that all joints move alike touch the same others, so that one of them stands for all.
    let moved = |link: &String| -> Result<_, ExcitationError> {
        let frame = robot.frame(link)?;
        let by: Vec<bool> = (0..robot.dof())
            .map(|joint| robot.moves(joint, frame))
            .collect();
        Ok((by, frame))
    };
    let with_shapes = model.links.iter().map(|(link, _)| link);
    let links = with_shapes.chain(model.untested.iter().map(|each| &each.link));
    let others: HashMap<_, FrameId> = links.map(moved).collect::<Result<_, _>>()?;
    if others.is_empty() && can_touch(base, tool) {
        return Err(ExcitationError::Untested(UntestedLinks(Vec::new())));
    }
    let boxes = [
        problem.payload_box.as_ref().map(|_| tool),
        (!problem.workspace.keep_out.is_empty()).then_some(base),
    ];
    let mut known: HashMap<Vec<bool>, bool> = HashMap::new();
    let mut missing = Vec::new();
    for each in &model.untested {
        let (by, frame) = moved(&each.link)?;
        let touches = || {
            others
                .values()
                .chain(boxes.iter().flatten())
                .any(|&other| can_touch(frame, other))
        };
        if *known.entry(by).or_insert_with(touches) {
            missing.push(each.clone());
        }
    }
    if missing.is_empty() {
        return Ok(());
    }
    Err(ExcitationError::Untested(UntestedLinks(missing)))
}

/// Returns the solids of a problem: links, payload, tool, keep-out boxes.
fn solids(problem: &Problem) -> Result<Vec<(Solid, Kind)>, ExcitationError> {
    let robot: &Manipulator = &problem.robot;
    let (base, tool) = (robot.base_frame(), robot.frame(&problem.tool)?);
    let mut solids = Vec::new();
    for (link, shapes) in problem.collisions.iter().flat_map(|model| &model.links) {
        let solid = Solid::new(link.clone(), robot.frame(link)?, shapes);
        solids.push((solid, Kind::Link));
    }
    if let Some(bounds) = &problem.payload_box {
        let solid = Solid::new("the payload".to_owned(), tool, &[Placed::cuboid(bounds)]);
        solids.push((solid, Kind::Payload));
    }
    let keep_out = &problem.workspace.keep_out;
    if !keep_out.is_empty() {
        let solid = Solid::new("the tool".to_owned(), tool, &[Placed::point()]);
        solids.push((solid, Kind::Tool));
    }
    for area in keep_out {
        let name = format!("the keep-out box {}", area.name);
        let solid = Solid::new(name, base, &[Placed::cuboid(&area.place)]);
        solids.push((solid, Kind::KeepOut));
    }
    Ok(solids)
}
