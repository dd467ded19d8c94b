"""Writes the tables of all options and arrays, docs/reference/options.md, from their declarations.

python docs/tools/option_table.py
"""

from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path
from typing import get_args

import tactid
from array_table import ARRAYS, array_table, code, row
from tactid.declaration import Declaration, Use
from tactid.naming import command_line_flag

PAGE = Path(__file__).parents[1] / "reference" / "options.md"

HEAD = """\
# Options

Every option of an identification, all of which may be left out. The keyword is that of
`tactid.identify`, `tactid.Identifier`, `tactid.PaperFilter` and `tactid.Options`; the command line
is that of `tactid identify`. [Their fields in Rust](#rust) are at the end.
"""

ARRAYS_HEAD = """\
## Arrays

What `tactid.identify` takes besides options where the recording is in arrays, of N samples of n
joints and S sensors. `push` of `tactid.Identifier` and `tactid.PaperFilter` takes the same arrays,
or one sample, without the axis N. Without a robot there are no joints.
"""

ARRAYS_TAIL = """\
`robot`, the model, and `sensors`, the links in whose frames the wrenches are, belong to arrays,
too; online they are arguments of the constructor.
"""

RUST_HEAD = """\
## Rust

A recording is identified by `identify_log` or `identify_arrays` of the crate `tactid-recordings`,
whose `Request` contains the other types of the second column. Online, `Identifier::new` of
`tactid-identify` takes the `EquationSettings`, and `PaperFilter::new` the `PaperSettings`, too.
`EquationSettings::effort_is_net` has no option: an unloaded recording sets it.
`Identifier` does not use `EquationSettings::effort_gain_std_dev`.
"""

TIP_ONLINE = "`tool` of `Identifier::new`"
"""The tip online: an argument, and no field of the settings."""


def page() -> str:
    """Returns the page."""
    arrays = [ARRAYS_HEAD, array_table(ARRAYS), "", ARRAYS_TAIL]
    return "\n".join([HEAD, *_options(), *arrays, RUST_HEAD, *_rust()]) + "\n"


def _options() -> Iterator[str]:
    panels = dict.fromkeys(Declaration.of(one).panel for one in fields(tactid.Options))
    for panel in panels:
        yield f"## {panel}\n"
        yield from _header("keyword", "command line", "applies to", "unit", "default")
        for one in fields(tactid.Options):
            declared = Declaration.of(one)
            if declared.panel == panel:
                flag = command_line_flag(one.name)
                texts = [_uses(declared), declared.unit or "", declared.default or ""]
                yield row(code(one.name), code(flag), *texts)
        yield ""


def _uses(declared: Declaration) -> str:
    every = get_args(Use)
    return "all" if len(declared.uses) == len(every) else ", ".join(declared.uses)


def _rust() -> Iterator[str]:
    yield from _header("keyword", "recording", "online")
    for one in fields(tactid.Options):
        declared = Declaration.of(one)
        yield row(code(one.name), code(*declared.rust_field.split(", ")), _online(declared))
    yield row(code("robot"), code("Arrays::robot"), "`robot` of `Identifier::new`")
    yield row(code("sensors"), code("Arrays::sensors"), "`sensors` of `Identifier::new`")
    for array in ARRAYS:
        yield row(
            code(array.name), code(array.recording_field), code(*array.sample_field.split(", "))
        )


def _online(declared: Declaration) -> str:
    """Returns the field online, which has the name that it has in a request."""
    if not {"online", "paper filter"} & {*declared.uses}:
        return ""
    if declared.rust_field == "Request::tip":
        return TIP_ONLINE
    return code(declared.rust_field.replace("Request::", "EquationSettings::"))


def _header(*columns: str) -> Iterator[str]:
    yield row(*columns)
    yield "|" + "---|" * len(columns)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
