"""The arrays of a recording as a table of a page."""

import re
from collections.abc import Sequence

from tactid._options.arrays import ARRAYS, ArrayDeclaration

MARK = re.compile(r"<!-- arrays: ([\w ]+) -->")
"""Where a page shows a table of some arrays, by their names."""


def with_array_tables(markdown: str) -> str:
    """Returns a page with the tables of arrays in the place of their marks."""
    by_name = {array.name: array for array in ARRAYS}
    return MARK.sub(
        lambda found: array_table([by_name[name] for name in found[1].split()]), markdown
    )


def array_table(arrays: Sequence[ArrayDeclaration]) -> str:
    """Returns a table of arrays as ``tactid.identify`` takes them."""
    rows = [
        row(
            code(array.name),
            array.text.replace("``", "`"),
            f"`{array.shape('recording')}`",
            array.unit,
        )
        for array in arrays
    ]
    return "\n".join([row("keyword", "meaning", "shape", "unit"), "|---|---|---|---|", *rows])


def code(*names: str) -> str:
    """Returns names as code."""
    return ", ".join(f"`{name}`" for name in names)


def row(*cells: str) -> str:
    """Returns a row of a table."""
    return f"| {' | '.join(cells)} |"
