"""What a shape adds: 16 tools of one or several materials, with and without it, and wrong shapes.

Run by `make bench-shape`. Each tool hangs on a wrist sensor that turns for 10 s at 100 Hz. The
noise is the strongest of the workshop tools of Nadeau et al. (0.2 N, 0.01 N m). The solids are made
here of boxes and rods, so that their inertia is known.
"""

import tempfile
from collections.abc import Iterable
from itertools import product
from multiprocessing import Pool
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

import tactid
from tactid._base.values import values_of

SEEDS = 20
SECONDS, RATE = 10.0, 100.0
NOISE = np.repeat([0.2, 0.01], 3)
STEEL, WOOD, PLASTIC, ALUMINIUM, RUBBER = 7800.0, 720.0, 1300.0, 2700.0, 1100.0

Array = NDArray[np.float64]


class Part(NamedTuple):
    """A convex part of a tool: a prism along z, whose outline is a box or a rod, m."""

    low: tuple[float, float, float]
    high: tuple[float, float, float]
    density: float
    sides: int = 4


def rod(z: tuple[float, float], radius: float, density: float, x: float = 0.0) -> Part:
    """Returns a rod along z."""
    return Part((x - radius, -radius, z[0]), (x + radius, radius, z[1]), density, 16)


def box(x: tuple[float, float], y: float, z: tuple[float, float], density: float) -> Part:
    """Returns a box, as far to both sides along y."""
    return Part((x[0], -y, z[0]), (x[1], y, z[1]), density)


def hammer(head: float, handle: float, half: float = 0.05) -> list[Part]:
    """Returns a handle with a head across its end."""
    return [
        rod((0.02, 0.24), 0.014, handle),
        box((-half, half + 0.01), 0.014, (0.24, 0.27), head),
    ]


TOOLS = {
    "wrench": [box((-0.012, 0.012), 0.003, (0.02, 0.2), STEEL), rod((0.2, 0.21), 0.02, STEEL)],
    "key": [rod((0.02, 0.15), 0.004, STEEL), box((0.0, 0.06), 0.004, (0.15, 0.158), STEEL)],
    "plate": [box((-0.03, 0.05), 0.04, (0.02, 0.03), ALUMINIUM)],
    "bar": [rod((0.02, 0.32), 0.008, STEEL)],
    "clamp": [
        box((0.0, 0.02), 0.006, (0.02, 0.18), STEEL),
        box((0.02, 0.1), 0.006, (0.02, 0.04), STEEL),
        box((0.02, 0.1), 0.006, (0.16, 0.18), STEEL),
    ],
    "mallet of plastic": hammer(PLASTIC, PLASTIC),
    "hammer of steel": hammer(STEEL, STEEL),
    "block": [box((-0.02, 0.03), 0.03, (0.01, 0.09), WOOD)],
    "hammer": hammer(STEEL, WOOD),
    "mallet": hammer(RUBBER, WOOD, 0.06),
    "screwdriver": [rod((0.02, 0.12), 0.015, PLASTIC), rod((0.12, 0.24), 0.004, STEEL)],
    "driver, reversed": [rod((0.02, 0.14), 0.004, STEEL), rod((0.14, 0.24), 0.015, PLASTIC)],
    "file": [rod((0.02, 0.12), 0.012, WOOD), box((-0.012, 0.012), 0.002, (0.12, 0.32), STEEL)],
    "saw": [
        box((-0.015, 0.015), 0.012, (0.02, 0.12), PLASTIC),
        box((-0.05, 0.01), 0.001, (0.12, 0.38), STEEL),
    ],
    "pliers": [
        box((-0.03, -0.01), 0.008, (0.02, 0.13), PLASTIC),
        box((0.01, 0.03), 0.008, (0.02, 0.13), PLASTIC),
        box((-0.03, 0.03), 0.008, (0.13, 0.19), STEEL),
    ],
    "caliper": [
        box((-0.02, 0.02), 0.008, (0.05, 0.12), PLASTIC),
        box((-0.008, 0.008), 0.002, (0.12, 0.25), STEEL),
        box((-0.06, -0.02), 0.002, (0.05, 0.065), STEEL),
    ],
}
"""The first eight are of one material."""


