"""The report of a fleet: clusters of equal payloads, changes, drift, and what to look at first."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from conftest import TactidCommand
from tactid._fleet import analysis, plots, report
from tactid._fleet.analysis import OFFSETS
from tactid._fleet.table import ParquetRows
from tactid._show.drawing import Figures

pytest.importorskip("pyarrow")

HOUR_NS = 3_600_000_000_000
STD_DEVS = {"mass": 0.002, "com.x": 1e-4, "com.y": 1e-4, "com.z": 2e-4}


def row(number: int, robot: str, values: list[float], **others: Any) -> dict[str, Any]:
    """A row with mass and centre of mass."""
    names = dict(zip(STD_DEVS, values, strict=True))
    return {
        "address": f"{robot}/{number:03}.mcap",
        "episode": None,
        "robot": robot,
        "outcome": "identified",
        "error": None,
        "start_ns": 1_790_000_000_000_000_000 + number * HOUR_NS,
        "findings": [],
        **{f"estimate.values.{name}": value for name, value in names.items()},
        **{f"estimate.std_devs.{name}": value for name, value in STD_DEVS.items()},
        **others,
    }


def shift(robot: str, scatter: float = 1.0, seed: int = 0) -> list[dict[str, Any]]:
    """A day with two tools in turns of ten hours: three stretches, and two changes."""
    rng = np.random.default_rng(seed)
    tools = ([1.2, 0.0, 0.01, 0.08], [1.9, 0.002, 0.0, 0.11])
    errors = scatter * rng.normal(size=(30, 4)) * list(STD_DEVS.values())
    return [row(k, robot, (np.array(tools[k // 10 % 2]) + errors[k]).tolist()) for k in range(30)]


def test_equal_payloads_are_one_cluster_and_changes_are_found() -> None:
    (robot,) = analysis.robots_of(shift("arm"))
    assert [len(cluster.members) for cluster in robot.clusters] == [20, 10]
    assert robot.clusters[0].mean == pytest.approx([1.2, 0.0, 0.01, 0.08], abs=2e-3)
    found = [(change[0].row["address"], *change[1:]) for change in robot.changes]
    assert found == [("arm/010.mcap", 0, 1), ("arm/020.mcap", 1, 0)]


def test_what_varies_between_recordings_is_no_change() -> None:
    """Recordings that differ by five of their standard deviations are still of two payloads."""
    (robot,) = analysis.robots_of(shift("arm", scatter=5.0))
    assert 3.0 < robot.scatter < 8.0
    assert len(robot.clusters) == 2


@pytest.mark.parametrize("order", ["AB", "AAB", "AB" * 6, "ABC" * 4, "AAABBB" * 2, "ABCDEFGH"])
def test_payloads_in_any_order_are_distinguished(order: str) -> None:
    rng = np.random.default_rng(4)
    errors = rng.normal(size=(len(order), 4)) * list(STD_DEVS.values())
    tools = {name: [2.0 + 0.05 * k, 0.0, 0.01, 0.08] for k, name in enumerate("ABCDEFGH")}
    values = np.array([tools[name] for name in order]) + errors
    (robot,) = analysis.robots_of([row(k, "arm", each.tolist()) for k, each in enumerate(values)])
    assert robot.scatter < 2.0
    assert ["ABCDEFGH"[label] for label in robot.labels] == list(order)


@pytest.mark.parametrize("seed", range(5))
def test_one_payload_is_rarely_split(seed: int) -> None:
    rng = np.random.default_rng(seed)
    errors = rng.normal(size=(200, 4)) * list(STD_DEVS.values())
    rows = [row(k, "arm", (np.array([1, 0, 0, 0.1]) + errors[k]).tolist()) for k in range(200)]
    (robot,) = analysis.robots_of(rows)
    assert len(robot.clusters[0].members) >= 197


def test_a_mass_alone_is_compared_with_a_whole_payload() -> None:
    rows = shift("arm")[:4]
    rows[2]["estimate.values.com.y"] = None
    (robot,) = analysis.robots_of(rows)
    assert len(robot.clusters) == 1


def test_a_drift_of_the_offset_has_its_slope() -> None:
    rng = np.random.default_rng(3)
    rows = shift("arm")
    for k, each in enumerate(rows):
        offset = [0.02 * rng.normal() for _ in range(6)]
        offset[2] += 0.5 * k / 24
        each["fit.wrench_offset.values"] = offset
    (robot,) = analysis.robots_of(rows)
    slopes = {name: (slope, probability) for name, slope, probability in robot.drift()}
    assert slopes["Fz"][0] == pytest.approx(0.5, abs=0.05)
    assert slopes["Fz"][1] < 1e-10
    assert slopes["Mx"][1] > report.DRIFTING


@pytest.mark.parametrize(
    ("degrees", "quantile"), [(1, 636.619), (2, 31.5991), (3, 12.9240), (10, 4.5869), (60, 3.4602)]
)
def test_the_probability_of_a_t_value_is_that_of_the_tables(degrees: int, quantile: float) -> None:
    """Quantiles of 0.999 on both sides."""
    assert analysis.chance(quantile, degrees) == pytest.approx(1e-3, rel=1e-3)
    assert analysis.chance(-quantile, degrees) == analysis.chance(quantile, degrees)
    assert analysis.chance(0.0, degrees) == 1.0


def test_offsets_of_few_recordings_are_rarely_a_drift() -> None:
    rng = np.random.default_rng(5)
    drifting = 0
    for _ in range(300):
        payloads = [
            analysis.Payload(
                {analysis.OFFSETS: rng.normal(size=6).tolist()}, 3600.0 * k, *[np.ones(1)] * 2
            )
            for k in range(4)
        ]
        robot = analysis.Robot("arm", payloads, [], 1.0, [])
        drifting += any(p < report.DRIFTING for _, _, p in robot.drift())
    assert drifting <= 2


def test_a_configured_payload_is_compared_with_what_varies_between_recordings() -> None:
    """The right one is rarely listed where recordings scatter; another centre of mass always."""
    rows = shift("arm", scatter=5.0)
    for each in rows[:10]:
        each["configured"] = [1.2, 0.0, 0.01, 0.08]
    for each in rows[10:20]:
        each["configured"] = [1.9, 0.102, 0.0, 0.11]
    found = analysis.disagreements(analysis.robots_of(rows))
    addresses = {row["address"] for _, row, _ in found}
    assert addresses == {each["address"] for each in rows[10:20]}
    for _, _, difference in found:
        assert difference[1] == pytest.approx(-0.1, abs=5e-3)


def test_the_page_shows_what_is_wrong_first() -> None:
    rows = [*shift("left"), *shift("right", seed=1)]
    rows[3] |= {"outcome": "refused", "error": "<b>no</b> joint states"}
    text = "The wrench has the opposite sign."
    rows[5]["findings"] = [{"kind": "wrench_sign", "severity": "contradicts", "text": text}]
    rows[5]["outcome"] = "contradicted"
    rows[7]["configured"] = [1.0, 0.0, 0.0, 0.05]
    page = report.render(rows, Figures())
    assert "<b>no</b>" not in page
    assert page.index(text) < page.index("&lt;b&gt;no&lt;/b&gt; joint states")
    assert page.index("left/007.mcap") < page.index("left/005.mcap")  # of the configured payloads
    assert "60 recordings of 2 robots" in page
    assert page.count("<img") == 1
    assert "tactid identify left/005.mcap --report report.html" in page
    assert "with the options of the fleet besides, and those of its robot in --table" in page


def test_a_recording_to_look_at_has_its_command_or_its_link() -> None:
    rows = shift("arm")[:4]
    refused = {"outcome": "refused", "error": "no"}
    rows[0] |= refused | {"address": "my logs/a.mcap", "begin_s": 4321.987, "end_s": 8000.0}
    rows[1] |= refused | {"address": "set", "episode": 7}
    rows[2] |= refused | {"address": "https://host/c.mcap"}
    rows[3] |= refused | {"address": "s3://bucket/d.mcap"}
    rows += [rows[3] | {"address": "e.toml", "seed": 3, "method": "effort"}]
    page = report.render(rows, Figures())
    for command in (
        "&#x27;my logs/a.mcap&#x27; --begin-s 4321.987 --end-s 8000.0",
        "set --episode 7",
    ):
        assert f"tactid identify {command} --report report.html" in page
    assert '<a href="https://host/c.mcap">https://host/c.mcap</a>' in page
    assert page.count("--report report.html") == 2


def test_copies_are_one_recording() -> None:
    """Their noise would count as agreement; equal values at another time are another recording."""
    first, other = [each | {"duration_s": 9.0} for each in shift("arm")[:2]]
    copies = [first | {"address": f"copy{k}.mcap"} for k in range(4)]
    later = first | {"address": "b.mcap", "start_ns": first["start_ns"] + 10}
    failed = [each | {"estimate.values.mass": None, "outcome": "refused"} for each in copies]
    page = report.render([first, other, *copies, later, *failed], Figures())
    assert "<h1>7 recordings of 1 robot</h1>" in page
    assert "<td>identified</td><td>3</td>" in page
    assert "4 recordings are copies of others" in page
    assert "such as copy0.mcap of arm/000.mcap" in page
    assert "copies of others" not in report.render([first, other, later], Figures())


def test_what_recordings_vary_by_hides_no_cut_of_one_recording() -> None:
    """The report says which segments of one recording are one payload only by that variation."""
    rows = [each | {"begin_s": 0.0} for each in shift("arm", scatter=5.0)]
    before = rows[0]["estimate.values.mass"]
    rows += [rows[0] | {"begin_s": 8.04, "estimate.values.mass": before + 0.02}]
    rows += [rows[0] | {"begin_s": 20.0, "estimate.values.mass": before + 0.021}]
    page = report.render(rows, Figures())
    assert "1 cut separates segments that differ beyond their intervals" in page
    assert "arm/000.mcap at 8.04 s" in page
    assert "beyond their intervals" not in report.render(rows[:-2], Figures())


def test_segments_are_no_recordings_and_have_their_places() -> None:
    rows = [each | {"begin_s": 0.0, "end_s": 4.0} for each in shift("arm")]
    rows += [each | {"begin_s": 4.125, "end_s": 9.0} for each in rows]
    rows[-1]["configured"] = [1.9, 0.102, 0.0, 0.11]
    sign = {"kind": "wrench_sign", "severity": "contradicts", "text": "The sign is opposite."}
    rows[-1] |= {"outcome": "contradicted", "findings": [sign]}
    rows[0]["configured"] = [1.9, 0.102, 0.0, 0.11]
    page = report.render(rows, Figures())
    assert "<h1>60 segments of 30 recordings of 1 robot</h1>" in page
    assert "a fleet of 30 recordings" in page
    assert page.count("<th>segments</th>") == 3  # outcomes, clusters, findings
    assert "<th>recording</th><th>from / s</th>" in page  # there is no episode
    for place in ("<td>arm/000.mcap</td><td>0</td>", "<td>arm/029.mcap</td><td>4.125</td>"):
        assert place in page
    (alone,) = [report.render([each | {"episode": 7}], Figures()) for each in rows[-1:]]
    assert "<td>arm/029.mcap</td><td>7</td><td>4.125</td>" in alone
    assert "<h1>1 recording of 1 robot</h1>" in alone


def test_the_page_counts_robots_without_a_payload_and_shows_damage() -> None:
    rows = shift("left")
    rows += [each | {"outcome": "refused", "error": "no wrench"} for each in shift("right")]
    rows[2]["damage"] = ["left/002.mcap is damaged at byte 43"]
    rows[4]["faults"] = [{"topic": "/w", "kind": "undecodable", "count": 2, "text": "2 messages"}]
    page = report.render(rows, Figures())
    assert "60 recordings of 2 robots" in page
    assert "<td>right</td><td>right/000.mcap</td>" in page
    assert "left/002.mcap is damaged at byte 43" in page
    assert "<td>damage</td><td>data</td><td>1</td>" in page
    assert "<td>undecodable</td><td>data</td><td>1</td>" in page
    assert "The line is" not in page
    assert "<td>2026-09-21 14:13</td><td>2026-09-22 19:13</td>" in page  # of the first payload
    rows[0]["configured"] = [1.0, 0.0, 0.0, 0.05]
    assert "The line is" in report.render(rows, Figures())


def test_some_stamps_that_begin_at_zero_leave_the_period_of_the_others() -> None:
    rows = shift("arm")
    page = report.render([*rows, *[each | {"start_ns": 0} for each in shift("old")]], Figures())
    assert "From 2026-09-21 14:13 to 2026-09-22 19:13, in UTC; 30 recordings have stamps" in page
    segments = [rows[0] | {"robot": "", "begin_s": begin_s} for begin_s in (0.0, 9.0)]
    assert "2 segments of 1 recording</h1>" in report.render(segments, Figures())


def test_payloads_of_a_figure_have_the_numbers_of_the_table() -> None:
    (robot,) = analysis.robots_of(shift("arm"))
    (axes, *_) = plots.payloads([robot]).axes
    assert axes.get_legend_handles_labels()[1] == ["1", "2"]


def test_stamps_that_begin_at_zero_are_no_dates() -> None:
    rows = [each | {"start_ns": 0, OFFSETS: [0.1 * k] * 6} for k, each in enumerate(shift("arm"))]
    page = report.render(rows, Figures())
    assert "1970" not in page
    assert "stamps that begin at zero" in page
    assert "No drift is larger" in page
    (robot,) = analysis.robots_of(rows)
    assert plots.payloads([robot]).axes[0].get_xlim()[1] < 40


def test_the_command_writes_the_report(command: TactidCommand, tmp_path: Path) -> None:
    table = ParquetRows(tmp_path / "payloads.parquet")
    for each in shift("arm"):
        table.add([each])
    table.close()
    done = command("fleet-report", "payloads.parquet")
    assert done.returncode == 0, done.stderr
    assert done.stderr == "Wrote fleet.html.\n"
    assert "30 recordings of 1 robot" in (tmp_path / "fleet.html").read_text()
    done = command("fleet-report", "payloads.parquet", "--out", "x.pdf")
    assert done.returncode == 2
    assert "--figures" not in done.stderr
