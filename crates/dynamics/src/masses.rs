//! What is known of the masses of a robot, and what its description lacks.

use crate::manipulator::{Body, check_body};
use crate::{BaseKind, FrameId, Manipulator, ModelError, ModelFinding};

/// A body that a joint moves, or a floating base.
struct MovingBody<'a> {
    index: usize,
    body: &'a Body,
    /// Name of the link that the joint moves.
    link: &'a str,
    /// Whether it has no mass, and [`Manipulator::without_subtree`] has removed none from it.
    is_massless: bool,
}

impl MovingBody<'_> {
    /// Returns the error for a body that must have mass and has none.
    fn massless(&self) -> ModelError {
        let link = self.link.to_owned();
        match &self.body.joint {
            None => ModelError::MasslessBase(link),
            Some(joint) => ModelError::NoInertial(link, joint.name.clone()),
        }
    }

    /// Returns the error for the first of the bodies where none of them has mass.
    fn massless_chain(&self) -> ModelError {
        let link = self.link.to_owned();
        match &self.body.joint {
            None => ModelError::MasslessBase(link),
            Some(joint) => ModelError::MasslessChain(link, joint.name.clone()),
        }
    }
}

impl Manipulator {
    /// Returns what is wrong in the description of the robot, and what the model assumes instead.
    /// The masses and inertias of links on a fixed base have no effect and are not reported.
    #[must_use]
    pub fn findings(&self) -> Vec<ModelFinding> {
        let mut findings = self.findings.clone();
        let bodies = self.moving_bodies();
        let massless = bodies.iter().filter(|body| body.is_massless);
        let links: Vec<String> = massless.map(|body| body.link.to_owned()).collect();
        if !links.is_empty() {
            findings.push(ModelFinding::Massless { links });
        }
        findings
    }

    /// Checks that something between the base and `tip`, or anywhere in the robot for `None`, has
    /// mass: a body that a joint moves, or a floating base. Some of the bodies may be without mass;
    /// [`Self::findings`] names them.
    ///
    /// Poses, velocities and Jacobians need no masses. Forces, momentum and the motion of a free
    /// base do, and mean nothing where no mass is known. Masses that [`Self::without_subtree`] has
    /// removed are known.
    ///
    /// # Errors
    /// Returns [`ModelError::MasslessChain`] or [`ModelError::MasslessBase`] with the first body.
    pub fn check_masses(&self, tip: Option<FrameId>) -> Result<(), ModelError> {
        let mut bodies = self.moving_bodies();
        if let Some(tip) = tip {
            let on_path = self.path_to(tip);
            bodies.retain(|body| on_path[body.index]);
        }
        match bodies.first() {
            Some(first) if bodies.iter().all(|body| body.is_massless) => {
                Err(first.massless_chain())
            }
            _ => Ok(()),
        }
    }

    /// Checks that the base has mass if it floats.
    ///
    /// # Errors
    /// Returns [`ModelError::MasslessBase`].
    pub fn check_base_mass(&self) -> Result<(), ModelError> {
        let bodies = self.moving_bodies();
        match bodies.first() {
            Some(base) if base.index == 0 && base.is_massless => Err(base.massless()),
            _ => Ok(()),
        }
    }

    /// Checks that each body that moves is one that can exist, as a simulation of its motion needs:
    /// the mass is positive and a rigid body can have the inertia.
    ///
    /// # Errors
    /// Returns [`ModelError::NoInertial`], [`ModelError::MasslessBase`], [`ModelError::Mass`] or
    /// [`ModelError::Inertia`] for the first body that is not.
    pub fn check_bodies(&self) -> Result<(), ModelError> {
        for moving in self.moving_bodies() {
            if moving.is_massless {
                return Err(moving.massless());
            }
            check_body(moving.link, &moving.body.parameters)?;
        }
        Ok(())
    }

    /// Returns the bodies that joints move, and a floating base, in depth-first order.
    fn moving_bodies(&self) -> Vec<MovingBody<'_>> {
        let mut masses_kg: Vec<f64> = self
            .bodies
            .iter()
            .map(|body| body.parameters.mass())
            .collect();
        let mut names = vec![""; self.bodies.len()];
        // In depth-first order the first link of a body is the one that its joint moves: it is
        // assigned last.
        for link in self.links.iter().rev() {
            masses_kg[link.body] += link.removed.mass();
            names[link.body] = &link.name;
        }
        let bodies = self.bodies.iter().enumerate();
        let moving = bodies.skip(usize::from(self.base_kind == BaseKind::Fixed));
        let view = |(index, body)| MovingBody {
            index,
            body,
            link: names[index],
            is_massless: masses_kg[index] == 0.0,
        };
        moving.map(view).collect()
    }

    /// Returns for each body whether it is on the path from the base to a frame.
    fn path_to(&self, tip: FrameId) -> Vec<bool> {
        let mut is_on_path = vec![false; self.bodies.len()];
        let mut index = self.link(tip).body;
        while !is_on_path[index] {
            is_on_path[index] = true;
            index = self.bodies[index].parent;
        }
        is_on_path
    }
}
