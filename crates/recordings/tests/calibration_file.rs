//! The file of a calibration: the same numbers come back, and what is wrong is named with its line.

use std::fs;

use crate::stored_arm::arm;
use tactid_recordings::{ArmCalibration, RecordingError};

fn written(arm: &ArmCalibration) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("arm.toml");
    arm.write(&path).unwrap();
    assert_eq!(
        fs::read_dir(folder.path()).unwrap().count(),
        1,
        "a temporary file is left"
    );
    fs::read_to_string(&path).unwrap()
}

fn read(text: &str) -> Result<ArmCalibration, RecordingError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("arm.toml");
    fs::write(&path, text).unwrap();
    ArmCalibration::read(&path)
}

/// Equality of floats is that of their bits here: no number is zero or NaN but two zeros of
/// gravity.
#[test]
fn the_same_numbers_come_back() {
    let arm = arm();
    assert_eq!(read(&written(&arm)).unwrap(), arm);
}

/// A residual that is not known is the only number that may be none.
#[test]
fn an_unknown_residual_comes_back() {
    let mut arm = arm();
    arm.report.joints[1].residual_held_out = f64::NAN;
    let back = read(&written(&arm)).unwrap();
    assert!(back.report.joints[1].residual_held_out.is_nan());
    assert_eq!(back.model, arm.model);
}

/// The reason of a bad file, and its line where there is one.
#[test]
fn what_is_wrong_is_named_with_its_line() {
    let text = written(&arm());
    let line_of = |part: &str| {
        1 + text
            .lines()
            .position(|line| line.starts_with(part))
            .unwrap_or_else(|| panic!("{part}"))
    };
    let without = |part: &str| -> String {
        let lines = text.lines().filter(|line| !line.starts_with(part));
        lines.collect::<Vec<_>>().join("\n")
    };
    let first_row = line_of("rows") + 1;
    let longer = text.replacen("rows = [\n  \"", "rows = [\n  \"1.0 ", 1);
    let cases = [
        (
            text.replace("version = 5", "version = 9"),
            None,
            "version 9",
        ),
        (
            text.replacen("viscous =", "viskous =", 1),
            Some(line_of("viscous")),
            "viskous",
        ),
        (without("cutoff_hz"), Some(1), "cutoff_hz"),
        (
            text.replacen("unit = \"N\"", "unit = \"kN\"", 1),
            Some(line_of("unit = \"N\"")),
            "`unit` of the joint `slide` is not valid: `kN`",
        ),
        (
            text.replacen("friction = [", "friction = [1.0, ", 1),
            Some(line_of("friction = [")),
            "has 4 numbers",
        ),
        (
            text.replacen("scales = [", "scales = [1.0, ", 1),
            Some(line_of("scales = [")),
            "has 10 numbers",
        ),
        (longer, Some(first_row), "must have 1 numbers"),
        (
            text.replacen("rows = [\n", "rows = [\n  \"nan\",\n", 1),
            Some(first_row),
            "40 rows",
        ),
        ("tool = ".to_owned(), Some(1), "no file of a calibration"),
        (
            "<robot name=\"arm\">".to_owned(),
            Some(1),
            "no file of a calibration",
        ),
    ];
    for (text, expected, part) in cases {
        assert_refused(&text, expected, part);
    }
}

/// A file of an earlier version, a fingerprint that is no number, and a contradiction of an unknown
/// kind.
#[test]
fn contradictions_and_fingerprints_are_checked() {
    let text = written(&arm());
    let line_of = |part: &str| {
        1 + text
            .lines()
            .position(|line| line.starts_with(part))
            .unwrap()
    };
    let cases = [
        (
            text.replace("version = 5", "version = 4"),
            None,
            "the version 4, but this tactid reads the version 5: calibrate anew",
        ),
        (
            text.replace("fingerprint = \"ffff", "fingerprint = \"gfff"),
            Some(line_of("fingerprint = \"ffff")),
            "`fingerprint` of the recording 2 is not valid",
        ),
        (
            text.replace("\"gravity_tilted\"", "\"gravity_odd\""),
            Some(line_of("assumption = \"gravity_tilted\"")),
            "gravity_odd",
        ),
        (
            text.replace("\"gravity_tilted\"", "\"gravity_tilted\"\nodd = 1"),
            Some(line_of("assumption = \"gravity_tilted\"") + 1),
            "`odd`",
        ),
    ];
    for (text, expected, part) in cases {
        assert_refused(&text, expected, part);
    }
}

