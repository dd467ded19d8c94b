"""The table of options in the help of a command."""

from typing import Any

from rich.table import Table


class OptionTable(Table):
    """The table of options of typer: what does not fit is folded, but for the names."""

    def add_row(self, *cells: Any, **settings: Any) -> None:
        """Adds an option: marks and names, the kind of its value, and what it does."""
        super().add_row(*cells, **settings)
        for column in self.columns[:-2]:
            column.no_wrap = True
        self.columns[-2].overflow = "fold"
