//! Errors of a shape and of its options.

use std::path::PathBuf;

use tactid_recordings::{EstimatorKind, RecordingError, Request, ShapePose, identify_arrays};

use crate::shape::{PARTS, Turning, WOOD_AND_STEEL, body, file, with_shape, written};

/// Returns the error of an identification, and the option that it names.
fn error(run: &Turning, request: &Request) -> (String, Option<&'static str>) {
    let mut observer = |_| std::ops::ControlFlow::Continue(());
    let found: Result<_, RecordingError> = identify_arrays(&run.arrays(), request, &mut observer);
    let error = found.err().unwrap();
    (error.to_string(), error.option())
}

/// Each error of a shape names its file and says what would be right.
#[test]
fn a_shape_that_cannot_be_used_is_an_error() {
    let run = Turning::new(&body(WOOD_AND_STEEL), 1.0, 2, 1.0);
    let text = std::fs::read_to_string(file("box.obj", 1.0, &PARTS[..1])).unwrap();
    let open = text.replace("f -8 -6 -5 -7\n", "");
    for (path, expected) in [
        (
            PathBuf::from("none.stl"),
            "`shape` is none.stl, which does not exist",
        ),
        (std::env::temp_dir(), "which is not a file"),
        (written("a.stl", b""), "which is empty"),
        (
            written("a.step", b"x"),
            "which cannot be used: only STL, OBJ and PLY are read",
        ),
        (
            written("a.obj", b"o a\n"),
            "which cannot be used: it has no vertices",
        ),
        (
            written("a.obj", open.as_bytes()),
            "which cannot be used: its surface is open, or its faces are oriented differently",
        ),
    ] {
        let (words, option) = error(&run, &with_shape(path));
        assert!(words.contains(expected), "{words}");
        assert_eq!(option, Some("shape"));
    }
}

/// An option of a shape that is out of range, or does not go with the others, is an error.
#[test]
fn a_shape_needs_options_that_go_together() {
    let run = Turning::new(&body(WOOD_AND_STEEL), 1.0, 2, 1.0);
    let kilometres = Request {
        shape_scale: Some(1e6),
        ..with_shape(file("a.obj", 1.0, &PARTS))
    };
    let (words, option) = error(&run, &kilometres);
    assert!(
        words.contains("`shape_scale` is the length of one unit of the file"),
        "{words}"
    );
    assert_eq!(option, Some("shape_scale"));
    let alone = Request {
        shape_scale: Some(1e-3),
        ..Request::default()
    };
    let (words, _) = error(&run, &alone);
    assert_eq!(words, "`shape` is missing, but `shape_scale` is given");
    let pose = Request {
        shape_pose: Some(ShapePose([0.0; 7])),
        ..with_shape(file("a.obj", 1.0, &PARTS))
    };
    let (words, option) = error(&run, &pose);
    assert!(words.contains("of `shape_pose` has the norm 0"), "{words}");
    assert_eq!(option, Some("shape_pose"));
    let filter = Request {
        estimator: Some(EstimatorKind::Nlms),
        ..with_shape(file("a.obj", 1.0, &PARTS))
    };
    assert!(
        error(&run, &filter).0.contains("a shape"),
        "{}",
        error(&run, &filter).0
    );
}
