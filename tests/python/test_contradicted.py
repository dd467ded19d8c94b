"""What the data contradict is not given to a program that would take it for right."""

import pickle
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import doubles
import faulty
import tactid
from conftest import TactidCommand
from doubles import offset_finding
from recorded_arm import FIXED, SENSOR, TIP_FROM_SENSOR
from recordings import moving, state, wrenches, write_bag
from tactid import Finding, Identification
from tactid._show import combination_report, remarks
from wrist import EARLY, identified

FORMATS = ("urdf", "mujoco", "ros", "controller", "ur", "franka", "kuka", "abb")


def inconsistent(distance: float) -> Finding:
    return Finding("inconsistent", {"distance": distance, "within_box": False})


@pytest.mark.parametrize(
    ("finding", "contradicts"),
    [
        (offset_finding(12.0, mass_change=0.6), True),
        (offset_finding(1.1, mass_change=0.06), True),
        (offset_finding(0.9, mass_change=0.04), False),
        (offset_finding(0.0, 0.25, shift=0.012), True),
        (offset_finding(0.0, 0.15, shift=0.008), False),
        (inconsistent(28.0), True),
        (inconsistent(20.0), False),
    ],
)
def test_what_is_certain_and_large_contradicts(finding: Finding, contradicts: bool) -> None:
    assert finding.contradicts_result == contradicts
    result = replace(doubles.tactile(duration=4.0), findings=[finding])
    assert result.is_contradicted == contradicts


def test_an_offset_is_named_and_identified_whatever_harm_it_does() -> None:
    """The sensor takes all attitudes, so that an offset changes neither mass nor centre by much."""
    for size in (12.0, 0.5):
        offset = np.array([size, 0.0, 0.0, 0.0, 0.0, 0.0])
        (found,) = identified(EARLY, 1, offset=offset, wrench_offset="no").findings
        assert (found.data["cause"], found.severity) == ("offset", "doubts")
        (noted,) = identified(EARLY, 1, offset=offset).findings
        assert (noted.data["cause"], noted.severity) == ("offset", "notes")


@pytest.fixture(scope="module")
def shifted(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A bag of an arm whose sensor has an offset of 12 N."""
    s = state(FIXED, 6.0, 100.0)
    felt = wrenches(s.time, s.wrench, frame=SENSOR, tip_from_sensor=TIP_FROM_SENSOR)
    noisy = faulty.noisy(faulty.offset(felt, [12, 0, 0, 0, 0, 0]), force=0.05, moment=0.005)
    return write_bag(tmp_path_factory.mktemp("bag") / "bag", [*moving(FIXED, 6.0, 100.0), *noisy])


def test_the_command_refuses_a_format_unless_the_user_insists(
    command: TactidCommand, shifted: Path
) -> None:
    given = ("identify", shifted, "--tip", "wrist_3_link", "--wrench-offset", "no")
    for form in FORMATS:
        done = command(*given, "--format", form)
        assert done.returncode == 1
        assert done.stdout == ""
        *others, last = done.stderr.splitlines()
        assert last.startswith("tactid: error: the data contradict the result: The wrenches seem")
        assert "let `--wrench-offset yes` identify it" in last
        assert last.endswith("--accept-contradicted gives the result as it is.")
        assert not any("constant offset" in line for line in others)
    done = command(*given, "--format", "ur", "--accept-contradicted")
    assert done.returncode == 1
    assert "set_target_payload(" in done.stdout
    assert done.stderr.startswith("The wrenches seem to have a constant offset")
    assert command(*given[:-2], "--format", "ur").returncode == 0


def formats_of(
    result: Identification | tactid.Combination | tactid.PayloadEstimate,
) -> list[Callable[..., str]]:
    return [result.to_urdf, result.to_mujoco, result.to_ros, result.to_controller]


def test_a_caller_gets_an_exception_unless_it_insists(shifted: Path) -> None:
    wrong = tactid.identify(shifted, tip="wrist_3_link", wrench_offset="no")
    sound = tactid.identify(shifted, tip="wrist_3_link", wrench_offset="yes")
    other = replace(wrong.setup, beginning="another recording")
    both = tactid.combine([sound, replace(wrong, inputs={}, setup=other)])
    for result in (wrong, both):
        assert result.is_contradicted
        for form in formats_of(result):
            with pytest.raises(tactid.IdentificationError, match="constant offset") as raised:
                form()
            assert str(raised.value).endswith("`accept_contradicted` gives the result as it is.")
            assert form(accept_contradicted=True)
        copied = pickle.loads(pickle.dumps(result.estimate))
        for form in [*formats_of(result.estimate), *formats_of(copied)]:
            with pytest.raises(tactid.IdentificationError, match="of the identification say why"):
                form()
            assert form(accept_contradicted=True)
    assert replace(wrong, findings=[]).estimate.to_urdf()
    assert "recording 2: The wrenches seem" in str(raised.value)
    text = combination_report.render(both)
    assert 'class="warn">The data contradict this result. recording 2: The wrenches seem' in text
    assert "set_target_payload" not in text
    for form in [*formats_of(sound), *formats_of(sound.estimate)]:
        assert form() == form(accept_contradicted=True)


def test_a_body_that_cannot_exist_is_refused_whoever_insists() -> None:
    with pytest.raises(tactid.IdentificationError, match="no body can have this estimate"):
        doubles.impossible().to_controller("ur", accept_contradicted=True)


def test_what_contradicts_stands_before_what_only_doubts() -> None:
    doubt = Finding("nothing_held", {"mass_kg": 0.001, "std_dev_kg": 0.001})
    certain = offset_finding(12.0, mass_change=0.6)
    result = replace(doubles.tactile(duration=4.0), findings=[doubt, certain])
    assert remarks.remarks(result)[0] == str(certain)
