"""Whether the reference has every public name of the package, inherited members included."""

import dataclasses
import inspect
from collections.abc import Iterable, Iterator
from pathlib import Path

import tactid


def missing_names(pages: Iterable[Path]) -> list[str]:
    """Returns the public names that no page of the built reference has as an anchor."""
    text = "\n".join(page.read_text(encoding="utf-8") for page in pages)
    return [name for name in _public_names() if f'id="{name}"' not in text]


def _public_names() -> Iterator[str]:
    for name in tactid.__all__:
        yield f"tactid.{name}"
        thing = getattr(tactid, name)
        if inspect.isclass(thing):
            yield from (f"tactid.{name}.{member}" for member in sorted(_members(thing)))


def _members(cls: type) -> set[str]:
    """Returns the public members of a class; an error has those that it adds to its base class."""
    classes = [each for each in cls.__mro__ if each.__module__.startswith("tactid")]
    if issubclass(cls, tactid.TactidError):
        classes = [cls]
    names = {name for each in classes for name in vars(each)}
    if dataclasses.is_dataclass(cls):
        names |= {field.name for field in dataclasses.fields(cls)}
    return {name for name in names if not name.startswith("_")}
