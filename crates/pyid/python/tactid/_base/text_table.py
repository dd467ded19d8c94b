"""Tables in a terminal and as plain text. Rich loads slowly: only a table imports it."""

import io
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table


def empty_table() -> "Table":
    """Returns a table without columns, with a line below its headings."""
    from rich import box
    from rich.table import Table

    return Table(box=box.SIMPLE_HEAD, pad_edge=False)


def whole_width(table: "Table", console: "Console") -> int:
    """Returns the width at which a console shows a table without truncating or folding cells."""
    from rich.measure import Measurement

    return Measurement.get(console, console.options.update(max_width=1000), table).maximum


def as_text(table: "Table") -> str:
    """Returns a table as text without colours."""
    from rich.console import Console

    page = io.StringIO()
    console = Console(file=page, color_system=None, force_terminal=False)
    console.width = whole_width(table, console)
    console.print(table)
    return "\n".join(line.rstrip() for line in page.getvalue().splitlines()).rstrip()
