"""A body given by its ten values: its tensors, whether it can exist, and its ellipsoid.

The ten values are those of ``values.Values``: mass, centre of mass in a frame, and the inertia
about the centre of mass along that frame's axes. An off-diagonal entry is the matrix's own,
``Ixy = -∫ x y dm``, as URDF, MuJoCo and Pinocchio have it.
"""

import itertools
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tactid._base.values import Values, finite

BORDER = 1e-9
"""How far rounding may push a flat body past the triangle inequality."""


def inertia_about_com(values: Sequence[float]) -> NDArray[np.float64]:
    """The inertia about the centre of mass as a matrix, kg m²."""
    xx, xy, xz, yy, yz, zz = values[4:10]
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], dtype=float)


def inertia_about_origin(values: Sequence[float]) -> NDArray[np.float64]:
    """The inertia about the frame's origin, by the parallel axes theorem, kg m²."""
    com = np.array(values[1:4], dtype=float)
    moved: NDArray[np.float64] = com @ com * np.eye(3) - np.outer(com, com)
    return inertia_about_com(values) + values[0] * moved


def together(one: Values, other: Values) -> Values:
    """Returns two bodies in one frame as one body; what is not known of one is not of both."""
    if None in (*one[:4], *other[:4]):
        return [None] * len(one)
    # What is unknown is NaN here.
    bodies = [np.array(body, dtype=float) for body in (one, other)]
    mass = float(sum(body[0] for body in bodies))
    com = np.sum([body[0] * body[1:4] for body in bodies], axis=0) / mass
    about_origin = np.sum([inertia_about_origin(body.tolist()) for body in bodies], axis=0)
    inertia = about_origin - mass * (com @ com * np.eye(3) - np.outer(com, com))
    return [finite(value) for value in (mass, *com, *inertia[np.triu_indices(3)])]


def principal_moments(values: Sequence[float]) -> list[float]:
    """The principal moments of inertia about the centre of mass, ascending, kg m²."""
    return [float(moment) for moment in np.linalg.eigvalsh(inertia_about_com(values))]


def principal_axes(inertia: NDArray[np.float64]) -> tuple[list[float], NDArray[np.float64]]:
    """The principal moments of an inertia, and the rotation whose columns are their axes.

    Of the 24 right-handed orders and directions of the axes, it is the rotation by the smallest
    angle, which is 63 degrees at most.
    """
    moments, axes = np.linalg.eigh(inertia)
    rotations = [
        (order, axes[:, order] * signs)
        for order in map(list, itertools.permutations(range(3)))
        for signs in itertools.product((1.0, -1.0), repeat=3)
    ]
    proper = [each for each in rotations if np.linalg.det(each[1]) > 0]
    order, nearest = max(proper, key=lambda each: float(np.trace(each[1])))
    return moments[order].tolist(), nearest


def why_impossible(values: Sequence[float]) -> str | None:
    """Returns why no body can have these values; None where one can."""
    if not all(math.isfinite(value) for value in values):
        return "not all of its values are finite"
    if values[0] <= 0:
        return f"its mass is {values[0]:.4g} kg"
    moments = principal_moments(values)
    listed = ", ".join(f"{moment:.4g}" for moment in moments) + " kg m²"
    if moments[0] <= 0:
        return f"its principal moments of inertia are {listed}, and none may be zero or less"
    if moments[2] > (1 + BORDER) * (moments[0] + moments[1]):
        return (
            f"its principal moments of inertia are {listed}, and none may exceed the sum of the"
            " other two"
        )
    return None


def ellipsoid(values: Sequence[float]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The uniform solid ellipsoid of this mass and inertia: semi-axes in m, and where they point.

    A column of the second array is the direction of a semi-axis. The moment about axis 1 is
    m (s2² + s3²) / 5; an estimate just past the border of what is possible becomes a flat one.
    """
    moments, axes = np.linalg.eigh(inertia_about_com(values))
    squares = 2.5 / values[0] * (moments.sum() - 2 * moments)
    return np.sqrt(np.maximum(squares, 0.0)), axes
