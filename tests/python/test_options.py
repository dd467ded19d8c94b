"""Options are declared once: Python's keywords, the command line and the documentation agree."""

import copy
import inspect
import pickle
import typing
from pathlib import Path

import numpy as np
import pytest

import tactid
from conftest import TactidCommand
from tactid._base.naming import command_line_flag
from tactid._options.options import OPTIONS, Estimator, Method, collect, option_names
from test_cli import assert_refused


@pytest.fixture
def help_text(command: TactidCommand, monkeypatch: pytest.MonkeyPatch) -> str:
    """The help of the command, in which nothing is folded."""
    monkeypatch.setenv("TERMINAL_WIDTH", "2000")
    return " ".join(command("identify", "--help").stdout.replace("│", " ").split())


def test_every_option_has_its_documentation_everywhere(help_text: str) -> None:
    documentation = {
        use: inspect.getdoc(thing) or ""
        for use, thing in {
            "log": tactid.identify,
            "online": tactid.Identifier,
            "paper filter": tactid.PaperFilter,
            "calibration": tactid.calibrate,
        }.items()
    }
    for option in OPTIONS.values():
        declaration = option
        assert "``" not in declaration.help
        assert declaration.help in help_text
        assert declaration.documentation.endswith("."), option.name
        assert command_line_flag(option.name) in help_text, option.name
        entry = f"{option.name}: {declaration.documentation}"
        assert entry in " ".join((inspect.getdoc(tactid.Options) or "").split())
        for use, text in documentation.items():
            assert (entry in " ".join(text.split())) == (use in declaration.uses), (use, entry)
    assert set(option_names("log")) <= set(inspect.signature(tactid.identify).parameters)


def test_the_help_groups_the_options_by_what_they_are_about(help_text: str) -> None:
    panels = {
        "Robot": ["urdf", "tip", "rename_joints", "sensor_frame", "wrench_axes"],
        "Topics": [name for name in option_names() if name.endswith("_topic")],
        "Measurements": [
            "method",
            "unloaded",
            "calibration",
            "delay_s",
            "begin_s",
            "end_s",
            "max_gap_s",
            "wrench_offset",
        ],
        "Signs": [
            "gravity",
            "wrench_is",
            "configured_payload",
            "wrench_acts_on",
            "efforts_are",
            "effort_gain",
            "effort_gain_std_dev",
        ],
        "Prior knowledge": [
            "known_tool",
            "known_tool_std_dev",
            "known_mass_kg",
            "known_mass_std_dev_kg",
            "bounding_box",
            "shape",
            "shape_pose",
            "shape_scale",
            "shape_position_std_dev_m",
            "shape_rotation_std_dev",
            "shape_size_std_dev",
            "shape_ln_density_std_dev",
        ],
        "Noise and filter": ["estimator", "cutoff_hz", "wrench_noise", "effort_noise"],
        "Paper's filter": ["alpha", "beta", "average_s", "epochs"],
        "Tables": ["columns", "episode"],
    }
    assert [name for names in panels.values() for name in names] == option_names()
    places = [help_text.index(f"╭─ {panel} ─") for panel in panels]
    assert places == sorted(places)
    for start, end, names in zip(places, [*places[1:], None], panels.values(), strict=True):
        for name in names:
            assert f" {command_line_flag(name)} " in help_text[start:end], name


def test_no_option_has_a_default_in_python() -> None:
    options = tactid.Options()
    assert options.given == {}
    for name in OPTIONS:
        assert getattr(options, name) is None, name
    assert list(inspect.signature(tactid.Options).parameters) == list(OPTIONS)


def test_the_choices_of_python_are_those_of_rust() -> None:
    assert OPTIONS["method"].kind == {"choice": list(typing.get_args(Method))}
    assert OPTIONS["estimator"].kind == {"choice": list(typing.get_args(Estimator))}


def test_options_are_values() -> None:
    """Options are compared and copied by what is given, and refuse what does not exist."""
    options = tactid.Options(gravity=np.array([0.0, 0.0, -9.81]), cutoff_hz=5.0, tip=None)
    assert options == tactid.Options(cutoff_hz=5.0, gravity=[0, 0, -9.81])
    assert options != tactid.Options(cutoff_hz=5.0)
    assert pickle.loads(pickle.dumps(options)) == copy.deepcopy(options) == options
    assert options.replace(gravity=None) == tactid.Options(cutoff_hz=5.0)
    assert repr(options.replace(gravity=None)) == "Options(cutoff_hz=5.0)"
    with pytest.raises(AttributeError, match="immutable"):
        options.cutoff_hz = 3.0
    with pytest.raises(AttributeError, match="no option `cutoff`"):
        _ = options.cutoff
    with pytest.raises(tactid.ArgumentError, match="did you mean `cutoff_hz`"):
        tactid.Options(cutoff=5.0)


