"""Checks the structure of the source: sizes of files and functions, circles, forgotten tests.

Run by ``make lint``; prints each violation with its place and exits with 1 if there is any.
Rust is read as text that rustfmt has formatted, Python by its syntax tree.

Two modules form a circle where code of each names something that the other defines. At each level
of the tree of modules, a module counts with everything below it, so that ``a::x -> b::y`` and
``b::z -> a::w`` are a circle of ``a`` and ``b``, although no two files are. Code below a module may
name what the module itself defines, and the module what is defined below it.
Re-exports define nothing: a path through one leads to the definition. Code for tests does not
count.
"""

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple, TypeVar

ROOT = Path(__file__).parents[2]
CRATES = ROOT / "crates"
PACKAGE = CRATES / "pyid" / "python"

MOST_FILE_LINES = 450
MOST_FUNCTION_LINES = 60

Module = tuple[str, ...]
"""The path of a module in its crate: () for ``lib.rs``."""


def main() -> int:
    """Prints the violations and returns the exit code."""
    violations = [*sizes(), *unused_tests(), *circles()]
    for violation in violations:
        print(violation)
    return 1 if violations else 0


def sizes() -> Iterator[str]:
    """Files and functions that are too long."""
    for path in sorted(CRATES.rglob("*")):
        if path.suffix in {".rs", ".py", ".pyi"}:
            text = path.read_text(encoding="utf-8")
            place = path.relative_to(ROOT)
            if text.count("\n") > MOST_FILE_LINES:
                yield f"{place}: {text.count(chr(10))} lines, at most {MOST_FILE_LINES}"
            functions = rust_functions(text) if path.suffix == ".rs" else python_functions(text)
            for name, line, length in functions:
                if length > MOST_FUNCTION_LINES:
                    limit = f"at most {MOST_FUNCTION_LINES}"
                    yield f"{place}:{line}: {name} has {length} lines, {limit}"


def unused_tests() -> Iterator[str]:
    """Files of integration tests that the test program of their crate leaves out."""
    for program in sorted(CRATES.glob("*/tests/main.rs")):
        named = re.findall(r"^mod (\w+);", program.read_text(encoding="utf-8"), re.MULTILINE)
        for path in sorted(program.parent.glob("*.rs")):
            if path.stem not in {"main", *named}:
                yield f"{path.relative_to(ROOT)}: no `mod {path.stem};` in main.rs beside it"


FUNCTION = re.compile(
    r"(\s*)(?:pub(?:\([a-z ]+\))? )?(?:(?:const|async|unsafe|extern \"[^\"]*\") )*fn (\w+)"
)


def rust_functions(text: str) -> Iterator[tuple[str, int, int]]:
    """Name, line and length of each function: it ends where its indentation comes again."""
    lines = text.splitlines()
    for start, line in enumerate(lines):
        found = FUNCTION.match(line)
        if found is None:
            continue
        indent = found.group(1)
        for end in range(start, len(lines)):
            if lines[end] == f"{indent}}}" or (end == start and line.endswith("}")):
                yield found.group(2), start + 1, end - start + 1
                break
            is_end = end == start or lines[end].startswith(f"{indent})")
            if is_end and lines[end].endswith(";"):
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
    """Files and modules that import each other, directly or through others."""
    for crate in sorted(CRATES.iterdir()):
        source = crate / "src"
        files, imports = rust_imports(source)
        yield from file_circles(files, imports)
        yield from module_circles(str(source.relative_to(ROOT)), imports)
    files, imports = python_imports()
    yield from file_circles(files, imports)
    yield from module_circles(str(PACKAGE.relative_to(ROOT)), imports)


Imports = dict[Module, set[Module]]
"""Which module names what which other modules define."""


def file_circles(files: dict[Module, Path], imports: Imports) -> Iterator[str]:
    """Files that import each other; a child may import its parent."""
    edges = {
        files[module]: {files[other] for other in others if other != module[:-1]}
        for module, others in imports.items()
    }
    for group in strongly_connected(edges):
        names = ", ".join(str(path.relative_to(ROOT)) for path in sorted(group))
        yield f"files that import each other: {names}"


def module_circles(place: str, imports: Imports) -> Iterator[str]:
    """Modules of one parent that import each other, each with everything below it."""
    levels: dict[Module, dict[str, set[str]]] = {}
    for module, others in imports.items():
        for other in others:
            shared = next(
                (k for k, (a, b) in enumerate(zip(module, other, strict=False)) if a != b), None
            )
            if shared is not None:  # None: one is above the other
                below = levels.setdefault(module[:shared], {})
                below.setdefault(module[shared], set()).add(other[shared])
                below.setdefault(other[shared], set())
    for parent, edges in sorted(levels.items()):
        for group in strongly_connected(edges):
            where = "::".join((place, *parent))
            yield f"{len(group)} modules of {where} import each other: {', '.join(sorted(group))}"


def rust_imports(source: Path) -> tuple[dict[Module, Path], Imports]:
    """The files of a crate's modules, and which of them names items that which other defines."""
    files = {module_of(path, source): path for path in source.rglob("*.rs")}
    codes = {module: code_of(path.read_text(encoding="utf-8")) for module, path in files.items()}
    tests = {(*module, name) for module, code in codes.items() for name in code.test_modules}
    texts = {
        module: code.text
        for module, code in codes.items()
        if not any(module[:k] in tests for k in range(len(module) + 1))
    }
    imports: Imports = {module: set() for module in texts}
    for module, text in texts.items():
        for target in paths_in(text, module):
            found = definition(target, texts)
            if found is not None and found != module:
                imports[module].add(found)
    return files, imports


