"""The layout of ``result.json`` and what an error is a fraction of."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

import doubles
from expectations import LAYOUT
from tactid import result

NOMINAL = [100.0, 0.5, 0.0, 0.0, 10.0, 0.0, 0.0, 20.0, 0.0, 10.0]


def test_an_error_is_of_the_nominal_value_or_of_the_largest_of_its_kind() -> None:
    truth = result.Truth(actual=NOMINAL, nominal=NOMINAL)
    found = [101.0, 0.5, 0.005, 0.0, 9.9, 0.2, 0.0, 20.4, 0.0, None]
    errors = truth.errors_percent(found)
    expected = [1.0, 0.0, 1.0, 0.0, -1.0, 1.0, 0.0, 2.0, 0.0]
    assert errors[:9] == pytest.approx(expected)
    assert errors[9] is None


def test_a_kind_without_any_nominal_value_has_no_error_in_percent() -> None:
    centred = [1.0, 0.0, 0.0, 0.0, *NOMINAL[4:]]
    errors = result.Truth(actual=centred, nominal=centred).errors_percent(NOMINAL)
    assert errors[1:4] == [None, None, None]


def test_nested_and_flat_are_inverse_and_hold_no_nan() -> None:
    values = [float(index) for index in range(10)]
    assert result.flat(result.nested(values)) == values
    assert list(result.nested(values)) == ["mass", "com", "inertia"]
    assert result.nested([math.nan, *values[1:]])["mass"] is None
    assert "NaN" not in result.to_json(result.nested([math.inf] * 10))


def test_principal_moments_and_the_time_left_are_told() -> None:
    found = doubles.tactile()
    told = result.record(found, within=0.002)
    moments = told["principal_moments"]
    assert moments["values"] == pytest.approx(found.principal_moments)
    assert moments["half_width_95"] == pytest.approx(1.96 * found.principal_moment_deviation)
    remaining = found.remaining(0.002)
    assert told["remaining_s"]["all"] == pytest.approx(remaining.max())
    assert result.flat(told["remaining_s"]["each"]) == pytest.approx(remaining)
    sentence = result.outlook(found, 0.002)
    assert sentence is not None
    assert sentence.startswith("Every value within 0.2 %: another ")
    assert result.outlook(found, 10) == "Every value is within 1000 %."


def test_a_file_is_written_whole_or_not_at_all(tmp_path: Path) -> None:
    path = tmp_path / "result.json"
    result.write_atomically(path, "first")
    path.chmod(0o600)
    result.write_atomically(path, "second")
    assert path.read_text() == "second"
    assert [file.name for file in tmp_path.iterdir()] == ["result.json"]
    (tmp_path / "folder").mkdir()
    with pytest.raises(IsADirectoryError):
        result.write_atomically(tmp_path / "folder", "nothing")
    assert sorted(file.name for file in tmp_path.iterdir()) == ["folder", "result.json"]


def test_a_recording_as_json_has_the_layout_that_others_read() -> None:
    found = doubles.turned_about_one_axis().but(remarks=["The sign of gravity looks wrong."])
    told = json.loads(result.to_json(result.record(found)))
    assert list(told) == LAYOUT
    assert told["frame"] == "tool0"
    assert told["estimate"]["mass"] == pytest.approx(doubles.BODY.mass, rel=1e-3)
    assert told["half_width_95"]["mass"] == pytest.approx(1.96 * found.deviation[0])
    for part in ("estimate", "half_width_95"):
        unknown = [axes for axes, value in told[part]["inertia"].items() if value is None]
        assert unknown == ["xx", "xy", "xz", "yy", "yz"]
        assert told[part]["com"]["z"] is None
    assert told["principal_moments"] == {"values": [None] * 3, "half_width_95": [None] * 3}
    assert told["remaining_s"]["within"] == 0.01
    assert told["remaining_s"]["all"] is None
    assert told["remaining_s"]["each"]["mass"] == 0
    diagnostics = told["diagnostics"]
    assert diagnostics["way"] == "tactile"
    assert diagnostics["windows"] + diagnostics["held_out_windows"] == len(found.fit_time)
    assert list(diagnostics["held_out_rms"]) == found.channels
    assert diagnostics["residual_rms"]["force y"] == pytest.approx(0.12, rel=0.05)
    assert diagnostics["not_identifiable"] == ["com.z", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz"]
    assert told["remarks"][0].startswith("Not identifiable: com.z, Ixx")
    assert told["remarks"][0].endswith(found.motion_advice[0])
    assert told["remarks"][1:] == found.remarks


def test_series_hold_fit_and_history_of_a_recording() -> None:
    found = doubles.tactile()
    told = json.loads(result.to_json(result.series(found)))
    assert told["start_ns"] == found.start_ns
    fit, history = told["fit"], told["history"]
    assert fit["time_s"] == pytest.approx(found.fit_time)
    assert fit["held_out"] == found.fit_held_out.tolist()
    assert [channel["unit"] for channel in fit["channels"]] == found.channel_units
    moment_y = fit["channels"][4]
    assert moment_y["name"] == "moment y"
    for name in ("measured", "predicted", "weight"):
        assert moment_y[name] == pytest.approx(getattr(found, f"fit_{name}")[:, 4])
    assert np.shape(history["values"]) == (len(history["time_s"]), 10)
    np.testing.assert_array_equal(np.array(history["values"], dtype=float)[-1], found.history[-1])
    np.testing.assert_allclose(
        np.array(history["half_width_95"], dtype=float)[-1], 1.96 * found.history_deviation[-1]
    )


def test_a_long_series_is_thinned_and_keeps_its_ends() -> None:
    found = doubles.tactile(duration=250.0)
    assert len(found.fit_time) == 12_500
    told = result.series(found)
    for part, time in (("fit", found.fit_time), ("history", found.history_time)):
        shown = told[part]["time_s"]
        assert len(shown) == min(2000, len(time))
        assert (shown[0], shown[-1]) == (time[0], time[-1])
        assert all(np.diff(shown) > 0)
    assert all(len(channel["weight"]) == 2000 for channel in told["fit"]["channels"])


def test_what_is_not_known_yet_is_null_in_the_history() -> None:
    found = doubles.tactile()
    deviation = found.history_deviation.copy()
    deviation[:5, 7] = np.inf
    history = result.series(found.but(history_deviation=deviation))["history"]
    for told in (history["values"], history["half_width_95"]):
        np.testing.assert_array_equal(np.isnan(np.array(told, dtype=float)), np.isinf(deviation))


def test_an_estimator_without_deviations_still_has_values() -> None:
    """As the paper's filter: every deviation is infinite, and yet nothing is unknown."""
    found = doubles.tactile()
    silent = found.but(
        deviation=np.full(10, np.inf), history_deviation=np.full_like(found.history, np.inf)
    )
    told = result.record(silent) | {"series": result.series(silent)}
    assert None not in result.flat(told["estimate"])
    assert told["half_width_95"]["mass"] is None
    assert None not in told["series"]["history"]["values"][-1]
    assert set(told["series"]["history"]["half_width_95"][-1]) == {None}


@pytest.mark.parametrize("name", doubles.DEGENERATE)
def test_json_never_holds_nan(name: str) -> None:
    found = doubles.DEGENERATE[name]()
    text = result.to_json(result.record(found) | {"series": result.series(found)})
    assert "NaN" not in text
    assert "Infinity" not in text


def test_a_body_that_cannot_be_is_told_with_the_reason() -> None:
    (remark,) = result.recording_remarks(doubles.impossible())
    assert "No body can have these parameters" in remark
    assert "exceed the sum of the other two" in remark
    assert len(result.recording_remarks(doubles.nothing_known())) == 1
