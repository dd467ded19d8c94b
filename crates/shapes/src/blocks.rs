//! Blocks of a solid, of which each has one density.

use std::collections::BTreeMap;

use nalgebra::{SMatrix, SVector, Vector3};

use crate::grid::Voxels;

/// Most blocks of a solid: the covariance takes a time that grows with their square.
const MOST_BLOCKS: usize = 700;

/// Cells along a side of a block, at least, where there are so many voxels: finer ones only cost.
const CELLS_OF_A_SIDE: f64 = 4.0;

/// Steps of the bisection of the size of the blocks.
const STEPS: usize = 30;

/// Correlation length of the density, relative to the diagonal of the box around the solid. Of the
/// lengths from 0.05 to 0.4, and standard deviations of the logarithm from 0.5 to 2, this one with 1
/// explains 20 workshop tools best; longer ones were not tried.
const CORRELATION_LENGTH: f64 = 0.4;

/// Centre of mass and inertia about the origin of a body of unit mass: x, y, z, xx, xy, xz, yy, yz,
/// zz.
pub(crate) type Nine = SVector<f64, 9>;

/// A cube of voxels.
struct Block {
    /// Fraction of the volume of the solid.
    fraction: f64,
    /// Moments of its uniform part of unit mass.
    moments: Nine,
}

impl Block {
    fn center(&self) -> Vector3<f64> {
        self.moments.fixed_rows::<3>(0).into()
    }
}

/// Voxels that are counted together.
#[derive(Clone, Copy, Default)]
struct Cell {
    count: f64,
    /// Sum of the moments of the voxels.
    sum: Nine,
}

impl Cell {
    fn center(&self) -> Vector3<f64> {
        self.sum.fixed_rows::<3>(0) / self.count
    }
}

/// Returns the moments of a voxel of unit mass.
pub(crate) fn moments(center: &Vector3<f64>, pitch: f64) -> Nine {
    let [x, y, z] = [center.x, center.y, center.z];
    let cube = pitch * pitch / 6.0;
    Nine::from([
        x,
        y,
        z,
        y * y + z * z + cube,
        -x * y,
        -x * z,
        x * x + z * z + cube,
        -y * z,
        x * x + y * y + cube,
    ])
}

/// Returns the mean of the moments of voxels of unit mass.
pub(crate) fn mean(voxels: &Voxels) -> Nine {
    let each = voxels.centers.iter().map(|at| moments(at, voxels.pitch));
    each.sum::<Nine>() / voxels.centers.len() as f64
}

/// Returns the covariance of the moments of a body of unit mass whose density at each place is
/// `exp g`, for a Gaussian field `g` of variance one whose correlation falls exponentially with
/// distance: to first order in `g`. `diagonal` is that of the box around the solid.
pub(crate) fn covariance(voxels: &Voxels, diagonal: f64) -> SMatrix<f64, 9, 9> {
    let blocks = blocks(voxels);
    let of_blocks: Nine = blocks.iter().map(|each| each.moments * each.fraction).sum();
    let weighted: Vec<(Vector3<f64>, Nine)> = blocks
        .iter()
        .map(|each| (each.center(), (each.moments - of_blocks) * each.fraction))
        .collect();
    let length = CORRELATION_LENGTH * diagonal;
    let mut covariance = SMatrix::zeros();
    for (at, change) in &weighted {
        let correlated: Nine = weighted
            .iter()
            .map(|(other, of_other)| of_other * (-(at - other).norm() / length).exp())
            .sum();
        covariance += change * correlated.transpose();
    }
    0.5 * (covariance + covariance.transpose())
}

/// Returns voxels in cubes as small as their number allows.
fn blocks(voxels: &Voxels) -> Vec<Block> {
    let low = voxels
        .centers
        .iter()
        .fold(Vector3::repeat(f64::INFINITY), |low, at| low.inf(at));
    let size = |voxels: &Voxels| {
        let extent = voxels.centers.iter().map(|at| (at - low).amax());
        extent.fold(voxels.pitch, f64::max)
    };
    let least = voxels.pitch * (voxels.centers.len() as f64 / MOST_BLOCKS as f64).cbrt();
    let each = voxels.centers.iter().map(|at| Cell {
        count: 1.0,
        sum: moments(at, voxels.pitch),
    });
    let side = least / CELLS_OF_A_SIDE;
    let cells: Vec<Cell> = if side > voxels.pitch {
        cubes(each, &low, side).into_values().collect()
    } else {
        each.collect()
    };
    let (mut small, mut large) = (voxels.pitch, 2.0 * size(voxels));
    for _ in 0..STEPS {
        let middle = (small * large).sqrt();
        if cubes(cells.iter().copied(), &low, middle).len() > MOST_BLOCKS {
            small = middle;
        } else {
            large = middle;
        }
    }
    cubes(cells.into_iter(), &low, large)
        .into_values()
        .map(|Cell { count, sum }| Block {
            fraction: count / voxels.centers.len() as f64,
            moments: sum / count,
        })
        .collect()
}

/// Returns what the cells in each cube of this side are together, those whose centres are in it.
fn cubes(
    cells: impl Iterator<Item = Cell>,
    low: &Vector3<f64>,
    side: f64,
) -> BTreeMap<[u32; 3], Cell> {
    let mut cubes = BTreeMap::new();
    for cell in cells {
        let place = ((cell.center() - low) / side).map(|steps| steps as u32);
        let cube: &mut Cell = cubes.entry(place.into()).or_default();
        cube.count += cell.count;
        cube.sum += cell.sum;
    }
    cubes
}
