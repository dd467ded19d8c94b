"""Tactile arrays in logs: clouds of points with forces are wrenches."""

from collections.abc import Sequence
from itertools import cycle
from pathlib import Path

import numpy as np
import pytest
from numpy.lib.recfunctions import unstructured_to_structured

import tactid
from recorded_arm import FIXED, PAYLOAD, TIP
from recordings import (
    Logged,
    description,
    header,
    joint_states,
    message,
    received,
    stamps,
    state,
    wrenches,
    write_bag,
)
from test_tactile import skew, taxels

DATATYPES = {"i1": 1, "u1": 2, "i2": 3, "u2": 4, "i4": 5, "u4": 6, "f4": 7, "f8": 8}
SHORT = ("x", "y", "z", "fx", "fy", "fz")
FOUND = "forces_summed"


def layout(names: Sequence[str], formats: str | Sequence[str], padding: int = 0) -> np.dtype:
    """A point with fields of these names, after padding."""
    kinds = [formats] * len(names) if isinstance(formats, str) else formats
    sizes = [np.dtype(kind).itemsize for kind in kinds]
    offsets = padding + np.cumsum([0, *sizes[:-1]])
    total = padding + sum(sizes) + padding
    return np.dtype(
        {"names": list(names), "formats": list(kinds), "offsets": list(offsets), "itemsize": total}
    )


def cloud(points: np.ndarray, stamp_ns: int, frame: str, *, rows: int = 1, gap: int = 0) -> object:
    """Points of a structured type, in rows with bytes between them."""
    kinds, data = points.dtype, points.tobytes()
    assert kinds.fields is not None
    row = len(data) // rows
    padded = b"".join(data[k * row : (k + 1) * row] + b"\0" * gap for k in range(rows))
    fields = []
    for name, (kind, offset) in ((n, f[:2]) for n, f in kinds.fields.items()):
        each = kind.base
        count = kind.shape[0] if kind.shape else 1
        datatype = DATATYPES[f"{each.kind}{each.itemsize}"]
        fields.append(
            message("PointField", name=name, offset=offset, datatype=datatype, count=count)
        )
    first = next(iter(kinds.fields.values()))[0].base
    return message(
        "PointCloud2",
        header=header(stamp_ns, frame),
        height=rows,
        width=len(points) // rows,
        fields=fields,
        is_bigendian=first.byteorder == ">",
        point_step=kinds.itemsize,
        row_step=row + gap,
        data=np.frombuffer(padded, np.uint8),
        is_dense=False,
    )


def six(rng: np.random.Generator, wrench: np.ndarray, points: int = 12) -> np.ndarray:
    """Positions and forces of points whose sum is the wrench, (N, P, 6)."""
    positions = taxels(rng, points)
    sums = np.hstack([np.vstack([np.eye(3), skew(at)]) for at in positions])
    forces = (wrench @ np.linalg.pinv(sums).T).reshape(len(wrench), -1, 3)
    return np.concatenate([np.broadcast_to(positions, forces.shape), forces], axis=2)


def clouds(time: np.ndarray, bodies: Sequence[object], topic: str = "/pad/points") -> list[Logged]:
    stamp_ns = stamps(time)
    pairs = zip(received(stamp_ns), bodies, strict=True)
    return [Logged(topic, log_ns, body) for log_ns, body in pairs]


def plain(time: np.ndarray, values: np.ndarray, topic: str = "/pad/points") -> list[Logged]:
    kinds = layout(SHORT, "<f8")
    return clouds(
        time,
        [
            cloud(unstructured_to_structured(each, kinds), stamp, TIP)
            for each, stamp in zip(values, stamps(time), strict=True)
        ],
        topic,
    )


ORDER = ("Force.Z", "force_x", "intensity", "z", "y", "Force_Y", "x")
LAYOUTS = {
    "single": layout(SHORT, "<f4"),
    "double": layout(SHORT, "<f8"),
    "big endian": layout(SHORT, ">f4"),
    "padded": layout(SHORT, "<f8", padding=12),
    "other order": layout(ORDER, ["<f4", "<f8", "<u2", "<f4", "<f8", "<f4", "<f4"], padding=3),
    "vectors": np.dtype([("force", "<f4", 3), ("position", "<f8", 3)]),
}


def filled(kinds: np.dtype, values: np.ndarray) -> np.ndarray:
    """Points with their positions and forces written to the fields of a type."""
    out = np.zeros(len(values), kinds)
    for name in kinds.names or ():
        axis = "xyz".find(name[-1].lower())
        is_force = name.lower().startswith("f")
        if name in ("force", "position"):
            out[name] = values[:, 3:] if is_force else values[:, :3]
        elif name != "intensity":
            out[name] = values[:, axis + 3 * is_force]
    return out


