"""The shapes of a robot's links, from its URDF."""

import math
from collections.abc import Container, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import Literal
from xml.etree import ElementTree

import numpy as np

from tactid._base.errors import ModelError
from tactid._base.meshes import Meshes
from tactid._base.naming import listed, shortened
from tactid._base.values import Array

Color = tuple[int, int, int, int]

GREY: Color = (176, 180, 186, 255)
"""Of what the URDF gives no colour."""

MESHES = [".glb", ".gltf", ".obj", ".stl", ".dae"]
"""What the viewer can show."""


@dataclass(frozen=True)
class Shape:
    """A part of a link, placed in the link's frame."""

    kind: Literal["box", "cylinder", "sphere", "mesh", "bones"]
    size: tuple[float, ...]
    """Box: lengths along x, y, z; cylinder: radius, length along z; sphere: radius; mesh: scale
    along x, y, z; m. Bones: the ends of lines that begin in the frame, three numbers each."""
    position: Array
    rotation: Array
    color: Color
    mesh: Path | None = None


def link_names(urdf: str) -> list[str]:
    """All links of a URDF."""
    return [link.get("name", "") for link in _parse(urdf).iter("link")]


def shapes_of(
    urdf: str, folder: Path | None, names: Container[str]
) -> tuple[dict[str, list[Shape]], dict[str, str]]:
    """The shapes of the links of these names, and why meshes are not among them, by their names.

    A link is shown as its visual geometry, or else its collision geometry; one that has none that
    can be shown, as lines to the joints that it carries. Meshes are looked for beside the URDF
    (``folder``) and in the packages of ROS's environment.
    """
    robot = _parse(urdf)
    colors = {
        material.get("name", ""): color
        for material in robot.findall("material")
        if (color := _color(material)) is not None
    }
    shapes: dict[str, list[Shape]] = {}
    meshes = _ShownMeshes(folder)
    bones = _bones(robot)
    for link in robot.findall("link"):
        name = link.get("name", "")
        if name not in names:
            continue
        for tag in ("visual", "collision"):
            found = list(_shapes(link.findall(tag), colors, meshes))
            if found:
                shapes[name] = found
                break
        else:
            shapes[name] = bones.get(name, [])
    return shapes, meshes.reasons


def _parse(urdf: str) -> ElementTree.Element:
    try:
        return ElementTree.fromstring(urdf)
    except ElementTree.ParseError as error:
        raise ModelError(f"the URDF is not XML: {error}") from None


def _shapes(
    parts: Sequence[ElementTree.Element],
    colors: dict[str, Color],
    meshes: "_ShownMeshes",
) -> Iterator[Shape]:
    for part in parts:
        geometry = part.find("geometry")
        if geometry is None:
            continue
        position, rotation = _origin(part)
        material = part.find("material")
        color = GREY
        if material is not None:
            color = _color(material) or colors.get(material.get("name", ""), GREY)
        for solid in geometry:
            if solid.tag == "box":
                size = _numbers(solid, "size", "1 1 1")
                yield Shape("box", size, position, rotation, color)
            elif solid.tag == "cylinder":
                size = (_number(solid, "radius"), _number(solid, "length"))
                yield Shape("cylinder", size, position, rotation, color)
            elif solid.tag == "sphere":
                yield Shape("sphere", (_number(solid, "radius"),), position, rotation, color)
            elif solid.tag == "mesh":
                path = meshes.find(solid.get("filename", ""))
                if path is not None:
                    scale = _numbers(solid, "scale", "1 1 1")
                    yield Shape("mesh", scale, position, rotation, color, path)


def _bones(robot: ElementTree.Element) -> dict[str, list[Shape]]:
    """The lines from each link to the joints that it carries, where these are away from it."""
    ends: dict[str, list[float]] = {}
    for joint in robot.findall("joint"):
        parent = joint.find("parent")
        if parent is not None:
            end = [float(value) for value in _origin(joint)[0]]
            ends.setdefault(parent.get("link", ""), []).extend(end)
    return {
        link: [Shape("bones", tuple(values), np.zeros(3), np.eye(3), GREY)]
        for link, values in ends.items()
        if any(values)
    }


class _ShownMeshes:
    """The files of the meshes that can be shown, and why others are not."""

    def __init__(self, folder: Path | None) -> None:
        self._folder = folder
        self._meshes = Meshes()
        self.reasons: dict[str, str] = {}

    def find(self, uri: str) -> Path | None:
        """Returns the file of a mesh. Where it cannot be shown, the reason is kept."""
        if PurePath(uri).suffix.lower() not in MESHES:
            found: Path | str = f"its name ends in none of {listed(MESHES)}"
        else:
            found = self._meshes.find(uri, self._folder)
        if isinstance(found, str):
            self.reasons[uri] = found
            return None
        return found


def _origin(element: ElementTree.Element) -> tuple[Array, Array]:
    origin = element.find("origin")
    if origin is None:
        return np.zeros(3), np.eye(3)
    roll, pitch, yaw = _numbers(origin, "rpy", "0 0 0")
    return np.array(_numbers(origin, "xyz", "0 0 0")), rotation_of(roll, pitch, yaw)


def rotation_of(roll: float, pitch: float, yaw: float) -> Array:
    """The rotation of a URDF's ``rpy``: about the fixed x, then y, then z."""
    (cr, cp, cy), (sr, sp, sy) = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def _color(material: ElementTree.Element) -> Color | None:
    color = material.find("color")
    if color is None:
        return None
    values = [min(max(value, 0.0), 1.0) for value in _numbers(color, "rgba", "1 1 1 1", 4)]
    red, green, blue, alpha = (round(255 * value) for value in values)
    return red, green, blue, alpha


def _numbers(
    element: ElementTree.Element, key: str, default: str, count: int = 3
) -> tuple[float, ...]:
    text = element.get(key, default)
    try:
        values = tuple(float(number) for number in text.split())
    except ValueError:
        values = ()
    if len(values) != count or not all(map(math.isfinite, values)):
        raise ModelError(
            f'the URDF has {key}="{shortened(text)}" in a <{element.tag}>:'
            f" expected {count} finite numbers"
        )
    return values


def _number(element: ElementTree.Element, key: str) -> float:
    return _numbers(element, key, "0.01", 1)[0]