def module_of(path: Path, source: Path) -> Module:
    """The module's path in its crate: () for lib.rs."""
    parts = list(path.relative_to(source).with_suffix("").parts)
    if parts[-1] in {"lib", "mod", "main"}:
        parts.pop()
    return tuple(parts)


class Code(NamedTuple):
    """What a file of Rust compiles to outside of tests."""

    text: str
    """The code without comments, literals and items for tests."""
    test_modules: list[str]
    """The modules in files of their own that are declared for tests alone."""


NO_CODE = re.compile(
    r"""//[^\n]*|/\*.*?\*/|r(#*)".*?"\1|"(?:\\.|[^"\\])*"|'(?:\\.[^']*|[^'\\])'""", re.DOTALL
)
"""Comments and literals of texts and characters."""

FOR_TESTS = re.compile(r"#\[cfg\((?:all\()?test\b[^\]]*\]\s*")


def code_of(text: str) -> Code:
    """Returns the code of a file, without the items that ``#[cfg(test)]`` stands above."""
    text = NO_CODE.sub("", text)
    test_modules = []
    while (found := FOR_TESTS.search(text)) is not None:
        declared = re.compile(r"(?:#\[[^\]]*\]\s*)*mod (\w+);").match(text, found.end())
        if declared is not None:
            test_modules.append(declared[1])
        text = text[: found.start()] + text[end_of_item(text, found.end()) :]
    return Code(text, test_modules)


def end_of_item(text: str, start: int) -> int:
    """The end of an item: its semicolon, or the brace that closes its first block."""
    depth = 0
    for end in range(start, len(text)):
        if text[end] in "([{":
            depth += 1
        elif text[end] in ")]}":
            depth -= 1
        if depth == 0 and (text[end] == "}" or text[end] == ";"):
            # A group of imports closes before its semicolon.
            is_use = re.match(r"(?:pub(?:\([a-z ]+\))? )?use ", text[start:]) is not None
            if text[end] == ";" or not is_use:
                return end + 1
    return len(text)


def paths_in(text: str, module: Module) -> Iterator[Module]:
    """All paths that begin with crate, super or self, groups in braces spread out."""
    for found in re.finditer(r"\b(crate|super|self)((?:::\w+)*)(::\{)?", text):
        group = group_at(text, found.end() - 1) if found.group(3) else None
        if found.group(1) == "self" and not (found.group(2) or group):
            continue
        start = tuple(part for part in found.group(0).rstrip("{").split("::") if part)
        for tail in spread(group) if group else [()]:
            path = absolute((*start, *tail), module)
            if path is not None:
                yield path


def absolute(path: Module, module: Module) -> Module | None:
    """Returns a path in a module as one from the root of the crate; None for another crate's."""
    if path[0] == "crate":
        return path[1:]
    if path[0] == "self":
        return (*module, *path[1:])
    while path and path[0] == "super":
        if not module:
            return None
        module, path = module[:-1], path[1:]
    return (*module, *path)


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


def definition(target: Module, texts: dict[Module, str], depth: int = 0) -> Module | None:
    """The module that defines what a path names."""
    known = next((target[:k] for k in range(len(target), -1, -1) if target[:k] in texts), None)
    if known is None or known == target or depth > 5:
        return known
    name, rest = target[len(known)], target[len(known) + 1 :]
    # What a module imports, a module below it can name through it, also where it is no re-export.
    for imported in re.finditer(r"\buse ([^;]+);", texts[known]):
        for path in spread("{" + imported.group(1) + "}"):
            # The path of another crate begins with no module of this one.
            is_here = (
                path[:1] in {("crate",), ("self",), ("super",)} or (*known, *path[:1]) in texts
            )
            inner = absolute(path, known) if path[-1:] == (name,) and is_here else None
            if inner is not None and inner != (*known, name):
                return definition((*inner, *rest), texts, depth + 1)
    return known


def python_imports() -> tuple[dict[Module, Path], Imports]:
    """The files of the Python package, and which imports which other, also within functions."""
    files: dict[Module, Path] = {}
    for path in [*PACKAGE.rglob("*.py"), *PACKAGE.rglob("*.pyi")]:
        parts = path.relative_to(PACKAGE).with_suffix("").parts
        files[parts[:-1] if parts[-1] == "__init__" else parts] = path
    imports: Imports = {module: set() for module in files}
    for module, path in files.items():
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names: list[str] = []
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom) and node.module:
                whole = [f"{node.module}.{alias.name}" for alias in node.names]
                names = [name if tuple(name.split(".")) in files else node.module for name in whole]
            found = {tuple(name.split(".")) for name in names}
            imports[module] |= found & files.keys() - {module}
    return files, imports


Node = TypeVar("Node", Path, str)


def strongly_connected(edges: dict[Node, set[Node]]) -> Iterator[set[Node]]:
    """Groups of more than one node that reach each other."""
    reach = {start: reachable(start, edges) for start in edges}
    done: set[Node] = set()
    for start in sorted(edges):
        group = {other for other in reach[start] if start in reach[other]}
        if start not in done and len(group) > 1:
            done |= group
            yield group


def reachable(start: Node, edges: dict[Node, set[Node]]) -> set[Node]:
    """All nodes that edges lead to from one, through others, too."""
    found: set[Node] = set()
    open_ends = [start]
    while open_ends:
        for node in edges.get(open_ends.pop(), ()):
            if node not in found:
                found.add(node)
                open_ends.append(node)
    return found


if __name__ == "__main__":
    sys.exit(main())
