"""Options written on the command line: from text to values, with a clear error for the rest."""

import re
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tactid._base.errors import ArgumentError
from tactid._native import MassProperties
from tactid._read.columns import DIMENSIONS

if TYPE_CHECKING:
    from tactid._api.excitation import Grip


def numbers(flag: str, text: str, count: int | None = None) -> list[float]:
    """Reads numbers separated by commas or spaces: ``count`` of them, or one and more."""
    try:
        found = [float(word) for word in text.replace(",", " ").split()]
    except ValueError:
        found = []
    if not found or (count is not None and len(found) != count):
        many = "numbers" if count is None else f"{count} number{'s' if count > 1 else ''}"
        raise ArgumentError(f"{flag} is {text!r}: expected {many}, separated by commas or spaces")
    return found


def vector(flag: str, text: str) -> list[float]:
    """Reads three numbers."""
    return numbers(flag, text, 3)


def vector_or_word(flag: str, text: str) -> list[float] | str:
    """Reads three numbers, or a word."""
    return text if text.strip().isalpha() else vector(flag, text)


def wrenches(flag: str, texts: list[str]) -> list[list[float]]:
    """Reads six numbers from each text."""
    return [numbers(flag, text, 6) for text in texts]


def six(flag: str, text: str) -> list[float]:
    """Reads six numbers."""
    return numbers(flag, text, 6)


def all_numbers(flag: str, texts: list[str]) -> list[float]:
    """Reads the numbers of all texts."""
    return [number for text in texts for number in numbers(flag, text)]


def vectors(flag: str, texts: list[str]) -> list[list[float]]:
    """Reads three numbers from each text."""
    return [vector(flag, text) for text in texts]


def inertias(flag: str, texts: list[str]) -> list[list[list[float]]]:
    """Reads an inertia from each text."""
    return [inertia(flag, text) for text in texts]


def radians(_: str, degrees: float) -> float:
    """Returns an angle in degrees as one in rad."""
    return float(np.radians(degrees))


def grip(flag: str, text: str) -> "Grip":
    """Reads the ten numbers of a grip."""
    from tactid._api.excitation import Grip  # only a design has one

    found = numbers(flag, text, 10)
    return Grip(found[:3], found[3:6], *found[6:])


def box(flag: str, text: str) -> NDArray[np.float64]:
    """Reads the least and the largest corner of a box, (2, 3)."""
    return np.reshape(numbers(flag, text, 6), (2, 3))


def named_boxes(flag: str, texts: list[str]) -> dict[str, NDArray[np.float64]]:
    """Reads boxes, each with its name before the corners, as in ``table=-1,-1,-0.5,1,1,0``."""
    boxes = {}
    for text in texts:
        name, equals, corners = text.partition("=")
        if not equals or not name.strip():
            raise ArgumentError(
                f"{flag} is {text!r}: expected a name, an equals sign and the least and the largest"
                " corner of a box, such as table=-1,-1,-0.5,1,1,0"
            )
        if name.strip() in boxes:
            raise ArgumentError(f"{flag} has two boxes of the name {name.strip()}")
        boxes[name.strip()] = box(flag, corners)
    return boxes


