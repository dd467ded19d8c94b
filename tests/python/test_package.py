"""The package as it is installed: its example runs, and its stubs are those of the binary."""

import ast
import dataclasses
import doctest
import inspect
import subprocess
import sys
from graphlib import TopologicalSorter
from importlib import metadata
from pathlib import Path

import pytest

import pages
import tactid
from tactid._results import records

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib  # pytest needs it there, too

PACKAGE = Path(tactid.__file__).parent
ROOT = Path(__file__).parents[2]
FOLDERS = [
    "_base",
    "_view",
    "_options",
    "_read",
    "_results",
    "_show",
    "_documents",
    "_api",
    "_fleet",
    "_live",
    "_ros",
    "_cli",
]
"""The folders of the package: each imports the ones before it."""


def test_the_packages_example_runs() -> None:
    outcome = doctest.testmod(tactid)
    assert outcome.attempted > 5
    assert outcome.failed == 0


def toml_blocks(page: str) -> list[str]:
    found = pages.blocks(ROOT / "docs" / page)
    return [block.text for block in found if block.language == "toml"]


def test_the_tutorials_manifest_has_the_workspaces_versions() -> None:
    """What a controller's Cargo.toml needs is what the workspace says of itself."""
    (manifest,) = map(tomllib.loads, toml_blocks("tutorials/controller.md"))
    workspace = tomllib.loads((ROOT / "Cargo.toml").read_text())["workspace"]
    crate = manifest["dependencies"]["tactid-identify"]
    assert crate["version"] == workspace["package"]["version"]
    assert (ROOT / crate["path"].removeprefix("../tactid/")).is_dir()
    assert manifest["dependencies"]["nalgebra"] == workspace["dependencies"]["nalgebra"]
    for key in ("edition", "rust-version"):
        assert manifest["package"][key] == workspace["package"][key]


def test_the_experiment_with_an_own_robot_is_one() -> None:
    (experiment,) = (text for text in toml_blocks("formats/experiment.md") if "arm.urdf" in text)
    assert tactid.Experiment.from_toml(experiment).base == "fixed"


def test_the_version_is_the_distributions() -> None:
    assert tactid.__version__ == metadata.version("tactid")
    assert Path(tactid.__file__).with_name("py.typed").exists()


def test_everything_public_says_what_it_is() -> None:
    for name in tactid.__all__:
        thing = getattr(tactid, name)
        if not callable(thing):
            continue
        assert thing.__doc__, name
        members = vars(thing).items() if isinstance(thing, type) else ()
        plain = {field.name for field in dataclasses.fields(thing)} if is_data(thing) else set()
        for member, value in members:
            if not member.startswith("_") and not isinstance(value, str) and member not in plain:
                assert value.__doc__, f"{name}.{member}"


def is_data(thing: object) -> bool:
    return isinstance(thing, type) and dataclasses.is_dataclass(thing)


def test_every_field_of_a_result_says_what_it_is() -> None:
    """Those of the crates have one in their schema, others a string below them in the source."""
    for name, schema in records.SCHEMAS.items():
        for key, part in schema.get("properties", {}).items():
            text = "." if name.startswith("TenValues_") else part.get("description", "")
            assert text.endswith("."), f"{name}: {key}"
    public = [getattr(tactid, name) for name in tactid.__all__]
    own = [each for each in public if is_data(each) and each is not tactid.Options]
    for thing in (each for each in own if each.__module__ != records.__name__):
        (body,) = ast.parse(inspect.getsource(thing)).body
        assert isinstance(body, ast.ClassDef)
        below = dict(zip(body.body, body.body[1:], strict=False))
        for field in (each for each in body.body if isinstance(each, ast.AnnAssign)):
            text = below.get(field)
            assert isinstance(text, ast.Expr), f"{thing.__name__}: {ast.unparse(field)}"
            assert isinstance(text.value, ast.Constant)
            assert str(text.value.value).strip().endswith("."), ast.unparse(text)
    for thing in own:
        for each in dataclasses.fields(thing):
            assert f"\n    {each.name}: " in thing.__doc__, f"{thing.__name__}: {each.name}"