/// Asserts that a file is refused, with the line and a part of the reason.
fn assert_refused(text: &str, expected: Option<usize>, part: &str) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("arm.toml");
    fs::write(&path, text).unwrap();
    match ArmCalibration::read(&path).unwrap_err() {
        RecordingError::Calibration { what, .. } => {
            assert!(what.contains(part), "{what}");
            let place = expected.map_or_else(String::new, |line| format!(":{line}"));
            assert!(
                what.starts_with(&format!("{}{place}: ", path.display())),
                "{what}"
            );
        }
        other => panic!("{other:?}"),
    }
}

/// Text of a calibration, of which single values are edited.
struct Edited(String);

impl Edited {
    /// Returns the line of a key in the table with a name, counted from 1.
    fn line_in(&self, name: &str, key: &str) -> usize {
        let lines = self.0.lines().enumerate();
        let mut rest = lines.skip_while(|(_, line)| *line != format!("name = \"{name}\""));
        let found = rest.find(|(_, line)| line.starts_with(&format!("{key} = ")));
        found.unwrap_or_else(|| panic!("{name} {key}")).0 + 1
    }

    /// Asserts that a value is refused in its line, with a part of the reason.
    fn assert_refused(&self, name: &str, key: &str, value: &str, part: &str) {
        let line = self.line_in(name, key);
        let mut lines: Vec<String> = self.0.lines().map(str::to_owned).collect();
        lines[line - 1] = format!("{key} = {value}");
        assert_refused(&lines.join("\n"), Some(line), part);
    }
}

/// A number of a joint that is out of range, or does not fit the number that it is derived from, is
/// named with its line.
#[test]
fn edited_numbers_of_joints_are_checked() {
    let text = Edited(written(&arm()));
    let cases = [
        (
            "gain",
            "1.9",
            "`gain` of the joint `slide` is not valid: 1.9 is not 1 / ",
        ),
        ("gain_std_dev", "-1.0", "-1 is not finite and not negative"),
        ("effort_gain", "0.0", "0 is not finite and not zero"),
        ("inverse_gain", "-2.0", "-2 is not finite and more"),
        (
            "friction",
            "[1.0, nan, 1.0]",
            "`friction` of the joint `slide` is not valid: NaN is not finite",
        ),
        ("scales", "[1.0]", "it has 1 numbers, but must have "),
        ("noise_white", "0.0", "`noise_white` of the joint"),
        (
            "noise_white",
            "1e9",
            "1000000000 is not between 0.0000 and 58.8235",
        ),
        ("noise_slow", "59.0", "59 is not between 0.0000 and 58.8235"),
        ("noise_standstill", "59.0", "59 is not between 0.0000 and"),
        ("noise_slow_time_s", "nan", "NaN is not finite"),
        ("reference_torque", "-1.0", "-1 is not finite and more"),
        ("max_velocity", "[1.0, -1.0]", "-1 is not finite"),
        ("residual_after", "inf", "inf is not finite"),
        ("residual_held_out", "-1.0", "-1 is not finite"),
        ("unit", "\"Nm\"", "`Nm` is neither `N m` nor `N`"),
    ];
    for (key, value, part) in cases {
        text.assert_refused("slide", key, value, part);
    }
}

