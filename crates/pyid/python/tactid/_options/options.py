"""The options of an identification, for Python and for the command line.

Rust declares them, and this table of their declarations comes from there; those of files that the
package reads itself are declared here. Each is a keyword of ``tactid.identify`` and a flag of the
command ``tactid identify``. All defaults are Rust's: None stands for them.
"""

from __future__ import annotations

import difflib
import inspect
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import is_dataclass
from typing import Any, Literal

import numpy as np

from tactid import _native
from tactid._base.errors import ArgumentError
from tactid._native import MassProperties
from tactid._options.declaration import Declaration, Declarations, Use, documented
from tactid._options.known_tool import plain_tool

Method = Literal["tactile", "effort", "joint-sensing", "combined"]
"""Which measurements the payload is identified from."""

Estimator = Literal["least-squares", "nlms"]
"""How equations become parameters."""

_OF_IDENTIFICATION, _OF_DESIGN, _OF_CALIBRATION = (
    {each["name"]: Declaration(**each) for each in table} for table in _native.options()
)

_FILES: tuple[Declaration, ...] = (
    Declaration(
        name="columns",
        text="Columns of a table that make up an array, where their names do not say so: of time,"
        " q, qd, effort, wrench or pose, each with an option of its own. * stands for any text,"
        " and a unit in brackets follows the name of a column that has another than SI and does"
        " not say so itself.",
        kind="columns",
        group="Tables",
        uses=["log", "compensation", "calibration"],
        default="the columns whose names are known",
        placeholder="ARRAY=COLUMN,...",
        python="A dict of ``time``, ``q``, ``qd``, ``effort`` and ``wrench``, each with a name or a"
        ' list of names: ``{"q": "joint_*[deg]"}``.',
    ),
    Declaration(
        name="episode",
        text="Number of the episode of a data set, from 0.",
        kind="count",
        group="Tables",
        uses=["log", "compensation", "calibration"],
        default="the only one",
    ),
)

FILE_OPTIONS = tuple(each.name for each in _FILES)
"""Options of recordings that become logs before Rust reads them."""

OPTIONS = _OF_IDENTIFICATION | {each.name: each for each in _FILES}
"""All options of an identification by their names, in the order in which they are documented."""

OWN: Mapping[Use, Declarations] = {"design": _OF_DESIGN, "calibration": _OF_CALIBRATION}
"""Options that only a design or only a calibration has, by their names."""


class Options:
    """What to identify from a recording, and how: every option once, each optional.

    An option that is not given is None. Options are immutable.

    <options>
    """

    given: dict[str, Any]
    """The options that are given, by their names."""

    __signature__ = inspect.Signature(
        [inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=None) for name in OPTIONS]
    )

    def __init__(self, **given: Any) -> None:
        _check_names(given, list(OPTIONS))
        self.__dict__["given"] = {
            name: given[name] for name in OPTIONS if given.get(name) is not None
        }

    def __getattr__(self, name: str) -> Any:
        if name in OPTIONS:
            return self.given.get(name)
        raise AttributeError(f"there is no option `{name}`")

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError("options are immutable: `replace` returns others")

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *OPTIONS]

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Options) and self.plain() == other.plain()

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        given = (f"{name}={value!r}" for name, value in self.given.items())
        return f"Options({', '.join(given)})"

    def replace(self, **changes: Any) -> Options:
        """Returns options with others in place of some; None takes one away."""
        return Options(**self.given | changes)

    def plain(self) -> dict[str, Any]:
        """Returns the options that are given, with values of plain types, as Rust reads them."""
        return {
            name: plain_tool(value) if name == "known_tool" else _plain(value)
            for name, value in self.given.items()
        }


def options_for(use: Use) -> list[Declaration]:
    """Returns the options that apply to one use, in order."""
    return [option for option in OPTIONS.values() if use in option.uses]


def option_names(use: Use | None = None) -> list[str]:
    """Returns the names of all options, or of those that apply to one use, in order."""
    return [option.name for option in OPTIONS.values() if use is None or use in option.uses]


def collect(
    options: Options | None,
    keywords: dict[str, Any],
    use: Use,
    own: Sequence[str] = (),
    taker: str = "",
) -> Options:
    """Merges keywords into options, and checks that all of them exist and apply.

    Args:
        options: Options to start from; none of them is set where it is None.
        keywords: Further options by name, which replace those of ``options``.
        use: Where the options are to apply.
        own: Keywords of the caller that are no options, for the list of an error.
        taker: What an error says that they do not apply to. Default: what ``use`` is.

    Raises:
        ArgumentError: ``options`` is something else, a keyword is no option, or an option does not
            apply.
    """
    if options is not None and not isinstance(options, Options):
        raise ArgumentError(
            f"`options` is of type {type(options).__name__}: expected tactid.Options"
        )
    allowed = option_names(use)
    _check_names(keywords, [*own, *OWN.get(use, ()), *allowed])
    collected = (options or Options()).replace(**keywords)
    for name in collected.given:
        if name not in allowed:
            raise ArgumentError(f"`{name}` does not apply to {taker or _NAMES[use]}", option=name)
    return collected


def take_own(keywords: dict[str, Any], use: Use) -> dict[str, Any]:
    """Takes options that only one use has from keywords; returns their values as Rust reads them.

    Recordings stay as they are: their arrays may be large.
    """
    taken = {name: keywords.pop(name, None) for name in OWN[use]}
    return {
        name: value
        if OWN[use][name].kind == "recordings"
        else _plain(vars(value) if is_dataclass(value) else value)
        for name, value in taken.items()
        if value is not None
    }


_NAMES: dict[Use, str] = {
    "log": "a log",
    "live": "a live session",
    "arrays": "arrays",
    "compensation": "a compensation",
    "poses": "poses at rest",
    "online": "Identifier",
    "paper filter": "PaperFilter",
    "calibration": "a calibration",
    "design": "the design of a motion",
}


def _check_names(given: Iterable[str], allowed: Sequence[str]) -> None:
    """Checks that each name is that of an option; an error lists those that there are."""
    for name in given:
        if name not in OPTIONS:
            raise ArgumentError(_unknown(name, allowed))


def _unknown(name: str, allowed: Sequence[str]) -> str:
    """Says that there is no such keyword, and lists those that there are, the closest first."""
    closest = difflib.get_close_matches(name, allowed, n=3)
    hint = f"; did you mean `{closest[0]}`?" if closest else "."
    listed = [*closest, *(other for other in allowed if other not in closest)]
    return f"there is no keyword `{name}`{hint} The keywords are {', '.join(listed)}."


def _plain(value: Any) -> Any:
    """Returns a value of numbers, texts, lists and dictionaries, as Rust reads it."""
    if isinstance(value, MassProperties):
        body = {"mass_kg": value.mass, "center_of_mass": value.com, "inertia": value.inertia}
        return _plain(body)
    if isinstance(value, list | tuple):
        return [_plain(each) for each in value]
    if isinstance(value, Mapping):
        return {name: _plain(each) for name, each in value.items()}
    if hasattr(value, "__array__"):
        return np.asarray(value).tolist()
    return value


documented(OPTIONS)(Options)