def body(flag: str, text: str) -> MassProperties:
    """Reads the ten values of a body."""
    mass, x, y, z, xx, xy, xz, yy, yz, zz = numbers(flag, text, 10)
    try:
        return MassProperties(mass, [x, y, z], [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    except ArgumentError as error:
        raise ArgumentError(f"{flag} is {text!r}: {error}") from None


def tool(flag: str, text: str) -> MassProperties | str:
    """Reads the ten values of a known tool, or the path of a JSON file."""
    return body(flag, text) if tool_file(text) is None else text


def tool_file(text: str | None) -> Path | None:
    """Returns the JSON file that a known tool is given as; None where it is none."""
    return Path(text) if text is not None and Path(text).suffix.lower() == ".json" else None


def inertia(flag: str, text: str) -> list[list[float]]:
    """Reads the six numbers of an inertia, (3, 3)."""
    xx, xy, xz, yy, yz, zz = numbers(flag, text, 6)
    return [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]


def pose(flag: str, text: str) -> list[float]:
    """Reads the origin and the quaternion of a frame."""
    return numbers(flag, text, 7)


def frame(flag: str, text: str) -> tuple[str, list[float]]:
    """Reads the name of a link, then the origin and the quaternion of a frame on it."""
    link, _, pose = text.partition(",")
    try:
        return link.strip(), numbers(flag, pose, 7)
    except ArgumentError:
        raise ArgumentError(
            f"{flag} is {text!r}: expected the name of a link, then the seven numbers x, y, z, qx,"
            " qy, qz, qw, all separated by commas"
        ) from None


def names(flag: str, text: str) -> dict[str, str]:
    """Reads pairs of names, as in ``a=b,c=d``."""
    pairs = [pair.split("=") for pair in text.replace(",", " ").split()]
    if not pairs or any(len(pair) != 2 or not all(pair) for pair in pairs):
        raise ArgumentError(
            f"{flag} is {text!r}: expected pairs of a name in the log and one in the URDF, such as"
            " fer_joint1=panda_joint1,fer_joint2=panda_joint2"
        )
    return dict(pairs)


def columns(flag: str, texts: list[str]) -> dict[str, list[str]]:
    """Reads the columns of arrays, as in ``q=joint_1,joint_2``."""
    found: dict[str, list[str]] = {}
    for text in texts:
        array, equals, names = text.partition("=")
        if not equals or not array.strip() or not all(map(str.strip, names.split(","))):
            raise ArgumentError(
                f"{flag} is {text!r}: expected an array, an equals sign and its columns, such as"
                " time=stamp[ms] or q=joint_*[deg]"
            )
        each = re.split(rf",\s*(?=(?:{'|'.join(DIMENSIONS)})\s*=)", text)
        if len(each) > 1:
            raise ArgumentError(
                f"{flag} is {text!r}: give the option once for each array:"
                f" {' '.join(f'{flag} {one}' for one in each)}"
            )
        found.setdefault(array.strip(), []).extend(map(str.strip, names.split(",")))
    return found


def fractions(flag: str, text: str) -> list[float]:
    """Reads percentages, each with its sign, as fractions of one.

    The sign is required: 0.05 may mean a fraction or a percentage.
    """
    words = text.replace(",", " ").split()
    try:
        found = [float(word.removesuffix("%")) / 100 for word in words if word.endswith("%")]
    except ValueError:
        found = []
    if not found or len(found) != len(words):
        raise ArgumentError(
            f"{flag} is {text!r}: expected percentages with their sign, such as 5%, separated by"
            " commas"
        )
    return found


def gain_std_devs(flag: str, text: str) -> list[float]:
    """Reads the standard deviations of gains, percentages with their sign, as fractions of one."""
    each = fractions(flag, text)
    if not all(0.0 <= std_dev < 1.0 for std_dev in each):
        raise ArgumentError(
            f"{flag} is {text!r}: expected 0% or more and less than 100%, because a gain is"
            " positive; where efforts are not torques, such as currents, give rough gains"
        )
    return each


def std_dev_of_gains(flag: str, text: str) -> float:
    """Reads one percentage with its sign as a fraction of one; 0 needs no sign."""
    if text.strip() == "0":
        return 0.0
    each = gain_std_devs(flag, text)
    if len(each) != 1:
        raise ArgumentError(f"{flag} is {text!r}: expected one percentage")
    return each[0]


def fraction(flag: str, text: str) -> float:
    """Reads a positive percentage with its sign as a fraction of one."""
    try:
        (found,) = fractions(flag, text)
    except (ArgumentError, ValueError):
        found = 0.0
    if not 0.0 < found < float("inf"):
        raise ArgumentError(
            f"{flag} is {text!r}: expected a positive percentage with its sign, such as 1%"
        )
    return found
