//! What it costs that a robot and its payload do not hit themselves or a table.

use std::path::{Path, PathBuf};
use std::time::Instant;

use tactid_dynamics::Urdf;
use tactid_excitation::{
    CollisionModel, DesignSettings, KeepOutBox, Limit, OrientedBox, design, margins,
};

use crate::Result;
use crate::arms::Arm;

/// Heights of a table, m: the first one counts that no link touches at the start.
const TABLES_M: [f64; 3] = [-0.05, -0.4, -0.8];

/// Prints a row for each arm.
pub(crate) fn measure(arms: &[Arm]) -> Result<()> {
    println!(
        "\n{:28} {:>9} {:>9} {:>9} {:>9} {:>9} {:>6}",
        "collisions", "free", "used", "kept", "used", "seconds", "pairs"
    );
    for arm in arms {
        let mut problem = arm.problem(0, 1.0)?;
        let free = design(&problem, &DesignSettings::default())?;
        let urdf = Urdf::from_file(&arm.path)?;
        let read = &mut |file: &str| read_mesh(&arm.path, file);
        let model = CollisionModel::of_urdf(&urdf, &problem.robot, read)?;
        for finding in model.findings() {
            println!("  {finding}");
        }
        // The meshes of the Kinova are COLLADA files, which are left out.
        problem.collisions = Some(model.accepting_untested());
        problem.payload_box = Some(OrientedBox::between([-0.1, -0.1, 0.0], [0.1, 0.1, 0.2]));
        let used = |all: Vec<tactid_excitation::Margin>| {
            let pairs = all
                .into_iter()
                .filter(|m| matches!(m.limit, Limit::Distance(..)));
            let used: Vec<f64> = pairs.map(|margin| margin.used).collect();
            (used.iter().copied().fold(0.0, f64::max), used.len())
        };
        let (free_used, _) = used(margins(&problem, &free.trajectory)?.0);
        for top_m in TABLES_M {
            problem.workspace.keep_out = vec![KeepOutBox {
                name: "table".to_owned(),
                place: OrientedBox::between([-2.0, -2.0, top_m - 0.5], [2.0, 2.0, top_m]),
            }];
            let began = Instant::now();
            match design(&problem, &DesignSettings::default()) {
                Ok(kept) => {
                    let (kept_used, pairs) = used(kept.margins);
                    println!(
                        "{:28} {:9.4} {free_used:9.3} {:9.4} {kept_used:9.4} {:9.2} {pairs:6}",
                        format!("{}, table at {top_m} m", arm.name),
                        free.prediction.largest().1,
                        kept.prediction.largest().1,
                        began.elapsed().as_secs_f64()
                    );
                    break;
                }
                Err(error) => println!("{:28} {error}", arm.name),
            }
        }
    }
    Ok(())
}

/// Reads a mesh from a package that is a folder above the URDF.
fn read_mesh(urdf: &Path, file: &str) -> std::result::Result<Vec<u8>, String> {
    let inside = file.strip_prefix("package://").unwrap_or(file);
    let urdf = urdf.canonicalize().map_err(|error| error.to_string())?;
    let candidates: Vec<PathBuf> = urdf
        .ancestors()
        .skip(1)
        .map(|folder| folder.join(inside))
        .collect();
    let found = candidates.iter().find(|path| path.is_file());
    let found = found.ok_or("no such file beside the URDF or above it")?;
    std::fs::read(found).map_err(|error| error.to_string())
}
