//! Rows of poses: those of one attitude, their means and their products.

use std::ops::Range;

use tactid_identify::equations::{Row, WRENCH};
use tactid_identify::solve::{Matrix, Vector};

use super::Rows;

/// The two kinds of channels: forces, then moments.
pub(super) const CHANNEL_KINDS: [Range<usize>; 2] = [0..3, 3..WRENCH];

/// The rows of one pose.
pub(super) struct Visit {
    pub(super) rows: Rows,
    /// Number of its attitude, which other visits share.
    pub(super) attitude: usize,
}

/// Returns for each visit the mean of the rows of its attitude.
pub(super) fn means_of_attitudes(visits: &[Visit], rows: &[Rows]) -> Vec<Rows> {
    let count = visits.iter().map(|visit| visit.attitude + 1).max();
    let mut of_attitudes = vec![Vec::new(); count.unwrap_or(0)];
    for (visit, rows) in visits.iter().zip(rows) {
        of_attitudes[visit.attitude].push(*rows);
    }
    let of_attitudes: Vec<Rows> = of_attitudes.iter().map(|rows| means(rows)).collect();
    visits
        .iter()
        .map(|visit| of_attitudes[visit.attitude])
        .collect()
}

/// Returns the products of the regressors of each kind of channels with themselves and with the
/// targets.
pub(super) fn grams(rows: &[Rows]) -> [(Matrix, Vector); 2] {
    CHANNEL_KINDS.map(|kind| {
        let rows = rows.iter().flat_map(|rows| &rows[kind.clone()]);
        rows.fold(
            (Matrix::zeros(), Vector::zeros()),
            |(square, target), row| {
                let column = row.regressor;
                (
                    square + column * column.transpose(),
                    target + column * row.target,
                )
            },
        )
    })
}

/// Returns the mean row of each channel.
pub(super) fn means(rows: &[Rows]) -> [Row; WRENCH] {
    let mut means = [Row::zero(); WRENCH];
    for pose in rows {
        for (mean, row) in means.iter_mut().zip(pose) {
            mean.add(row, 1.0 / rows.len() as f64);
        }
    }
    means
}

/// Returns rows less the mean row of each channel.
pub(super) fn less(rows: &Rows, means: &[Row; WRENCH]) -> Rows {
    let mut rows = *rows;
    for (row, mean) in rows.iter_mut().zip(means) {
        row.add(mean, -1.0);
    }
    rows
}
