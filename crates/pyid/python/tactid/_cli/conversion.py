"""Plain values of options and arguments, without Pydantic, by which typer converts all values.

Pydantic takes longer to load than all else that reads a command line.
"""

import os
import re
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import Any, get_args, get_origin


def convert_plain_values(parameters: Iterable[Any]) -> None:
    """Makes parameters of typer convert what needs no validation; typer converts the rest."""
    for parameter in parameters:
        parameter.process_value = partial(_processed, parameter, parameter.process_value)


def _processed(parameter: Any, process: Callable[..., Any], context: Any, value: Any) -> Any:
    """Returns the value of a parameter: as given where it is plain, else as typer converts it."""
    kind = parameter.type_descriptor.annotation
    is_bounded = parameter.min is not None or parameter.max is not None
    if is_bounded or (parameter.required and not value):
        return process(context, value)
    try:
        plain = _plain(kind, value)
    except ValueError:
        return process(context, value)
    return parameter.callback(context, parameter, plain) if parameter.callback else plain


def _plain(kind: Any, value: Any) -> Any:
    """Returns a value of a kind.

    Raises:
        ValueError: It has to be validated, and may be wrong.
    """
    is_list = get_origin(kind) is list
    if value is None:
        return () if is_list else None
    if is_list:
        (kind_of_each,) = get_args(kind)
        return [_plain(kind_of_each, each) for each in value]
    if isinstance(value, str) and kind in _PLAIN:
        return _PLAIN[kind](value)
    if value in get_args(kind) or (isinstance(kind, type) and isinstance(value, kind)):
        return value
    raise ValueError


def _path(text: str) -> Path:
    if os.path.exists(text) and not os.access(text, os.R_OK):
        raise ValueError
    return Path(text)


def _number(text: str) -> float:
    if not re.fullmatch(r"[-+]?\d+(\.\d*)?", text, re.ASCII):
        raise ValueError
    return float(text)


_PLAIN: dict[Any, Callable[[str], Any]] = {str: str, Path: _path, float: _number}
"""How plain texts are converted."""