def test_an_unknown_keyword_is_refused_with_the_nearest() -> None:
    with pytest.raises(tactid.ArgumentError) as error:
        tactid.identify("run.mcap", wrench_offest=True)
    message = str(error.value)
    assert "no keyword `wrench_offest`; did you mean `wrench_offset`?" in message
    assert all(name in message for name in option_names("log"))


def test_keywords_replace_options() -> None:
    options = tactid.Options(cutoff_hz=5.0, max_gap_s=0.2)
    merged = collect(options, {"cutoff_hz": 7.0}, "log")
    assert (merged.cutoff_hz, merged.max_gap_s) == (7.0, 0.2)


def test_options_and_keywords_are_the_same(log: Path) -> None:
    by_keyword = tactid.identify(log, cutoff_hz=8.0, wrench_offset="yes")
    by_object = tactid.identify(log, options=tactid.Options(cutoff_hz=8.0, wrench_offset="yes"))
    assert by_keyword.estimate.values.tolist() == by_object.estimate.values.tolist()
    assert by_keyword.cutoff_hz == 8.0


@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("method", "magic"),
        ("cutoff_hz", "fast"),
        ("cutoff_hz", -1.0),
        ("max_gap_s", 0.0),
        ("gravity", [1.0, 2.0]),
        ("gravity", [0.0, 0.0, -98.1]),
        ("wrench_noise", [1.0]),
        ("wrench_acts_on", "robot"),
        ("known_tool", "hammer"),
        ("known_mass_kg", -1.0),
        ("bounding_box", [[0, 0, 0], [1, 1, 0]]),
        ("joint_topic", "/none"),
        ("wrench_topic", ["/none"]),
        ("unloaded", "none.mcap"),
        ("alpha", 1.0),
        ("effort_gain", [1.0]),
        ("effort_gain_std_dev", -0.1),
        ("effort_gain_std_dev", 1.0),
    ],
)
def test_an_error_carries_the_option_that_causes_it(log: Path, option: str, value: object) -> None:
    needed = {"method": "effort"} if option == "unloaded" else {}
    with pytest.raises(tactid.TactidError) as error:
        tactid.identify(log, **needed, **{option: value})
    kind = tactid.LogError if option == "unloaded" else tactid.ArgumentError
    assert isinstance(error.value, kind), error.value
    assert error.value.option == option
    assert f"`{option}`" in str(error.value)
    assert command_line_flag(option) in error.value.worded("command-line")


@pytest.mark.parametrize(
    ("option", "given", "sentence"),
    [
        ("joint_topic", {"joint_topic": "/none"}, "`joint_topic`: the log has no topic /none of"),
        (
            "unloaded",
            {"method": "effort", "unloaded": "none"},
            "`unloaded`: the unloaded recording cannot be read: ",
        ),
        ("method", {"unloaded": "none"}, "; `method` chooses the method"),
        ("tip", {"tip": "hand"}, "; `tip` names the end-effector frame"),
        ("cutoff_hz", {"cutoff_hz": 0.01}, "or raise the cutoff; `cutoff_hz` sets the cutoff"),
        ("max_gap_s", {"max_gap_s": 1e-5}, "; `max_gap_s` sets the longest time that is bridged"),
        (
            "estimator",
            {"estimator": "nlms", "known_mass_kg": 1.0},
            "nothing else; `estimator` chooses the estimator",
        ),
        (
            "known_mass_kg",
            {"known_mass_std_dev_kg": 0.1},
            "`known_mass_kg` is missing, but its standard deviation is given",
        ),
        ("alpha", {"alpha": 1.0}, "`alpha` is an option of the paper's filter, and not of least"),
        (
            "bounding_box",
            {"bounding_box": [[0, 0, 0], [1, 1, 0]]},
            "`bounding_box`: the box goes from 0 to 0 m along z",
        ),
    ],
)
def test_an_error_says_whether_an_option_causes_or_resolves_it(
    log: Path, option: str, given: dict[str, object], sentence: str
) -> None:
    with pytest.raises(tactid.TactidError) as error:
        tactid.identify(log, options=tactid.Options(**given))
    assert sentence in str(error.value)
    assert error.value.option == option
    flag = command_line_flag(option)
    assert error.value.worded("command-line") == str(error.value).replace(f"`{option}`", flag)


def test_an_option_that_does_not_apply_is_refused(log: Path) -> None:
    with pytest.raises(tactid.ArgumentError, match="`q` belongs to arrays"):
        tactid.identify(log, q=[[0.0]])
    with pytest.raises(tactid.ArgumentError, match="`imu_topic` does not apply to arrays"):
        tactid.identify([0.0, 1.0], imu_topic="/imu")


def test_the_command_names_its_own_options(command: TactidCommand, log: Path) -> None:
    assert_refused(command("identify", log, "--cutoff-hz", "-1"), "--cutoff-hz is -1")
    assert_refused(
        command("identify", log, "--joint-topic", "/none"),
        "error: --joint-topic: the log has no topic /none",
    )
