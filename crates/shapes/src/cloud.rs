//! The solid inside a cloud of points on its surface.

use std::collections::VecDeque;

use nalgebra::Vector3;

use crate::grid::{Grid, Voxels};

/// Fewest points of a cloud.
const FEWEST: usize = 200;

/// Most points whose distances to their neighbours are computed, for their median.
const MOST_MEASURED: usize = 300;

/// The distance between points is that to this neighbour: in the median of a surface that is
/// sampled at random, some 1.4 times the side of the square that each point has.
const NEIGHBOUR: usize = 6;

/// Largest hole between points that is closed, in distances between points.
const CLOSED: f64 = 3.0;

/// Cells in a distance between points.
const CELLS: f64 = 2.0;

/// Cells around a point that are its surface: those that share a corner with its own.
const SURFACE: f64 = 1.75;

/// Cells from a point to the inside of the solid, at most, beyond its surface.
const TO_INSIDE: f64 = 2.0 * SURFACE;

/// Smallest fraction of the cells of points that bound the inside: of a cloud without a side, or of a
/// blade that is thinner than some distances between points, few do.
const SMALLEST_BOUND: f64 = 0.5;

/// Most cells of a grid: each cell near a point marks some hundred others.
const MOST_CELLS: usize = 3_000_000;

/// Returns the voxels inside points on all sides of a solid: the points are dilated until they
/// touch, what they enclose is filled, and the result is eroded by as much.
///
/// # Errors
/// Returns the reason why the points enclose no solid.
pub(crate) fn voxels(
    points: &[Vector3<f64>],
    [low, high]: [Vector3<f64>; 2],
) -> Result<Voxels, String> {
    if points.len() < FEWEST {
        return Err(format!(
            "it has {} points and no faces: a point cloud needs at least {FEWEST}, on all sides of the solid",
            points.len()
        ));
    }
    let spacing = spacing(points);
    if spacing <= 0.0 {
        return Err("most of its points are equal".to_owned());
    }
    let margin = CLOSED * CELLS + 2.0;
    let grid = Grid::around(low, high, spacing / CELLS, margin, MOST_CELLS);
    let radius = (CLOSED * spacing / grid.pitch).max(1.5);
    let mut touched = vec![false; grid.cells()];
    for point in points {
        let place = ((point - grid.low) / grid.pitch).map(|steps| steps as usize);
        touched[grid.index(place.into())] = true;
    }
    let dilated = grown(&grid, &touched, radius);
    let outside = outside(&grid, &dilated);
    // Only cells at the boundary reach inside.
    let boundary: Vec<bool> = (0..grid.cells())
        .map(|k| outside[k] && neighbours(&grid, k).any(|other| !outside[other]))
        .collect();
    // Half of a cell of a point is outside.
    let eroded = grown(&grid, &boundary, radius + 0.5);
    let is_inside = |k: usize| !outside[k] && !eroded[k];
    // The surface alone is never empty.
    let surface = grown(&grid, &touched, SURFACE);
    let deep: Vec<bool> = (0..grid.cells())
        .map(|k| is_inside(k) && !surface[k])
        .collect();
    let near = ball(TO_INSIDE);
    let of_points = || (0..grid.cells()).filter(|index| touched[*index]);
    let bounds = |index: &usize| {
        let place = grid.place(*index);
        let mut around = near.iter().filter_map(|step| moved(&grid, place, step));
        around.any(|other| deep[other])
    };
    let bounding = of_points().filter(bounds).count();
    if (bounding as f64) < SMALLEST_BOUND * of_points().count() as f64 || bounding == 0 {
        return Err(
            "its points enclose no solid that is thicker than a few distances between them: a point cloud needs points on all \
             sides, without large gaps"
                .to_owned(),
        );
    }
    Ok(grid.voxels(is_inside))
}

/// Returns the median distance of points from their [`NEIGHBOUR`].
fn spacing(points: &[Vector3<f64>]) -> f64 {
    let step = points.len().div_ceil(MOST_MEASURED);
    let measured = points.iter().step_by(step).map(|point| {
        let squares = points.iter().map(|other| (other - point).norm_squared());
        let mut squares: Vec<f64> = squares.collect();
        // The nearest one is the point itself.
        let (_, square, _) = squares.select_nth_unstable_by(NEIGHBOUR, f64::total_cmp);
        square.sqrt()
    });
    let mut distances: Vec<f64> = measured.collect();
    let middle = distances.len() / 2;
    *distances.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Returns the cells within a radius, in cells, of those that are marked.
fn grown(grid: &Grid, marked: &[bool], radius: f64) -> Vec<bool> {
    let ball = ball(radius);
    let mut near = marked.to_vec();
    for index in (0..marked.len()).filter(|index| marked[*index]) {
        let place = grid.place(index);
        for step in &ball {
            if let Some(other) = moved(grid, place, step) {
                near[other] = true;
            }
        }
    }
    near
}

/// Returns the steps from a cell to those within a radius, in cells.
fn ball(radius: f64) -> Vec<[i64; 3]> {
    let reach = radius as i64;
    let steps = || -reach..=reach;
    steps()
        .flat_map(|x| steps().flat_map(move |y| steps().map(move |z| [x, y, z])))
        .filter(|step| step.map(|k| (k * k) as f64).iter().sum::<f64>() <= radius * radius)
        .collect()
}

/// Returns the cells that are connected with the corner of the grid through cells without a mark.
fn outside(grid: &Grid, marked: &[bool]) -> Vec<bool> {
    let mut outside = vec![false; marked.len()];
    outside[0] = true;
    let mut open = VecDeque::from([0]);
    while let Some(index) = open.pop_front() {
        for other in neighbours(grid, index) {
            if !marked[other] && !outside[other] {
                outside[other] = true;
                open.push_back(other);
            }
        }
    }
    outside
}

/// Returns the cells that share a face with a cell.
fn neighbours(grid: &Grid, index: usize) -> impl Iterator<Item = usize> {
    let place = grid.place(index);
    let steps = (0..3).flat_map(|axis| {
        [-1, 1].map(|step| {
            let mut steps = [0; 3];
            steps[axis] = step;
            steps
        })
    });
    steps.filter_map(move |step| moved(grid, place, &step))
}

/// Returns the index of the cell some steps away; `None` beyond the grid.
fn moved(grid: &Grid, place: [usize; 3], steps: &[i64; 3]) -> Option<usize> {
    let mut to = [0; 3];
    for axis in 0..3 {
        to[axis] = usize::try_from(place[axis] as i64 + steps[axis]).ok()?;
        if to[axis] >= grid.counts[axis] {
            return None;
        }
    }
    Some(grid.index(to))
}
