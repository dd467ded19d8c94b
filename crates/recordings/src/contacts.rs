//! Wrenches of messages: as a sensor measures them, and as the sums of the forces at the points of
//! a tactile array.

use nalgebra::Vector3;
use tactid_dynamics::Wrench;
use tactid_dynamics::words::listed;
use tactid_logs::messages::{Header, PointCloud2, PointField, WrenchStamped};
use tactid_logs::{LogReader, RawMessage, Topic};

use crate::fault::FaultKind;

/// Reader of the messages that have a wrench; its memory is used again.
#[derive(Clone, Debug, Default)]
pub(crate) struct WrenchMessages {
    stamped: WrenchStamped,
    cloud: PointCloud2,
}

impl WrenchMessages {
    /// Decodes a message: its header, its wrench about the origin of the header's frame, and the
    /// number of points without a number, which are left out of the sum.
    pub(crate) fn read(
        &mut self,
        message: &RawMessage,
    ) -> Result<(&Header, Wrench, u64), FaultKind> {
        if message.topic.is::<PointCloud2>() {
            let decoded = message.decode_into(&mut self.cloud);
            decoded.map_err(|_| FaultKind::Undecodable)?;
            let (wrench, left_out) = sum(&self.cloud)?;
            return Ok((&self.cloud.header, wrench, left_out));
        }
        let decoded = message.decode_into(&mut self.stamped);
        decoded.map_err(|_| FaultKind::Undecodable)?;
        let [force, moment] = [self.stamped.wrench.force, self.stamped.wrench.torque]
            .map(|v| Vector3::new(v.x, v.y, v.z));
        Ok((&self.stamped.header, Wrench { force, moment }, 0))
    }
}

/// Returns why the points of a topic cannot be summed to a wrench; `None` where the first message
/// has points with forces.
pub(crate) fn why_no_forces(log: &LogReader, topic: &Topic) -> Option<String> {
    let first = log.messages_on([&topic.name]).ok();
    let first = first.and_then(|mut messages| messages.next()?.ok());
    let cloud = first.and_then(|message| message.decode::<PointCloud2>().ok());
    let fields = cloud.map(|cloud| cloud.fields).unwrap_or_default();
    if Layout::of(&fields).is_some() {
        return None;
    }
    let quoted = |names: Vec<&str>| -> Vec<String> {
        names.iter().map(|name| format!("`{name}`")).collect()
    };
    let there = quoted(fields.iter().map(|field| field.name.as_str()).collect());
    let places = Layout::places(&fields).into_iter().zip(NUMBERS);
    let missing = quoted(
        places
            .filter_map(|(place, name)| place.is_none().then_some(name))
            .collect(),
    );
    Some(format!(
        "the points of {} have the fields {}, and their forces need {}, too: `x`, `y`, `z` are the \
         position, m, and `fx`, `fy`, `fz` the force, N; similar names such as `force_x` are \
         recognized",
        topic.name,
        if there.is_empty() {
            "none".to_owned()
        } else {
            listed(&there)
        },
        listed(&missing)
    ))
}

/// Names of the numbers of a point: its position, then its force.
const NUMBERS: [&str; 6] = ["x", "y", "z", "fx", "fy", "fz"];

/// Byte offset and data type of one number of a point.
#[derive(Clone, Copy, Debug)]
struct Place {
    offset: usize,
    datatype: u8,
}

/// Where a point has its position and its force.
#[derive(Clone, Copy, Debug)]
struct Layout([Place; 6]);

impl Layout {
    /// Returns the layout of the first fields with the names of a position and a force: `x`, `fx`,
    /// `force_x` or `Force.X` for their first components, or `position` and `force` of three
    /// elements.
    fn of(fields: &[PointField]) -> Option<Self> {
        let [x, y, z, fx, fy, fz] = Self::places(fields);
        Some(Self([x?, y?, z?, fx?, fy?, fz?]))
    }

