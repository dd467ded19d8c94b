//! Voxels of the solid inside a closed surface.

use nalgebra::Vector3;

/// Number of voxels of a solid: enough for the covariance of its moments, of which the mean is exact.
const VOXELS: f64 = 30_000.0;

/// Most cells of a grid: 30 MB.
const MOST_CELLS: usize = 30_000_000;

/// Most pairs of a triangle and a ray in the box around it: half a second.
const MOST_PAIRS: f64 = 1e8;

/// Growth of the pitch of a grid that is too fine.
const COARSER: f64 = 1.2;

/// Offsets of the rays from the middle of the cells, relative to the pitch: a ray along an edge,
/// which the coordinates of many meshes have, would meet two triangles or none.
const OFF_MIDDLE: [f64; 2] = [1.3e-4, 2.7e-4];

/// Cells of equal sides.
#[derive(Clone, Debug)]
pub(crate) struct Grid {
    /// Corner with the smallest coordinates.
    pub(crate) low: Vector3<f64>,
    /// Side of a cell.
    pub(crate) pitch: f64,
    pub(crate) counts: [usize; 3],
}

/// The cells of a solid.
pub(crate) struct Voxels {
    pub(crate) centers: Vec<Vector3<f64>>,
    pub(crate) pitch: f64,
}

impl Grid {
    /// Returns a grid with a margin around a box, with this pitch or with a larger one.
    pub(crate) fn around(
        low: Vector3<f64>,
        high: Vector3<f64>,
        mut pitch: f64,
        margin: f64,
        most_cells: usize,
    ) -> Self {
        loop {
            let corner = low - Vector3::repeat(margin * pitch);
            let sides = (high - corner) / pitch + Vector3::repeat(margin);
            let cells = sides.map(|side| side.ceil() + 1.0);
            if cells.product() <= most_cells as f64 {
                return Self {
                    low: corner,
                    pitch,
                    counts: [0, 1, 2].map(|axis| cells[axis] as usize),
                };
            }
            pitch *= COARSER;
        }
    }

    pub(crate) fn cells(&self) -> usize {
        self.counts.iter().product()
    }

    pub(crate) fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (x * self.counts[1] + y) * self.counts[2] + z
    }

    pub(crate) fn place(&self, index: usize) -> [usize; 3] {
        let [_, y, z] = self.counts;
        [index / (y * z), index / z % y, index % z]
    }

    pub(crate) fn center(&self, place: [usize; 3]) -> Vector3<f64> {
        let steps = Vector3::from(place.map(|k| k as f64 + 0.5));
        self.low + steps * self.pitch
    }

    /// Returns the voxels whose cells satisfy a condition.
    pub(crate) fn voxels(&self, is_inside: impl Fn(usize) -> bool) -> Voxels {
        let inside = (0..self.cells()).filter(|index| is_inside(*index));
        Voxels {
            centers: inside.map(|index| self.center(self.place(index))).collect(),
            pitch: self.pitch,
        }
    }
}

/// Returns the voxels inside triangles, which enclose this volume: negative where they are
/// clockwise as seen from outside.
///
/// A voxel is inside where two of three rays along the axes find it so. Bodies may overlap, and
/// small holes do no harm.
pub(crate) fn voxels(
    triangles: &[[Vector3<f64>; 3]],
    [low, high]: [Vector3<f64>; 2],
    volume: f64,
) -> Voxels {
    let mut pitch = (volume.abs() / VOXELS).cbrt();
    let grid = loop {
        let grid = Grid::around(low, high, pitch, 1.0, MOST_CELLS);
        let pairs = (0..3).map(|axis| Rays { grid: &grid, axis }.pairs(triangles));
        if pairs.sum::<f64>() <= MOST_PAIRS {
            break grid;
        }
        pitch = grid.pitch * COARSER;
    };
    let mut votes = vec![0_u8; grid.cells()];
    for axis in 0..3 {
        Rays { grid: &grid, axis }.vote(triangles, volume.signum(), &mut votes);
    }
    grid.voxels(|index| votes[index] >= 2)
}

/// Rays through the cells of a grid along one of its axes.
struct Rays<'a> {
    grid: &'a Grid,
    axis: usize,
}