def triangles(part: Part) -> Array:
    """Returns the triangles of a part, counterclockwise as seen from outside, (T, 3, 3)."""
    low, high = np.array(part.low), np.array(part.high)
    middle, half = (low + high) / 2, (high - low) / 2
    angles = 2 * np.pi * (np.arange(part.sides) + 0.5) / part.sides
    ring = np.stack([np.cos(angles), np.sin(angles)], 1)
    ring *= half[:2] / np.abs(ring).max(0)
    ring += middle[:2]
    bottom, top = (np.column_stack([ring, np.full(part.sides, z)]) for z in (low[2], high[2]))
    found = []
    for k in range(part.sides):
        following = (k + 1) % part.sides
        found += [[bottom[k], bottom[following], top[following]]]
        found += [[bottom[k], top[following], top[k]]]
        found += [[[*middle[:2], low[2]], bottom[following], bottom[k]]]
        found += [[[*middle[:2], high[2]], top[k], top[following]]]
    return np.array(found)


def parameters(parts: Iterable[Part]) -> Array:
    """Returns the ten linear parameters of a tool, by signed tetrahedra."""
    total = np.zeros(10)
    for part in parts:
        a, b, c = triangles(part).transpose(1, 0, 2)
        mass = part.density * np.einsum("ij,ij->i", a, np.cross(b, c)) / 6
        corners = np.stack([a, b, c, a + b + c])
        second = np.einsum("t,kti,ktj->ij", mass / 20, corners, corners)
        inertia = np.trace(second) * np.eye(3) - second
        total += [mass.sum(), *(mass @ corners[3] / 4), *inertia[np.triu_indices(3)]]
    return total


def write(path: Path, parts: Iterable[Part], unit: float = 1.0) -> str:
    """Writes a tool as an OBJ file, in a unit, m."""
    corners = np.concatenate([triangles(part) for part in parts]).reshape(-1, 3) / unit
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in corners]
    lines += [f"f {k} {k + 1} {k + 2}" for k in range(1, len(corners), 3)]
    path.write_text("\n".join(lines))
    return str(path)


def motion(seed: int) -> tuple[Array, Array, Array]:
    """Returns times, poses and the regressor of the wrench."""
    draw = np.random.default_rng(seed)
    phases, time = draw.uniform(0, 6, 3), np.arange(0, SECONDS, 1 / RATE)
    rates, step = np.array([0.9, 1.2, 0.7]), 1e-4

    def turned(t: Array) -> Array:
        angles = [1.0, 0.8, 1.2] * np.sin(np.outer(t, rates) + phases)
        return about(0, angles[:, 0]) @ about(1, angles[:, 1]) @ about(2, angles[:, 2])

    def spin(t: Array) -> Array:
        rate = turned(t).swapaxes(1, 2) @ (turned(t + step) - turned(t - step)) / (2 * step)
        return np.stack([rate[:, 2, 1], rate[:, 0, 2], rate[:, 1, 0]], 1)

    pose = np.tile(np.eye(4), (len(time), 1, 1))
    pose[:, :3, :3] = turned(time)
    upward = pose[:, :3, :3].swapaxes(1, 2) @ [0, 0, 9.81]
    angular = (spin(time + step) - spin(time - step)) / (2 * step)
    return time, pose, tactid.wrench_regressor(upward, spin(time), angular)


def about(axis: int, angle: Array) -> Array:
    """Returns rotations about a coordinate axis, (N, 3, 3)."""
    first, second = (axis + 1) % 3, (axis + 2) % 3
    found = np.tile(np.eye(3), (len(angle), 1, 1))
    found[:, first, first] = found[:, second, second] = np.cos(angle)
    found[:, second, first], found[:, first, second] = np.sin(angle), -np.sin(angle)
    return found


def pose(shift: Iterable[float] = (0, 0, 0), axis: int = 0, degrees: float = 0.0) -> list[float]:
    """Returns a pose: shifted, and turned about a coordinate axis."""
    half, quaternion = np.radians(degrees) / 2, np.zeros(4)
    quaternion[axis], quaternion[3] = np.sin(half), np.cos(half)
    return [*shift, *quaternion]


TOLERATED = "as its tolerances"
"""A file with random errors of the size that the defaults allow."""

CASES: dict[str, dict[str, Any]] = {
    "without": {},
    "right": {"shape_scale": 1.0},
    TOLERATED: {},
    "3 mm across": {"shape_pose": pose((3e-3, 0, 0))},
    "3 degrees": {"shape_pose": pose(degrees=3)},
    "10 mm across": {"shape_pose": pose((0.01, 0, 0))},
    "10 degrees": {"shape_pose": pose(degrees=10)},
    "180 degrees": {"shape_pose": pose((0, 0, 0.26), degrees=180)},
    "10 % too large": {"shape_scale": 1.1},
    "another tool": {"shape_scale": 1.0},
    "mm for m": {"shape_scale": 1e3},
}


