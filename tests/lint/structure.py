"""Checks the structure of the source: sizes of files and functions, and circles of imports.

Run by ``make lint``; prints each violation with its place and exits with 1 if there is any.
Rust is read as text that rustfmt has formatted, Python by its syntax tree.
"""

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
CRATES = ROOT / "crates"
PACKAGE = CRATES / "pyid" / "python"

MOST_FILE_LINES = 450
MOST_FUNCTION_LINES = 60
SIZED = ("calibrate", "excitation", "identify", "nlms", "pyid", "recordings")
"""Crates whose files and functions have these limits."""

Edges = dict[Path, set[Path]]


def main() -> int:
    """Prints the violations and returns the exit code."""
    violations = [*sizes(), *circles()]
    for violation in violations:
        print(violation)
    return 1 if violations else 0


def sizes() -> Iterator[str]:
    """Files and functions that are too long."""
    for crate in SIZED:
        for path in sorted((CRATES / crate).rglob("*")):
            if path.suffix not in {".rs", ".py", ".pyi"}:
                continue
            text = path.read_text(encoding="utf-8")
            place = path.relative_to(ROOT)
            if text.count("\n") > MOST_FILE_LINES:
                yield f"{place}: {text.count(chr(10))} lines, at most {MOST_FILE_LINES}"
            functions = rust_functions(text) if path.suffix == ".rs" else python_functions(text)
            for name, line, length in functions:
                if length > MOST_FUNCTION_LINES:
                    limit = f"at most {MOST_FUNCTION_LINES}"
                    yield f"{place}:{line}: {name} has {length} lines, {limit}"


def rust_functions(text: str) -> Iterator[tuple[str, int, int]]:
    """Name, line and length of each function: it ends where its indentation comes again."""
    lines = text.splitlines()
    for start, line in enumerate(lines):
        found = re.match(r"(\s*)(?:pub(?:\([a-z]+\))? )?(?:const )?fn (\w+)", line)
        if found is None:
            continue
        indent = found.group(1)
        for end in range(start, len(lines)):
            if lines[end] == f"{indent}}}" or (end == start and line.endswith("}")):
                yield found.group(2), start + 1, end - start + 1
                break
            if lines[end].startswith(indent) and lines[end].endswith(";") and end == start:
                break  # a declaration without a body


def python_functions(text: str) -> Iterator[tuple[str, int, int]]:
    """Name, line and length of each function, its docstring not counted."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            first, last = node.lineno, node.end_lineno or node.lineno
            doc = node.body[0]
            is_doc = isinstance(doc, ast.Expr) and isinstance(doc.value, ast.Constant)
            doc_lines = (doc.end_lineno or doc.lineno) - doc.lineno + 1 if is_doc else 0
            yield node.name, first, last - first + 1 - doc_lines


def circles() -> Iterator[str]:
    """Files that import each other, directly or through others."""
    trees = [rust_edges(crate / "src") for crate in sorted(CRATES.iterdir())]
    for edges in [*trees, python_edges()]:
        for group in strongly_connected(edges):
            names = ", ".join(str(path.relative_to(ROOT)) for path in sorted(group))
            yield f"files that import each other: {names}"


def rust_edges(source: Path) -> Edges:
    """Which file of a crate names items of which other, re-exports followed to their definition."""
    files = {module_of(path, source): path for path in source.rglob("*.rs")}
    texts = {module: code_of(path) for module, path in files.items()}
    edges: Edges = {path: set() for path in files.values()}
    for module, text in texts.items():
        for target in paths_in(text, module):
            found = definition(target, files, texts)
            # A child module may use its parent; so may unit tests in a file of their own.
            if found not in {None, module} and found != module[:-1] and module[-1:] != ("tests",):
                edges[files[module]].add(files[found])
    return edges


def module_of(path: Path, source: Path) -> tuple[str, ...]:
    """The module's path in its crate: () for lib.rs."""
    parts = list(path.relative_to(source).with_suffix("").parts)
    if parts[-1] in {"lib", "mod", "main"}:
        parts.pop()
    return tuple(parts)


