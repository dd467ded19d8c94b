//! Links with collision shapes that cannot be tested.

use std::fmt;

/// Most links that a message names.
const MOST_NAMED: usize = 30;

/// What stands for the shape of a link that has a visual shape alone.
pub(crate) const VISUAL: &str = "<visual>";

/// A link of which a collision shape cannot be tested.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UntestedLink {
    /// Name of the link.
    pub link: String,
    /// The first of its shapes that cannot be tested: file of a mesh, or element of the URDF, which is
    /// `<visual>` where a part of the arm has no collision shape.
    pub shape: String,
    /// Why the shape cannot be tested.
    pub because: String,
}

/// The links with collisions that cannot be tested; none if the URDF has no collision shapes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UntestedLinks(pub Vec<UntestedLink>);

impl UntestedLinks {
    /// Returns what makes a test possible.
    pub(crate) fn remedy(&self) -> String {
        let all = self.0.len();
        let missing = self.0.iter().filter(|link| link.shape == VISUAL).count();
        let shapes = match all {
            0 => "give a URDF with collision shapes",
            _ => "give these links collision shapes in the URDF",
        };
        let meshes = "put the meshes, as STL, OBJ or PLY files, where the URDF names them (for package://, ROS_PACKAGE_PATH may \
                      name the folder that contains the package)";
        if missing == all {
            shapes.to_owned()
        } else if missing == 0 {
            meshes.to_owned()
        } else {
            format!("{shapes} and {meshes}")
        }
    }
}

impl fmt::Display for UntestedLinks {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0.is_empty() {
            return formatter.write_str(
                "collisions of the robot with itself cannot be tested: the URDF has no collision shapes",
            );
        }
        let mut by_reason: Vec<(&str, Vec<&UntestedLink>)> = Vec::new();
        for link in &self.0 {
            match by_reason
                .iter_mut()
                .find(|(reason, _)| *reason == link.because)
            {
                Some((_, links)) => links.push(link),
                None => by_reason.push((&link.because, vec![link])),
            }
        }
        formatter.write_str("collisions of the robot with itself cannot be tested: ")?;
        for (group, (because, links)) in by_reason.iter().enumerate() {
            let names: Vec<&str> = links.iter().map(|link| link.link.as_str()).collect();
            let separator = if group > 0 { "; " } else { "" };
            let noun = if names.len() > 1 { "links" } else { "link" };
            if links[0].shape == VISUAL {
                let names = listed(&names);
                write!(
                    formatter,
                    "{separator}the URDF has no collision shape of the {noun} {names}"
                )?;
                continue;
            }
            write!(
                formatter,
                "{separator}collision shapes of the {noun} {} are left out (`{}`: {because})",
                listed(&names),
                links[0].shape
            )?;
        }
        Ok(())
    }
}

/// Lists names as a sentence does, and counts those beyond [`MOST_NAMED`].
fn listed(names: &[&str]) -> String {
    let shown = &names[..names.len().min(MOST_NAMED)];
    match (shown, names.len() - shown.len()) {
        ([one], 0) => (*one).to_owned(),
        ([first @ .., last], 0) => format!("{} and {last}", first.join(", ")),
        (shown, more) => format!("{} and {more} more", shown.join(", ")),
    }
}
