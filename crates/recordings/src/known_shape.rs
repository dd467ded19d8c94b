//! A shape as a request gives it: a file, and how well it is known.

use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::Path;

use nalgebra::Isometry3;
use tactid_dynamics::words::three_digits;
use tactid_identify::Range;
use tactid_options::{Kind, Value, read_as};
use tactid_shapes::{Mesh, ShapePrior, Solid, Tolerance};

use crate::RecordingError;
use crate::choices::pose;

/// Largest size of a file, MiB: a million triangles as text.
const MAX_MIB: u64 = 256;

/// Diagonals of what a robot may hold, m.
const DIAGONALS_M: std::ops::RangeInclusive<f64> = 1e-4..=1e4;

/// Lengths of the units that files have, m: metres, millimetres, centimetres and inches.
const UNITS_M: [f64; 4] = [1.0, 1e-3, 1e-2, 0.0254];

/// Range of the length of one unit of a file, m.
pub(crate) const UNIT_M: Range = Range {
    contains: |unit_m| (1e-9..=1e6).contains(&unit_m),
    expected: "the length of one unit of the file, such as 0.001 for millimetres",
};

/// Range of the standard deviation of the position of a shape, m.
pub(crate) const POSITION_STD_DEV: Range = Range {
    contains: |std_dev| (0.0..=1.0).contains(&std_dev),
    expected: "a standard deviation from 0 to 1 m",
};

/// Range of the standard deviation of the orientation of a shape, rad. Beyond it, the second order of
/// the errors does not describe the inertia.
pub(crate) const ROTATION_STD_DEV: Range = Range {
    contains: |std_dev| (0.0..=std::f64::consts::FRAC_PI_6).contains(&std_dev),
    expected: "a standard deviation from 0 to π/6 rad, 30 degrees",
};

/// Range of the standard deviation of the logarithm of a density. Without it, the mean density of a
/// body would have to be the same in each of its parts.
pub(crate) const LN_DENSITY: Range = Range {
    contains: |std_dev| (0.01..=5.0).contains(&std_dev),
    expected: "a standard deviation from 0.01, a uniform solid, to 5",
};

/// Pose of the frame of a shape's file in the frame of the tip: origin, m, and the quaternion
/// `[x, y, z, w]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapePose(pub [f64; 7]);

impl ShapePose {
    /// Returns the pose.
    ///
    /// # Errors
    /// Returns [`RecordingError::Option`] if the norm of the quaternion is not one to within 0.1.
    pub fn tip_from_shape(&self) -> Result<Isometry3<f64>, RecordingError> {
        let [x, y, z, qx, qy, qz, qw] = self.0;
        pose("shape_pose", [x, y, z], [qx, qy, qz, qw])
    }
}

impl From<[f64; 7]> for ShapePose {
    fn from(entries: [f64; 7]) -> Self {
        Self(entries)
    }
}

impl Value for ShapePose {
    read_as!(Kind::Pose, [f64; 7]);

    fn numbers(&self) -> Vec<f64> {
        self.0.to_vec()
    }
}

/// The shape of the payload as a request gives it.
#[derive(Clone, Debug)]
pub(crate) struct GivenShape {
    solid: Solid,
    tip_from_shape: Isometry3<f64>,
    unit_m: f64,
    tolerance: Tolerance,
}

impl GivenShape {
    /// Returns what the shape says of the payload.
    pub(crate) fn prior(&self) -> ShapePrior {
        self.with_unit(self.unit_m)
    }

    /// Returns other lengths of the unit of the file, m, with what the shape then says.
    pub(crate) fn in_other_units(&self) -> impl Iterator<Item = (f64, ShapePrior)> + '_ {
        let units = UNITS_M.into_iter().filter(|unit| *unit != self.unit_m);
        units.map(|unit_m| (unit_m, self.with_unit(unit_m)))
    }

    fn with_unit(&self, unit_m: f64) -> ShapePrior {
        let Self {
            solid,
            tip_from_shape,
            ..
        } = self;
        solid.prior(tip_from_shape, unit_m, &self.tolerance)
    }

    /// Reads a shape from its file.
    ///
    /// # Errors
    /// Returns [`RecordingError::Option`] if the file cannot be read, has no solid, or one of a size
    /// that no robot holds.
    pub(crate) fn read(
        path: &Path,
        tip_from_shape: Isometry3<f64>,
        unit_m: f64,
        tolerance: Tolerance,
    ) -> Result<Self, RecordingError> {
        let name = path.display();
        let bytes = bytes(path).map_err(|why| of_shape(format!("`shape` is {name}, {why}")))?;
        let file = path.file_name().unwrap_or_default().to_string_lossy();
        let solid = Mesh::read(&file, &bytes).and_then(|mesh| Solid::new(&mesh));
        let solid = solid
            .map_err(|why| of_shape(format!("`shape` is {name}, which cannot be used: {why}")))?;
        let diagonal_m = unit_m * solid.diagonal();
        if !DIAGONALS_M.contains(&diagonal_m) {
            return Err(RecordingError::Option {
                option: "shape_scale",
                what: format!(
                    "`shape` is {name}, whose solid is {} m large with a unit of {unit_m} m: `shape_scale` is the length of \
                     one unit of the file, such as 0.001 for millimetres",
                    three_digits(diagonal_m)
                ),
            });
        }
        Ok(Self {
            solid,
            tip_from_shape,
            unit_m,
            tolerance,
        })
    }
}

/// Returns the bytes of a file, or the reason why it cannot be read.
fn bytes(path: &Path) -> Result<Vec<u8>, String> {
    let unreadable = |error: std::io::Error| match error.kind() {
        ErrorKind::NotFound => "which does not exist".to_owned(),
        _ => format!("which cannot be read: {error}"),
    };
    let metadata = std::fs::metadata(path).map_err(unreadable)?;
    if !metadata.is_file() {
        return Err("which is not a file".to_owned());
    }
    let mut bytes = Vec::new();
    let most = MAX_MIB << 20;
    let file = File::open(path).map_err(unreadable)?;
    file.take(most + 1)
        .read_to_end(&mut bytes)
        .map_err(unreadable)?;
    if bytes.is_empty() {
        return Err("which is empty".to_owned());
    }
    if bytes.len() as u64 > most {
        return Err(format!("which is larger than {MAX_MIB} MiB"));
    }
    Ok(bytes)
}

/// Returns an error of the file of a shape.
pub(crate) fn of_shape(what: String) -> RecordingError {
    RecordingError::Option {
        option: "shape",
        what,
    }
}
