//! Solids of boxes, balls and pipes, against formulas, trimesh and sums over voxels.

use nalgebra::{Isometry3, SMatrix, SVector, UnitQuaternion, Vector3};

use crate::{Mesh, ShapePrior, Solid, Tolerance};

/// Mean and covariance of a prior.
struct Normal {
    mean: SVector<f64, 9>,
    covariance: SMatrix<f64, 9, 9>,
}

impl From<ShapePrior> for Normal {
    fn from(prior: ShapePrior) -> Self {
        Self {
            mean: prior.mean.into(),
            covariance: prior.covariance.into(),
        }
    }
}

/// Head across the end of a handle, m.
const HAMMER: [[[f64; 3]; 2]; 2] = [
    [[0.0, -0.01, -0.015], [0.2, 0.01, 0.015]],
    [[0.2, -0.03, -0.02], [0.24, 0.07, 0.03]],
];

/// Printed by `golden.py`.
const MEAN: [f64; 9] = [
    0.175,
    0.0125,
    0.003125,
    0.000957291667,
    -0.00275,
    -0.0006875,
    0.0355072917,
    -6.25e-05,
    0.0361166667,
];

/// What errors of the shape add to the mean, on average; printed by `golden.py`.
const TOLERATED: [f64; 9] = [
    2.768e-06, 4.572e-06, 1.275e-06, 4.242e-05, 3.942e-06, 7.424e-07, 1.358e-05, 1.161e-07,
    1.017e-05,
];

/// Upper triangle, row by row; printed by `golden.py`.
const COVARIANCE: [f64; 45] = [
    0.001432, 0.0001854, 4.515e-05, 1.15e-05, -4.108e-05, -9.996e-06, 0.0003966, -9.337e-07,
    0.0004054, 0.0001011, 7.069e-06, 4.543e-06, -2.182e-05, -1.564e-06, 5.369e-05, -4.888e-07,
    5.782e-05, 1.668e-05, 5.416e-07, -1.562e-06, -3.22e-06, 1.301e-05, -2.582e-07, 1.323e-05,
    2.336e-07, -1.003e-06, -1.204e-07, 3.314e-06, -2.507e-08, 3.518e-06, 4.778e-06, 3.456e-07,
    -1.191e-05, 1.076e-07, -1.282e-05, 6.887e-07, -2.884e-06, 5.909e-08, -2.933e-06, 0.0001112,
    -2.728e-07, 0.0001137, 9.262e-09, -2.912e-07, 0.0001165,
];

/// Returns the OBJ file of boxes, times a scale. `faces` are those of each box that it has.
fn obj(boxes: &[[[f64; 3]; 2]], scale: f64, faces: &[&str]) -> String {
    let mut text = String::new();
    for corners in boxes {
        for corner in 0..8 {
            let [x, y, z] = [0, 1, 2].map(|axis| scale * corners[corner >> axis & 1][axis]);
            text += &format!("v {x} {y} {z}\n");
        }
        for face in faces {
            text += &format!("f {face}\n");
        }
    }
    text
}

/// Faces of a box whose corners have the bits of x, y and z, counterclockwise as seen from outside,
/// counted back from the last corner.
const FACES: [&str; 6] = [
    "-8 -6 -5 -7",
    "-4 -3 -1 -2",
    "-8 -7 -3 -4",
    "-6 -2 -1 -5",
    "-8 -4 -2 -6",
    "-7 -5 -1 -3",
];

/// Returns an OBJ file with its vertices turned about the origin.
fn turned(text: &str, by: &UnitQuaternion<f64>) -> String {
    let line = |line: &str| match line.strip_prefix("v ") {
        None => format!("{line}\n"),
        Some(numbers) => {
            let numbers: Vec<f64> = numbers.split(' ').map(|n| n.parse().unwrap()).collect();
            let to = by * Vector3::from_column_slice(&numbers);
            format!("v {} {} {}\n", to.x, to.y, to.z)
        }
    };
    text.lines().map(line).collect()
}

fn solid(text: &str) -> Result<Solid, String> {
    Solid::new(&Mesh::read("a.obj", text.as_bytes()).unwrap())
}

fn prior(solid: &Solid, unit_m: f64) -> Normal {
    let pose = Isometry3::identity();
    solid.prior(&pose, unit_m, &Tolerance::default()).into()
}

