"""The code blocks of a Markdown page, and how a reader would run them: in order, in one folder.

- A block with a file's name as its title is saved under that name.
- Other blocks in ``python`` run in one namespace a page, and blocks in ``sh`` with ``bash -e``.
- A block in ``text`` with the title ``Output`` shows what the block above it prints. A number with
  decimals may differ by two units of its last digit, as it does from one processor to another; all
  else is the same, and ``...`` stands for what differs from run to run.
- ``<!-- continues: PAGE -->`` begins in a copy of the folder that another page leaves behind.
- ``<!-- not run: REASON -->`` above a block leaves it out.

Rust is run by rustdoc: see ``tests/rust/lib.rs``; C++ by ``crates/capi/tests/programs.rs``. After a
change of what is printed, ``python tests/python/pages.py PAGE...`` writes the outputs anew.
"""

import contextlib
import io
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]

RUN = ("python", "sh")
SHOWN = ("text", "csv", "toml", "xml", "json", "rust", "cpp", "cmake", "math")
OUTPUT = "Output"

FENCE = re.compile(
    r"^(?:<!-- not run: (?P<reason>[^\n]+) -->\n+)?"
    r'```(?P<language>\w*)(?: title="(?P<title>[^"\n]+)")?\n'
    r"(?P<text>.*?)^```$",
    re.MULTILINE | re.DOTALL,
)
CONTINUES = re.compile(r"^<!-- continues: (\S+) -->$", re.MULTILINE)


@dataclass(frozen=True)
class Block:
    """A fenced block of a page."""

    place: str
    """Page and line, as an editor takes them."""
    language: str
    title: str | None
    text: str
    reason: str | None
    """Why it does not run; None where it does."""
    span: tuple[int, int]
    """Where its text stands in the page."""

    @property
    def runs(self) -> bool:
        """Whether a reader would type it."""
        return self.language in RUN and self.title is None and self.reason is None


def blocks(page: Path) -> list[Block]:
    """Returns the fenced blocks of a page, in order."""
    text = page.read_text(encoding="utf-8")
    return [
        Block(
            f"{page.relative_to(ROOT)}:{text.count(chr(10), 0, found.start('language')) + 1}",
            found["language"],
            found["title"],
            found["text"],
            found["reason"],
            found.span("text"),
        )
        for found in FENCE.finditer(text)
    ]


def beginning(page: Path) -> Path | None:
    """Returns the page that this one continues."""
    found = CONTINUES.search(page.read_text(encoding="utf-8"))
    return None if found is None else (page.parent / found[1]).resolve()


class Runner:
    """Runs pages in folders below one folder, each page once."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._done: dict[Path, Path] = {}

    def run(self, page: Path) -> Path:
        """Runs a page, after the page that it continues, and returns the folder it leaves."""
        if page not in self._done:
            for block, printed in self.outputs(page):
                if not matches(block.text, printed):
                    raise AssertionError(
                        f"{block.place}: expected\n{block.text}\nbut got\n{printed}"
                    )
        return self._done[page]

    def outputs(self, page: Path) -> Iterator[tuple[Block, str]]:
        """Runs a page, and yields each output that it shows with what was printed."""
        folder = self._folder / str(page.relative_to(ROOT)).replace("/", "-")
        before = beginning(page)
        if before is None:
            folder.mkdir(parents=True)
        else:
            shutil.copytree(self.run(before), folder)
        names: dict[str, Any] = {"__name__": page.stem}
        printed = ""
        for block in blocks(page):
            if block.runs:
                printed = run_block(block, folder, names)
            elif block.title == OUTPUT:
                yield block, printed
            elif block.title is not None and block.reason is None:
                (folder / block.title).write_text(block.text, encoding="utf-8")
        self._done[page] = folder


def run_block(block: Block, folder: Path, names: dict[str, Any]) -> str:
    """Runs a block, and returns what it prints."""
    if block.language == "sh":
        return run_shell(block, folder)
    printed, before = io.StringIO(), Path.cwd()
    os.chdir(folder)
    try:
        with contextlib.redirect_stdout(printed):
            exec(compile(block.text, block.place, "exec"), names)
    finally:
        os.chdir(before)
    return printed.getvalue()


def run_shell(block: Block, folder: Path) -> str:
    """Runs a block in bash, with the commands of this Python's environment first."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(
        ["bash", "-e", "-o", "pipefail", "-c", block.text],
        cwd=folder,
        env={**os.environ, "PATH": path, "PYTHONUNBUFFERED": "1"},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=120,
        check=False,
    )
    if done.returncode != 0:
        raise AssertionError(f"{block.place}: exit code {done.returncode}\n{done.stdout}")
    return done.stdout


def matches(expected: str, printed: str) -> bool:
    """Whether an output is the expected one, but for spaces and the last digits of decimals."""
    text = " ".join(expected.split())
    pattern = ".*?".join(map(as_pattern, text.split("...")))
    found = re.fullmatch(pattern, " ".join(printed.split()), re.DOTALL)
    if found is None:
        return False
    numbers = [number for part in text.split("...") for number in DECIMAL.findall(part)]
    pairs = zip(numbers, found.groups(), strict=True)
    return all(abs(float(one) - float(other)) <= tolerance(one) for one, other in pairs)


DECIMAL = re.compile(r"(?<![\w.])-?\d+\.\d+(?:e[-+]\d+)?(?!\.?\w)")
"""A number with decimals, which is part of no name and of no version."""


def as_pattern(text: str) -> str:
    """Returns a pattern for a text, with a group for each number with decimals.

    The group has the sign, the number of decimals and, if there is one, the exponent's sign.
    """
    words, pattern, end = DECIMAL.finditer(text), "", 0
    for word in words:
        sign = "-" if word[0].startswith("-") else ""
        mantissa, _, exponent = word[0].partition("e")
        decimals = len(mantissa.partition(".")[2])
        power = rf"e{re.escape(exponent[0])}\d+" if exponent else ""
        pattern += re.escape(text[end : word.start()])
        pattern += rf"((?<!-){sign}\d+\.\d{{{decimals}}}{power})(?!\d)"
        end = word.end()
    return pattern + re.escape(text[end:])


def tolerance(number: str) -> float:
    """Returns by how much a number may differ: two units of its last digit."""
    mantissa, _, exponent = number.partition("e")
    # A little more, because neither number is exact in binary.
    return 2.1 * 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))


def trimmed(text: str) -> str:
    """Returns the text without space at the ends of its lines, and without empty lines around."""
    return "\n".join(line.rstrip() for line in text.splitlines()).strip("\n")


def update(page: Path, runner: Runner) -> None:
    """Writes the outputs of a page anew where they do not match."""
    found = [(b, printed) for b, printed in runner.outputs(page) if not matches(b.text, printed)]
    text = page.read_text(encoding="utf-8")
    for block, printed in reversed(found):
        start, end = block.span
        text = f"{text[:start]}{trimmed(printed)}\n{text[end:]}"
    page.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as temporary:
        shared = Runner(Path(temporary))
        for name in sys.argv[1:]:
            update(Path(name).resolve(), shared)
