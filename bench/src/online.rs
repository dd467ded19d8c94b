//! The online update: each kernel presents all samples to a new stream or identifier and writes its
//! last result.

use nalgebra::Vector3;
use tactid_dynamics::{BaseKind, InertialParameters, Manipulator, Wrench};
use tactid_identify::{BaseState, EquationSettings, EquationStream, Identifier, Sample};

/// A robot on a fixed base with a wrench sensor at its tool, and what they measured.
pub struct Online {
    robot: Manipulator,
    tool: String,
    times_s: Vec<f64>,
    position: Vec<f64>,
    velocity: Vec<f64>,
    wrenches: Vec<Wrench>,
}

/// Presents all samples and writes the result; `None` where an error stops it.
pub type Kernel = fn(&Online, &mut [f64]) -> Option<()>;

/// Returns the kernel of a name.
pub fn kernel(name: &str) -> Option<Kernel> {
    Some(match name {
        "rows" => rows,
        "update" => update,
        _ => return None,
    })
}

impl Online {
    /// Reads samples: time, positions and velocities of the joints, force and moment at the tool.
    pub fn new(urdf: &str, tool: &str, numbers: &[f64]) -> Option<Self> {
        let robot = Manipulator::from_urdf(urdf, BaseKind::Fixed).ok()?;
        let dof = robot.dof();
        let mut online = Self {
            robot,
            tool: tool.to_owned(),
            times_s: Vec::new(),
            position: Vec::new(),
            velocity: Vec::new(),
            wrenches: Vec::new(),
        };
        for sample in numbers.chunks_exact(1 + 2 * dof + 6) {
            let (joints, wrench) = sample[1..].split_at(2 * dof);
            online.times_s.push(sample[0]);
            online.position.extend_from_slice(&joints[..dof]);
            online.velocity.extend_from_slice(&joints[dof..]);
            online.wrenches.push(Wrench {
                force: Vector3::from_column_slice(&wrench[..3]),
                moment: Vector3::from_column_slice(&wrench[3..]),
            });
        }
        Some(online)
    }

    fn samples(&self) -> impl Iterator<Item = Sample<'_>> {
        let dof = self.robot.dof();
        let joints = self.position.chunks(dof).zip(self.velocity.chunks(dof));
        let measured = self.times_s.iter().zip(joints).zip(&self.wrenches);
        measured.map(|((&time_s, (position, velocity)), wrench)| Sample {
            time_s,
            base: BaseState::fixed(),
            joint_position: position,
            joint_velocity: velocity,
            joint_effort: &[],
            wrenches: std::slice::from_ref(wrench),
        })
    }
}

/// The mean rows of the last window: for each channel the ten entries of the regressor and the
/// target.
fn rows(online: &Online, out: &mut [f64]) -> Option<()> {
    let settings = EquationSettings::default();
    let (tool, robot) = (online.tool.as_str(), &online.robot);
    let mut stream = EquationStream::new(robot, tool, &[tool], &settings).ok()?;
    for sample in online.samples() {
        let (_, equation) = stream.push(&sample).ok()?;
        let Some(equation) = equation else { continue };
        for (row, out) in equation.rows.iter().zip(out.chunks_exact_mut(11)) {
            out[..10].copy_from_slice(row.regressor.as_slice());
            out[10] = row.target;
        }
    }
    Some(())
}

/// The ten parameters after the last sample. The estimate with its uncertainty is asked for after
/// each sample.
fn update(online: &Online, out: &mut [f64]) -> Option<()> {
    let settings = EquationSettings::default();
    let (tool, robot) = (online.tool.as_str(), &online.robot);
    let mut identifier = Identifier::new(robot, tool, &[tool], &settings).ok()?;
    for sample in online.samples() {
        identifier.push(&sample).ok()?;
        std::hint::black_box(identifier.estimate());
    }
    identifier.finish();
    let parameters = InertialParameters::from(identifier.estimate().body);
    out.copy_from_slice(parameters.as_vector().as_slice());
    Some(())
}