/// Returns the largest difference of covariances in units of the standard deviations.
fn difference(found: &SMatrix<f64, 9, 9>, expected: &SMatrix<f64, 9, 9>) -> f64 {
    let scales = expected.diagonal().map(f64::sqrt);
    let relative = (found - expected).component_div(&(scales * scales.transpose()));
    relative.amax()
}

/// Returns the standard deviations of the errors of a shape, without those of its density.
fn of_shape(all: &Normal, of_density: &Normal) -> SVector<f64, 9> {
    (all.covariance - of_density.covariance)
        .diagonal()
        .map(f64::sqrt)
}

/// The mean of a solid is that of trimesh, and its covariance the sum over all pairs of voxels, in
/// any unit and from either side of the faces.
#[test]
fn a_hammer_has_the_golden_values() {
    let mut expected = SMatrix::<f64, 9, 9>::zeros();
    let pairs = (0..9).flat_map(|i| (i..9).map(move |j| (i, j)));
    for ((i, j), entry) in pairs.zip(COVARIANCE) {
        (expected[(i, j)], expected[(j, i)]) = (entry, entry);
    }
    let reversed = FACES.map(|face| face.split(' ').rev().collect::<Vec<_>>().join(" "));
    let reversed: Vec<&str> = reversed.iter().map(String::as_str).collect();
    for (scale, faces) in [(1.0, &FACES[..]), (1000.0, &FACES), (1.0, &reversed)] {
        let hammer = solid(&obj(&HAMMER, scale, faces)).unwrap();
        let found = prior(&hammer, scale.recip());
        let exact = Tolerance {
            position_m: 0.0,
            rotation_rad: 0.0,
            size: 0.0,
            ..Tolerance::default()
        };
        let exact = Normal::from(hammer.prior(&Isometry3::identity(), scale.recip(), &exact));
        let error = (exact.mean - SVector::from(MEAN)).amax();
        assert!(error < 1e-8, "{error}");
        let error = found.mean - exact.mean - SVector::from(TOLERATED);
        // A million draws.
        let of_draws = 4e-3 * of_shape(&found, &exact);
        assert!(error.abs() < of_draws, "{error}: {of_draws}");
        let error = difference(&found.covariance, &expected);
        // Blocks of voxels have not quite the volumes of the boxes.
        assert!(error < 0.06, "{error}");
    }
}

/// A pose moves what a solid says as it moves bodies, and the errors of the shape move with it.
#[test]
fn a_pose_moves_the_prior() {
    let solid = solid(&obj(&HAMMER, 1.0, &FACES)).unwrap();
    let pose = Isometry3::from_parts(
        Vector3::new(0.1, -0.2, 0.3).into(),
        UnitQuaternion::from_euler_angles(0.4, -0.8, 1.2),
    );
    let still = prior(&solid, 1.0);
    let moved = Normal::from(solid.prior(&pose, 1.0, &Tolerance::default()));
    let body = |nine: &SVector<f64, 9>| {
        let parameters = tactid_dynamics::InertialParameters::from_vector(nine.insert_row(0, 1.0));
        parameters
            .expressed_in(&pose)
            .as_vector()
            .fixed_rows::<9>(1)
            .into_owned()
    };
    assert!((body(&still.mean) - moved.mean).amax() < 1e-14);
    // A principal axis of the covariance is a difference of two bodies.
    let eigen = still.covariance.symmetric_eigen();
    let images = (0..9).map(|k| {
        let step = eigen.eigenvectors.column(k) * eigen.eigenvalues[k].sqrt();
        let image = body(&(still.mean + step)) - moved.mean;
        image * image.transpose()
    });
    let expected: SMatrix<f64, 9, 9> = images.sum();
    assert!(difference(&moved.covariance, &expected) < 1e-9);
}

/// Returns points spread evenly over a ball of radius one about (2, 0, 0) as an OBJ file.
fn cloud(count: u32) -> String {
    let golden_angle = std::f64::consts::PI * (3.0 - 5_f64.sqrt());
    let point = |k: u32| {
        let z = f64::from(2 * k + 1) / f64::from(count) - 1.0;
        let (sin, cos) = (golden_angle * f64::from(k)).sin_cos();
        let radius = (1.0 - z * z).sqrt();
        format!("v {} {} {}\n", 2.0 + radius * cos, radius * sin, z)
    };
    (0..count).map(point).collect()
}

