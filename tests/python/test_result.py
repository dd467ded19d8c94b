"""The layout of ``result.json`` and what an error is a fraction of."""

import math
from pathlib import Path

import pytest

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
