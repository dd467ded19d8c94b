//! The order of the unknowns of an arm.

use std::ops::Range;

use tactid_dynamics::PARAMETER_NAMES;

use super::arm::WIDTHS;

/// The order of the unknowns: ten parameters of each link, groups of one for each joint, the delay.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Layout {
    pub(crate) links: usize,
    pub(crate) joints: usize,
    /// Indices in [`WIDTHS`] of the friction terms.
    pub(crate) widths: Vec<usize>,
}

/// A group with one unknown for each joint, or with one that all joints share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Group {
    Offset,
    Viscous,
    /// The friction term with this place in [`Layout::widths`].
    Friction(usize),
    /// Load-dependent friction.
    Load,
    /// What the load-dependent friction of a payload adds.
    PayloadLoad,
    Rotor,
    InverseGain,
    /// Delay of the efforts, which all joints share.
    Delay,
}

impl Layout {
    /// Returns the groups in their order.
    pub(crate) fn groups(&self) -> impl Iterator<Item = Group> + use<> {
        let friction = (0..self.widths.len()).map(Group::Friction);
        let last = [
            Group::Load,
            Group::PayloadLoad,
            Group::Rotor,
            Group::InverseGain,
            Group::Delay,
        ];
        [Group::Offset, Group::Viscous]
            .into_iter()
            .chain(friction)
            .chain(last)
    }

    /// Number of unknowns.
    pub(crate) fn len(&self) -> usize {
        self.link_range().end + self.joints * (6 + self.widths.len()) + 1
    }

    /// Range of the parameters of all links.
    pub(crate) fn link_range(&self) -> Range<usize> {
        0..10 * self.links
    }

    /// Range of a group.
    pub(crate) fn range(&self, group: Group) -> Range<usize> {
        let widths = self.widths.len();
        let place = match group {
            Group::Offset => 0,
            Group::Viscous => 1,
            Group::Friction(width) => 2 + width,
            Group::Load => 2 + widths,
            Group::PayloadLoad => 3 + widths,
            Group::Rotor => 4 + widths,
            Group::InverseGain => 5 + widths,
            Group::Delay => 6 + widths,
        };
        let start = self.link_range().end + place * self.joints;
        let is_shared = group == Group::Delay;
        start..start + if is_shared { 1 } else { self.joints }
    }

    /// Index of the unknown of a joint in a group.
    pub(crate) fn index(&self, group: Group, joint: usize) -> usize {
        let range = self.range(group);
        range.start + joint.min(range.len() - 1)
    }

    /// Returns the name of each unknown.
    pub(crate) fn names(&self, links: &[String], joints: &[String]) -> Vec<String> {
        let of_link = |link: &String| PARAMETER_NAMES.map(|name| format!("{link} {name}"));
        let of_links = links.iter().flat_map(of_link);
        let of_groups = self.groups().flat_map(|group| -> Vec<String> {
            let name = match group {
                Group::Offset => "offset".into(),
                Group::Viscous => "viscous friction".into(),
                Group::Friction(width) => format!("friction {}", WIDTHS[self.widths[width]]),
                Group::Load => "load friction".into(),
                Group::PayloadLoad => "payload friction".into(),
                Group::Rotor => "rotor inertia".into(),
                Group::InverseGain => "inverse gain".to_owned(),
                Group::Delay => return vec!["delay".to_owned()],
            };
            joints
                .iter()
                .map(|joint| format!("{joint} {name}"))
                .collect()
        });
        of_links.chain(of_groups).collect()
    }
}