/// The solid of a point cloud is a ball to within the distance of its points.
#[test]
fn a_cloud_is_a_solid() {
    let found = prior(&solid(&cloud(2000)).unwrap(), 0.1);
    let center = found.mean.fixed_rows::<3>(0) - Vector3::new(0.2, 0.0, 0.0);
    assert!(center.amax() < 1e-3, "{center}");
    let moment = found.mean[3] / (0.4 * 0.01);
    assert!((moment - 1.0).abs() < 0.03, "{moment}");
    assert!((found.mean[6] / (0.4 * 0.01 + 0.04) - 1.0).abs() < 0.01);
}

/// A cloud that lacks a side is refused, whichever it is, and one of few points says less.
#[test]
fn a_cloud_has_all_sides() {
    let points = cloud(4000);
    for axis in 0..3 {
        let is_kept = |line: &&str| {
            let coordinate: f64 = line.split(' ').nth(axis + 1).unwrap().parse().unwrap();
            coordinate - if axis == 0 { 2.0 } else { 0.0 } > -0.4
        };
        let open: Vec<&str> = points.lines().filter(is_kept).collect();
        let reason = solid(&open.join("\n")).unwrap_err();
        assert!(
            reason.starts_with("its points enclose no solid"),
            "{reason}"
        );
    }
    let [few, many] = [300, 4000].map(|count| {
        let exact = Tolerance {
            size: 0.0,
            ..Tolerance::default()
        };
        let solid = solid(&cloud(count)).unwrap();
        Normal::from(solid.prior(&Isometry3::identity(), 0.1, &exact)).covariance[(3, 3)]
    });
    assert!(few > 1.2 * many, "{few} {many}");
}

/// A file without a solid has a reason.
#[test]
fn what_is_no_solid_has_a_reason() {
    let reason = |text: &str| solid(text).unwrap_err();
    let cube = [[[0.0; 3], [1.0; 3]]];
    for open in [&FACES[1..], &FACES[2..], &FACES[..5]] {
        let found = reason(&obj(&cube, 1.0, open));
        assert!(found.starts_with("its surface is open, or"), "{found}");
    }
    // Seen along its diagonal, a box that lacks its lid, or three sides that meet in a corner.
    let across = Vector3::new(1.0, 1.0, 1.0);
    let turn = UnitQuaternion::rotation_between(&Vector3::z(), &across).unwrap();
    let low_box = [[[0.0; 3], [0.06, 0.06, 0.1]]];
    for faces in [&FACES[1..], &[FACES[0], FACES[2], FACES[4]]] {
        let found = reason(&turned(&obj(&low_box, 1.0, faces), &turn));
        assert!(found.starts_with("its surface is open, or"), "{found}");
    }
    // A thin plate is closed from each side, and a vertex without a face is no part of it.
    let plate = obj(&[[[0.0; 3], [0.3, 0.1, 1e-3]]], 1.0, &FACES);
    assert!(solid(&turned(&plate, &turn)).is_ok());
    let stray = prior(&solid(&format!("{plate}v 9 9 9\n")).unwrap(), 1.0);
    let expected = prior(&solid(&plate).unwrap(), 1.0);
    assert_eq!(
        (stray.mean, stray.covariance),
        (expected.mean, expected.covariance)
    );
    let mut turned = FACES;
    turned[0] = "-7 -5 -6 -8";
    assert!(reason(&obj(&cube, 1.0, &turned)).starts_with("its surface is open, or"));
    let flat = [[[0.0; 3], [1.0, 1.0, 0.0]]];
    for faces in [obj(&flat, 1.0, &FACES), obj(&cube, 1.0, &FACES[..1])] {
        assert_eq!(reason(&faces), "its faces enclose no volume");
    }
    assert!(reason("v 0 0 0\nv 0 0 1\n").starts_with("it has 2 points and no faces"));
    let equal = "v 0 0 1\n".repeat(300);
    assert_eq!(reason(&equal), "most of its points are equal");
    let plane: String = (0..400)
        .map(|k| format!("v {} {} 0\n", k % 20, k / 20))
        .collect();
    assert!(
        reason(&plane).starts_with("its points enclose no solid"),
        "{}",
        reason(&plane)
    );
    assert_eq!(reason("v 0 0 inf\nf 1 1 1\n"), "a coordinate is not finite");
    assert_eq!(
        reason("v 0 0 0\nf 1 1\n"),
        "its face 1 has no three vertices before it"
    );
}

