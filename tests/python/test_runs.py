"""Several recordings of one payload: one estimate, and whether they agree.

The arm records three motions. In the bag ``warm`` its sensor has a gain that is 10 % off.
"""

import json
import pickle
import shutil
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.transforms import Bbox

import tactid
from conftest import TactidCommand
from expectations import LAYOUT, assert_fits_schema, half_widths_of, limits_of, values_of
from recorded_arm import PAYLOAD, TIP, Arm, State, ur5e
from recordings import clock, description, joint_states, wrenches, write_bag
from tactid._show.forest_plot import forest

NOISE = np.array([0.3] * 3 + [0.02] * 3)
"""Standard deviation of a sample of the sensor, N and N m."""

GAINS = {"cold": 1.0, "later": 1.0, "warm": 1.1}
OPTIONS = ("--urdf", "arm.urdf", "--tip", TIP)


@cache
def recorded(name: str) -> tuple[State, np.ndarray]:
    """How the arm moves in a recording, and its wrenches as they are measured."""
    seed = list(GAINS).index(name)
    state = Arm(seed=3 + seed).at(clock(12.0, 100.0))
    noise = np.random.default_rng(seed).normal(size=state.wrench.shape) * NOISE
    return state, GAINS[name] * state.wrench + noise


@pytest.fixture(scope="module")
def bags(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the bags and the URDF."""
    folder = tmp_path_factory.mktemp("runs")
    (folder / "arm.urdf").write_text(ur5e())
    for name in GAINS:
        state, wrench = recorded(name)
        messages = [description(), *joint_states(state), *wrenches(state.time, wrench)]
        write_bag(folder / name, messages)
    return folder


@pytest.fixture(scope="module")
def whole(bags: Path) -> tactid.Combination:
    """All three recordings together."""
    found = tactid.identify([bags / name for name in GAINS], urdf=bags / "arm.urdf", tip=TIP)
    assert isinstance(found, tactid.Combination)
    return found


def assert_is_a_combination(record: dict[str, Any]) -> None:
    validator = jsonschema.Draft202012Validator(tactid.combination_schema())
    problems = [f"{error.json_path}: {error.message}" for error in validator.iter_errors(record)]
    assert not problems, problems
    for run in record["runs"]:
        assert_fits_schema(run)


def test_a_gain_that_is_off_is_named_and_covered(command: TactidCommand, bags: Path) -> None:
    logs = [bags / name for name in GAINS]
    done = command("identify", *logs, "--urdf", bags / "arm.urdf", "--tip", TIP, "--json")
    assert done.returncode == 0, done.stderr
    record = json.loads(done.stdout)
    assert_is_a_combination(record)
    (finding,) = record["findings"]
    assert finding["kind"] == "runs_disagree"
    assert (finding["run"], finding["others_agree"]) == ("warm", True)
    assert finding["p_value"] < 1e-9
    assert finding["sigmas"] > 10
    assert finding["difference"] / finding["of_others"] == pytest.approx(0.1, abs=0.02)
    assert not record["agreement"]["agree"]
    truth = PAYLOAD.values
    values, half_widths = values_of(record["estimate"]["values"]), half_widths_of(record)
    assert np.all(np.abs(values - truth) < half_widths)
    # Of each alone, the intervals do not contain a mass that is 10 % off.
    warm = record["runs"][2]
    assert limits_of(warm)[0][0] > 1.05 * truth[0]
    assert half_widths[0] == pytest.approx(4.303 * 0.1 * truth[0] / 3, rel=0.2)
    # A gain does not move the centre of mass.
    assert np.all(half_widths[1:4] < 0.01)


def test_recordings_that_agree_narrow_the_intervals(bags: Path) -> None:
    logs = (bags / "cold", bags / "later")
    both = tactid.identify(logs, urdf=bags / "arm.urdf", tip=TIP)
    assert isinstance(both, tactid.Combination)
    assert both.agreement.agree
    assert both.findings == []
    assert "The 2 recordings agree within their noise (chi-square" in str(both)
    found = both.agreement
    assert 9 < found.degrees_of_freedom < 10.01
    assert 0.5 < found.chi_square / found.degrees_of_freedom < 2.5
    each = np.array([run.estimate.std_devs for run in both.runs])
    # A value that differs by chance keeps its interval; the others narrow by the root of two.
    assert np.median(both.estimate.std_devs / each.mean(axis=0)) < 0.8
    assert np.all(np.abs(both.estimate.values - PAYLOAD.values) < 4 * both.estimate.std_devs)
    assert both.estimate.windows == sum(run.estimate.windows for run in both.runs)
    reverse = tactid.identify(logs[::-1], urdf=bags / "arm.urdf", tip=TIP)
    np.testing.assert_allclose(reverse.estimate.values, both.estimate.values, rtol=1e-6, atol=1e-9)


def test_a_list_of_one_log_is_the_log(bags: Path) -> None:
    options = tactid.Options(urdf=bags / "arm.urdf", tip=TIP)
    alone = tactid.identify(bags / "cold", options=options)
    listed = tactid.identify([str(bags / "cold")], options=options)
    assert isinstance(listed, tactid.Identification)
    assert listed.to_json() == alone.to_json()
    assert list(json.loads(alone.to_json())) == LAYOUT


def test_results_of_arrays_combine_as_those_of_logs() -> None:
    runs = []
    for name in GAINS:
        state, wrench = recorded(name)
        motion = {"q": state.q, "qd": state.v}
        runs.append(tactid.identify(state.time, urdf=ur5e(), tip=TIP, wrench=wrench, **motion))
    found = tactid.combine(runs)
    assert found.names == ["recording 1", "recording 2", "recording 3"]
    assert found.findings[0].data["run"] == "recording 3"
    assert "recording 3 differs most from the others, which agree" in str(found)
    assert pickle.loads(pickle.dumps(found)) == found
    assert tactid.combine(pickle.loads(pickle.dumps(runs))) == found
    alone = tactid.combine(runs[:1])
    np.testing.assert_allclose(alone.estimate.values, runs[0].estimate.values, rtol=1e-6)
    np.testing.assert_allclose(alone.estimate.std_devs, runs[0].estimate.std_devs, rtol=1e-3)


def test_the_files_have_each_recording_beside_the_whole(
    command: TactidCommand, bags: Path, tmp_path: Path
) -> None:
    outputs = ("--report", "all.html", "--result", "all.json", "--format", "franka")
    logs = [bags / name for name in GAINS]
    done = command("identify", *logs, "--urdf", bags / "arm.urdf", "--tip", TIP, *outputs)
    assert done.returncode == 0, done.stderr
    assert "setLoad" in done.stdout
    assert "The 3 recordings disagree by more than their noise" in done.stderr
    report = (tmp_path / "all.html").read_text()
    for part in (*GAINS, "warm differs most", "data:image/png", "others agree", "fullinertia"):
        assert part in report
    record = json.loads((tmp_path / "all.json").read_text())
    assert_is_a_combination(record)
    assert all("history" in run for run in record["runs"])


def test_the_table_has_a_column_for_each(whole: tactid.Combination) -> None:
    lines = str(whole).splitlines()
    (head,) = (line for line in lines if line.startswith(" parameter"))
    assert head.split()[2:] == [word for name in ("all", *GAINS) for word in (name, "±", "95", "%")]
    assert repr(whole).endswith("3 recordings that disagree>")
    assert "disagree by more" in whole._repr_html_()
    assert {name for name in whole.inputs if name.startswith("the log")} == {
        f"the log of {name}" for name in GAINS
    }


def test_a_copy_of_a_recording_is_refused(
    command: TactidCommand, bags: Path, tmp_path: Path
) -> None:
    copy = shutil.copytree(bags / "cold", tmp_path / "copy")
    done = command("identify", bags / "cold", copy, "--urdf", bags / "arm.urdf", "--tip", TIP)
    assert done.returncode == 2
    assert "recordings 1 and 2 have the same data" in done.stderr


def test_two_masses_of_which_neither_is_known_to_be_right_are_no_result(
    command: TactidCommand, bags: Path
) -> None:
    logs = (bags / "cold", bags / "warm")
    found = tactid.identify(logs, urdf=bags / "arm.urdf", tip=TIP)
    assert "mass" in found.estimate.uncertain
    assert found.is_contradicted
    for taken in (found, found.estimate):
        with pytest.raises(tactid.IdentificationError, match="the data contradict the result"):
            taken.to_controller("ur")
    given = ("identify", *logs, "--urdf", bags / "arm.urdf", "--tip", TIP, "--format", "ur")
    done = command(*given)
    assert done.returncode == 1
    assert "set_target_payload" not in done.stdout
    assert "the data contradict the result: The 2 recordings disagree" in done.stderr
    assert "set_target_payload" in command(*given, "--accept-contradicted").stdout


def test_formats_without_intervals_come_with_a_warning(command: TactidCommand, bags: Path) -> None:
    options = ("--urdf", bags / "arm.urdf", "--tip", TIP, "--format", "ur")
    for third, warns in ((), False), (("warm",), True):
        logs = [bags / name for name in ("cold", "later", *third)]
        done = command("identify", *logs, *options)
        assert done.returncode == 0, done.stderr
        assert "set_target_payload" in done.stdout
        warning = "warning: the recordings disagree, which formats without intervals hide: the mass"
        assert (warning in done.stderr) == warns
        assert done.stdout.count(warning) == warns


def test_the_labels_of_panels_side_by_side_are_apart() -> None:
    figure = forest(tactid.combine([short_recording(seed) for seed in range(3)]))
    figure.draw_without_rendering()
    rows: dict[float, list[Bbox]] = {}
    for axes in (each for each in figure.axes if each.axison):
        labels = axes.xaxis.get_tightbbox(FigureCanvasAgg(figure).get_renderer())
        assert labels is not None
        rows.setdefault(axes.get_position().y0, []).append(labels)
    gaps = [right.x0 - left.x1 for row in rows.values() for left, right in pairwise(row)]
    assert min(gaps) > 15 * figure.dpi / 72  # two digits


def test_many_short_recordings_hold_what_they_promise() -> None:
    # In 24 draws of twelve recordings of 2 s the errors are as large as the standard deviations.
    pool = [short_recording(seed) for seed in range(72)]
    random = np.random.default_rng(1)
    drawn = [random.choice(len(pool), 12, replace=False) for _ in range(24)]
    found = [tactid.combine([pool[k] for k in each]) for each in drawn]
    sigmas = [(one.estimate.values - PAYLOAD.values) / one.estimate.std_devs for one in found]
    assert 0.6 < np.sqrt(np.mean(np.square(sigmas))) < 1.25  # with the inverse covariances, 2
    assert np.mean(np.abs(sigmas) < 1.96) > 0.88
    assert sum(not one.agreement.agree for one in found) <= 2
    # More than four recordings have a line each below the table of the whole.
    text = str(found[0])
    assert max(map(len, text.split("\n\n")[0].splitlines())) < 80
    rows = [line for line in text.splitlines() if line.startswith(" recording ")]
    assert len(rows) == 13


def short_recording(seed: int) -> tactid.Identification:
    """The arm in a motion of its own for 2 s, with the noise of the sensor."""
    state = Arm(seed=100 + seed).at(clock(2.0, 100.0))
    noise = np.random.default_rng(seed).normal(size=state.wrench.shape) * NOISE
    motion = {"q": state.q, "qd": state.v, "wrench": state.wrench + noise}
    return tactid.identify(state.time, urdf=ur5e(), tip=TIP, **motion)


def test_a_known_mass_counts_once(bags: Path) -> None:
    found = tactid.identify(
        [bags / "cold", bags / "later"],
        urdf=bags / "arm.urdf",
        tip=TIP,
        known_mass_kg=2.3,
        known_mass_std_dev_kg=1e-4,
    )
    assert found.estimate.std_devs[0] == pytest.approx(1e-4, rel=0.05)


def test_what_is_wrong_with_one_of_several_logs_names_it(
    command: TactidCommand, bags: Path, tmp_path: Path
) -> None:
    (tmp_path / "broken.mcap").write_bytes(b"this is no log")
    good, options = bags / "cold", ("--urdf", bags / "arm.urdf", "--tip", TIP)
    for arguments, parts in {
        (good, "broken.mcap", *options): ["broken.mcap"],
        (good, "absent.mcap", *options): ["absent.mcap"],
        (good, good, *options): [str(good), "twice"],
        (good, bags / "warm", *options, "--estimates", "x.mcap"): ["--estimates", "2 are given"],
        (good, bags / "warm", *options, "--estimator", "nlms"): ["--estimator", "least squares"],
        (good, bags / "warm", *options, "--result", good / "cold.mcap"): ["--result", "the log"],
    }.items():
        done = command("identify", *arguments)
        assert done.returncode == 2, done.stderr
        assert done.stderr.startswith("tactid: error: ")
        assert done.stderr.count("\n") == 1
        for part in parts:
            assert part in done.stderr


def test_results_that_do_not_belong_together_are_refused(bags: Path) -> None:
    urdf = bags / "arm.urdf"
    first = tactid.identify(bags / "cold", urdf=urdf, tip=TIP)
    for options, what in (
        ({"tip": "wrist_3_link"}, "frame"),
        ({"tip": TIP, "known_mass_kg": 2.3}, "known mass"),
        ({"tip": TIP, "bounding_box": [[-1, -1, -1], [1, 1, 1]]}, "bounding box"),
    ):
        other = tactid.identify(bags / "later", urdf=urdf, **options)
        with pytest.raises(tactid.ArgumentError, match=f"later has another {what}"):
            tactid.combine([first, other])
    paper = tactid.identify(bags / "later", urdf=urdf, tip=TIP, estimator="nlms")
    with pytest.raises(tactid.IdentificationError, match="later has no information"):
        tactid.combine([paper, first])
    for given, message in (
        ([], "empty"),
        (first, "`results` is of type Identification"),
        (["cold"], r"`results\[0\]` is of type str"),
        ([first, tactid.combine([first])], r"`results\[1\]` is a combination"),
        ([first, first], "recordings 1 and 2 have the same data"),
    ):
        with pytest.raises(tactid.ArgumentError, match=message):
            tactid.combine(given)
    with pytest.raises(tactid.ArgumentError, match="`q` belongs to arrays"):
        tactid.identify([bags / "cold", bags / "later"], q=np.zeros((2, 6)))
