//! Names in error messages.

use strsim::levenshtein;

/// Largest number of names that a message lists in full.
const MAX_LISTED: usize = 16;
/// Number of most similar names that a message lists where there are more than [`MAX_LISTED`].
const MOST_SIMILAR: usize = 8;
/// Most characters of a name that are compared and shown. The cost is its square for each name.
const MAX_NAME_CHARS: usize = 64;

/// Lists the names among which one was not found, for an error message: all of up to 16, and of
/// more the eight that are most similar to the given one, with the number of the others.
///
/// ```
/// use tactid_dynamics::list_similar;
///
/// assert_eq!(list_similar("tool", ["base", "tool0"]), "base, tool0");
/// let links: Vec<String> = (0..1000).map(|index| format!("link_{index}")).collect();
/// let listed = list_similar("link_042", links.iter().map(String::as_str));
/// assert!(listed.starts_with("link_42, ") && listed.ends_with(" and 992 more"), "{listed}");
/// ```
#[must_use]
pub fn list_similar<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let mut known: Vec<String> = known
        .into_iter()
        .map(|name| shortened(name, MAX_NAME_CHARS))
        .collect();
    let more = known.len().saturating_sub(MOST_SIMILAR);
    if known.len() <= MAX_LISTED {
        return known.join(", ");
    }
    let name = shortened(name, MAX_NAME_CHARS);
    known.sort_by_cached_key(|other| levenshtein(&name, other));
    known.truncate(MOST_SIMILAR);
    format!("{} and {more} more", known.join(", "))
}

/// Returns a text for an error message: the first characters of one that is longer than
/// `most_chars`, and three dots.
///
/// ```
/// assert_eq!(tactid_dynamics::shortened("forearm_link", 20), "forearm_link");
/// assert_eq!(tactid_dynamics::shortened("forearm_link", 7), "forearm...");
/// ```
#[must_use]
pub fn shortened(name: &str, most_chars: usize) -> String {
    match name.char_indices().nth(most_chars) {
        Some((end, _)) => format!("{}...", &name[..end]),
        None => name.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Names with a slip are near, whatever the alphabet.
    #[test]
    fn distances_count_characters() {
        for (from, to, distance) in [
            ("", "", 0),
            ("tool0", "tool0", 0),
            ("tool", "tool0", 1),
            ("tüol0", "tool0", 1),
            ("", "abc", 3),
            ("kitten", "sitting", 3),
            ("abc", "cab", 2),
            ("run", "run", 0),
            ("run1", "run2", 1),
            ("", "ab", 2),
        ] {
            assert_eq!(levenshtein(from, to), distance, "{from} {to}");
            assert_eq!(levenshtein(to, from), distance, "{to} {from}");
        }
    }

    /// A message stays short whatever the names are.
    #[test]
    fn long_names_are_cut() {
        let long = "ü".repeat(100_000);
        let known = vec![long.as_str(); 17];
        let listed = list_similar(&long, known);
        assert!(
            listed.chars().count() < 9 * (MAX_NAME_CHARS + 5),
            "{listed}"
        );
        assert!(listed.ends_with("... and 9 more"), "{listed}");
    }
}