/// Where a ray passes a triangle.
struct Crossing {
    ray: [usize; 2],
    /// First cell of the ray behind the triangle.
    cell: usize,
    /// One where the ray enters the solid, minus one where it leaves it.
    change: f64,
}

impl Rays<'_> {
    /// Axes across the rays.
    fn across(&self) -> [usize; 2] {
        [(self.axis + 1) % 3, (self.axis + 2) % 3]
    }

    /// Returns the range of the rays that pass the box around a triangle.
    fn around(&self, triangle: &[Vector3<f64>; 3]) -> [std::ops::Range<usize>; 2] {
        let across = self.across();
        [0, 1].map(|k| {
            let axis = across[k];
            let ray = |coordinate: f64| {
                (coordinate - self.grid.low[axis]) / self.grid.pitch - 0.5 - OFF_MIDDLE[k]
            };
            let rays = triangle.map(|corner| ray(corner[axis]));
            let first = rays.iter().copied().fold(f64::INFINITY, f64::min).ceil();
            let last = rays.iter().copied().fold(0.0, f64::max).floor();
            first.max(0.0) as usize..(last as usize + 1).min(self.grid.counts[axis])
        })
    }

    /// Returns the number of pairs of a triangle and a ray in the box around it.
    fn pairs(&self, triangles: &[[Vector3<f64>; 3]]) -> f64 {
        let pairs = triangles.iter().map(|triangle| {
            let [first, second] = self.around(triangle);
            (first.len() * second.len()) as f64
        });
        pairs.sum()
    }

    /// Adds a vote for each cell that is inside by the winding number along its ray.
    fn vote(&self, triangles: &[[Vector3<f64>; 3]], orientation: f64, votes: &mut [u8]) {
        let mut crossings: Vec<Crossing> = Vec::new();
        for triangle in triangles {
            self.cross(triangle, orientation, &mut crossings);
        }
        crossings.sort_unstable_by_key(|crossing| (crossing.ray, crossing.cell));
        let [first, second] = self.across();
        for of_ray in crossings.chunk_by(|a, b| a.ray == b.ray) {
            let mut winding = 0.0;
            let ends = of_ray.iter().skip(1).map(|crossing| crossing.cell);
            for (crossing, end) in of_ray.iter().zip(ends) {
                winding += crossing.change;
                if winding < 0.5 {
                    continue;
                }
                for cell in crossing.cell..end.min(self.grid.counts[self.axis]) {
                    let mut place = [0; 3];
                    place[self.axis] = cell;
                    [place[first], place[second]] = crossing.ray;
                    votes[self.grid.index(place)] += 1;
                }
            }
        }
    }

    /// Adds where rays pass a triangle.
    fn cross(&self, triangle: &[Vector3<f64>; 3], orientation: f64, to: &mut Vec<Crossing>) {
        let grid = self.grid;
        let across = self.across();
        let [a, b, c] = triangle.map(|corner| across.map(|axis| corner[axis]));
        let side = |p: [f64; 2], q: [f64; 2], r: [f64; 2]| {
            (q[0] - p[0]) * (r[1] - p[1]) - (r[0] - p[0]) * (q[1] - p[1])
        };
        let area = side(a, b, c);
        if area == 0.0 {
            return;
        }
        let [first, second] = self.around(triangle);
        for ray in first.flat_map(|i| second.clone().map(move |j| [i, j])) {
            let at = [0, 1].map(|k| {
                let steps = ray[k] as f64 + 0.5 + OFF_MIDDLE[k];
                grid.low[across[k]] + steps * grid.pitch
            });
            let (of_b, of_c) = (side(a, at, c) / area, side(a, b, at) / area);
            if of_b < 0.0 || of_c < 0.0 || of_b + of_c >= 1.0 {
                continue;
            }
            let [a, b, c] = triangle.map(|corner| corner[self.axis]);
            let height = a + of_b * (b - a) + of_c * (c - a);
            let cell = (height - grid.low[self.axis]) / grid.pitch - 0.5;
            to.push(Crossing {
                ray,
                cell: cell.ceil().max(0.0) as usize,
                change: -area.signum() * orientation,
            });
        }
    }
}
