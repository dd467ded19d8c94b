"""Checks names and prose against the project's glossary: one standard term for one thing.

Run by ``make lint``; prints each violation with its place and the term to use, and exits with 1 if
there is any. Names are the words of identifiers in Rust and Python; prose is comments, strings and
Markdown.
"""

import re
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
FOLDERS = ("crates", "tests", "bench", "docs")
PAGES = ("README.md", "DESIGN.md", "Makefile", "Cargo.toml", "pyproject.toml")
SUFFIXES = {".rs", ".py", ".pyi", ".md", ".toml"}

NAMES = {
    "wanted": "target",
    "deviation": "std_dev",
    "deviations": "std_devs",
    "told": "reported",
    "tells": "reports",
    "judged": "robust weight",
    "surprise": "innovation",
    "alike": "correlated",
    "dirt": "faults",
    "bare": "unloaded",
    "pulse": "interruption check",
}
"""Words that no identifier has, and what to say instead."""

WHOLE_NAMES = {
    "way": "method",
    "ways": "methods",
    "Way": "Method",
    "WAYS": "METHODS",
    "turn_in": "update_square_root",
    "Front": "EquationStream",
}
"""Identifiers that do not exist as a whole; as a word of others they may."""

FRACTIONS = ("crates/identify/", "crates/batch/", "crates/nlms/", "crates/recordings/src/")
"""Where the identifier ``part`` would mean a fraction; elsewhere it may be a piece of something."""

PROSE = {
    r"\b(tactile|effort|joint-sensing|combined) way\b": "method",
    r"\bwanted\b": "target",
    r"(?<!standard )(?<!absolute )(?<!standard\n)\bdeviations?\b(?! of the)": "standard deviation",
    r"\b(is|are|was|were|be) told\b": "is reported",
    r"\b(is|are|was|were) said\b": "is reported",
    r"\btells? apart\b": "distinguishes",
    r"\bdirt\b": "data faults",
    r"\bbare (recording|motion)\b": "unloaded recording",
    r"\banother payload\b": "payload change",
    r"\bpayload (is|being|was) another\b": "payload change",
    r"\ban eye on\b": "detects",
    r"\bturn(s|ed)? in(to the triangle)?\b": "square-root information update",
    r"\b(is|are|was|were|been) taken off\b": "is subtracted, is corrected",
    r"\btakes? off\b": "subtracts",
    r"\bunknown directions?\b": "unobservable direction",
    r"\bwhat is left (to do|of it)\b": "deferred, residual",
    r"\bnearest possible body\b": "projection onto physically consistent parameters",
}
"""Phrases of the private vocabulary that prose once had, and what to say instead."""


NO_CODE = r'"""(?:.|\n)*?"""|//[^\n]*|#(?![\[!])[^\n]*|"(?:\\(?:.|\n)|[^"\\\n])*"'
"""Docstrings, comments and strings."""


def main() -> int:
    """Prints the violations and returns the exit code."""
    violations = list(check())
    for violation in violations:
        print(violation)
    return 1 if violations else 0


def check() -> Iterator[str]:
    """Each violation with its place."""
    for path in sources():
        text = path.read_text(encoding="utf-8")
        is_code = path.suffix in {".rs", ".py", ".pyi"}
        found = [*names(text), *phrases(prose_of(text))] if is_code else [*phrases(text)]
        if path.relative_to(ROOT).as_posix().startswith(FRACTIONS) and is_code:
            found += [(n, w, "fraction or ratio") for n, w in identifiers(text) if w == "part"]
        for line, word, better in found:
            yield f"{path.relative_to(ROOT)}:{line}: `{word}`: say {better}"


def sources() -> Iterator[Path]:
    """All files that people write, but for this one."""
    for folder in FOLDERS:
        for path in sorted((ROOT / folder).rglob("*")):
            hidden = any(part in {"target", ".venv"} for part in path.parts)
            if path.suffix in SUFFIXES and not hidden and path != Path(__file__).resolve():
                yield path
    yield from (ROOT / page for page in PAGES)


def identifiers(text: str) -> Iterator[tuple[int, str]]:
    """All identifiers with their lines."""
    code = re.sub(NO_CODE, lambda found: "\n" * found.group().count("\n"), text)
    for number, line in enumerate(code.splitlines(), start=1):
        yield from ((number, identifier) for identifier in re.findall(r"[A-Za-z_]\w*", line))


def names(text: str) -> Iterator[tuple[int, str, str]]:
    """Identifiers with a word that has a better one."""
    for number, identifier in identifiers(text):
        whole = re.sub(r"standard_deviations?", "", identifier)
        words = re.findall(r"[A-Z]?[a-z0-9]+|[A-Z]+(?![a-z])", whole)
        found = next((word for word in words if word.lower() in NAMES), None)
        if found is not None:
            yield number, identifier, NAMES[found.lower()]
        elif identifier in WHOLE_NAMES:
            yield number, identifier, WHOLE_NAMES[identifier]


def prose_of(text: str) -> str:
    """The comments and strings of a source, each on its line."""
    prose, end = "", 0
    for found in re.finditer(NO_CODE, text):
        between = text[end : found.start()]
        # Comments that follow each other are one text; what stands between others ends a sentence.
        prose += "\n" * between.count("\n") + (" . " if between.strip() else "") + found.group()
        end = found.end()
    return prose


def phrases(text: str) -> Iterator[tuple[int, str, str]]:
    """Phrases that have a better one; they may run over the end of a line."""
    joined = re.sub(r"[ \t]*\n[ \t]*(?:///?!?|#|\*)?[ \t]*", "\x00", text)
    flat = joined.replace("\x00", " ")
    for pattern, better in PROSE.items():
        for found in re.finditer(pattern, flat, re.IGNORECASE):
            yield joined[: found.start()].count("\x00") + 1, found.group(), better


if __name__ == "__main__":
    sys.exit(main())
