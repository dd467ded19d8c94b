//! Messages as rows of numbers.

use tactid_logs::messages::{
    AccelStamped, Imu, InertiaStamped, JointState, Odometry, Quaternion, StringMsg, Vector3,
    WrenchStamped,
};

use crate::table::{Rows, Table};

impl Rows for JointState {
    // As wide as the number of joints, which the messages determine.
    const ARRAYS: &'static [(&'static str, usize)] =
        &[("position", 0), ("velocity", 0), ("effort", 0)];

    fn put(&self, table: &mut Table) {
        if self.name != table.last_names {
            table.last_names.clone_from(&self.name);
            table.order = self.name.iter().map(|name| table.joint(name)).collect();
        }
        for (array, values) in [&self.position, &self.velocity, &self.effort]
            .into_iter()
            .enumerate()
        {
            let mut row = vec![f64::NAN; table.names.len()];
            // A list that is too short leaves the rest unmeasured.
            for (&joint, &value) in table.order.iter().zip(values) {
                row[joint] = value;
            }
            table.arrays[array].put(row);
        }
    }

    fn publisher(&self) -> &[String] {
        &self.name
    }

    fn frame(&self) -> &str {
        "" // joints have none, whatever the header contains
    }
}

impl Rows for WrenchStamped {
    const ARRAYS: &'static [(&'static str, usize)] = &[("wrench", 6)];

    fn put(&self, table: &mut Table) {
        table.arrays[0].put(six(self.wrench.force, self.wrench.torque));
    }
}

impl Rows for Odometry {
    const ARRAYS: &'static [(&'static str, usize)] = &[("pose", 7), ("twist", 6)];

    fn put(&self, table: &mut Table) {
        let (pose, twist) = (&self.pose.pose, &self.twist.twist);
        let position: [f64; 3] = pose.position.into();
        table.arrays[0].put(position.into_iter().chain(four(pose.orientation)));
        table.arrays[1].put(six(twist.linear, twist.angular));
    }

    fn child_frame(&self) -> &str {
        &self.child_frame_id
    }
}

impl Rows for AccelStamped {
    const ARRAYS: &'static [(&'static str, usize)] = &[("acceleration", 6)];

    fn put(&self, table: &mut Table) {
        table.arrays[0].put(six(self.accel.linear, self.accel.angular));
    }
}

impl Rows for Imu {
    const ARRAYS: &'static [(&'static str, usize)] = &[
        ("orientation", 4),
        ("angular_velocity", 3),
        ("linear_acceleration", 3),
    ];

    fn put(&self, table: &mut Table) {
        // A covariance that begins with -1 marks what was not measured.
        let known = |covariance: &[f64; 9]| {
            if covariance[0] == -1.0 { f64::NAN } else { 1.0 }
        };
        let orientation = known(&self.orientation_covariance);
        let rate = known(&self.angular_velocity_covariance);
        let acceleration = known(&self.linear_acceleration_covariance);
        table.arrays[0].put(four(self.orientation).map(|value| orientation * value));
        table.arrays[1].put(three(self.angular_velocity).map(|value| rate * value));
        table.arrays[2].put(three(self.linear_acceleration).map(|value| acceleration * value));
    }
}

impl Rows for InertiaStamped {
    const ARRAYS: &'static [(&'static str, usize)] = &[("values", 10)];

    fn put(&self, table: &mut Table) {
        let body = &self.inertia;
        let [x, y, z] = body.com.into();
        table.arrays[0].put([
            body.m, x, y, z, body.ixx, body.ixy, body.ixz, body.iyy, body.iyz, body.izz,
        ]);
    }
}

impl Rows for StringMsg {
    const ARRAYS: &'static [(&'static str, usize)] = &[];

    fn put(&self, table: &mut Table) {
        table.text.push(self.data.clone());
    }
}

fn three(vector: Vector3) -> [f64; 3] {
    vector.into()
}

fn four(rotation: Quaternion) -> [f64; 4] {
    [rotation.x, rotation.y, rotation.z, rotation.w]
}

fn six(first: Vector3, second: Vector3) -> impl Iterator<Item = f64> {
    three(first).into_iter().chain(three(second))
}
