//! An arm that moves, comes to rest, and exchanges its payload or touches something, with exact
//! samples.

use nalgebra::{Isometry3, Vector3};
use tactid_dynamics::{
    BaseKind, FrameMotion, InertialParameters, JointMotion, MassProperties, Workspace, Wrench,
    motion, wrench_regressor,
};
use tactid_identify::BaseState;

use crate::arm::{Instant, JOINTS, Run, TOOL, arm, joints_at};

/// Time that the arm takes to stop, s.
const STOPPING_S: f64 = 1.0;

/// Returns the time along the motion, and its first two derivatives, of an arm that begins to stop
/// at `stop_s`, and to move again at `resume_s`.
fn warped(time_s: f64, [stop_s, resume_s]: [f64; 2]) -> [f64; 3] {
    if time_s > resume_s {
        let [along, rate, slope] = warped(time_s - resume_s, [0.0, f64::INFINITY]);
        let stood = stop_s + 0.5 * STOPPING_S;
        return [stood + time_s - resume_s - along, 1.0 - rate, -slope];
    }
    let u = ((time_s - stop_s) / STOPPING_S).clamp(0.0, 1.0);
    let angle = std::f64::consts::PI * u;
    let moved = 0.5 * STOPPING_S * (u + angle.sin() / std::f64::consts::PI);
    let is_stopping = u > 0.0 && u < 1.0;
    let slope = -0.5 * std::f64::consts::PI / STOPPING_S * angle.sin();
    [
        time_s.min(stop_s) + moved,
        0.5 * (1.0 + angle.cos()),
        if is_stopping { slope } else { 0.0 },
    ]
}

/// Returns the samples of a run on a fixed base whose arm begins to stop at a time, s. `pushed` is
/// the further wrench that the sensor measures at a time, in the tool frame, given the rotation of
/// the world into it.
pub(crate) fn stopping(
    run: &Run,
    stop_s: f64,
    pushed: impl Fn(f64, &Isometry3<f64>) -> Wrench,
) -> Vec<Instant> {
    pausing(run, [stop_s, f64::INFINITY], pushed)
}

/// Returns the samples as [`stopping`] does, of an arm that begins to stop at a time, s, and to
/// move again at another.
pub(crate) fn pausing(
    run: &Run,
    rest_s: [f64; 2],
    pushed: impl Fn(f64, &Isometry3<f64>) -> Wrench,
) -> Vec<Instant> {
    let robot = arm(BaseKind::Fixed);
    let tool = robot.frame(TOOL).unwrap();
    let mut workspace = Workspace::new(&robot);
    let sines = run.sines();
    let base = FrameMotion::at_rest(Isometry3::identity());
    let count = (run.duration_s * run.rate_hz).round() as usize;
    let instant = |k: usize| {
        let time_s = k as f64 / run.rate_hz;
        let [along, rate, slope] = warped(time_s, rest_s);
        let [position, velocity, acceleration] = joints_at(&sines, along);
        let velocities = velocity.map(|v| v * rate);
        let accelerations = std::array::from_fn::<f64, JOINTS, _>(|j| {
            acceleration[j] * rate * rate + velocity[j] * slope
        });
        let joints = JointMotion {
            position: &position,
            velocity: &velocities,
            acceleration: &accelerations,
        };
        motion(&mut workspace, &base, joints).unwrap();
        let gravity = Vector3::new(0.0, 0.0, -9.81);
        let of_tool = workspace.frame_motion(tool).in_frame(&gravity);
        let payload: MassProperties = run.payloads[run.held_at(time_s)].1;
        let load = wrench_regressor(&of_tool) * InertialParameters::from(payload).as_vector();
        let further = pushed(time_s, &workspace.pose(tool).inverse());
        Instant {
            time_s,
            base: BaseState::fixed(),
            joints: [position, velocities, accelerations],
            wrench: Wrench {
                force: load.fixed_rows::<3>(0) + further.force,
                moment: load.fixed_rows::<3>(3) + further.moment,
            },
        }
    };
    (0..count).map(instant).collect()
}
