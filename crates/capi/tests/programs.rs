//! Programs in C and C++, built as a user builds them: against an installed package, which CMake
//! and pkg-config find.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]
#![expect(
    clippy::print_stderr,
    reason = "a test that is skipped gives the reason"
)]

#[path = "../../identify/tests/common/mod.rs"]
mod common;

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::LazyLock;

use common::{Experiment, Instant, Noise, TOOL, URDF, identifier, payload};
use nalgebra::UnitQuaternion;
use rand::{SeedableRng, rngs::SmallRng};
use tactid::tactid_estimate;
use tactid_dynamics::MassProperties;
use tactid_identify::{EquationSettings, Identifier, Observability};

const CRATE: &str = env!("CARGO_MANIFEST_DIR");
const FOLDER: &str = env!("CARGO_TARGET_TMPDIR");
const WARNINGS: [&str; 4] = ["-Wall", "-Wextra", "-Wpedantic", "-Werror"];

/// Number of samples whose cycles are counted.
const SAMPLES: usize = 10_001;

/// Where the library of this build is installed; `None` on a machine without CMake or pkg-config.
static PREFIX: LazyLock<Option<PathBuf>> = LazyLock::new(|| {
    let missing = ["cmake", "pkg-config", "c++"].into_iter().find(|tool| {
        let found = Command::new(tool).arg("--version").output();
        found.is_err()
    });
    if let Some(tool) = missing {
        assert!(std::env::var_os("CI").is_none(), "{tool} is missing");
        eprintln!("skipped: {tool} is missing");
        return None;
    }
    let (build, prefix) = (folder("build"), folder("prefix"));
    // Cargo builds the libraries of a test beside it.
    let program = std::env::current_exe().unwrap();
    let library = format!(
        "-DTACTID_LIBRARY_DIR={}",
        program.parent().unwrap().display()
    );
    run(Command::new("cmake")
        .args(["-S", CRATE, &library, "-B"])
        .arg(&build));
    run(Command::new("cmake")
        .arg("--install")
        .arg(&build)
        .arg("--prefix")
        .arg(&prefix));
    Some(prefix)
});

/// Returns an empty folder.
fn folder(name: &str) -> PathBuf {
    let path = Path::new(FOLDER).join(name);
    if path.exists() {
        std::fs::remove_dir_all(&path).unwrap();
    }
    std::fs::create_dir_all(&path).unwrap();
    path
}

/// Runs a command and returns what it prints.
fn run(command: &mut Command) -> String {
    let output = command.output().unwrap();
    let [printed, complaint] =
        [output.stdout, output.stderr].map(|of| String::from_utf8_lossy(&of).into_owned());
    assert!(
        output.status.success(),
        "{command:?}\n{printed}\n{complaint}"
    );
    printed
}

/// Returns what pkg-config says of the installed library.
fn flags(prefix: &Path) -> Vec<String> {
    let mut command = Command::new("pkg-config");
    command.env("PKG_CONFIG_PATH", prefix.join("lib/pkgconfig"));
    let flags = run(command.args(["--cflags", "--libs", "tactid"]));
    flags.split_whitespace().map(str::to_owned).collect()
}

/// Builds a C program by pkg-config, and returns a command that runs it.
fn built(prefix: &Path, name: &str, further: &[&str]) -> Command {
    let source = Path::new(CRATE)
        .join("tests/programs")
        .join(format!("{name}.c"));
    let program = Path::new(FOLDER).join(name);
    let mut compiler = Command::new("cc");
    compiler
        .arg("-std=c11")
        .args(WARNINGS)
        .args(further)
        .arg(source)
        .arg("-o")
        .arg(&program);
    run(compiler.args(flags(prefix)).args(["-lm", "-pthread"]));
    with_library(prefix, &program)
}

/// Returns a command that runs a program with the installed library.
fn with_library(prefix: &Path, program: &Path) -> Command {
    let mut command = Command::new(program);
    command.env("LD_LIBRARY_PATH", prefix.join("lib"));
    command
}

/// Samples of the simulated arm with noise, whose payload changes.
fn instants(experiment: &Experiment) -> Vec<Instant> {
    let mut random = SmallRng::seed_from_u64(0);
    let exact = experiment.run();
    exact
        .iter()
        .map(|i| Noise::fraction(0.01).on(i, &mut random))
        .collect()
}

/// The numbers of a sample in the order of `programs/replay.c`.
fn row(instant: &Instant) -> impl Iterator<Item = f64> + '_ {
    std::iter::once(instant.time_s)
        .chain(instant.position.iter().copied())
        .chain(instant.velocity.iter().copied())
        .chain(instant.base_numbers())
        .chain(instant.wrench_numbers())
}

