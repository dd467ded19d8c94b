"""Documentation of the fields of dataclasses in ``help``, which shows no strings below fields."""

import ast
import dataclasses
import inspect
import textwrap
from typing import TypeVar

_Class = TypeVar("_Class", bound=type)


def with_fields(cls: _Class) -> _Class:
    """Adds each field with the string below it in the source to the docstring of a dataclass."""
    if cls.__doc__:  # python -OO has none
        texts = {name: text for base in cls.__mro__ for name, text in _below_fields(base).items()}
        entries = [
            textwrap.fill(f"{field.name}: {texts[field.name]}", 92, subsequent_indent="    ")
            for field in dataclasses.fields(cls)
            if field.name in texts
        ]
        listed = textwrap.indent("\n".join(entries), "    ")
        cls.__doc__ = f"{inspect.cleandoc(cls.__doc__)}\n\nAttributes:\n{listed}\n"
    return cls


def _below_fields(cls: type) -> dict[str, str]:
    """Returns the string below each field of a class, by the name of the field, on one line."""
    try:
        (body,) = ast.parse(textwrap.dedent(inspect.getsource(cls))).body
    except (OSError, TypeError):  # no source: a built-in class, or an installation without it
        return {}
    if not isinstance(body, ast.ClassDef):
        return {}
    return {
        field.target.id: " ".join(text.value.value.split())
        for field, text in zip(body.body, body.body[1:], strict=False)
        if isinstance(field, ast.AnnAssign)
        and isinstance(field.target, ast.Name)
        and isinstance(text, ast.Expr)
        and isinstance(text.value, ast.Constant)
        and isinstance(text.value.value, str)
    }
