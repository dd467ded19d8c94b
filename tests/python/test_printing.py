"""A result as people read it: printed, in a notebook, in the help, and through its methods."""

import doctest
import inspect
import json
import pydoc
import re
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

import doubles
import tactid
from expectations import assert_fits_schema
from tactid import Finding, Identification
from tactid._api import result
from tactid._documents import result_json, schemas
from tactid._results import formats, payload, provenance, table
from tactid._show import outlook, remarks

GRAVITY = Finding(
    "gravity_contradicted",
    {"better": [0.0, 0.0, 9.81], "residual_ratio": 1e-3, "method": "tactile"},
)
NEGATIVE = Finding("negative_mass", {"method": "tactile", "or_gravity": False})
HEAVY = Finding("known_bodies_too_heavy", {"known_bodies_kg": 3.0, "load_kg": 2.0})
SUMMED = Finding("wrenches_summed", {"topics": ["/left", "/right"]})
NOT_KEPT = Finding(
    "known_mass_not_kept",
    {
        "known_mass_kg": 2.0,
        "known_mass_std_dev_kg": 0.0,
        "estimated_kg": 4.0,
        "within_box": True,
    },
)
OFFSET = doubles.offset_finding(1.5)


def with_mass(mass: float) -> Identification:
    """A result with another mass, which no body has where it is not positive."""
    found = doubles.tactile(duration=4.0)
    values = np.concatenate([[mass], found.estimate.values[1:]])
    return doubles.with_estimate(found, values=values, is_physical=mass > 0)


def test_a_result_prints_its_table_and_a_line_for_each_thing_to_know() -> None:
    found = replace(doubles.tactile(duration=4.0), findings=[SUMMED, OFFSET])
    lines = str(found).splitlines()
    assert lines[0] == "Payload in the frame tool0, inertia about the centre of mass"
    (mass,) = (line.split() for line in lines if line.startswith(" mass"))
    assert mass[1] == "kg"
    assert float(mass[2]) == pytest.approx(found.estimate.values[0], abs=1e-4)
    assert float(mass[3]) == pytest.approx(1.96 * found.estimate.std_devs[0], rel=0.05)
    sentences = lines[-4:]
    said = [remarks.assumptions(found), provenance.sentence(found)]
    assert sentences == [str(OFFSET), str(SUMMED), *said]
    assert '`wrench_offset="yes"`' in sentences[0]
    assert "--" not in "".join(sentences)
    assert "array" not in str(found)


def test_a_number_that_no_payload_has_is_short() -> None:
    assert table.number(1e308) == "1.000000e+308"
    assert table.number(-123456789.0) == "-123456789.0000"


def test_the_representation_is_one_short_line() -> None:
    found = replace(with_mass(-1.0), findings=[NEGATIVE])
    assert repr(found) == (
        "<tactid.Identification: -1.0000 kg in tool0, 10 of 10 values identifiable, tactile,"
        " least-squares, 1 finding, contradicted by the data>"
    )
    assert repr(found.estimate) == (
        "<tactid.PayloadEstimate: -1.0000 kg in tool0, 10 of 10 values identifiable>"
    )


def test_an_unknown_mass_is_no_number() -> None:
    found = doubles.nothing_known()
    for shown in (str(found), str(found.estimate), found.estimate._repr_html_()):
        (line,) = re.findall(r".*\bmass\b[ <].*unobservable.*", shown)
        assert "0.0" not in line.split("mass")[1].split("unobservable")[0]
    assert "unknown mass in tool0, 0 of 10 values identifiable" in repr(found)
    assert "Nothing is identifiable: the motion does not exceed its noise." in str(found)
    given = str(replace(found, given={"cutoff_hz": 50.0}, cutoff_hz=50.0))
    after = "the motion after the cutoff of 50 Hz (`cutoff_hz`) does not exceed its noise."
    assert f"Nothing is identifiable: {after}" in given
    assert "Omit the cutoff of 50 Hz (`cutoff_hz`) to have one chosen from the motion." in given
    assert "its mass is" not in str(found)


