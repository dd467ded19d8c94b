"""An uncertain value is given with its interval; an unobservable one is not given."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

import doubles
import tactid
from expectations import assert_fits_schema
from tactid._base.values import Interval, Observability
from tactid._results import table
from tactid._show import remarks

VALUES = np.array([2.0, 0.1, 0.0, 0.2, 0.03, 0.0, 0.001, 0.04, 0.0, 0.02])
STATES: list[Observability] = ["identifiable"] * 4 + ["uncertain"] * 6


def estimate(**changes: object) -> tactid.PayloadEstimate:
    """A body whose inertia drowns in noise, cut at what a body can have."""
    std_devs = np.array([0.01, *[1e-3] * 3, *[0.05] * 6])
    intervals = VALUES[:, None] + np.outer(std_devs, [-1.96, 1.96])
    intervals[[4, 7, 9], 0] = 0.0
    intervals[[5, 6, 8]] = [-0.06, 0.06]
    found = tactid.PayloadEstimate(
        "tool0",
        values=VALUES,
        std_devs=std_devs,
        observability=STATES,
        is_physical=True,
        intervals=intervals,
    )
    return replace(found, **changes)


def test_the_three_states_are_lists_of_names() -> None:
    states: list[Observability] = ["identifiable"] * 3 + ["unobservable"] + ["uncertain"] * 6
    found = estimate(observability=states)
    assert found.unobservable == ["com z"]
    assert found.uncertain == ["Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz"]
    assert found.not_identifiable == ["com z", *found.uncertain]
    assert found.identifiable == [True] * 3 + [False] * 7
    assert found.reported_values[3] is None
    assert found.reported_intervals[3] is None
    assert found.reported_values[4] == 0.03
    assert found.summary == "2.0000 kg in tool0, 3 of 10 values identifiable"


def test_an_interval_that_is_cut_shows_both_limits() -> None:
    found = estimate()
    assert found.reported_intervals[4] == Interval(0.0, pytest.approx(0.128))
    assert found.half_widths[:2] == pytest.approx([0.0196, 0.00196])
    # The farther limit: value ± half width contains the interval.
    assert found.half_widths[4] == pytest.approx(0.098)
    assert found.half_widths[6] == pytest.approx(0.061)
    lines = {line[:12].strip(): line for line in str(found).splitlines()}
    assert lines["mass"].split()[-2:] == ["2.0000", "0.020"]
    assert lines["Ixx"].endswith("0.0300    0.000 .. 0.128")
    assert lines["Ixz"].endswith("0.0010   -0.060 .. 0.060")
    assert lines["Ixy"].endswith("0.060")
    assert "0.000 .. 0.128" in found._repr_html_()


def test_without_limits_an_uncertain_value_is_no_number() -> None:
    """Where the mass is hardly known, nothing limits what is divided by it."""
    infinite = np.array([0.7, *[np.inf] * 9])
    intervals = VALUES[:, None] + np.outer(infinite, [-1.96, 1.96])
    intervals[[4, 7, 9], 0] = 0.0
    states: list[Observability] = ["identifiable"] + ["uncertain"] * 9
    found = estimate(std_devs=infinite, intervals=intervals, observability=states)
    assert found.reported_values == [2.0, *[None] * 9]
    assert re.search(r"com x +m +uncertain", str(found))
    (said,) = remarks.uncertain_values(found, advised=False)
    assert "Nothing limits com x, com y, com z, Ixx" in said
    with pytest.raises(tactid.IdentificationError, match="com x, com y, com z not identifiable"):
        found.to_controller("ur")


def test_json_has_the_states_and_the_limits() -> None:
    found = doubles.with_estimate(
        doubles.tactile(duration=4.0), **{k: getattr(estimate(), k) for k in FIELDS}
    )
    record = json.loads(found.to_json())
    assert_fits_schema(record)
    assert record["estimate"]["values"]["inertia"]["xx"] == 0.03
    assert record["estimate"]["intervals"]["inertia"]["xx"] == [0.0, pytest.approx(0.128)]
    assert record["estimate"]["observability"]["mass"] == "identifiable"
    assert record["estimate"]["observability"]["inertia"]["zz"] == "uncertain"
    assert record["not_identifiable"] == found.estimate.uncertain
    (said,) = [remark for remark in record["remarks"] if remark.startswith("Uncertain")]
    assert "Rotate the tool faster about its x, y and z axes" in said
    assert "go on for another" in said
    assert "(`bounding_box`)" in said
    boxed = replace(found, bounding_box=tactid.BoundingBox([-0.1] * 3, [0.1] * 3))
    assert not any("bounding_box" in remark for remark in json.loads(boxed.to_json())["remarks"])


FIELDS = ("values", "std_devs", "observability", "intervals", "is_physical")


def test_every_format_names_what_is_uncertain() -> None:
    names = "Ixx, Ixy, Ixz, Iyy, Iyz, Izz"
    found, known = estimate(), estimate(observability=["identifiable"] * 10)
    for form in ("to_urdf", "to_mujoco", "to_ros", "to_controller"):
        text, plain = getattr(found, form)(), getattr(known, form)()
        assert names in text
        assert [line for line in text.splitlines() if "uncertain" not in line] == plain.splitlines()
    for maker in ("ur", "franka", "kuka", "abb"):
        comment, line = found.to_controller(maker).split("\n")
        assert comment.endswith(f"; uncertain: {names}")
        assert line == known.to_controller(maker).split("\n")[1]


def test_no_format_writes_an_uncertain_tensor_that_no_body_has() -> None:
    impossible = estimate(values=np.array([*VALUES[:4], 0.03, 0, 0, 0.09, 0, 0.02]))
    for maker in ("ur", "franka", "kuka", "abb"):
        with pytest.raises(tactid.IdentificationError, match="exceed the sum"):
            impossible.to_controller(maker)


def test_a_table_column_says_why_a_value_is_missing() -> None:
    column = table.Column("a", [None] * 10, observability=["unobservable"] + ["uncertain"] * 9)
    assert [row.number for row in column.rows[:2]] == ["unobservable", "uncertain"]
    assert [row.around for row in column.rows[:2]] == ["–", "–"]
