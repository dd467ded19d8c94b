"""The start of the command line: a command loads what it needs, and nothing else."""

import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from typer.exceptions import TyperException
from typer.main import get_command

from tactid._cli import cli

NOT_FOR_A_LINE = ("rich", "pydantic", "tactid._api", "tactid._results", "matplotlib")
"""What a line on the terminal does not take."""

NOT_FOR_A_TABLE = ("pydantic", "tactid._fleet", "tactid._live", "matplotlib")
"""What an identification and its table do not take."""


PROGRAM = """
import atexit, sys
atexit.register(lambda: print("loaded", *sys.modules, file=sys.stderr))
from tactid.__main__ import main
main()
"""


def loaded(*arguments: object) -> set[str]:
    """Returns the modules that a command loads."""
    command = [sys.executable, "-c", PROGRAM, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    (line,) = (line for line in done.stderr.splitlines() if line.startswith("loaded "))
    return set(line.split())


def test_the_version_is_shown_without_the_commands() -> None:
    modules = loaded("--version")
    assert "tactid._cli.cli" in modules
    assert modules.isdisjoint(NOT_FOR_A_LINE)
    assert not any(name.endswith("_command") for name in modules)


def test_an_identification_loads_no_other_command(log: Path) -> None:
    """Neither does a plain value of an option load the library that validates others."""
    options = ("--tip", "tool0", "--method", "tactile", "--cutoff-hz", "40", "--within", "5%")
    modules = loaded("identify", log, "--json", *options)
    commands = {name for name in modules if name.endswith("_command")}
    assert commands == {"tactid._cli.identify_command"}
    assert modules.isdisjoint(NOT_FOR_A_TABLE)


def test_every_command_is_in_the_help(capsys: pytest.CaptureFixture[str]) -> None:
    group: Any = get_command(cli.app)
    with pytest.raises(SystemExit):
        group(["--help"])
    shown = capsys.readouterr().out
    for name in cli.COMMANDS:
        command = group.get_command(None, name)
        assert command.name == name
        assert f"│ {name} " in shown
        assert command.help.split()[0] in shown


TEXTS = (
    "tool0",
    "1",
    "-2.5",
    "3.",
    "1e3",
    " 1",
    "1_0",
    "nan",
    "",
    "effort",
    "table",
    ".",
    "/no/file",
)


def outcome_of(process: Callable[..., Any], context: Any, value: Any) -> tuple[str, str]:
    try:
        found = process(context, value)
    except TyperException as error:
        return "error", error.format_message()
    return type(found).__name__, repr(found)


@pytest.mark.parametrize("name", ["identify", "simulate", "fleet"])
def test_plain_values_are_what_the_library_makes_of_them(name: str, tmp_path: Path) -> None:
    """Those that it does not need to validate are converted without it."""
    secret = tmp_path / "secret.mcap"
    secret.touch(0)
    group: Any = get_command(cli.app)
    command = group.get_command(None, name)
    context = command.make_context(name, ["run.mcap"])
    for parameter in command.params:
        several = parameter.multiple or parameter.nargs == -1
        texts = (*TEXTS, str(secret))
        given = [*((text,) for text in texts), texts] if several else texts
        for value in (None, parameter.default, *given):
            by_library = partial(type(parameter).process_value, parameter)
            expected = outcome_of(by_library, context, value)
            assert outcome_of(parameter.process_value, context, value) == expected, parameter.name
