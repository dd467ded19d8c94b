"""Writes the tables of all options and arrays, docs/reference/options.md, from their declarations.

python docs/tools/option_table.py
"""

from collections.abc import Iterator
from pathlib import Path
from typing import get_args

from array_table import ARRAYS, array_table, code, row
from tactid._options.declaration import Declaration, Use
from tactid._options.options import OPTIONS

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

A recording is identified by `identify_log` or `identify_arrays` of the crate `tactid-recordings`.
The fields of its `Request` are the options, with the names of their keywords, and those of its
`Arrays` are the arrays. Online, `Identifier::new` of `tactid-identify` takes `EquationSettings`,
whose fields have the same names, and the tip, the robot and the sensors as arguments;
`PaperFilter::new` takes the `PaperSettings`, too. Each sample is a `Sample`:
"""


def page() -> str:
    """Returns the page."""
    arrays = [ARRAYS_HEAD, array_table(ARRAYS), "", ARRAYS_TAIL]
    return "\n".join([HEAD, *_options(), *arrays, RUST_HEAD, *_rust()]) + "\n"


def _options() -> Iterator[str]:
    for group in dict.fromkeys(option.group for option in OPTIONS.values()):
        yield f"## {group}\n"
        yield from _header("keyword", "command line", "applies to", "unit", "default")
        for option in OPTIONS.values():
            if option.group == group:
                texts = [_uses(option), option.unit, option.default]
                yield row(code(option.name), code(option.flag), *texts)
        yield ""


def _uses(declared: Declaration) -> str:
    every = get_args(Use)
    return "all" if len(declared.uses) == len(every) else ", ".join(declared.uses)


def _rust() -> Iterator[str]:
    yield from _header("keyword", "online")
    for name in ("robot", "sensors"):
        yield row(code(name), f"`{name}` of `Identifier::new`")
    for array in ARRAYS:
        yield row(code(array.name), code(*array.sample_field.split(", ")))


def _header(*columns: str) -> Iterator[str]:
    yield row(*columns)
    yield "|" + "---|" * len(columns)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