def test_no_file_imports_another_in_a_circle() -> None:
    """`import tactid` in a file of the package would be a circle through `__init__.py`."""
    modules = {
        ".".join(("tactid", *path.relative_to(PACKAGE).with_suffix("").parts)): path
        for path in PACKAGE.rglob("*.py")
    }
    modules = {name.removesuffix(".__init__"): path for name, path in modules.items()}
    known = {*modules, "tactid._native"}
    imported: dict[str, set[str]] = {name: set() for name in modules}
    for name, path in modules.items():
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                imported[name] |= {each.name for each in node.names} & known
            elif isinstance(node, ast.ImportFrom) and node.module in known:
                below = {f"{node.module}.{each.name}" for each in node.names}
                imported[name] |= below & known
                if not below <= known:
                    imported[name].add(str(node.module))
    order = list(TopologicalSorter(imported).static_order())  # raises where there is a circle
    assert set(order) >= modules.keys()
    for name, used in imported.items():
        places = [FOLDERS.index(each.split(".")[1]) for each in used if each.count(".") > 1]
        if name.count(".") > 1:
            assert max(places, default=0) <= FOLDERS.index(name.split(".")[1]), name


def test_the_package_lists_public_names_only() -> None:
    assert dir(tactid) == sorted(tactid.__all__)
    modules = {name for name, thing in vars(tactid).items() if inspect.ismodule(thing)}
    assert all(name.startswith("_") for name in modules), modules


def output_of(program: str) -> str:
    """Returns what a fresh interpreter prints."""
    command = [sys.executable, "-c", program]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def test_a_name_is_imported_when_it_is_used() -> None:
    loaded = "print('numpy' in sys.modules)"
    program = f"import sys, tactid; {loaded}; tactid.identify; {loaded}"
    assert output_of(program).split() == ["False", "True"]
    assert output_of("import tactid; print(hasattr(tactid, 'identity'))").split() == ["False"]


def test_results_have_their_methods_whatever_was_imported() -> None:
    made = "print(records.CLASSES['PayloadEstimate'].__module__)"
    program = f"from tactid._results import records; {made}"
    assert output_of(program).strip() == "tactid._results.payload"


def test_a_result_is_made_when_it_is_first_used() -> None:
    """A class of data takes longer to make than to describe, and a command uses a few of many."""
    program = (
        "import tactid; tactid.PayloadEstimate; from tactid._results.records import CLASSES;"
        "print('ActiveReport' in CLASSES, CLASSES['ActiveReport'] is tactid.ActiveReport)"
    )
    assert output_of(program).split() == ["False", "True"]


def test_a_traceback_names_no_internal_module() -> None:
    public = (getattr(tactid, name) for name in tactid.__all__)
    errors = [thing for thing in public if inspect.isclass(thing)]
    for error in (each for each in errors if issubclass(each, tactid.TactidError)):
        assert error.__module__ == "tactid"


def test_the_stub_of_the_results_is_that_of_their_schemas() -> None:
    """``python docs/tools/record_stub.py`` writes it."""
    sys.path.insert(0, str(Path(__file__).parents[2] / "docs" / "tools"))
    from record_stub import PATH, stub

    assert PATH.read_text(encoding="utf-8") == stub()


@pytest.mark.parametrize("module", ["tactid._native"])
def test_the_stubs_are_those_of_the_binary(module: str, tmp_path: Path) -> None:
    # The names themselves are compared one by one.
    allowed = tmp_path / "allowed"
    allowed.write_text(f"{module}.__all__\n")
    done = subprocess.run(
        [sys.executable, "-m", "mypy.stubtest", "--allowlist", str(allowed), module],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
