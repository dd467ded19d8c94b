"""The linter of the structure: which modules of a crate count as a circle."""

import sys
from collections.abc import Mapping
from pathlib import Path

import pytest

import pages

sys.path.insert(0, str(pages.ROOT / "tests" / "lint"))
import structure

CIRCLE = {
    "lib.rs": "mod a; mod b;",
    "a/mod.rs": "mod x; mod y;",
    "a/x.rs": "use crate::b::Z;",
    "a/y.rs": "pub(crate) struct Y;",
    "b.rs": "use crate::a::y::Y; pub(crate) struct Z;",
}
"""Two modules that name each other, and no two files that do."""


def _circles(folder: Path, files: Mapping[str, str]) -> list[str]:
    """Returns the circles of a crate."""
    for name, text in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    _, imports = structure.rust_imports(folder)
    return list(structure.module_circles("src", imports))


def test_modules_are_compared_with_everything_below_them(tmp_path: Path) -> None:
    assert _circles(tmp_path, CIRCLE) == ["2 modules of src import each other: a, b"]


def test_a_circle_below_a_module_is_found_at_its_level(tmp_path: Path) -> None:
    moved = {
        "lib.rs": "mod c;",
        "c/mod.rs": "mod a; mod b;",
        **{
            f"c/{name}": text.replace("crate::", "crate::c::")
            for name, text in CIRCLE.items()
            if name != "lib.rs"
        },
    }
    assert _circles(tmp_path, moved) == ["2 modules of src::c import each other: a, b"]


@pytest.mark.parametrize(
    ("name", "text"),
    [
        # Through a re-export, an import of the parent, a group, and a path in the code.
        ("b.rs", "use crate::a::Y; pub(crate) struct Z;"),
        ("b.rs", "use crate::{a::{x, y::Y as Why}}; pub(crate) struct Z;"),
        ("b.rs", "pub(crate) struct Z(crate::a::Y);"),
        ("b.rs", "pub(crate) struct Z(super::Y);"),
    ],
)
def test_a_path_leads_to_the_definition(name: str, text: str, tmp_path: Path) -> None:
    files = {
        **CIRCLE,
        "lib.rs": "mod a; mod b; use a::Y;",
        "a/mod.rs": "mod x; mod y; pub(crate) use y::Y;",
        name: text,
    }
    assert len(_circles(tmp_path, files)) == 1


@pytest.mark.parametrize(
    ("name", "text"),
    [
        # Tests, comments and texts count as nothing, and neither does what follows a test's brace.
        ("b.rs", "pub(crate) struct Z; #[cfg(test)] mod tests { use crate::a::y::Y; }"),
        ("b.rs", "#[cfg(test)] use crate::a::{y::Y}; pub(crate) struct Z;"),
        ("b.rs", "#[cfg(test)] #[allow(unused)] mod checks; pub(crate) struct Z;"),
        ("b.rs", "pub(crate) struct Z; // use crate::a::y::Y;"),
        ("b.rs", 'pub(crate) struct Z; const C: (&str, char) = (r#"crate::a"::y::Y"#, \'"\');'),
        # An item of the parent.
        ("b.rs", "use crate::a::Own; pub(crate) struct Z;"),
    ],
)
def test_what_is_no_import_makes_no_circle(name: str, text: str, tmp_path: Path) -> None:
    files = {**CIRCLE, name: text}
    if "checks" in text:
        files |= {"b/checks.rs": "use crate::a::y::Y;"}
    if "Own" in text:
        # A parent that declares its children and re-exports what stands elsewhere.
        files |= {
            "lib.rs": "mod a; mod b; mod c;",
            "a/mod.rs": "mod x; mod y; pub use crate::c::Own;",
        }
        files |= {"c.rs": "pub(crate) struct Own;"}
    assert _circles(tmp_path, files) == []


def test_code_below_the_tests_counts(tmp_path: Path) -> None:
    tests = "#[cfg(test)] mod tests { fn f() { '{'; '\\''; } }"
    text = f"{tests} use crate::a::y::Y; pub(crate) struct Z;"
    assert len(_circles(tmp_path, {**CIRCLE, "b.rs": text})) == 1


def test_a_child_may_name_its_parent(tmp_path: Path) -> None:
    files = {
        "lib.rs": "mod a; pub(crate) struct Root;",
        "a/mod.rs": "mod x; pub(crate) struct Own(x::X);",
        "a/x.rs": "use super::Own; use crate::Root; pub(crate) struct X;",
    }
    assert _circles(tmp_path, files) == []


@pytest.mark.parametrize(
    ("text", "lengths"),
    [
        ("pub(crate) async fn f() {\n    1\n}\n", {"f": 3}),
        ('unsafe extern "C" fn f() {\n    1\n}\n', {"f": 3}),
        ("trait T {\n    fn f(\n        a: u8,\n    );\n    fn g() {\n    }\n}\n", {"g": 2}),
    ],
)
def test_functions_are_measured(text: str, lengths: dict[str, int]) -> None:
    assert {name: length for name, _, length in structure.rust_functions(text)} == lengths