    /// Returns the place of each of [`NUMBERS`]; `None` where no field has it.
    fn places(fields: &[PointField]) -> [Option<Place>; 6] {
        let place = |quantity: &str, short: &str, axis: usize| {
            let letter = ["x", "y", "z"][axis];
            let names = [format!("{short}{letter}"), format!("{quantity}{letter}")];
            let find = |field: &PointField| {
                let lower = field.name.to_lowercase();
                let name = lower.replace(|c: char| !c.is_alphanumeric(), "");
                let element = match field.count {
                    3 if name == quantity => axis,
                    _ if names.contains(&name) => 0,
                    _ => return None,
                };
                let datatype = field.datatype;
                let offset = field.offset as usize + element * size(datatype)?;
                Some(Place { offset, datatype })
            };
            fields.iter().find_map(find)
        };
        std::array::from_fn(|k| match k {
            0..3 => place("position", "", k),
            _ => place("force", "f", k - 3),
        })
    }
}

/// Returns the size of a data type, bytes.
fn size(datatype: u8) -> Option<usize> {
    match datatype {
        PointField::INT8 | PointField::UINT8 => Some(1),
        PointField::INT16 | PointField::UINT16 => Some(2),
        PointField::INT32 | PointField::UINT32 | PointField::FLOAT32 => Some(4),
        PointField::FLOAT64 => Some(8),
        _ => None,
    }
}

/// Returns the sum of the forces of a cloud about the origin of its frame, and how many points have
/// no number: a cloud without points is one of a pad that nothing touches.
fn sum(cloud: &PointCloud2) -> Result<(Wrench, u64), FaultKind> {
    let layout = Layout::of(&cloud.fields).ok_or(FaultKind::Undecodable)?;
    let mut total = Wrench::zero();
    let (mut points, mut left_out) = (0, 0);
    let [step, width, height, row] =
        [cloud.point_step, cloud.width, cloud.height, cloud.row_step].map(|n| n as usize);
    if width == 0 || height == 0 {
        return Ok((total, 0));
    }
    let row = if height == 1 { cloud.data.len() } else { row };
    let bytes = step.checked_mul(width).filter(|bytes| *bytes > 0);
    let bytes = bytes.ok_or(FaultKind::Undecodable)?;
    // A row that is shorter than its points, or missing, makes the cloud another one than its
    // header says.
    if row < bytes
        || row
            .checked_mul(height)
            .is_none_or(|all| all > cloud.data.len())
    {
        return Err(FaultKind::Undecodable);
    }
    for row in cloud.data.chunks_exact(row).take(height) {
        for point in row[..bytes].chunks_exact(step) {
            points += 1;
            let mut six = [0.0; 6];
            for (value, place) in six.iter_mut().zip(layout.0) {
                *value = number(point, place, cloud.is_bigendian).ok_or(FaultKind::Undecodable)?;
            }
            if six.iter().all(|value| value.is_finite()) {
                let [at, force] = [&six[..3], &six[3..]].map(Vector3::from_column_slice);
                total.force += force;
                total.moment += at.cross(&force);
            } else {
                left_out += 1;
            }
        }
    }
    if left_out == points {
        return Err(FaultKind::NotFinite);
    }
    Ok((total, left_out))
}

/// Reads a number of a point.
fn number(point: &[u8], place: Place, is_big_endian: bool) -> Option<f64> {
    let bytes = point.get(place.offset..)?.get(..size(place.datatype)?)?;
    let mut eight = [0; 8];
    let little = &mut eight[..bytes.len()];
    little.copy_from_slice(bytes);
    if is_big_endian {
        little.reverse();
    }
    let [a, b, c, d, ..] = eight;
    let (two, four) = ([a, b], [a, b, c, d]);
    Some(match place.datatype {
        PointField::INT8 => f64::from(a as i8),
        PointField::UINT8 => f64::from(a),
        PointField::INT16 => f64::from(i16::from_le_bytes(two)),
        PointField::UINT16 => f64::from(u16::from_le_bytes(two)),
        PointField::INT32 => f64::from(i32::from_le_bytes(four)),
        PointField::UINT32 => f64::from(u32::from_le_bytes(four)),
        PointField::FLOAT32 => f64::from(f32::from_le_bytes(four)),
        _ => f64::from_le_bytes(eight),
    })
}