@pytest.mark.parametrize("kinds", LAYOUTS.values(), ids=LAYOUTS)
def test_points_of_each_layout_are_the_wrench_that_they_sum_to(
    kinds: np.dtype, rng: np.random.Generator, tmp_path: Path
) -> None:
    s = state(FIXED, 8.0, 100.0)
    values = six(rng, s.wrench)
    bodies = [
        cloud(filled(kinds, each), stamp, TIP, rows=rows, gap=5 * (rows - 1))
        for each, stamp, rows in zip(values, stamps(s.time), cycle((1, 2)), strict=False)
    ]
    shared = [description(), *joint_states(s)]
    found = tactid.identify(write_bag(tmp_path / "points", [*shared, *clouds(s.time, bodies)]))
    sensor = tactid.identify(write_bag(tmp_path / "sensor", [*shared, *wrenches(s.time, s.wrench)]))
    np.testing.assert_allclose(found.estimate.values, sensor.estimate.values, atol=1e-4)
    assert [each.kind for each in found.findings] == [FOUND]
    assert "/pad/points" in str(found.findings[0])
    assert found.estimate.body.mass == pytest.approx(PAYLOAD.mass, rel=1e-3)


def test_a_finger_and_its_points_in_two_clouds(rng: np.random.Generator, tmp_path: Path) -> None:
    """Halves of a load that two named pads of one hand share are summed."""
    s = state(FIXED, 8.0, 100.0)
    halves = [plain(s.time, six(rng, part * s.wrench), f"/{part}") for part in (0.25, 0.75)]
    bag = write_bag(tmp_path / "bag", [description(), *joint_states(s), *halves[0], *halves[1]])
    with pytest.raises(tactid.IdentificationError, match="several topics of wrenches"):
        tactid.identify(bag)
    found = tactid.identify(bag, wrench_topic=["/0.75", "/0.25"])
    assert found.estimate.body.mass == pytest.approx(PAYLOAD.mass, rel=1e-3)
    assert [each.kind for each in found.findings] == ["wrenches_summed"]


def test_points_without_numbers_and_clouds_without_points(
    rng: np.random.Generator, tmp_path: Path
) -> None:
    """A point without a number is left out of the sum, and a cloud of nothing else is no wrench."""
    s = state(FIXED, 8.0, 100.0)
    values = six(rng, s.wrench)
    dead = np.full((len(values), 2, 6), np.nan)
    dead[:, 0, :3] = 0.01
    some = np.concatenate([values, dead], axis=1)
    some[10:20] = np.nan
    shared = [description(), *joint_states(s)]
    found = tactid.identify(write_bag(tmp_path / "dead", [*shared, *plain(s.time, some)]))
    assert found.estimate.body.mass == pytest.approx(PAYLOAD.mass, rel=1e-3)
    counts = {each.kind: each.count for each in found.faults}
    assert counts["point_not_finite"] == 2 * (len(values) - 10)
    assert counts["not_finite"] == 10
    empty = plain(s.time, values[:, :0])
    assert len(empty[0].message.data) == 0
    nothing = tactid.identify(write_bag(tmp_path / "empty", [*shared, *empty]))
    assert [each.kind for each in nothing.findings] == [FOUND, "constant_channels", "nothing_held"]


def test_wrenches_are_used_before_points(rng: np.random.Generator, tmp_path: Path) -> None:
    s = state(FIXED, 8.0, 100.0)
    shared = [description(), *joint_states(s), *wrenches(s.time, s.wrench)]
    bag = write_bag(tmp_path / "both", [*shared, *plain(s.time, six(rng, 2 * s.wrench))])
    found = tactid.identify(bag)
    assert found.findings == []
    assert found.estimate.body.mass == pytest.approx(PAYLOAD.mass, rel=1e-3)
    named = tactid.identify(bag, wrench_topic=["/pad/points"])
    assert named.estimate.body.mass == pytest.approx(2 * PAYLOAD.mass, rel=1e-3)


def test_points_without_forces_are_refused_by_their_name(tmp_path: Path) -> None:
    s = state(FIXED, 1.0, 100.0)
    kinds = layout(("x", "y", "z", "intensity"), "<f4")
    lidar = cloud(np.zeros(4, kinds), stamps(s.time)[0], TIP)
    bag = write_bag(
        tmp_path / "lidar", [description(), *joint_states(s), *clouds(s.time[:1], [lidar])]
    )
    fields = (
        "the points of /pad/points have the fields `x`, `y`, `z` and `intensity`, and their forces"
        " need `fx`, `fy` and `fz`, too"
    )
    with pytest.raises(tactid.ArgumentError, match=fields):
        tactid.identify(bag, wrench_topic=["/pad/points"])
    with pytest.raises(tactid.IdentificationError, match=f"neither a wrench .*; {fields}"):
        tactid.identify(bag)


def test_contacts_of_a_simulation_give_the_payload(log: Path) -> None:
    topics = ["/finger_left/contacts", "/finger_right/contacts"]
    found = tactid.identify(log, wrench_topic=topics)
    truth = tactid.identify(log)
    error = found.estimate.values - truth.estimate.values
    assert abs(error[0]) < 0.02 * truth.estimate.values[0]
    assert (np.abs(error) < 4 * found.estimate.std_devs)[:4].all()