/// C has the numbers of Rust to the last digit, also across a payload change, and allocates
/// nothing.
#[test]
fn c_has_the_numbers_of_rust_and_allocates_nothing() {
    let Some(prefix) = PREFIX.as_deref() else {
        return;
    };
    let lighter = MassProperties {
        mass_kg: 60.0,
        ..payload()
    };
    let experiment = Experiment {
        duration_s: (SAMPLES - 1) as f64 * 1e-3,
        swap: Some((2.0, lighter)),
        ..Experiment::default()
    };
    let instants = instants(&experiment);
    let [urdf, samples, found] =
        ["arm.urdf", "samples", "estimates"].map(|name| Path::new(FOLDER).join(name));
    std::fs::write(&urdf, URDF).unwrap();
    let numbers: Vec<u8> = instants
        .iter()
        .flat_map(row)
        .flat_map(f64::to_ne_bytes)
        .collect();
    std::fs::write(&samples, numbers).unwrap();
    let printed = run(built(prefix, "replay", &["-O2"]).args([&urdf, &samples, &found]));
    assert_eq!(
        printed,
        format!("{SAMPLES} samples, 0 allocations, 1 changes\n")
    );

    let found = std::fs::read(&found).unwrap();
    let of_estimate = size_of::<tactid_estimate>() - size_of::<usize>();
    let of_c = found.chunks_exact(of_estimate + 12 * size_of::<f64>());
    assert_eq!(of_c.len(), SAMPLES);
    let mut identifier = identifier(&experiment, &EquationSettings::default());
    let mut wrenches = vec![0; 12 * size_of::<f64>()];
    for (mut instant, bytes) in instants.into_iter().zip(of_c) {
        // C has plain quaternions, which are normalised.
        let rotation = &mut instant.base.pose.rotation;
        *rotation = UnitQuaternion::new_normalize(rotation.into_inner());
        identifier.push(&instant.sample()).unwrap();
        wrenches = wrenches_now(&identifier).unwrap_or(wrenches);
        let of_rust = [estimate_now(&identifier), wrenches.clone()].concat();
        assert_eq!(of_rust, bytes, "at {} s", instant.time_s);
    }
}

/// The bytes of the wrenches of contact and load that an identifier knows.
fn wrenches_now(identifier: &Identifier) -> Option<Vec<u8>> {
    let frame = identifier.wrench_frame(TOOL, None).unwrap();
    let found = identifier.wrenches(&frame)?;
    let both = [found.contact, found.load].map(|each| each.wrench.entries());
    Some(bytes_of(both.as_flattened(), f64::to_ne_bytes))
}

/// The bytes of an estimate behind its size, in the order of the struct.
fn estimate_now(identifier: &Identifier) -> Vec<u8> {
    let (estimate, covariance) = (identifier.estimate(), identifier.covariance());
    let covariance: [[f64; 10]; 10] = covariance.map_or([[f64::NAN; 10]; 10], Into::into);
    let before = identifier.estimate_before_change();
    let before = before.map_or([[f64::NAN; 10]; 2], |of| [of.values(), of.std_devs]);
    let observability = estimate.observability.map(|of| match of {
        Observability::Identifiable => 0_u32,
        Observability::Uncertain => 1,
        Observability::Unobservable => 2,
    });
    let is_settled = [estimate.is_physical, identifier.is_settled()];
    let is_held = [identifier.knows_weight(), identifier.is_payload_held()];
    let counts = [
        estimate.payload_changes,
        estimate.windows,
        estimate.rejected,
        estimate.gaps,
    ];
    [
        bytes_of(&estimate.values(), f64::to_ne_bytes),
        bytes_of(&estimate.std_devs, f64::to_ne_bytes),
        bytes_of(estimate.intervals.as_flattened(), f64::to_ne_bytes),
        bytes_of(covariance.as_flattened(), f64::to_ne_bytes),
        bytes_of(&observability, u32::to_ne_bytes),
        bytes_of(&is_settled.map(u32::from), u32::to_ne_bytes),
        bytes_of(before.as_flattened(), f64::to_ne_bytes),
        bytes_of(&[estimate.since_s], f64::to_ne_bytes),
        bytes_of(&counts, u64::to_ne_bytes),
        bytes_of(&is_held.map(u32::from), u32::to_ne_bytes),
    ]
    .concat()
}

fn bytes_of<T: Copy, const N: usize>(numbers: &[T], bytes: fn(T) -> [u8; N]) -> Vec<u8> {
    numbers.iter().flat_map(|number| bytes(*number)).collect()
}

/// Wrong arguments, null, NaN and two threads are answered, and nothing is read or written that is
/// not the caller's.
#[test]
fn wrong_arguments_are_answered_under_the_address_sanitizer() {
    let Some(prefix) = PREFIX.as_deref() else {
        return;
    };
    let sanitized = [
        "-O1",
        "-g",
        "-fsanitize=address,undefined",
        "-fno-sanitize-recover=all",
    ];
    assert_eq!(
        run(&mut built(prefix, "hostile", &sanitized)),
        "every answer is right\n"
    );
}

/// The files of the page for C++ controllers, and what its program prints.
#[test]
fn the_page_for_controllers_builds_by_cmake_and_prints_what_it_shows() {
    let Some(prefix) = PREFIX.as_deref() else {
        return;
    };
    let page = include_str!("../../../docs/how-to/cpp-controller.md");
    let (source, build) = (folder("page"), folder("page/build"));
    let mut shown = None;
    for block in page
        .split("\n```")
        .filter(|block| block.contains(" title=\""))
    {
        let (head, content) = block.split_once('\n').unwrap();
        let title = head.split('"').nth(1).unwrap();
        if title == "Output" {
            shown = Some(format!("{content}\n"));
        } else {
            std::fs::write(source.join(title), format!("{content}\n")).unwrap();
        }
    }
    let mut configure = Command::new("cmake");
    configure.arg("-S").arg(&source).arg("-B").arg(&build);
    configure.arg(format!("-DCMAKE_PREFIX_PATH={}", prefix.display()));
    run(configure.arg(format!("-DCMAKE_CXX_FLAGS={}", WARNINGS.join(" "))));
    run(Command::new("cmake").arg("--build").arg(&build));
    let printed = run(&mut with_library(prefix, &build.join("payload_filter")));
    assert_eq!(Some(printed), shown);
}
