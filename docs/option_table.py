"""Writes the table of all options, docs/options.md, from their declarations.

python docs/option_table.py
"""

from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path
from typing import get_args

import tactid
from tactid.declaration import Declaration, Use
from tactid.naming import command_line_flag

PAGE = Path(__file__).with_name("options.md")

HEAD = """\
# Options

Every option of an identification, all of which may be left out. The keyword is that of
`tactid.identify`, `tactid.Identifier`, `tactid.PaperFilter` and `tactid.Options`; the command line
is that of `tactid identify`. The Rust field is one of the crate `tactid-recordings`, whose
`Request` contains the others.
"""

ARRAYS = """\
## Arrays

What `tactid.identify` takes besides options where the recording is in arrays, of N samples of n
joints and S sensors, and what `push` of `tactid.Identifier` and `tactid.PaperFilter` takes.
`help(tactid.identify)` has their frames and signs.

| keyword | Rust field | online | shape | unit |
|---|---|---|---|---|
| `time`, the first argument | `Arrays::times_s` | `push` | (N,) | s |
| `robot` | `Arrays::robot` | constructor | | |
| `sensors` | `Arrays::sensors` | constructor | S names | |
| `q` | `Arrays::joint_position` | `push` | (N, n) | rad or m |
| `qd` | `Arrays::joint_velocity` | `push` | (N, n) | rad/s or m/s |
| `effort` | `Arrays::joint_effort` | `push` | (N, n) | N m or N |
| `wrench` | `Arrays::wrenches` | `push` | (N, 6) or (N, S, 6) | N, N m |
| `pose` | `Arrays::poses` | `push` | (N, 7) or (N, 4, 4) | m |
| `twist` | `Arrays::twists` | `push` | (N, 6) | m/s, rad/s |
| `acceleration` | `Arrays::accelerations` | `push` | (N, 6) | m/s², rad/s² |
"""


def page() -> str:
    """Returns the page."""
    return "\n".join([HEAD, *_tables(), ARRAYS])


def _tables() -> Iterator[str]:
    columns = ["keyword", "command line", "Rust field", *get_args(Use), "unit", "default"]
    panels = dict.fromkeys(Declaration.of(one).panel for one in fields(tactid.Options))
    for panel in panels:
        yield f"## {panel}\n"
        yield _row(columns)
        yield "|" + "---|" * len(columns)
        for one in fields(tactid.Options):
            declared = Declaration.of(one)
            if declared.panel == panel:
                yield _row(_cells(one.name, declared))
        yield ""


def _cells(name: str, declared: Declaration) -> list[str]:
    return [
        f"`{name}`",
        f"`{command_line_flag(name)}`",
        ", ".join(f"`{field}`" for field in declared.rust_field.split(", ")),
        *("yes" if use in declared.uses else "" for use in get_args(Use)),
        declared.unit or "",
        declared.default or "",
    ]


def _row(cells: list[str]) -> str:
    return f"| {' | '.join(cells)} |"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
