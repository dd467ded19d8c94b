"""Messages spell an option as their reader writes it: keywords in Python, flags in a terminal."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from conftest import TactidCommand
from tactid._api.offline import FROM_ARRAYS
from tactid._base.naming import command_line_flag
from tactid._options.options import option_names

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "crates/pyid/python/tactid"
OUTPUTS = {
    "--format",
    "--json",
    "--result",
    "--report",
    "--within",
    "--estimates",
    "--save",
    "--out",
}
FLAGS = OUTPUTS | {command_line_flag(name) for name in option_names()}


def texts(tree: ast.AST) -> Iterator[str]:
    """The strings of a module that are no docstrings."""
    documentation = {
        id(node.value)
        for node in ast.walk(tree)
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
    }
    for node in ast.walk(tree):
        is_text = isinstance(node, ast.Constant) and isinstance(node.value, str)
        if is_text and id(node) not in documentation:
            yield node.value


def test_no_message_that_python_raises_spells_a_flag() -> None:
    for path in PACKAGE.rglob("*.py"):
        if path.parent.name != "_cli":
            for text in texts(ast.parse(path.read_text(encoding="utf-8"))):
                assert not FLAGS.intersection(re.findall(r"--[a-z-]+", text)), text
    for path in [*ROOT.glob("crates/*/src/**/*.rs")]:
        code = re.sub(r"^ *//.*$", "", path.read_text(encoding="utf-8"), flags=re.MULTILINE)
        for text in re.findall(r'"((?:[^"\\]|\\.)*)"', code):
            assert not FLAGS.intersection(re.findall(r"--[a-z-]+", text)), text


@pytest.mark.parametrize(
    ("arguments", "flag"),
    [
        ("identify {log} --cutoff-hz -1", "--cutoff-hz"),
        ("identify {log} --max-gap-s 0", "--max-gap-s"),
        ("identify {log} --gravity 0 0 nan", "--gravity"),
        ("identify {log} --effort-gain 1 2", "--effort-gain"),
        ("identify {log} --known-mass-std-dev-kg 1", "--known-mass-kg"),
        ("identify {log} --known-mass-kg -1", "--known-mass-kg"),
        ("identify {log} --bounding-box 0 0 0 0 0 0", "--bounding-box"),
        ("identify {log} --alpha 1", "--alpha"),
        ("identify {log} --estimator nlms --alpha 3", "--alpha"),
        ("identify {log} --estimator nlms --known-mass-kg 1", "--estimator"),
        ("identify {log} --wrench-topic /none", "--wrench-topic"),
        ("identify {log} --odometry-topic /none", "--odometry-topic"),
        ("identify {log} --imu-topic /none", "--imu-topic"),
        ("identify {log} --wrench-noise 1,1,1,1,1,1 --wrench-noise 0,1,1,1,1,1", "--wrench-noise"),
        ("identify {log} --effort-noise 1 2 --method effort", "--effort-noise"),
        ("identify {log} --tip paw", "--tip"),
        ("identify {log} --urdf none.urdf", "--urdf"),
        ("identify {log} --urdf {log}", "--urdf"),
        ("identify {log} --urdf /dev/null", "--urdf"),
        ("identify {log} --unloaded {log}", "--method"),
        ("identify {log} --cutoff-hz 0.01", "--cutoff-hz"),
        ("identify {log} --begin-s 5 --end-s 3", "which is not after --begin-s"),
        ("identify {log} --wrench-is contact", "(--wrench-is)"),
        ("view {log} --tip paw --save a.rrd", "--tip"),
    ],
)
def test_an_error_of_the_command_spells_flags_and_no_keyword(
    command: TactidCommand, log: Path, arguments: str, flag: str
) -> None:
    done = command(*arguments.format(log=log).split())
    assert done.returncode == 2, done.stdout
    assert flag in done.stderr
    for name in {*option_names(), *FROM_ARRAYS}:
        assert f"`{name}`" not in done.stderr