def misplaced(seed: int, centre: Array) -> dict[str, Any]:
    """Returns options with random errors of position, orientation about a point, and size."""
    random = np.random.default_rng(2000 + seed)
    shift, turn = 3e-3 * random.normal(size=3), np.radians(3) * random.normal(size=3)
    scale, angle = 1 + 0.03 * random.normal(), np.linalg.norm(turn)
    axis = turn / angle
    rotated = np.cos(angle) * centre + np.sin(angle) * np.cross(axis, centre)
    rotated += (1 - np.cos(angle)) * (axis @ centre) * axis
    quaternion = [*(np.sin(angle / 2) * axis), np.cos(angle / 2)]
    return {"shape_scale": scale, "shape_pose": [*(centre + shift - scale * rotated), *quaternion]}


def run(case: tuple[str, str, int]) -> tuple[Array, Array, bool]:
    """Returns errors (mass, centre, inertia), which intervals hold, and whether it is refused."""
    name, kind, seed = case
    names = list(TOOLS)
    shown = names[(names.index(name) + 1 + seed) % len(names)] if kind == "another tool" else name
    options = dict(CASES[kind])
    if kind != "without":
        options["shape"] = str(FOLDER / f"{shown}.obj")
    time, poses, regressor = motion(seed)
    truth = parameters(TOOLS[name])
    if kind == TOLERATED:
        options |= misplaced(100 * names.index(name) + seed, truth[1:4] / truth[0])
    noise = np.random.default_rng(1000 + seed).normal(size=(len(time), 6)) * NOISE
    found = tactid.identify(time, pose=poses, wrench=regressor @ truth + noise, **options)
    values = np.array(values_of(tactid.MassProperties.from_parameters(truth)))
    error = found.estimate.values - values
    low, high = found.estimate.intervals.T
    sizes = [abs(error[0]) / values[0], np.linalg.norm(error[1:4])]
    sizes.append(np.linalg.norm(error[4:]) / np.linalg.norm(values[4:]))
    refused = any(finding.kind == "shape_contradicted" for finding in found.findings)
    return np.array(sizes), (low <= values) & (values <= high), refused


def start(folder: Path) -> None:
    """What each process keeps."""
    global FOLDER
    FOLDER = folder


def main() -> None:
    """Prints a row for each case, and the values that miss in most seeds."""
    table = Table(title=f"{len(TOOLS)} tools, {SEEDS} seeds, 0.2 N and 0.01 N m of noise")
    medians = ("mass %, median", "centre mm, median", "inertia %, median")
    for title in ("shape", *medians, "mean", "largest"):
        table.add_column(title, justify="right")
    for title in ("inside %", "inertia inside %", "always miss", "refused %"):
        table.add_column(title, justify="right")
    with tempfile.TemporaryDirectory() as folder:
        for name, parts in TOOLS.items():
            write(Path(folder) / f"{name}.obj", parts)
        with Pool(initializer=start, initargs=(Path(folder),)) as pool:
            for kind in CASES:
                seeds = range(SEEDS if kind in ("without", "right", TOLERATED) else 8)
                runs = pool.map(run, [(name, kind, seed) for name, seed in product(TOOLS, seeds)])
                table.add_row(kind, *cells(runs, len(seeds)))
    Console(width=140).print(table)


def cells(runs: list[tuple[Array, Array, bool]], seeds: int) -> list[str]:
    """Returns what a row says of the runs of one case, tool by tool."""
    errors, inside, refused = (np.array(each) for each in zip(*runs, strict=True))
    mass, centre, inertia = errors.T
    of_pairs = inside.reshape(-1, seeds, 10).mean(1)
    return [
        f"{100 * np.median(mass):.3f}",
        f"{1e3 * np.median(centre):.2f}",
        *(f"{100 * of(inertia):.1f}" for of in (np.median, np.mean, np.max)),
        f"{100 * inside.mean():.1f}",
        f"{100 * inside[:, 4:].mean():.1f}",
        str(int((of_pairs < 0.5).sum())),
        f"{100 * refused.mean():.0f}",
    ]


if __name__ == "__main__":
    main()
