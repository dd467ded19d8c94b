"""Equality of results, whose fields contain arrays."""

from collections.abc import Mapping
from dataclasses import fields
from typing import Any, ClassVar

import numpy as np


class ComparedByValue:
    """A dataclass (``eq=False``) that equals another of its class where all fields are equal.

    Fields that are declared with ``compare=False`` do not count. Arrays are equal where all their
    numbers are, and a number that is not known (NaN) equals another. Arrays can be changed, so
    there is no hash.
    """

    __hash__: ClassVar[None]  # type: ignore[assignment]

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        compared = [field for field in fields(self) if field.compare]  # type: ignore[arg-type]
        names = [field.name for field in compared]
        return all(are_equal(getattr(self, name), getattr(other, name)) for name in names)


def are_equal(a: Any, b: Any) -> bool:
    """Returns whether two values are equal, number by number; NaN equals NaN."""
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return _are_equal_arrays(a, b)
    if isinstance(a, list | tuple) and isinstance(b, list | tuple):
        return len(a) == len(b) and all(map(are_equal, a, b))
    if isinstance(a, Mapping) and isinstance(b, Mapping):
        return a.keys() == b.keys() and all(are_equal(a[key], b[key]) for key in a)
    both_unknown = isinstance(a, float) and isinstance(b, float) and a != a and b != b
    return both_unknown or bool(a == b)


def _are_equal_arrays(a: Any, b: Any) -> bool:
    if not isinstance(a, np.ndarray) or not isinstance(b, np.ndarray) or a.dtype != b.dtype:
        return False
    return np.array_equal(a, b, equal_nan=np.issubdtype(a.dtype, np.inexact))