def test_a_payload_that_nothing_moved_has_its_known_values_and_the_motion_that_is_missing() -> None:
    """A robot that holds still under gravity measures the mass and two of three coordinates."""
    time = np.arange(0.0, 8.0, 0.01)
    pose = np.tile(np.eye(4), (len(time), 1, 1))
    zero, up = np.zeros((len(time), 3)), np.array([0, 0, 9.81])
    wrench = tactid.wrench_regressor(zero + up, zero, zero) @ doubles.BODY.parameters
    wrench += 0.01 * np.random.default_rng(0).normal(size=wrench.shape)
    still = tactid.identify(time, pose=pose, wrench=wrench, wrench_offset="no")
    assert "known: mass, com x, com y. Rotate the tool about its x or y axis" in str(still)
    weightless = tactid.identify(time, pose=pose, wrench=0.001 * wrench, gravity=[0, 0, 0])
    assert not weightless.is_contradicted
    text = str(weightless)
    assert "Nothing is identifiable" in text
    assert "Accelerate the tool, or hold it still under gravity, for the mass." in text
    assert "Hold the tool at another angle to the vertical, or rotate it about two of its" in text


def test_what_contradicts_a_result_comes_first_and_no_value_is_then_known_within_a_target() -> None:
    found = replace(with_mass(-1.0), findings=[SUMMED, OFFSET, NEGATIVE, GRAVITY])
    assert found.is_contradicted
    assert remarks.remarks(found) == [str(each) for each in (GRAVITY, NEGATIVE, OFFSET, SUMMED)]
    assert outlook.outlook(found, 10.0) is None
    assert result_json.record(found)["is_contradicted"] is True
    for finding in (GRAVITY, NEGATIVE, HEAVY):
        assert replace(doubles.tactile(duration=4.0), findings=[finding]).is_contradicted
    for found in (with_mass(-1.0), doubles.impossible()):
        assert found.is_contradicted
        assert remarks.remarks(found)[0].startswith("No body can have these parameters")
    sound = doubles.tactile(duration=4.0)
    assert not sound.is_contradicted
    assert outlook.outlook(sound, 10.0) == "Every value is known within 1000 %."
    for doubt in (OFFSET, NOT_KEPT):
        doubtful = replace(sound, findings=[doubt])
        assert not doubtful.is_contradicted
        assert outlook.outlook(doubtful, 10.0) is None
    partly = doubles.turned_about_one_axis()
    assert not partly.is_contradicted
    contradicted = replace(partly, findings=[GRAVITY])
    assert "Rotate" not in " ".join(remarks.remarks(contradicted))


@pytest.mark.parametrize(
    ("delay", "estimated", "line"),
    [
        (
            0.0,
            tactid.Delay(-1e-8, 2e-6),
            "wrenches 0.0000 ± 0.0039 ms (estimated, too small to correct)",
        ),
        (0.0123, tactid.Delay(0.0123, 4e-4), "wrenches 12.30 ± 0.78 ms (estimated and corrected)"),
        (0.01, None, "delay of the wrenches 10 ms (given)"),
        (0.0, None, "cutoff 10 Hz; times from header stamps."),
    ],
)
def test_the_line_below_says_the_delay(
    delay: float, estimated: tactid.Delay | None, line: str
) -> None:
    found = replace(doubles.tactile(duration=4.0), delay_s=delay, estimated_delay=estimated)
    assert line in remarks.assumptions(found)


def test_a_notebook_shows_a_small_table() -> None:
    found = doubles.with_estimate(doubles.tactile(duration=4.0), frame="<tool>")
    page = found._repr_html_()
    assert page.count("<tr>") == 11
    assert "&lt;tool&gt;, inertia about the centre of mass" in page
    assert "<p>" not in page
    wrong = replace(found, findings=[GRAVITY])._repr_html_()
    assert wrong.count("<p>") == 1
    assert "Another gravity" in wrong


