"""Identification from poses at rest: attitudes and wrenches without times."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from tactid import _native
from tactid._api.offline import identification, inputs, provenance
from tactid._api.result import Identification
from tactid._base.values import Array
from tactid._native import Manipulator
from tactid._options.declaration import with_options
from tactid._options.options import OPTIONS, Options, collect
from tactid._read.descriptions import with_urdf

OWN = ("robot", "q", "pose", "wrench", "sensors", "options")
"""The keywords that are no options."""


@with_options(OPTIONS, "poses")
def identify_poses(
    *,
    robot: Manipulator | None = None,
    q: ArrayLike | None = None,
    pose: ArrayLike | None = None,
    wrench: ArrayLike | None = None,
    sensors: str | Sequence[str] | None = None,
    options: Options | None = None,
    **keywords: Any,
) -> Identification:
    """Identifies the payload from wrenches at rest in a few attitudes, without times.

    It gives the mass, the centre of mass and the offset of the sensor; the inertia needs motion.
    With an unknown offset, two attitudes determine the mass and three the centre of mass; with
    ``wrench_offset="no"``, one and two do. From four on, the intervals are narrow: they follow from
    the noise between poses, with Student's t. Samples that follow each other in one attitude
    (gravity turns by less than half a degree) are averaged, and count once.

        tactid.identify_poses(pose=pose, wrench=wrench, wrench_acts_on="sensor")
        tactid.identify_poses(urdf="arm.urdf", tip="tool0", q=q, wrench=wrench)

    The result is an :class:`Identification` with ``clock == "none"``: it has no history, forecast,
    cutoff or delay, and each of its windows is a pose. Its finding ``poses_at_rest`` says
    which further attitude would help most.

    Args:
        robot: The robot with its gripper and without the payload; or give a ``urdf``.
        q: Joint positions of each pose in the order of the robot's ``joint_names``, rad or m. Shape
            (N, n).
        pose: Pose in the world of the sensor where there is no robot, or of a floating base: x, y,
            z, qx, qy, qz, qw in m (the scalar of the quaternion comes last), a homogeneous matrix,
            or a rotation matrix ``world_from_sensor``. Only the attitude counts. Shape (N, 7),
            (N, 4, 4) or (N, 3, 3).
        wrench: Force, then moment, in the sensor's frame and about that frame's origin, N and N m:
            the mean of each pose, or its samples one after another. Shape (N, 6), or
            (N, K, 6) of K samples in each pose; (N, S, 6) of S sensors.
        sensors: The links of the wrenches, one name or several. Default: the tip.
        options: Options to start from; keywords replace them.
        **keywords: Those fields of :class:`tactid.Options` that apply, as follows.

            <options>

    Raises:
        ModelError: The robot cannot be modelled, or has no such link.
        IdentificationError: No pose can be used.
        ArgumentError: An option is unknown, does not apply or is out of range, a shape is wrong, or
            all poses have one attitude, which does not distinguish an offset from a weight.
    """
    collected = collect(options, keywords, "poses", OWN)
    samples = 1
    if (
        wrench is not None
        and np.ndim(wrench) == 3
        and (sensors is None or isinstance(sensors, str))
    ):
        samples = np.shape(wrench)[1]
        q, pose, wrench = _one_by_one(q, pose, np.asarray(wrench))
    arrays = {"robot": robot, "q": q, "pose": pose, "wrench": wrench, "sensors": sensors}
    return _identified(None, collected, arrays, samples)


def identify_pose_table(path: Path, arrays: Mapping[str, Any], options: Options) -> Identification:
    """Identifies the payload from the arrays of a table of poses: see :func:`identify_poses`."""
    collect(options.replace(columns=None), {}, "poses")
    return _identified(path, options, arrays)


def _identified(
    path: Path | None, options: Options, arrays: Mapping[str, Any], samples: int = 1
) -> Identification:
    """Identifies the payload from arrays that have so many samples for each row of the caller's."""
    plain = with_urdf(options.replace(columns=None)).plain()
    pose = _homogeneous(arrays.get("pose"))
    found = _native.identify_poses(plain, **{**arrays, "pose": pose})
    for finding in found["findings"]:
        for row in {"first_row", "last_row"} & finding.data.keys():
            finding.data[row] = (finding.data[row] - 1) // samples + 1
    return cast(Identification, identification(found | provenance(inputs(path, options), options)))


def _one_by_one(
    q: ArrayLike | None, pose: ArrayLike | None, wrench: Array
) -> tuple[ArrayLike | None, ArrayLike | None, Array]:
    """Returns K samples in each pose one after another, each with the attitude of its pose."""
    count, each, _ = wrench.shape

    def repeated(given: ArrayLike | None) -> ArrayLike | None:
        is_of_each = given is not None and np.shape(given)[:1] == (count,)
        return np.repeat(np.asarray(given), each, axis=0) if is_of_each else given

    return repeated(q), repeated(pose), wrench.reshape(count * each, -1)


def _homogeneous(given: ArrayLike | None) -> ArrayLike | None:
    """Returns rotation matrices as homogeneous ones, and other poses as they are."""
    if given is None or np.shape(given)[-2:] != (3, 3):
        return given
    rotations = np.asarray(given)
    poses = np.zeros((*rotations.shape[:-2], 4, 4))
    poses[..., :3, :3], poses[..., 3, 3] = rotations, 1
    return poses
