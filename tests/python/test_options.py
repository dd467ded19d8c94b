"""Options are declared once: Python's keywords, the command line and the documentation agree."""

import inspect
import typing
from dataclasses import fields
from pathlib import Path

import pytest

import tactid
from conftest import TactidCommand
from tactid.declaration import Declaration
from tactid.naming import command_line_flag
from tactid.options import collect, option_names
from test_cli import assert_refused


def test_every_option_has_its_documentation_everywhere(command: TactidCommand) -> None:
    help_text = " ".join(command("identify", "--help").stdout.replace("│", " ").split())
    documentation = {
        use: inspect.getdoc(thing) or ""
        for use, thing in {
            "log": tactid.identify,
            "online": tactid.Identifier,
            "paper filter": tactid.PaperFilter,
        }.items()
    }
    flat = help_text.replace(" ", "")  # wherever the columns wrap
    for option in fields(tactid.Options):
        declaration = Declaration.of(option)
        assert "``" not in declaration.help
        assert declaration.help.split(".")[0][:20].replace(" ", "") in flat
        assert declaration.documentation.endswith("."), option.name
        assert command_line_flag(option.name) in help_text, option.name
        entry = f"{option.name}: {declaration.documentation}"
        assert entry in " ".join((inspect.getdoc(tactid.Options) or "").split())
        for use, text in documentation.items():
            assert (entry in " ".join(text.split())) == (use in declaration.uses), (use, entry)
    assert set(option_names("log")) <= set(inspect.signature(tactid.identify).parameters)


def test_no_option_has_a_default_in_python() -> None:
    for option in fields(tactid.Options):
        assert option.default is None, option.name
        assert type(None) in typing.get_args(typing.get_type_hints(tactid.Options)[option.name])


def test_an_unknown_keyword_is_refused_with_the_nearest() -> None:
    with pytest.raises(tactid.ArgumentError) as error:
        tactid.identify("run.mcap", wrench_offest=True)
    message = str(error.value)
    assert "no keyword `wrench_offest`; did you mean `wrench_offset`?" in message
    assert all(name in message for name in option_names("log"))


def test_keywords_replace_options() -> None:
    options = tactid.Options(cutoff=5.0, max_gap=0.2)
    merged = collect(options, {"cutoff": 7.0}, "log")
    assert (merged.cutoff, merged.max_gap) == (7.0, 0.2)


def test_options_and_keywords_are_the_same(log: Path) -> None:
    by_keyword = tactid.identify(log, cutoff=8.0, wrench_offset=True)
    by_object = tactid.identify(log, options=tactid.Options(cutoff=8.0, wrench_offset=True))
    assert by_keyword.estimate.values.tolist() == by_object.estimate.values.tolist()
    assert by_keyword.cutoff == 8.0


@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("method", "magic"),
        ("cutoff", "fast"),
        ("cutoff", -1.0),
        ("max_gap", 0.0),
        ("gravity", [1.0, 2.0]),
        ("wrench_noise", [1.0]),
        ("wrench_acts_on", "robot"),
        ("known_tool", "hammer"),
        ("known_mass", -1.0),
        ("bounding_box", [[0, 0, 0], [1, 1, 0]]),
        ("joint_topic", "/none"),
        ("wrench_topic", ["/none"]),
        ("unloaded", "none.mcap"),
        ("alpha", 1.0),
        ("effort_gain", [1.0]),
    ],
)
def test_an_error_carries_the_option_that_causes_it(log: Path, option: str, value: object) -> None:
    with pytest.raises(tactid.TactidError) as error:
        tactid.identify(log, **{option: value})
    if option == "unloaded":
        return  # an error of the log, which names its path
    assert isinstance(error.value, tactid.ArgumentError), error.value
    assert error.value.option == option
    assert f"`{option}`" in str(error.value)
    assert command_line_flag(option) in error.value.worded("command-line")


def test_an_option_that_does_not_apply_is_refused(log: Path) -> None:
    with pytest.raises(tactid.ArgumentError, match="`q` belongs to arrays"):
        tactid.identify(log, q=[[0.0]])
    with pytest.raises(tactid.ArgumentError, match="`imu_topic` does not apply to arrays"):
        tactid.identify([0.0, 1.0], imu_topic="/imu")


def test_the_command_names_its_own_options(command: TactidCommand, log: Path) -> None:
    assert_refused(command("identify", log, "--cutoff", "-1"), "--cutoff is -1")
    assert_refused(command("identify", log, "--joint-topic", "/none"), "(--joint-topic)")
