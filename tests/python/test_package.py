"""The package as it is installed: its example runs, and its stubs are those of the binary."""

import doctest
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest

import tactid


def test_the_packages_example_runs() -> None:
    outcome = doctest.testmod(tactid)
    assert outcome.attempted > 5
    assert outcome.failed == 0


def test_the_readmes_examples_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    readme = (Path(__file__).parents[2] / "README.md").read_text()
    examples = [part.split("```")[0] for part in readme.split("```python\n")[1:]]
    assert examples
    monkeypatch.chdir(tmp_path)
    for example in examples:
        exec(compile(example, "README.md", "exec"), {})


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
        for member, value in members:
            if not member.startswith("_") and not isinstance(value, str):
                assert value.__doc__, f"{name}.{member}"


@pytest.mark.parametrize("module", ["tactid._native"])
def test_the_stubs_are_those_of_the_binary(module: str) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "mypy.stubtest", module],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
