"""The documentation as a reader uses it: every block runs, and every public name is there."""

import re
import sys
from pathlib import Path

import pytest

import pages
import tactid
from tactid._documents.finding_schemas import (
    calibration_finding_schema,
    fault_kinds,
    finding_schema,
    kinds_of,
)

REFERENCE = pages.ROOT / "docs" / "reference"
RUN = [page for page in pages.PAGES if any(block.runs for block in pages.blocks(page))]


@pytest.fixture(scope="session")
def runner(tmp_path_factory: pytest.TempPathFactory) -> pages.Runner:
    return pages.Runner(tmp_path_factory.mktemp("pages"))


@pytest.mark.parametrize("page", RUN, ids=[str(page.relative_to(pages.ROOT)) for page in RUN])
def test_the_blocks_of_a_page_run(page: Path, runner: pages.Runner) -> None:
    runner.run(page)


def test_every_block_is_of_a_known_kind() -> None:
    for page in pages.PAGES:
        found = pages.blocks(page)
        assert page.read_text().count("```") == 2 * len(found), f"{page}: a block is indented"
        for block in found:
            assert block.language in {*pages.RUN, *pages.SHOWN}, block.place


def test_rustdoc_runs_the_pages_with_rust() -> None:
    listed = (pages.ROOT / "tests" / "rust" / "lib.rs").read_text()
    for page in pages.PAGES:
        if any(block.language == "rust" for block in pages.blocks(page)):
            name = page.relative_to(pages.ROOT).as_posix()
            assert f'include_str!("../../{name}")' in listed, f"{name} is not in tests/rust/lib.rs"


def test_every_public_name_is_in_the_reference() -> None:
    text = "\n".join(page.read_text() for page in REFERENCE.glob("*.md"))
    shown = set(re.findall(r"^::: tactid\.(\w+)$", text, re.MULTILINE))
    assert shown == set(tactid.__all__)


def test_every_finding_and_every_fault_is_explained() -> None:
    rows = re.findall(r"^\| (`.*?`) \|", (REFERENCE / "findings.md").read_text(), re.MULTILINE)
    explained = {name for row in rows for name in re.findall(r"`(\w+)`", row)}
    of_calibration = kinds_of(calibration_finding_schema())
    assert explained == {*kinds_of(finding_schema()), *of_calibration, *fault_kinds()}


def test_the_data_of_every_finding_are_in_the_reference() -> None:
    sys.path.insert(0, str(pages.ROOT / "docs" / "tools"))
    from schema_tables import finding_table

    table = finding_table(tactid.result_schema())
    for each in tactid.result_schema()["$defs"]["Finding"]["oneOf"]:
        (row,) = (
            line
            for line in table.splitlines()
            if f"`{each['properties']['kind']['const']}`" in line
        )
        assert all(
            f"`{key}`" in row for key in each["required"] if key not in ("kind", "severity", "text")
        ), row
    assert "<!-- findings -->" in (REFERENCE / "findings.md").read_text()


@pytest.mark.parametrize(
    ("expected", "printed", "same"),
    [
        ("a\n", "a  \n\n", True),
        ("a\n", "b\n", False),
        ("in ... s\n", "in 1.6 s\n", True),
        ("1\n...\n4\n", "1\n2\n3\n4\n", True),
        ("1\n", "1\n2\n", False),
        ("1.25 kg", "1.27 kg", True),
        ("1.25 kg", "1.28 kg", False),
        ("1.1e-05", "1.2e-05", True),
        ("1.1e-05", "1.1e-02", False),
        ("1.1e-05", "1.1e+05", False),
        ("100.00 kg", "100.03 kg", False),
        ("-1", "1", False),
        ("1", "-1", False),
        ("-0.01", "0.01", False),
        ("0.01", "-0.01", False),
        ("3 windows", "4 windows", False),
        ("tool0", "tool2", False),
        ("joint_1.25", "joint_1.26", False),
        ("version 0.1.0", "version 0.1.1", False),
        ("1.25 kg", "1.250 kg", False),
        ("1.25 kg", "1.2 kg", False),
        ("[1.25, -2.50]", "[1.26, -2.51]", True),
    ],
)
def test_what_an_output_may_differ_in(expected: str, printed: str, same: bool) -> None:
    assert pages.matches(expected, printed) == same
