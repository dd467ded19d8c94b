//! Kernels of the estimators: each goes through all rows and writes the parameters at the end.

use nalgebra::SVector;
use tactid_nlms::{Estimator, Nlms, Rls};

/// Number of parameters.
const PARAMETERS: usize = 10;

/// Rows that enter together in blocks: those of one window of a wrench.
const BLOCK: usize = 6;

/// A row and its target.
type Row = (SVector<f64, PARAMETERS>, f64);

/// Goes through all rows and returns the parameters.
pub type Kernel = fn(&[Row]) -> SVector<f64, PARAMETERS>;

/// Returns the kernel of a name.
pub fn kernel(name: &str) -> Option<Kernel> {
    Some(match name {
        "nlms" => |rows| {
            let filter = Nlms::paper();
            after_single_rows(filter.starting_at(SVector::zeros()), rows)
        },
        "rls" => |rows| after_single_rows(Rls::starting_at(SVector::zeros()), rows),
        "rls_blocks" => |rows| {
            let mut rls = Rls::starting_at(SVector::zeros());
            for block in rows.chunks_exact(BLOCK) {
                let mut rows = [(SVector::zeros(), 0.0); BLOCK];
                rows.copy_from_slice(block);
                rls.update_all(&mut rows);
            }
            rls.parameters()
        },
        _ => return None,
    })
}

/// Reads rows of ten entries and a target.
pub fn rows(numbers: &[f64]) -> Vec<Row> {
    let rows = numbers.chunks_exact(PARAMETERS + 1);
    rows.map(|row| {
        (
            SVector::from_column_slice(&row[..PARAMETERS]),
            row[PARAMETERS],
        )
    })
    .collect()
}

fn after_single_rows(
    mut estimator: impl Estimator<PARAMETERS>,
    rows: &[Row],
) -> SVector<f64, PARAMETERS> {
    for (row, target) in rows {
        estimator.update(row, *target);
    }
    estimator.parameters()
}
