"""How an option is declared, and how docstrings and signatures show what is declared.

The options themselves are the fields of :class:`tactid.Options`.
"""

import inspect
import textwrap
from collections.abc import Callable, Iterable
from dataclasses import Field, dataclass, field, fields
from typing import Any, Literal, TypeVar

Use = Literal["log", "arrays", "online", "paper filter", "calibration", "design"]
"""Where an option can apply: to a log, to arrays, to ``Identifier``, to ``PaperFilter``, to
``calibrate`` or to ``design_excitation``."""

_KEY = "option"
_Class = TypeVar("_Class", bound=Callable[..., Any])


@dataclass(frozen=True)
class Declaration:
    """What is known of an option besides its name and its type."""

    text: str
    """What the option is, in complete sentences."""
    panel: str
    """Panel of the command's help."""
    uses: tuple[Use, ...]
    """Where the option applies."""
    rust_field: str
    """Field of Rust's ``Request``, or of a type in it."""
    default: str | None
    """What stands where the option is absent, in words; None where nothing does."""
    unit: str | None
    """Unit of the value; None for what has none."""
    metavar: str | None
    """Placeholder of the value in the command's help, with commas for several numbers."""
    argument: Any
    """Type of the command line's argument; None for that of the field."""
    parse: Callable[[str, Any], Any] | None
    """Turns a flag and the command line's argument into the value; None where they are the same."""
    python: str | None
    """What only Python has, in complete sentences; None where that is nothing."""

    @classmethod
    def of(cls, one: "Field[Any]") -> "Declaration":
        """Returns the declaration of a field of :class:`Options`."""
        declaration: Declaration = one.metadata[_KEY]
        return declaration

    @property
    def documentation(self) -> str:
        """Documentation for Python in complete sentences, with the default and the unit."""
        return self._sentences(self.text, self.python)

    @property
    def help(self) -> str:
        """Documentation for the command line, with the default and the unit."""
        return self._sentences(self.text)

    def _sentences(self, *sentences: str | None) -> str:
        default = f"Default: {self.default}." if self.default else None
        unit = f"Unit: {self.unit}." if self.unit else None
        return " ".join(each for each in (*sentences, default, unit) if each)


def option(
    text: str,
    panel: str,
    uses: tuple[Use, ...] = ("log", "arrays"),
    *,
    rust_field: str,
    default: str | None = None,
    unit: str | None = None,
    metavar: str | None = None,
    argument: Any = None,
    parse: Callable[[str, Any], Any] | None = None,
    python: str | None = None,
) -> Any:
    """Returns the field of an option: optional, with its declaration.

    See :class:`Declaration` for the arguments.
    """
    declaration = Declaration(
        text, panel, uses, rust_field, default, unit, metavar, argument, parse, python
    )
    return field(default=None, metadata={_KEY: declaration})


def describe(options: type[Any], use: Use | None = None) -> str:
    """Lists the options with their documentation, as a docstring has them, in groups."""
    lines = []
    panel = None
    for one in fields(options):
        declaration = Declaration.of(one)
        if use is None or use in declaration.uses:
            if declaration.panel != panel:
                panel = declaration.panel
                lines += ["", f"{panel}:", ""]
            text = f"    {one.name}: {declaration.documentation}"
            indent = " " * 8
            lines.append(textwrap.fill(text, 88, subsequent_indent=indent, break_on_hyphens=False))
    return "\n".join(lines[1:])


def documented(options: type[Any], use: Use | None = None) -> Callable[[_Class], _Class]:
    """Returns a decorator that writes the options in place of ``<options>`` in a docstring."""
    return lambda thing: write_into_docstring(thing, "<options>", describe(options, use))


def write_into_docstring(thing: _Class, mark: str, text: str) -> _Class:
    """Writes a text in place of the line ``mark`` of a docstring, with that line's indentation."""
    if thing.__doc__:  # python -OO has none
        lines = inspect.cleandoc(thing.__doc__).splitlines()
        thing.__doc__ = "\n".join(_filled(lines, mark, text))
    return thing


def _filled(lines: Iterable[str], mark: str, text: str) -> Iterable[str]:
    for line in lines:
        if line.strip() == mark:
            yield textwrap.indent(text, line[: len(line) - len(line.lstrip())])
        else:
            yield line


def with_options(options: type[Any], use: Use) -> Callable[[_Class], _Class]:
    """Returns a decorator that shows the options in a function's docstring and signature.

    The signature has names only: the types of all keywords would hide them, and are in the text.
    """

    def show(function: _Class) -> _Class:
        signature = inspect.signature(function)
        given = [
            parameter.replace(annotation=inspect.Parameter.empty)
            for parameter in signature.parameters.values()
            if parameter.kind is not parameter.VAR_KEYWORD
        ]
        own = [
            inspect.Parameter(one.name, inspect.Parameter.KEYWORD_ONLY, default=None)
            for one in fields(options)
            if use in Declaration.of(one).uses
        ]
        function.__signature__ = inspect.Signature([*given, *own])  # type: ignore[attr-defined]
        return documented(options, use)(function)

    return show
