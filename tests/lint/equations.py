"""Checks docs/theory/equations.md: each equation of the paper has a row, each item and test exists.

Run it from anywhere: ``python3 tests/lint/equations.py [FILE]``. It prints each fault and exits
with status 1 if there is one.
"""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
INDEX = ROOT / "docs" / "theory" / "equations.md"
EQUATIONS = range(1, 55)
COLUMNS = ["equation", "states", "computed by (item, file)", "held by (test, file)"]
REFERENCE = re.compile(r"`([\w:]+)`, `([\w./]+)`")


def read_table(text: str) -> list[list[str]]:
    """Returns the cells of the rows below the header that has the expected columns."""
    lines = [line for line in text.splitlines() if line.startswith("|")]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    if not rows or rows[0] != COLUMNS:
        raise SystemExit(f"the table's columns must be {' | '.join(COLUMNS)}")
    return rows[2:]


def item_fault(item: str, source: str) -> str | None:
    """Returns what is wrong with an item of a source file, or None.

    The last segment of the path must be defined there. A type before it must be known there.
    """
    *path, name = item.split("::")
    owner = path[-1] if path and path[-1][0].isupper() else None
    # A method may stand in another file than its type: then an `impl` block names the type.
    if owner and not re.search(rf"\b(struct|enum|trait|type|for|impl(<.*>)?) {owner}\b", source):
        return f"has no type `{owner}`"
    if not re.search(rf"\b(fn|struct|enum|trait|type|const) {name}\b", source):
        return f"does not define `{name}`"
    return None


def export_fault(item: str) -> str | None:
    """Returns what is wrong with a path of a crate's public API, or None."""
    crate, *path = item.split("::")
    if not path:
        return None
    root = ROOT / "crates" / crate.removeprefix("tactid_") / "src" / "lib.rs"
    if not root.is_file():
        return f"names the crate `{crate}`, which does not exist"
    if not re.search(rf"^pub use [^;]*\b{path[0]}\b", root.read_text(), re.MULTILINE):
        return f"is not exported by `{crate}`"
    return None


def test_fault(test: str, source: str) -> str | None:
    """Returns what is wrong with a test of a source file, or None."""
    if re.search(rf"#\[test\]\s*(#\[[^\]]*\]\s*)*fn {test}\b", source):
        return None
    return f"has no test `{test}`"


def row_faults(number: str, items: str, tests: str) -> list[str]:
    """Returns the faults of the references of one row."""
    faults = []
    for cell, column, check in ((items, COLUMNS[2], item_fault), (tests, COLUMNS[3], test_fault)):
        references = REFERENCE.findall(cell)
        if "; ".join(f"`{name}`, `{file}`" for name, file in references) != cell or not references:
            faults.append(f"{number}: {column}: expected `name`, `file`; ...: {cell}")
        for name, file in references:
            path = ROOT / file
            fault = check(name, path.read_text()) if path.is_file() else "does not exist"
            if fault:
                faults.append(f"{number}: {file} {fault}")
            fault = export_fault(name) if check is item_fault else None
            if fault:
                faults.append(f"{number}: `{name}` {fault}")
    return faults


def main() -> int:
    index = Path(sys.argv[1]) if len(sys.argv) > 1 else INDEX
    rows = read_table(index.read_text())
    width = len(COLUMNS)
    faults = [f"{row[0]}: the row does not have {width} cells" for row in rows if len(row) != width]
    rows = [row for row in rows if len(row) == width]
    numbers = [row[0] for row in rows]
    for equation in EQUATIONS:
        count = numbers.count(f"({equation})")
        if count != 1:
            faults.append(f"({equation}): the index has {count} rows for this equation")
    unknown = set(numbers) - {f"({equation})" for equation in EQUATIONS}
    faults += [f"{number}: the paper has no such equation" for number in sorted(unknown)]
    for number, states, items, tests in rows:
        if not states:
            faults.append(f"{number}: the index does not say what the equation states")
        faults += row_faults(number, items, tests)
    for fault in faults:
        print(fault, file=sys.stderr)
    return 1 if faults else 0


if __name__ == "__main__":
    raise SystemExit(main())