/// A number of a link that is out of range, and a direction whose length is not one, are named with
/// their line.
#[test]
fn edited_numbers_of_links_are_checked() {
    let text = Edited(written(&arm()));
    let ten = |third: &str| format!("[1.0, 1.0, {third}, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0]");
    let cases = [
        (
            "scales",
            ten("inf"),
            "`scales` of the link `lower` is not valid: inf is not finite",
        ),
        ("scales", ten("0.0"), "0 is not finite and more than zero"),
        (
            "std_devs",
            ten("nan"),
            "`std_devs` of the link `lower` is not valid: NaN is not finite",
        ),
        ("std_devs", ten("-2.0"), "-2 is not finite and not negative"),
        (
            "axis",
            "[1.0, 1.0, 0.0]".to_owned(),
            "its length is 1.4142135623730951 instead of 1",
        ),
        (
            "rotation",
            "[0.0, 0.0, 0.0, nan]".to_owned(),
            "its length is NaN instead of 1",
        ),
    ];
    for (key, value, part) in cases {
        text.assert_refused("lower", key, &value, part);
    }
}

/// A number before the first table is named with its line.
#[test]
fn edited_keys_before_the_tables_are_checked() {
    let text = written(&arm());
    let cases = [
        ("delay_std_dev_s", "nan"),
        ("delay_std_dev_s", "-0.001"),
        ("delay_s", "inf"),
        ("delay_scale_s", "0.0"),
        ("gravity_m_s2", "[0.0, nan, 1.0]"),
        ("cutoff_hz", "-2.0"),
        ("window_s", "0.0"),
        ("log_evidence", "nan"),
        ("friction_velocities", "[0.005, 0.05, 7.0]"),
    ];
    for (key, value) in cases {
        let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
        let start = format!("{key} = ");
        let place = lines.iter().position(|line| line.starts_with(&start));
        let place = place.unwrap();
        let mut end = place + 1;
        while lines[place].ends_with('[') && lines[end - 1] != "]" {
            end += 1;
        }
        lines.splice(place..end, [start + value]);
        let expected = format!("`{key}` is not valid");
        assert_refused(&lines.join("\n"), Some(place + 1), &expected);
    }
}

/// A delay that no calibration finds, and windows that do not belong to the cutoff, are refused
/// with what would be right; types are named in words.
#[test]
fn ranges_are_named() {
    let text = written(&arm());
    let cases = [
        ("delay_s", "29.0", "29 is not between -0.0496 and 0.0496"),
        ("delay_s", "-0.05", "-0.05 is not between -0.0496 and"),
        ("window_s", "46.3", "46.3 is not 0.39685"),
        (
            "windows",
            "\"many\"",
            "expected a whole number that is not negative",
        ),
        (
            "cutoff_hz",
            "\"two\"",
            "invalid type: string \"two\", expected a number",
        ),
    ];
    for (key, value, part) in cases {
        let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
        let start = format!("{key} = ");
        let place = lines.iter().position(|line| line.starts_with(&start));
        let place = place.unwrap();
        lines[place] = start + value;
        assert_refused(&lines.join("\n"), Some(place + 1), part);
    }
}

/// A precision that no covariance has is refused with its line.
#[test]
fn an_edited_precision_is_checked() {
    let text = written(&arm());
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let header = lines.iter().position(|line| line == "[precision]").unwrap();
    lines[header + 2] = "  \"-1.0\",".to_owned();
    let expected = "not positive definite";
    assert_refused(&lines.join("\n"), Some(header + 1), expected);
}

/// A file that is not there, and a folder that is not, are errors that name the file.
#[test]
fn files_that_cannot_be_used_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("none").join("arm.toml");
    let read = ArmCalibration::read(&path).unwrap_err().to_string();
    let write = arm().write(&path).unwrap_err().to_string();
    assert!(
        read.starts_with(&format!("cannot read the calibration {}: ", path.display())),
        "{read}"
    );
    assert!(
        write.starts_with(&format!(
            "cannot write the calibration {}: ",
            path.display()
        )),
        "{write}"
    );
}
