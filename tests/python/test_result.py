"""The layout of ``result.json``, and the scale of an error."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import doubles
from expectations import LAYOUT, assert_fits_schema
from tactid import BoundingBox, Finding, KnownMass
from tactid._base import files, values
from tactid._documents import result_json
from tactid._results import truth
from tactid._show import outlook, remarks

NOMINAL = [100.0, 0.5, 0.0, 0.0, 10.0, 0.0, 0.0, 20.0, 0.0, 10.0]


def test_an_error_is_of_the_nominal_value_or_of_the_largest_of_its_kind() -> None:
    true = truth.Truth(actual=NOMINAL, nominal=NOMINAL, frame="tool0")
    found = [101.0, 0.5, 0.005, 0.0, 9.9, 0.2, 0.0, 20.4, 0.0, None]
    errors = true.errors_percent(found)
    expected = [1.0, 0.0, 1.0, 0.0, -1.0, 1.0, 0.0, 2.0, 0.0]
    assert errors[:9] == pytest.approx(expected)
    assert errors[9] is None


def test_a_kind_without_any_nominal_value_has_no_error_in_percent() -> None:
    centred = [1.0, 0.0, 0.0, 0.0, *NOMINAL[4:]]
    errors = truth.Truth(actual=centred, nominal=centred, frame="tool0").errors_percent(NOMINAL)
    assert errors[1:4] == [None, None, None]


def test_nested_and_flat_are_inverse_and_hold_no_nan() -> None:
    ten = [float(index) for index in range(10)]
    assert values.flat(values.nested(ten)) == ten
    assert list(values.nested(ten)) == ["mass", "com", "inertia"]
    assert values.nested([math.nan, *ten[1:]])["mass"] is None
    assert "NaN" not in result_json.to_json(values.nested([math.inf] * 10))


def test_principal_moments_and_the_remaining_time_are_reported() -> None:
    found = doubles.tactile()
    shown = result_json.record(found, within=0.002)
    moments = shown["principal_moments"]
    assert moments["values"] == pytest.approx(found.principal_moments.values)
    assert moments["std_devs"] == pytest.approx(found.principal_moments.std_devs)
    remaining = found.remaining(0.002)
    assert shown["remaining_s"]["all"] == pytest.approx(remaining.max())
    assert values.flat(shown["remaining_s"]["each"]) == pytest.approx(remaining)
    sentence = outlook.outlook(found, 0.005)
    assert sentence is not None
    assert sentence.startswith("Every value is known within 0.5 % after another ")
    assert outlook.outlook(found, 0.002) == (
        "This motion does not determine the inertia within 0.2 % (Ixx would need more than 10 min)."
        " Rotate the tool faster about its x, y and z axes, for Ixx, Ixy, Ixz, Iyy and Izz."
    )
    assert outlook.outlook(found, 10) == "Every value is known within 1000 %."


def test_a_file_is_written_whole_or_not_at_all(tmp_path: Path) -> None:
    path = tmp_path / "result.json"
    files.write_atomically(path, "first")
    path.chmod(0o600)
    files.write_atomically(path, "second")
    assert path.read_text() == "second"
    assert [file.name for file in tmp_path.iterdir()] == ["result.json"]
    (tmp_path / "folder").mkdir()
    with pytest.raises(IsADirectoryError):
        files.write_atomically(tmp_path / "folder", "nothing")
    assert sorted(file.name for file in tmp_path.iterdir()) == ["folder", "result.json"]


def test_a_recording_as_json_has_the_layout_that_others_read() -> None:
    finding = Finding("frame_assumed", {"topic": "/wrench", "frame": "tool0"})
    found = replace(doubles.turned_about_one_axis(), findings=[finding])
    shown = json.loads(result_json.to_json(result_json.record(found)))
    assert list(shown) == LAYOUT
    assert shown["estimate"]["frame"] == "tool0"
    assert shown["estimate"]["values"]["mass"] == pytest.approx(doubles.BODY.mass, rel=1e-3)
    assert shown["estimate"]["std_devs"]["mass"] == pytest.approx(found.estimate.std_devs[0])
    for part in ("values", "std_devs"):
        ten = shown["estimate"][part]
        unknown = [axes for axes, value in ten["inertia"].items() if value is None]
        assert unknown == ["xx", "xy", "xz", "yy", "yz"]
        assert ten["com"]["z"] is None
    assert shown["principal_moments"] == {
        "values": [None] * 3,
        "std_devs": [None] * 3,
        "intervals": [[None, None]] * 3,
    }
    assert shown["remaining_s"]["within"] == 0.01
    assert shown["remaining_s"]["all"] is None
    assert shown["remaining_s"]["each"]["mass"] == 0
    assert shown["method"] == "tactile"
    fit = shown["fit"]
    assert len(fit["held_out_rms"]) == len(fit["channels"]) == 6
    assert fit["channels"][1] == {"name": "force y", "unit": "N"}
    assert fit["residual_rms"][1] == pytest.approx(0.12, rel=0.05)
    assert shown["not_identifiable"] == ["com z", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz"]
    assert shown["remarks"][0].startswith("Unobservable: com z, Ixx")
    assert shown["remarks"][0].endswith(shown["motion_advice"][-1])
    assert shown["remarks"][1:] == [str(finding)]
    assert shown["findings"] == [
        {"kind": "frame_assumed", "severity": "notes", **finding.data, "text": str(finding)}
    ]


def test_the_keys_of_what_was_given_have_units() -> None:
    low, high = [-0.1, -0.1, 0.0], [0.1, 0.1, 0.3]
    found = replace(
        doubles.tactile(duration=4.0),
        known_mass=KnownMass(1.84, 0.01),
        bounding_box=BoundingBox(low, high),
    )
    shown = result_json.record(found)
    assert shown["known_mass"] == {"mass_kg": 1.84, "std_dev_kg": 0.01}
    assert shown["bounding_box"] == {"min": low, "max": high}
    assert shown["gravity_m_s2"] == doubles.GRAVITY.tolist()
    assert shown["estimated_delay"]["std_dev_s"] == found.estimated_delay.std_dev_s
    assert shown["fit"]["wrench_offset"] is None


def test_series_hold_fit_and_history_of_a_recording() -> None:
    found = doubles.tactile()
    shown = json.loads(result_json.to_json(result_json.record(found, series=True)))
    assert shown["start_ns"] == found.start_ns
    fit, history = shown["fit"], shown["history"]
    known = found.fit
    assert fit["times_s"] == pytest.approx(known.times_s)
    assert fit["held_out"] == known.held_out.tolist()
    assert [c["unit"] for c in fit["channels"]] == [channel.unit for channel in known.channels]
    assert fit["channels"][4]["name"] == "moment y"
    for name in ("measured", "predicted", "weights"):
        np.testing.assert_allclose(np.array(fit[name], dtype=float), getattr(known, name))
    assert np.shape(history["values"]) == (len(history["times_s"]), 10)
    np.testing.assert_array_equal(
        np.array(history["values"], dtype=float)[-1], found.history.values[-1]
    )
    np.testing.assert_allclose(
        np.array(history["std_devs"], dtype=float)[-1], found.history.std_devs[-1]
    )


def test_a_long_series_is_thinned_and_keeps_its_ends() -> None:
    found = doubles.tactile(duration=250.0)
    fit_time = found.fit.times_s
    assert len(fit_time) == 12_500
    shown = result_json.record(found, series=True)
    for part, time in (("fit", fit_time), ("history", found.history.times_s)):
        times = shown[part]["times_s"]
        assert len(times) == min(2000, len(time))
        assert (times[0], times[-1]) == (time[0], time[-1])
        assert all(np.diff(times) > 0)
    assert len(shown["fit"]["measured"]) == len(shown["fit"]["weights"]) == 2000


def test_what_is_not_known_yet_is_null_in_the_history() -> None:
    found = doubles.tactile()
    std_devs = found.history.std_devs.copy()
    std_devs[:5, 7] = np.inf
    history = result_json.history(doubles.with_history(found, std_devs=std_devs))
    for shown in (history["values"], history["std_devs"]):
        np.testing.assert_array_equal(np.isnan(np.array(shown, dtype=float)), np.isinf(std_devs))


def test_an_estimator_without_standard_deviations_still_has_values() -> None:
    shown = result_json.record(doubles.by_the_papers_filter(), series=True)
    assert None not in values.flat(shown["estimate"]["values"])
    assert None not in shown["history"]["values"][-1]
    assert "std_devs" not in {**shown["estimate"], **shown["history"]}


@pytest.mark.parametrize("name", doubles.DEGENERATE)
def test_json_never_holds_nan(name: str) -> None:
    found = doubles.DEGENERATE[name]()
    text = result_json.to_json(result_json.record(found, series=True))
    assert "NaN" not in text
    assert "Infinity" not in text
    assert_fits_schema(json.loads(text))


def test_an_impossible_body_is_reported_with_the_reason() -> None:
    (remark,) = remarks.remarks(doubles.impossible())
    assert "No body can have these parameters" in remark
    assert "exceed the sum of the other two" in remark
    assert len(remarks.remarks(doubles.nothing_known())) == 1
