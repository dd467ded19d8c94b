//! Which motion would make known what a recording left unknown.

/// For each value the motion that determines it, by the structure of the regressor: the force knows
/// the mass by any acceleration against gravity, the first moments by turning; the moment knows the
/// inertia by angular accelerations, (45).
const MOTIONS: [&str; 10] = [
    "Accelerate the tool, or weigh the payload under gravity, for the mass.",
    "Turn the tool about its y or z axis, or its x axis away from the vertical, for com.x.",
    "Turn the tool about its x or z axis, or its y axis away from the vertical, for com.y.",
    "Turn the tool about its x or y axis, or its z axis away from the vertical, for com.z.",
    "Swing the tool about its x axis, faster, for Ixx.",
    "Swing the tool about its x or y axis, faster, for Ixy.",
    "Swing the tool about its x or z axis, faster, for Ixz.",
    "Swing the tool about its y axis, faster, for Iyy.",
    "Swing the tool about its y or z axis, faster, for Iyz.",
    "Swing the tool about its z axis, faster, for Izz.",
];

/// A sentence for each value that is not known.
pub(crate) fn advice(identifiable: &[bool; 10]) -> Vec<String> {
    let pairs = identifiable.iter().zip(MOTIONS);
    let unknown = pairs.filter(|(known, _)| !**known);
    unknown.map(|(_, motion)| motion.to_owned()).collect()
}
