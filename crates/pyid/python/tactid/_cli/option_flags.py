"""Options as flags of a command: their parameters for typer, and from text to values."""

import inspect
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, get_origin

import typer

from tactid._base.errors import ArgumentError
from tactid._base.naming import switched_off
from tactid._cli import option_text
from tactid._cli.command import FLAG
from tactid._options.declaration import Declaration, Use
from tactid._options.options import Options, options_for


class _Form(NamedTuple):
    """How the values of a kind of options are written on the command line."""

    argument: Any
    """Type of the argument."""
    placeholder: str | None = None
    """Placeholder in the command's help, with commas for several numbers; None for typer's."""
    parse: Callable[[str, Any], Any] | None = None
    """Turns a flag and the argument into the value; None where they are the same."""


_FORMS = {
    "flag": _Form(bool, FLAG),
    "switch": _Form(bool),
    "number": _Form(float),
    "degrees": _Form(float, None, option_text.radians),
    "percentage": _Form(str, None, option_text.fraction),
    "gain-percentage": _Form(str, None, option_text.std_dev_of_gains),
    "count": _Form(int),
    "text": _Form(str),
    "texts": _Form(list[str]),
    "path": _Form(Path),
    "recordings": _Form(list[Path]),
    "calibration": _Form(Path),
    "names": _Form(str, "RECORDED=JOINT,...", option_text.names),
    "columns": _Form(list[str], None, option_text.columns),
    "vector": _Form(str, "X,Y,Z", option_text.vector),
    "gravity": _Form(str, "X,Y,Z", option_text.vector_or_word),
    "numbers": _Form(str, "N,N,...", option_text.numbers),
    "posture": _Form(str, "N,N,...", option_text.numbers),
    "each-number": _Form(list[str], "N,N,...", option_text.all_numbers),
    "each-point": _Form(list[str], "X,Y,Z", option_text.vectors),
    "each-inertia": _Form(list[str], "XX,XY,XZ,YY,YZ,ZZ", option_text.inertias),
    "fractions": _Form(str, "P%,P%,...", option_text.gain_std_devs),
    "wrench": _Form(str, "FX,FY,FZ,MX,MY,MZ", option_text.six),
    "wrenches": _Form(list[str], "FX,FY,FZ,MX,MY,MZ", option_text.wrenches),
    "box": _Form(str, "X,Y,Z,X,Y,Z", option_text.box),
    "boxes": _Form(list[str], "NAME=BOX", option_text.named_boxes),
    "grip": _Form(str, "X,Y,Z,NX,NY,NZ,DISTANCE,FORCE,FRICTION,RADIUS", option_text.grip),
    "payload": _Form(str, "M,X,Y,Z", option_text.numbers),
    "body": _Form(str, "M,X,Y,Z,XX,XY,XZ,YY,YZ,ZZ", option_text.body),
    "tool": _Form(str, "FILE.json|M,X,Y,Z,XX,XY,XZ,YY,YZ,ZZ", option_text.tool),
    "pose": _Form(str, "X,Y,Z,QX,QY,QZ,QW", option_text.pose),
    "frame": _Form(str, "LINK,X,Y,Z,QX,QY,QZ,QW", option_text.frame),
}
"""How options are written, by the names of their kinds."""


def _form(option: Declaration) -> _Form:
    if isinstance(option.kind, dict):
        return _Form(Literal[tuple(option.kind["choice"])])
    return _FORMS[option.kind]


_ALIASES = {"start": "--from"}
"""Further flags of options."""


def _flags(option: Declaration) -> Iterator[str]:
    """Yields the flags of an option; a switch has one that turns it off."""
    if option.kind == "switch":
        yield f"{option.flag}/{switched_off(option.name, 'command-line')}"
        return
    yield option.flag
    if option.name in _ALIASES:
        yield _ALIASES[option.name]


def parameters(options: Iterable[Declaration]) -> list[inspect.Parameter]:
    """Returns a parameter for each of some options."""
    found = []
    for option in options:
        form = _form(option)
        declaration = typer.Option(
            *_flags(option),
            help=option.help,
            metavar=option.placeholder or form.placeholder,
            rich_help_panel=option.group,
            show_default=False,
        )
        parameter = inspect.Parameter(
            option.name,
            inspect.Parameter.KEYWORD_ONLY,
            default=None,
            annotation=Annotated[form.argument | None, declaration],
        )
        found.append(parameter)
    return found


def values(arguments: Mapping[str, Any], options: Iterable[Declaration]) -> dict[str, Any]:
    """Returns the values of the options that a command line gives, by their names."""
    found = {}
    for option in options:
        value = arguments.get(option.name)
        if value is not None and value != []:
            parse = _form(option).parse
            found[option.name] = value if parse is None else parse(option.flag, value)
    return found


def from_text(option: Declaration, text: str) -> Any:
    """Returns the value of an option from the text of a cell; a semicolon separates several.

    Raises:
        ValueError: The text is no such value.
    """
    form = _form(option)
    types: dict[Any, Callable[[str], Any]] = {bool: _switch, Path: Path, float: float, int: int}
    argument = types.get(form.argument, str)
    several = get_origin(form.argument) is list
    try:
        value: Any = [*map(str.strip, text.split(";"))] if several else argument(text.strip())
    except ValueError:
        raise ArgumentError(f"{option.flag} is {text!r}: expected {option.kind}") from None
    return value if form.parse is None else form.parse(option.flag, value)


def _switch(text: str) -> bool:
    words = {"yes": True, "true": True, "1": True, "no": False, "false": False, "0": False}
    if text.lower() not in words:
        raise ValueError
    return words[text.lower()]


def read(arguments: Mapping[str, Any], use: Use) -> Options:
    """Returns the options of one use that a command line gives."""
    return Options(**values(arguments, options_for(use)))


def show(
    command: Callable[..., None],
    options: Iterable[inspect.Parameter],
    last: Collection[str] = (),
) -> None:
    """Gives a command the signature that typer reads: its own parameters and options.

    Args:
        command: The command, whose keywords the options are.
        options: Parameters of the options, which follow those of the command itself.
        last: Names of parameters of the command that follow the options.
    """
    signature = inspect.signature(command, eval_str=True)
    own = [
        parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY)
        for parameter in signature.parameters.values()
        if parameter.kind is not parameter.VAR_KEYWORD
    ]
    first = [parameter for parameter in own if parameter.name not in last]
    every = [*first, *options, *(parameter for parameter in own if parameter.name in last)]
    command.__signature__ = signature.replace(parameters=every)  # type: ignore[attr-defined]
    command.__annotations__ = {parameter.name: parameter.annotation for parameter in every}