/// A small hole, parts that touch and parts inside others do little harm.
#[test]
fn a_surface_need_not_be_perfect() {
    let whole = solid(&obj(&HAMMER, 1.0, &FACES)).unwrap();
    let mut text = obj(&HAMMER, 1.0, &FACES);
    // A bolt through handle and head, which counts twice.
    text += &obj(
        &[[[0.19, -0.002, -0.002], [0.21, 0.002, 0.002]]],
        1.0,
        &FACES,
    );
    let assembled = prior(&solid(&text).unwrap(), 1.0);
    let (whole, scales) = (
        prior(&whole, 1.0),
        assembled.covariance.diagonal().map(f64::sqrt),
    );
    let error = (assembled.mean - whole.mean).component_div(&scales);
    assert!(error.amax() < 0.01, "{error}");
    assert!(difference(&assembled.covariance, &whole.covariance) < 0.02);
}

/// Thousands of large faces are a solid, and a needle across its box has an answer without a panic.
#[test]
fn large_faces_and_needles_have_an_answer() {
    let cube = [[[0.0; 3], [1.0; 3]]];
    let thousands: String = (0..3000).map(|_| obj(&cube, 1.0, &FACES)).collect();
    assert!(solid(&thousands).is_ok());
    let needle = "v 0 0 0\nv 1e-3 0 0\nv 0 1e-3 0\nv 1 1 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    drop(solid(needle));
}

/// No change of a file's bytes makes the reader panic: hundreds of files of each format, with bytes
/// that are exchanged, removed and repeated.
#[test]
fn any_bytes_are_read() {
    let text = obj(&HAMMER, 1.0, &FACES);
    let mesh = Mesh::read("a.obj", text.as_bytes()).unwrap();
    let triangles = mesh.triangles.unwrap();
    let mut stl = vec![b' '; 80];
    stl.extend((triangles.len() as u32).to_le_bytes());
    let mut ply = "ply\nformat binary_little_endian 1.0\nelement vertex 16\nproperty float x\nproperty float y\n\
                   property float z\nelement face 24\nproperty list uchar int vertex_indices\nend_header\n"
        .as_bytes()
        .to_vec();
    let bytes = |corner: &[f32; 3]| -> Vec<u8> {
        corner
            .iter()
            .flat_map(|entry| entry.to_le_bytes())
            .collect()
    };
    ply.extend(mesh.vertices.iter().flat_map(bytes));
    for triangle in &triangles {
        ply.push(3);
        ply.extend(triangle.iter().flat_map(|corner| corner.to_le_bytes()));
        stl.extend([0; 12]);
        stl.extend(
            triangle
                .iter()
                .flat_map(|corner| bytes(&mesh.vertices[*corner as usize])),
        );
        stl.extend([0; 2]);
    }
    let mut state = 1_u64;
    let mut random = |below: usize| {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 33) as usize % below
    };
    for (name, whole) in [("a.obj", text.into_bytes()), ("a.stl", stl), ("a.ply", ply)] {
        assert!(
            Solid::new(&Mesh::read(name, &whole).unwrap()).is_ok(),
            "{name}"
        );
        for _ in 0..300 {
            let mut changed = whole.clone();
            for _ in 0..1 + random(4) {
                let at = random(changed.len());
                match random(3) {
                    0 => changed[at] = random(256) as u8,
                    1 => drop(changed.remove(at)),
                    _ => changed.insert(at, changed[at]),
                }
            }
            let solid = Mesh::read(name, &changed).and_then(|mesh| Solid::new(&mesh));
            if let Ok(solid) = solid {
                let found = prior(&solid, 1.0);
                assert!(found.mean.iter().all(|entry| entry.is_finite()));
                assert!(found.covariance.iter().all(|entry| entry.is_finite()));
            }
        }
    }
}
