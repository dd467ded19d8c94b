"""Prints the golden values of ``tests.rs``: ``pip install numpy scipy trimesh``, then run this script.

The mean is that of trimesh, for two boxes that touch: a head across the end of a handle. The
covariance is that of a density ``exp g`` to first order, summed over all pairs of voxels of both
boxes, and of random errors of position, orientation and size, which change the mean, too.
"""

import itertools

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

BOXES = (((0.0, -0.01, -0.015), (0.2, 0.01, 0.015)), ((0.2, -0.03, -0.02), (0.24, 0.07, 0.03)))
PITCH = 0.0025
LENGTH, LN_DENSITY = 0.4, 1.4
POSITION, ROTATION, SIZE = 3e-3, np.radians(3.0), 0.03
DRAWS = 1_000_000


def moments(points, cube=PITCH):
    """Centre of mass and inertia about the origin of voxels of unit mass, (N, 9)."""
    x, y, z = points.T
    edge = cube**2 / 6
    inertia = [y * y + z * z + edge, -x * y, -x * z, x * x + z * z + edge, -y * z]
    return np.stack([x, y, z, *inertia, x * x + y * y + edge], 1)


def centers(box):
    """Yields the centres of the voxels of a box."""
    sides = zip(*box, strict=True)
    return itertools.product(*(np.arange(low + PITCH / 2, high, PITCH) for low, high in sides))


def misplaced(mean):
    """Returns the nine quantities for random errors of the shape, (DRAWS, 9)."""
    random = np.random.default_rng(1)
    shift, turn, size = (
        std_dev * random.normal(size=(DRAWS, 3)) for std_dev in (POSITION, ROTATION, SIZE)
    )
    center, (xx, xy, xz, yy, yz, zz) = mean[:3], mean[3:]
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    spread = np.trace(inertia) / 2 * np.eye(3) - inertia - np.outer(center, center)
    turned = Rotation.from_rotvec(turn).as_matrix() * (1 + size)[:, None, :]
    center = center + shift
    second = turned @ spread @ turned.swapaxes(1, 2) + center[:, :, None] * center[:, None, :]
    inertia = np.trace(second, axis1=1, axis2=2)[:, None, None] * np.eye(3) - second
    rows, columns = np.triu_indices(3)
    return np.hstack([center, inertia[:, rows, columns]])


def main():
    """Prints mean and covariance, each with its upper triangle row by row."""
    parts = [trimesh.creation.box(bounds=np.array(box)) for box in BOXES]
    solid = trimesh.util.concatenate(parts)
    at_origin = np.eye(4)
    inertia = solid.moment_inertia_frame(at_origin) / solid.volume
    mean = [*solid.center_mass, *inertia[np.triu_indices(3)]]
    print("MEAN", [float(f"{entry:.9g}") for entry in mean])

    points = np.array([point for box in BOXES for point in centers(box)])
    each = moments(points)
    change = (each - each.mean(0)) / len(points)
    diagonal = np.linalg.norm(np.max(BOXES[1], 0) - np.min([BOXES[0][0], BOXES[1][0]], 0))
    covariance = np.zeros((9, 9))
    for rows in np.array_split(np.arange(len(points)), 100):
        distances = np.linalg.norm(points[rows, None] - points[None], axis=2)
        correlated = np.exp(-distances / (LENGTH * diagonal)) @ change
        covariance += LN_DENSITY**2 * change[rows].T @ correlated

    drawn = misplaced(np.array(mean))
    print("TOLERATED", [float(f"{entry:.4g}") for entry in drawn.mean(0) - mean])
    covariance += np.cov(drawn.T)
    triangle = covariance[np.triu_indices(9)]
    print("COVARIANCE", [float(f"{entry:.4g}") for entry in triangle])


if __name__ == "__main__":
    main()
