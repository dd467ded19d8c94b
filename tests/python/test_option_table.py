"""The table of options is complete and up to date: keyword, command line, Rust field, source."""

import importlib.util
import inspect
import re
from dataclasses import fields
from pathlib import Path

import tactid
from tactid.declaration import Declaration
from tactid.offline import ARRAYS

ROOT = Path(__file__).parents[2]
CRATES = ROOT / "crates"


def rust_fields(file: str, structure: str) -> set[str]:
    """The public fields of a Rust structure, as the table writes them."""
    text = (CRATES / file).read_text(encoding="utf-8")
    found = re.search(rf"pub struct {structure}(?:<.*?>)? \{{(.*?)\n\}}", text, re.S)
    assert found is not None, structure
    names = re.findall(r"^    pub (\w+):", found.group(1), re.M)
    return {f"{structure}::{name}" for name in names}


def table() -> str:
    """The page as the script writes it now."""
    path = ROOT / "docs/option_table.py"
    spec = importlib.util.spec_from_file_location("option_table", path)
    assert spec is not None
    assert spec.loader is not None
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    page: str = script.page()
    return page


def test_the_table_is_up_to_date() -> None:
    hint = "docs/options.md is out of date: run `python docs/option_table.py`"
    assert (ROOT / "docs/options.md").read_text(encoding="utf-8") == table(), hint


def test_every_field_of_rust_is_in_the_table() -> None:
    """Those that contain others stand in the table by what they contain."""
    request = rust_fields("recordings/src/request.rs", "Request")
    contained = (
        rust_fields("recordings/src/request.rs", "Topics")
        | rust_fields("identify/src/solve/prior.rs", "KnownMass")
        | rust_fields("identify/src/paper/filter.rs", "PaperSettings")
    )
    declared = {
        name
        for option in fields(tactid.Options)
        for name in Declaration.of(option).rust_field.split(", ")
    }
    expected = request - {"Request::topics", "Request::known_mass"} | contained
    assert declared - {"Arrays::unloaded"} == expected
    arrays = rust_fields("recordings/src/arrays/fields.rs", "Arrays")
    assert {name for name in arrays if f"`{name}`" not in table()} == set()


def test_every_keyword_of_arrays_is_in_the_table() -> None:
    pushed = set(inspect.signature(tactid.Identifier.push).parameters) - {"self"}
    assert pushed <= {"time", *ARRAYS}
    assert all(f"| `{name}`" in table() for name in ("time", *ARRAYS))


def test_units_are_those_of_the_fields() -> None:
    """A field of Rust with a unit in its name has it in the table."""
    units = {"_s": "s", "_hz": "Hz", "_kg": "kg"}
    for option in fields(tactid.Options):
        declared = Declaration.of(option)
        for suffix, unit in units.items():
            if declared.rust_field.endswith(suffix):
                assert declared.unit == unit, option.name
