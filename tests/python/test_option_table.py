"""The table of options is complete and up to date: keyword, command line, Rust field, source."""

import inspect
import re
import sys
from pathlib import Path

import tactid
from tactid._api.offline import FROM_ARRAYS
from tactid._options.arrays import ARRAYS
from tactid._options.options import OPTIONS

ROOT = Path(__file__).parents[2]
CRATES = ROOT / "crates"
PAGE = ROOT / "docs/reference/options.md"

sys.path.append(str(ROOT / "docs/tools"))

import option_table  # noqa: E402


def rust_fields(file: str, structure: str) -> set[str]:
    """The public fields of a Rust structure, as the table writes them."""
    text = (CRATES / file).read_text(encoding="utf-8")
    found = re.search(rf"pub struct {structure}(?:<.*?>)? \{{(.*?)\n\}}", text, re.S)
    assert found is not None, structure
    names = re.findall(r"^    pub (\w+):", found.group(1), re.M)
    return {f"{structure}::{name}" for name in names}


def names_in_table() -> set[str]:
    """Every name that the tables show as code."""
    rows = [line for line in option_table.page().splitlines() if line.startswith("|")]
    return set(re.findall(r"`([^`]+)`", "\n".join(rows)))


def test_the_table_is_up_to_date() -> None:
    hint = "docs/reference/options.md is out of date: run `python docs/tools/option_table.py`"
    assert PAGE.read_text(encoding="utf-8") == option_table.page(), hint


def test_every_field_of_rust_is_in_the_table() -> None:
    """The names are those of the keywords."""
    arrays = rust_fields("recordings/src/arrays/fields.rs", "Arrays")
    assert {*OPTIONS} <= names_in_table()
    assert {name.removeprefix("Arrays::") for name in arrays} <= names_in_table()
    # Python gives some options to types of their own.
    settings = rust_fields("identify/src/equations/settings.rs", "EquationSettings")
    settings |= rust_fields("recordings/src/paper/filter.rs", "PaperSettings")
    # The first keyword has a name that is a question, and several options set the others.
    fields = ("effort_content", "shared_noise_s", "subtracted", "unknowns", "unmeasured")
    settings -= {f"EquationSettings::{field}" for field in fields}
    assert {name.partition("::")[2] for name in settings} <= {*OPTIONS}


def test_every_field_of_rust_online_is_in_the_table() -> None:
    """A field in the table exists, and each one that exists is there."""
    sample = rust_fields("identify/src/equations/sample.rs", "Sample")
    base = rust_fields("identify/src/equations/sample.rs", "BaseState")
    # The base is in the table by what it contains.
    expected = sample - {"Sample::base"} | base
    listed = {name for name in names_in_table() if name.startswith(("Sample::", "BaseState::"))}
    assert listed == expected


def test_every_keyword_of_arrays_is_in_the_table() -> None:
    declared = {array.name for array in ARRAYS}
    pushed = set(inspect.signature(tactid.Identifier.push).parameters) - {"self"}
    assert pushed == declared
    assert {"time", *FROM_ARRAYS} == declared | {"robot", "sensors"}
    assert declared | {"robot", "sensors"} <= names_in_table()


def test_docstrings_list_every_array() -> None:
    for function in (tactid.identify, tactid.Identifier.push):
        documented = inspect.getdoc(function) or ""
        for array in ARRAYS[1:]:
            assert f" {array.name}: {array.text.split()[0]} " in documented
        assert "<arrays>" not in documented


def test_units_are_those_of_the_fields() -> None:
    """A field of Rust with a unit in its name has it in the table."""
    units = {"_s": "s", "_hz": "Hz", "_kg": "kg"}
    for option in OPTIONS.values():
        for suffix, unit in units.items():
            if option.name.endswith(suffix):
                assert option.unit == unit, option.name
