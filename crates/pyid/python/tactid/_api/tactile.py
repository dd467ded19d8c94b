"""Tactile arrays: forces at points of a link, summed to one wrench."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactid._base.errors import ArgumentError
from tactid._base.field_docs import with_fields

OUT_OF_REACH_M = 2.0
"""Distance from the origin of its link beyond which no point of an array is, m."""


@with_fields
@dataclass(frozen=True, eq=False)
class SummedForces:
    """The wrench of forces at points of a link, for the keywords of `identify`."""

    wrench: NDArray[np.float64]
    """Force, N, and moment about the origin of the link's frame, N m, of each sample, (N, 6)."""
    noise: NDArray[np.float64] | None
    """Standard deviations of the white noise of one wrench, N and N m, (6,); None where that of the
    forces is not given."""


def sum_forces(
    force: ArrayLike, position: ArrayLike, *, noise: ArrayLike | None = None
) -> SummedForces:
    """Sums forces at points of a link, such as those of a tactile array, to one wrench.

    Args:
        force: Force at each of P points, along the axes of the link's frame, N, (N, P, 3). The body
            that they act on is that of the wrench: see ``wrench_acts_on``.
        position: The points in the link's frame, m, (P, 3); or (N, P, 3) where they move.
        noise: Standard deviation of the white noise of a component of a force, which is independent
            of the others, N: one number, (3,) for the axes, or (P, 3).

    Returns:
        The wrench about the origin of the link's frame, and its noise. That of points that move is
        the mean over the samples.

    Raises:
        ArgumentError: A shape does not fit, a point is more than 2 m away, as in millimetres, or a
            standard deviation is not positive and finite.
    """
    forces, points = np.asarray(force, dtype=float), np.asarray(position, dtype=float)
    if forces.ndim != 3 or forces.shape[2] != 3:
        raise ArgumentError(f"`force` must be of the shape (N, P, 3), and is {forces.shape}")
    if points.shape not in (forces.shape, forces.shape[1:]):
        raise ArgumentError(
            f"`position` must be of the shape {forces.shape[1:]} or {forces.shape}, as `force` is,"
            f" and is {points.shape}"
        )
    farthest = float(np.linalg.norm(points, axis=-1).max(initial=0.0))
    if farthest > OUT_OF_REACH_M:
        raise ArgumentError(
            f"`position` has a point {farthest:.3g} m from the origin of the link, farther than"
            " anything on an arm, as of millimetres: give metres"
        )
    moments = np.cross(points, forces)
    wrench = np.hstack([forces.sum(axis=1), moments.sum(axis=1)])
    if noise is None:
        return SummedForces(wrench, None)
    return SummedForces(wrench, _noise(points, np.asarray(noise, dtype=float)))


def _noise(points: NDArray[np.float64], given: NDArray[np.float64]) -> NDArray[np.float64]:
    """Returns the standard deviations of the wrench of forces with independent noise."""
    if not (np.isfinite(given).all() and (given > 0).all()):
        raise ArgumentError("`noise` must be positive and finite")
    try:
        variances = np.broadcast_to(given**2, points.shape[-2:])
    except ValueError:
        raise ArgumentError(
            f"`noise` must be one number, (3,) or {points.shape[-2:]}, and is {given.shape}"
        ) from None
    squares = points**2
    # n_x = y f_z - z f_y, and so on.
    of_moments = np.roll(squares, -1, axis=-1) * np.roll(variances, -2, axis=-1)
    of_moments += np.roll(squares, -2, axis=-1) * np.roll(variances, -1, axis=-1)
    of_sums = of_moments.sum(axis=-2).reshape(-1, 3).mean(axis=0)
    return np.asarray(np.sqrt(np.concatenate([variances.sum(axis=0), of_sums])))
