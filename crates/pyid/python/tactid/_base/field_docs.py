"""Documentation of the fields of dataclasses in ``help``, which shows no strings below fields."""

import ast
import dataclasses
import functools
import inspect
import sys
import textwrap
from itertools import pairwise
from typing import TypeVar

_Class = TypeVar("_Class", bound=type)


def with_fields(cls: _Class) -> _Class:
    """Adds each field with the string below it in the source to the docstring of a dataclass."""
    if cls.__doc__:  # python -OO has none
        cls.__doc__ = _Docstring(cls, cls.__doc__)  # type: ignore[assignment]
    return cls


class _Docstring:
    """Docstring of a dataclass with its fields, which is composed when it is read."""

    def __init__(self, cls: type, beginning: str) -> None:
        self._cls, self._beginning = cls, beginning

    def __get__(self, _instance: object, _owner: type) -> str:
        return self._text

    @functools.cached_property
    def _text(self) -> str:
        bases = self._cls.__mro__
        texts = {name: text for base in bases for name, text in _below_fields(base).items()}
        entries = [
            textwrap.fill(f"{field.name}: {texts[field.name]}", 92, subsequent_indent="    ")
            for field in dataclasses.fields(self._cls)
            if field.name in texts
        ]
        listed = textwrap.indent("\n".join(entries), "    ")
        return f"{inspect.cleandoc(self._beginning)}\n\nAttributes:\n{listed}\n"


def _below_fields(cls: type) -> dict[str, str]:
    """Returns the documentation of the fields of a class by their names.

    It is the description of a field's schema, or the string below the field.
    """
    known = dataclasses.fields(cls) if dataclasses.is_dataclass(cls) else ()
    schemas = {each.name: each.metadata["schema"] for each in known if "schema" in each.metadata}
    texts = {
        name: " ".join(schema.get("description", "").split()) for name, schema in schemas.items()
    }
    if inspect.get_annotations(cls).keys() <= texts.keys():
        return texts  # reading the source takes longer than all else that makes a class
    body = _classes(cls.__module__).get(cls.__name__, [])
    return texts | {
        field.target.id: " ".join(text.value.value.split())
        for field, text in pairwise(body)
        if isinstance(field, ast.AnnAssign)
        and isinstance(field.target, ast.Name)
        and isinstance(text, ast.Expr)
        and isinstance(text.value, ast.Constant)
        and isinstance(text.value.value, str)
    }


@functools.cache
def _classes(module: str) -> dict[str, list[ast.stmt]]:
    """Returns the statements of each class of a module, by the name of the class."""
    try:
        source = inspect.getsource(sys.modules[module])
    except (OSError, TypeError):  # no source: a built-in module, or an installation without it
        return {}
    found = (each for each in ast.parse(source).body if isinstance(each, ast.ClassDef))
    return {each.name: each.body for each in found}