OWN_FIELDS = {
    "inputs": "Files and folders that were read,",
    "hashes": "SHA-256 of each file that was read,",
    "given": "The options that were given,",
}


@pytest.mark.parametrize(
    "thing", [tactid.Identification, tactid.PaperIdentification, tactid.PayloadEstimate]
)
def test_the_help_lists_every_field_with_its_text(thing: type) -> None:
    text = " ".join(pydoc.plain(pydoc.render_doc(thing)).replace("|", " ").split())
    for field in fields(thing):
        schema = field.metadata.get("schema", {"description": OWN_FIELDS.get(field.name, "")})
        assert f"{field.name}: {' '.join(schema['description'].split())}" in text, field.name


def test_the_examples_of_the_methods_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    experiment = tactid.Experiment.paper().replace(duration=2.0, frequency=0.5)
    tactid.simulate(experiment, "run.mcap")
    found = tactid.identify("run.mcap")
    estimate = tactid.PayloadEstimate(
        "tool0",
        values=np.array([1.5, 0, 0, 0.1, 0.02, 0, 0, 0.03, 0, 0.04]),
        std_devs=np.full(10, 1e-3),
        observability=["identifiable"] * 10,
        is_physical=True,
    )
    names = {"tactid": tactid, "result": found, "estimate": estimate}
    for module in (payload, result, formats, schemas):
        outcome = doctest.testmod(module, extraglobs=names, optionflags=doctest.ELLIPSIS)
        assert outcome.failed == 0, module.__name__
        assert outcome.attempted
    for name, method in inspect.getmembers(Identification, inspect.isfunction):
        if name.startswith(("to_", "write_")):
            assert ">>> " in (method.__doc__ or ""), name
    assert {"payload.json", "payload.html", "payload.mcap"} < {
        file.name for file in Path().iterdir()
    }
    record = json.loads(Path("payload.json").read_text())
    assert_fits_schema(record)
    assert "history" in record


@pytest.mark.parametrize("write", ["write_result", "write_report", "write_estimates"])
def test_a_method_replaces_nothing_that_was_read(tmp_path: Path, write: str) -> None:
    log = tmp_path / "run.mcap"
    log.write_text("a log")
    (tmp_path / "link").symlink_to(log)
    found = replace(doubles.tactile(duration=2.0), inputs={"the log": log})
    for path in (log, tmp_path / "link", tmp_path / "none/file", tmp_path):
        with pytest.raises(tactid.ArgumentError, match="`path`") as error:
            getattr(found, write)(path)
        assert "--" not in str(error.value)
    assert log.read_text() == "a log"
    assert sorted(file.name for file in tmp_path.iterdir()) == ["link", "run.mcap"]


def test_an_identification_from_a_log_knows_what_it_read(
    log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(log.parent)
    found = tactid.identify(log.name, unloaded=None)
    assert found.inputs == {"the log": log}
    assert found.source_name == log.name
    assert doubles.tactile(duration=2.0).source_name == "arrays"


def test_simulate_does_not_replace_the_robot(tmp_path: Path) -> None:
    robot = tmp_path / "robot.urdf"
    robot.write_text(tactid.Experiment.paper().urdf)
    experiment = tactid.Experiment.from_toml(f"duration_s = 0.1\n[robot]\nurdf = '{robot}'\n")
    with pytest.raises(tactid.ArgumentError, match="`out` and the experiment's URDF"):
        tactid.simulate(experiment, robot)
    with pytest.raises(tactid.ArgumentError, match=r"the folder .* of `out` does not exist"):
        tactid.simulate(experiment, tmp_path / "none/run.mcap")
    assert robot.read_text() == tactid.Experiment.paper().urdf
