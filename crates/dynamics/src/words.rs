//! Numbers and lists as sentences have them.

use std::fmt::Write;

/// Largest number that a sentence shows: in data without noise it may be any number.
const LARGEST_SHOWN: f64 = 1000.0;

/// Number of names that a sentence lists; of more it lists one less, and counts the rest.
const MOST_NAMES: usize = 6;

/// Largest number of characters of a name in a sentence.
const LONGEST_NAME: usize = 200;

/// Half of a 95 % interval in standard deviations.
pub const HALF_WIDTH_95: f64 = 1.96;

/// Returns a number rounded to three significant digits, for a message.
#[must_use]
pub fn three_digits(value: f64) -> f64 {
    // Every float in this format is a number again.
    format!("{value:.2e}").parse().unwrap_or(value)
}

/// Returns a number with so many significant figures, without trailing zeros, and with an exponent
/// where it is very large or small, as `%g` of C has it.
///
/// ```
/// use tactid_dynamics::words::general;
///
/// assert_eq!(general(-9.81, 6), "-9.81");
/// assert_eq!(general(0.000_01, 3), "1e-05");
/// assert_eq!(general(31_234.0, 4), "3.123e+04");
/// ```
#[must_use]
pub fn general(number: f64, figures: usize) -> String {
    if !number.is_finite() {
        return if number.is_nan() {
            "nan".to_owned()
        } else {
            number.to_string()
        };
    }
    let decimals = figures.saturating_sub(1);
    let text = format!("{number:.decimals$e}");
    let Some((mantissa, exponent)) = text.split_once('e') else {
        return text;
    };
    let exponent: i32 = exponent.parse().unwrap_or_default();
    match usize::try_from(i64::from(exponent) + 4) {
        Ok(above) if above < figures + 4 => {
            let decimals = (decimals + 4).saturating_sub(above);
            without_zeros(&format!("{number:.decimals$}")).to_owned()
        }
        _ => {
            let sign = if exponent < 0 { '-' } else { '+' };
            format!(
                "{}e{sign}{:02}",
                without_zeros(mantissa),
                exponent.unsigned_abs()
            )
        }
    }
}

/// Returns a decimal number without trailing zeros.
fn without_zeros(text: &str) -> &str {
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.')
    } else {
        text
    }
}

/// Returns a number with two significant figures and without an exponent.
#[must_use]
pub fn two_figures(number: f64) -> String {
    let rounded = general(number, 2).parse().unwrap_or(number);
    general(rounded, 15)
}

/// Returns a number with so many decimals, or that it is more than 1000.
#[must_use]
pub fn at_most(number: f64, decimals: usize) -> String {
    if number < LARGEST_SHOWN {
        format!("{number:.decimals$}")
    } else {
        format!("more than {LARGEST_SHOWN}")
    }
}

/// Returns the number of decimals that show two figures of a half width, nine at most.
#[must_use]
pub fn decimals_of(half_width: f64) -> usize {
    if half_width <= 0.0 || half_width.is_nan() {
        return 9;
    }
    // Saturates.
    (1.0 - half_width.log10().floor()).clamp(0.0, 9.0) as usize
}

/// Returns a value with half of its 95 % interval, to two figures of it; `not known` without one.
#[must_use]
pub fn with_interval(value: f64, std_dev: f64) -> String {
    let half_width = HALF_WIDTH_95 * std_dev;
    if !half_width.is_finite() {
        return "not known".to_owned();
    }
    let decimals = decimals_of(half_width);
    format!("{value:.decimals$} ± {half_width:.decimals$}")
}

/// Returns a ratio in percent, with two figures where it is small.
#[must_use]
pub fn percent(ratio: f64) -> String {
    let percent = 100.0 * ratio;
    if percent >= 1e-3 {
        format!("{percent:.*} %", decimals_of(percent).min(3))
    } else {
        "under 0.001 %".to_owned()
    }
}

/// Returns a number with its noun, which has a plural in `s`.
#[must_use]
pub fn counted(count: usize, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}

/// Lists words as a sentence does: with commas, and `and` before the last one.
#[must_use]
pub fn listed<W: AsRef<str>>(words: &[W]) -> String {
    let mut list = String::new();
    for (k, word) in words.iter().enumerate() {
        list.push_str(match k {
            0 => "",
            _ if k + 1 < words.len() => ", ",
            _ => " and ",
        });
        list.push_str(word.as_ref());
    }
    list
}

/// Lists words as [`listed`] does, but only the first of more than six. A long word is cut off.
#[must_use]
pub fn abridged<W: AsRef<str>>(words: &[W]) -> String {
    let shown = match words.len() {
        0..=MOST_NAMES => words.len(),
        _ => MOST_NAMES - 1,
    };
    let short: Vec<String> = words[..shown]
        .iter()
        .map(|word| cut(word.as_ref()))
        .collect();
    if shown == words.len() {
        return listed(&short);
    }
    let mut list = short.join(", ");
    // Writing to a string does not fail.
    let _ = write!(list, " and {} more", words.len() - shown);
    list
}

/// Returns a word, cut off after [`LONGEST_NAME`] characters.
fn cut(word: &str) -> String {
    match word.char_indices().nth(LONGEST_NAME) {
        Some((end, _)) => format!("{}…", &word[..end]),
        None => word.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers are formatted as C's `%g` does.
    #[test]
    fn general_numbers_are_those_of_c() {
        for (number, figures, expected) in [
            (0.0, 6, "0"),
            (-0.0, 6, "-0"),
            (9.81, 6, "9.81"),
            (1e-4, 6, "0.0001"),
            (9.999_999e-5, 3, "0.0001"),
            (1.25e-8, 3, "1.25e-08"),
            (999_999.5, 6, "1e+06"),
            (123_456.0, 6, "123456"),
            (0.5, 1, "0.5"),
            (f64::INFINITY, 6, "inf"),
            (f64::NAN, 6, "nan"),
        ] {
            assert_eq!(general(number, figures), expected);
        }
        assert_eq!(two_figures(0.0456), "0.046");
        assert_eq!(two_figures(123.4), "120");
    }

    /// Of many names the first five are listed.
    #[test]
    fn many_names_are_abridged() {
        let names = ["a", "b", "c", "d", "e", "f", "g"];
        assert_eq!(listed(&names[..3]), "a, b and c");
        assert_eq!(listed(&names[..1]), "a");
        assert_eq!(abridged(&names[..6]), "a, b, c, d, e and f");
        assert_eq!(abridged(&names), "a, b, c, d, e and 2 more");
        assert_eq!(abridged(&["ü".repeat(201)]), "ü".repeat(200) + "…");
    }
}
