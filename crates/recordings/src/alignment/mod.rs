//! Alignment: measurements of several publishers, brought onto the times of the joints.

mod aligner;
mod averaging;
mod event;
mod interpolation;
mod stream;

pub(crate) use aligner::{Aligned, Aligner};
pub(crate) use event::{
    Averaging, Event, JOINT_VELOCITY, JointValues, Measured, SpecificForce, Streams, first_joints,
};