def code_of(path: Path) -> str:
    """The text without comments, strings and the unit tests at its end."""
    text = path.read_text(encoding="utf-8").split("#[cfg(test)]\nmod tests", maxsplit=1)[0]
    return re.sub(r'//[^\n]*|"(?:\\.|[^"\\])*"', "", text)


def paths_in(text: str, module: tuple[str, ...]) -> Iterator[tuple[str, ...]]:
    """All paths that begin with crate or super, groups in braces spread out."""
    for found in re.finditer(r"\b(crate|super|self)((?:::\w+)*)(::\{)?", text):
        base: tuple[str, ...] = ()
        group = group_at(text, found.end() - 1) if found.group(3) else None
        rest = [part for part in found.group(2).split("::") if part]
        if found.group(1) == "self" and not text[: found.start()].endswith("use "):
            continue
        if found.group(1) != "crate":
            base = module if found.group(1) == "self" else module[:-1]
            while rest and rest[0] == "super":
                base, rest = base[:-1], rest[1:]
        for tail in spread(group) if group else [()]:
            yield (*base, *rest, *tail)


def group_at(text: str, start: int) -> str:
    """The group whose opening brace stands at a place, with its braces."""
    depth = 0
    for end in range(start, len(text)):
        depth += (text[end] == "{") - (text[end] == "}")
        if depth == 0:
            return text[start : end + 1]
    return "{}"


def spread(group: str) -> Iterator[tuple[str, ...]]:
    """The paths of a group in braces."""
    inner, depth, start = group[1:-1], 0, 0
    pieces = []
    for k, character in enumerate(f"{inner},"):
        depth += (character == "{") - (character == "}")
        if character == "," and depth == 0:
            pieces.append(inner[start:k].strip())
            start = k + 1
    for piece in filter(None, pieces):
        head, brace, tail = piece.partition("::{")
        names = tuple(head.split(" as ")[0].split("::"))
        for rest in spread("{" + tail) if brace else [()]:
            yield tuple(name for name in (*names, *rest) if name != "self")


def definition(
    target: tuple[str, ...],
    files: dict[tuple[str, ...], Path],
    texts: dict[tuple[str, ...], str],
    depth: int = 0,
) -> tuple[str, ...] | None:
    """The module that defines what a path names."""
    known = next((target[:k] for k in range(len(target), -1, -1) if target[:k] in files), None)
    if known is None or known == target or depth > 5:
        return known
    name = target[len(known)]
    for exported in re.finditer(r"pub(?:\([a-z]+\))? use ([^;]+);", texts[known]):
        for path in spread("{" + exported.group(1) + "}"):
            if path and path[-1] == name:
                inner = path[1:] if path[0] in {"self", "crate"} else path
                base = () if path[0] == "crate" else known
                return definition((*base, *inner), files, texts, depth + 1)
    return known


def python_edges() -> Edges:
    """Which file of the Python package imports which other, also within functions."""
    paths = [*PACKAGE.rglob("*.py"), *PACKAGE.rglob("*.pyi")]
    files = {path: path.relative_to(PACKAGE).with_suffix("") for path in paths}
    modules = {".".join(name.parts).removesuffix(".__init__"): path for path, name in files.items()}
    edges: Edges = {path: set() for path in files}
    for path in files:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names: list[str] = []
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom) and node.module:
                whole = [f"{node.module}.{alias.name}" for alias in node.names]
                names = [name if name in modules else node.module for name in whole]
            edges[path] |= {modules[name] for name in names if name in modules} - {path}
    return edges


def strongly_connected(edges: Edges) -> Iterator[set[Path]]:
    """Groups of more than one file that reach each other."""
    reach = {start: reachable(start, edges) for start in edges}
    done: set[Path] = set()
    for start in sorted(edges):
        group = {other for other in reach[start] if start in reach[other]}
        if start not in done and len(group) > 1:
            done |= group
            yield group


def reachable(start: Path, edges: Edges) -> set[Path]:
    """All files that a file imports, through others, too."""
    found: set[Path] = set()
    open_ends = [start]
    while open_ends:
        for path in edges.get(open_ends.pop(), ()):
            if path not in found:
                found.add(path)
                open_ends.append(path)
    return found


if __name__ == "__main__":
    sys.exit(main())
