"""Writes the tables of all options and arrays, docs/reference/options.md, from their declarations.

python docs/tools/option_table.py
"""

from collections.abc import Iterator
from pathlib import Path
from typing import get_args

from array_table import ARRAYS, array_table, code, row
from tactid._options.declaration import Declaration, Declarations, Use
from tactid._options.options import OPTIONS, OWN

PAGE = Path(__file__).parents[1] / "reference" / "options.md"

HEAD = """\
# Options

Every option of an identification, all of which may be left out. The keyword is an argument of
`tactid.identify`, `tactid.Identifier`, `tactid.PaperFilter` and `tactid.Options`; the command line
is `tactid identify`. [Their fields in Rust](#rust) are at the end.
"""

OWN_HEADS: dict[Use, str] = {
    "calibration": """\
## Options of a calibration

What `tactid.calibrate` and `tactid calibrate` take besides those options of an identification that
apply to a calibration. The fields of `CalibrationRequest` of the crate `tactid-recordings` have the
names of the keywords.
""",
    "design": """\
## Options of a design

What `tactid.design_excitation` and `tactid excite` take besides those options of an identification
that apply to a design. The fields of `MotionRequest` of the crate `tactid-excitation` have the
names of the keywords.
""",
}

ARRAYS_HEAD = """\
## Arrays

What `tactid.identify` takes besides options where the recording is in arrays, of N samples of n
joints and S sensors. `push` of `tactid.Identifier` and `tactid.PaperFilter` takes the same arrays,
or one sample, without the axis N. Without a robot there are no joints.
"""

ARRAYS_TAIL = """\
`robot`, the model, and `sensors`, the links with the frames of the wrenches, belong to arrays,
too; online they are arguments of the constructor.
"""

RUST_HEAD = """\
## Rust

A recording is identified by `identify_log` or `identify_arrays` of the crate `tactid-recordings`.
The fields of its `Request` are the options, with the names of their keywords, but for those of
tables, which the Python package reads. The fields of its `Arrays` are the arrays. Online,
`Identifier::new` of `tactid-identify` takes `EquationSettings`, with fields of the same names, and
the tip, the robot and the sensors as arguments; `PaperFilter::new` takes the `PaperSettings`, too.
Each sample is a `Sample`:
"""


def page() -> str:
    """Returns the page."""
    arrays = [ARRAYS_HEAD, array_table(ARRAYS), "", ARRAYS_TAIL]
    own = [line for use, head in OWN_HEADS.items() for line in (head, *_options(OWN[use], "###"))]
    return "\n".join([HEAD, *_options(OPTIONS), *own, *arrays, RUST_HEAD, *_rust()]) + "\n"


def _options(options: Declarations, level: str = "##") -> Iterator[str]:
    for group in dict.fromkeys(option.group for option in options.values()):
        yield f"{level} {group}\n"
        yield from _header("keyword", "command line", "applies to", "unit", "default")
        for option in options.values():
            if option.group == group:
                default = option.default.replace("``", "`")
                texts = [_uses(option), option.unit, default]
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
