"""How an option is declared, and how docstrings and signatures show what is declared.

Rust declares the options: each is a field of ``tactid_recordings::Request``, or of the request for
a design or a calibration, and ``tactid._options.options`` has the tables of them.
"""

import inspect
import re
import textwrap
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Literal, TypeVar

from tactid._base.naming import command_line_flag

Use = Literal[
    "log",
    "live",
    "arrays",
    "compensation",
    "poses",
    "online",
    "paper filter",
    "calibration",
    "design",
]
"""Where an option can apply: to a log, to the topics of a robot that runs, to arrays, to
``identify_poses``, to ``Identifier``, to ``PaperFilter``, to ``calibrate`` or to
``design_excitation``."""

_Class = TypeVar("_Class", bound=Callable[..., Any])


@dataclass(frozen=True)
class Declaration:
    """Declaration of an option. A text is empty where there is nothing to say."""

    name: str
    """Keyword of the option."""
    text: str
    """What the option is, in complete sentences."""
    kind: str | dict[str, list[str]]
    """Type of its values: the name of a ``Kind`` of Rust, or that of a choice with the choices."""
    group: str
    """Heading under which it is listed, and panel of the command's help."""
    uses: list[Use]
    """Where the option applies."""
    unit: str = ""
    """Unit of the value."""
    default: str = ""
    """What holds where the option is absent, in words."""
    placeholder: str = ""
    """Placeholder of the value in the command's help, where that of its kind says less."""
    python: str = ""
    """What only Python has, in complete sentences."""

    @property
    def flag(self) -> str:
        """The option on the command line."""
        return command_line_flag(self.name)

    @property
    def documentation(self) -> str:
        """Documentation for Python in complete sentences, with the default and the unit."""
        return self._sentences(self.text, self.python)

    @property
    def help(self) -> str:
        """Documentation for the command line, with the default and the unit."""
        text = self._sentences(self.text)
        return re.sub(r"``(\w+)``", lambda found: command_line_flag(found[1]), text)

    def _sentences(self, *sentences: str) -> str:
        default = f"Default: {self.default}." if self.default else ""
        unit = f"Unit: {self.unit}." if self.unit else ""
        return " ".join(each for each in (*sentences, default, unit) if each)


Declarations = Mapping[str, Declaration]
"""Options by their names, in the order in which they are documented."""


def describe(options: Declarations, use: Use | None = None) -> str:
    """Lists the options with their documentation, as a docstring has them, in groups."""
    lines = []
    group = None
    for option in options.values():
        if use is None or use in option.uses:
            if option.group != group:
                group = option.group
                lines += ["", f"{group}:", ""]
            text = f"    {option.name}: {option.documentation}"
            indent = " " * 8
            lines.append(textwrap.fill(text, 88, subsequent_indent=indent, break_on_hyphens=False))
    return "\n".join(lines[1:])


def arguments(options: Declarations) -> str:
    """Lists the options with their documentation, as a docstring has arguments."""
    texts = [f"{option.name}: {option.documentation}" for option in options.values()]
    return "\n".join(
        textwrap.fill(text, 92, subsequent_indent=" " * 4, break_on_hyphens=False) for text in texts
    )


def documented(options: Declarations, use: Use | None = None) -> Callable[[_Class], _Class]:
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


def with_options(
    options: Declarations, use: Use, own: Declarations = MappingProxyType({})
) -> Callable[[_Class], _Class]:
    """Returns a decorator that shows options in a function's docstring and signature.

    The signature has names only: the types of all keywords would hide them, and are in the text.

    Args:
        options: The options of an identification.
        use: Where those of them apply that the function has.
        own: Options that no identification has, which stand in place of ``<own>`` in a docstring.
    """

    def show(function: _Class) -> _Class:
        signature = inspect.signature(function)
        given = {
            name: parameter.replace(annotation=inspect.Parameter.empty)
            for name, parameter in signature.parameters.items()
            if parameter.kind is not parameter.VAR_KEYWORD
        }
        names = [*own, *(option.name for option in options.values() if use in option.uses)]
        keywords = [
            inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=None)
            for name in names
            if name not in given
        ]
        shown = inspect.Signature([*given.values(), *keywords])
        function.__signature__ = shown  # type: ignore[attr-defined]
        return documented(options, use)(write_into_docstring(function, "<own>", arguments(own)))

    return show
