"""The report of a recording shows what was found, whatever was found."""

import html
import re
from dataclasses import replace
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

import doubles
import tactid
from tactid import Channel, Finding, Identification
from tactid._base.bodies import ellipsoid
from tactid._base.naming import Style
from tactid._base.output_files import check_report, figure_paths
from tactid._base.values import MOMENT_NAMES, Interval, values_of
from tactid._show import drawing, outlook, page, recording_plots, recording_report, remarks

MOMENT_CHANNELS = ["moment x", "moment y", "moment z"]

BODY = values_of(doubles.BODY)


class Page(HTMLParser):
    """The words of a page, the rows of its tables, and whether its elements close."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.rows: list[list[str]] = []
        self.words: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in ("meta", "img"):
            self.open.append(tag)
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")
        for name, value in attrs:
            assert name not in ("src", "href") or (value or "").startswith("data:image/png;base64")

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] == "style":
            return
        self.words.append(data)
        if self.open and self.open[-1] in ("td", "th"):
            self.rows[-1][-1] += data


class Words(drawing.Figures):
    """Figures that are left out of the page: most of the time goes into them."""

    def html(self, _name: str, _figure: Figure, caption: str) -> str:
        return page.figure(b"", caption)


def text_of(found: Identification, within: float = 0.01, style: Style = "keyword") -> str:
    """Returns the report without its pictures."""
    return recording_report.render(found, within, style, Words())


def page_of(found: Identification) -> Page:
    shown = Page(text_of(found))
    assert shown.open == []
    return shown


@cache
def degenerate(name: str) -> str:
    """All words of the report of what went wrong."""
    shown = Page(recording_report.render(doubles.DEGENERATE[name]()))
    assert shown.open == []
    return " ".join(shown.words)


def test_a_report_is_one_small_file_with_every_value(tmp_path: Path) -> None:
    path = tmp_path / "report.html"
    found = replace(doubles.tactile(), inputs={"the log": tmp_path / "pick & <place>.mcap"})
    found.write_report(path)
    text = path.read_text()
    assert len(text) < 3_000_000
    assert text.count("data:image/png;base64,") == 5
    shown = Page(text)
    words = " ".join(shown.words)
    assert "pick & <place>.mcap" in words
    cells = {row[0]: row[1:] for row in shown.rows}
    for index, name in enumerate(tactid.VALUE_NAMES):
        value, around, low, high = map(float, cells[name][1:])
        assert low <= value <= high
        assert around == pytest.approx(1.96 * found.estimate.std_devs[index], rel=0.05)
        assert value == pytest.approx(found.estimate.values[index], abs=0.06 * around)
    moments = [float(cells[name][1]) for name in MOMENT_NAMES]
    assert moments == pytest.approx(found.principal_moments.values, rel=0.01)
    assert float(cells["force y"][1]) == pytest.approx(0.12, rel=0.05)
    assert cells["moment z"][4] == "99.98 %"
    assert "<inertial>" in words
    assert "12.3 ms ± 0.78 ms" in words
    assert "Every value is known within 0.5 % after another" in " ".join(
        Page(text_of(found, 0.005)).words
    )


def test_what_is_not_identifiable_is_no_number() -> None:
    found = doubles.turned_about_one_axis()
    shown = page_of(found)
    unknown = [row[0] for row in shown.rows if row[-1] == "unobservable"]
    inertia = [f"I{axes}" for axes in ("xx", "xy", "xz", "yy", "yz")]
    assert unknown == ["com z", *inertia, *MOMENT_NAMES]
    words = " ".join(shown.words)
    for advice in remarks.motion_advice(found.estimate.not_identifiable):
        assert words.count(advice) == 1
    assert "The centre of mass is not known." in words
    assert "no inertial for URDF: com z, Ixx" in words


def test_remarks_damage_and_advice_are_shown() -> None:
    finding = Finding("wrenches_summed", {"topics": ["/<left>", "/right"]})
    found = replace(doubles.effort(joints=1), findings=[finding], damage=["cut at byte 7"])
    words = " ".join(page_of(found).words)
    assert "The wrenches of /<left> and /right are summed." in words
    assert "Damage: cut at byte 7" in words
    (advice,) = remarks.motion_advice(["Ixx"])
    unknown = doubles.with_estimate(
        found, observability=doubles.observability([True] * 4 + [False] + [True] * 5)
    )
    assert advice in " ".join(page_of(unknown).words)
    assert "Nothing was noticed" not in words


def test_friction_is_named_where_efforts_are_measured() -> None:
    sentence = "Friction in the joints is the usual reason for large residuals of joint efforts"
    text = text_of(doubles.effort(joints=1), style="command-line")
    assert sentence in text
    assert "--unloaded" in text
    assert sentence not in text_of(doubles.tactile(duration=2.0))


def test_the_head_says_that_the_data_contradict_the_result() -> None:
    sound = doubles.tactile(duration=2.0)
    certain = doubles.offset_finding(12.0, mass_change=0.6)
    text = text_of(replace(sound, findings=[certain]))
    head = f'<p class="warn">The data contradict this result. {html.escape(str(certain))}</p>'
    assert text.index("</h1>") < text.index(head) < text.index("<table>")
    assert "<inertial" not in html.unescape(text)
    assert "`accept_contradicted` gives the result as it is." in text
    assert 'class="warn"' not in text_of(sound)


def test_an_outlier_beyond_the_axis_has_an_arrow() -> None:
    found = doubles.tactile(duration=4.0)
    measured = found.fit.measured.copy()
    (first, *_) = np.flatnonzero(recording_plots.outliers(found.fit))
    measured[first, 0] += 1000.0
    axes = recording_plots.figures(doubles.with_fit(found, measured=measured))["residuals"].axes[0]
    (arrow,) = (line for line in axes.lines if line.get_marker() == "^" and len(line.get_xdata()))
    assert found.fit.times_s[first] in arrow.get_xdata()
    assert max(arrow.get_ydata()) < axes.get_ylim()[1]


@pytest.mark.parametrize("name", doubles.DEGENERATE)
def test_whatever_was_found_there_is_a_report(name: str) -> None:
    assert re.search(r"\b(nan|inf)\b", degenerate(name).lower()) is None


def test_an_impossible_body_has_no_ellipsoid() -> None:
    words = degenerate("impossible")
    assert "no body can have this inertia" in words
    assert "uniform solid ellipsoid" not in words
    assert words.count("no body can have this estimate") == 3


def test_names_may_be_of_any_script_and_hold_no_formula() -> None:
    names = ["effort $x_{$", "effort 关节", "<b>", "&amp;", "a\nb", "", "effort \\frac{"]
    found = doubles.with_estimate(doubles.effort(), frame="手")
    found = doubles.with_fit(found, channels=[Channel(name, "N m") for name in names])
    found = replace(found, inputs={"the log": Path("ログ")})
    text = recording_report.render(found)
    assert html.escape("<b>") in text
    assert Page(text).open == []


def test_a_long_recording_makes_no_larger_report() -> None:
    found = doubles.tactile(duration=400.0)
    assert len(found.fit.times_s) == 20_000
    assert len(recording_report.render(found)) < 3_000_000


def test_a_peak_in_what_is_left_is_found_across_gaps() -> None:
    """A sine of 0.1 N at 3.1 Hz over noise of 0.12 N, and its level: 2 s / √2 of white noise."""
    found = doubles.tactile(duration=100.0).fit
    left = (found.measured - found.predicted)[:, 0]
    left[recording_plots.outliers(found)] = np.nan
    kept = np.ones(len(left), dtype=bool)
    kept[1000:1100] = False
    frequency, density = recording_plots.spectrum(found.times_s[kept], left[kept])
    assert frequency[density.argmax()] == pytest.approx(3.1, abs=0.2)
    level = np.median(density[frequency > 6])
    assert level == pytest.approx(0.12 * np.sqrt(2 * doubles.STRIDE), rel=0.05)
    assert frequency[-1] == pytest.approx(0.5 / doubles.STRIDE)
    short, _ = recording_plots.spectrum(found.times_s[:9], left[:9])
    assert short.size == 0


def test_weak_directions_are_named_by_what_they_are_made_of() -> None:
    found = doubles.turned_about_one_axis()
    fit, observed = found.fit, recording_plots.observed(found.estimate)
    relative, weak = recording_plots.relative_excitation(fit, observed)
    names = [recording_plots.composition(row) for row in fit.excitation_directions]
    assert relative[0] == 1
    assert {name for name, faint in zip(names, weak, strict=True) if faint} == {
        "mass*com z",
        "Ixx",
        "Ixy",
        "Iyy",
    }
    assert recording_plots.composition(np.sqrt([0.6, 0, 0, 0.35, 0.05, *[0] * 5])) == (
        "60 % mass, 35 % mass*com z, 5 % Ixx"
    )
    moving = doubles.tactile().fit
    assert not recording_plots.relative_excitation(moving, [True] * 10)[1].any()


def test_windows_that_count_less_are_marked_where_they_were_used() -> None:
    found = doubles.tactile().fit
    marked = recording_plots.outliers(found)
    assert marked.any()
    assert not marked[found.held_out].any()
    np.testing.assert_array_equal(marked, found.weights < 0.5)
    none = replace(found, weights=np.where(found.held_out, 0.0, 1.0))
    assert not recording_plots.outliers(none).any()


def around(value: float, half_width: float) -> Interval:
    return Interval(value - half_width, value + half_width)


def test_an_interval_has_two_figures() -> None:
    assert recording_report.with_interval(1.23456, around(1.23456, 0.00789)) == (
        "1.2346",
        "0.0079",
        "1.2267",
        "1.2425",
    )
    assert recording_report.with_interval(-0.00001, around(-0.00001, 0.02))[0] == "0.000"
    wide = recording_report.with_interval(1234.5, around(1234.5, 870.0))
    assert wide == ("1234", "870", "364", "2104")
    # Cut at what a body can have, an interval has two ends and no half.
    cut = recording_report.with_interval(0.02, Interval(0.0, 0.05))
    assert cut == ("0.020", "–", "0.000", "0.050")
    assert recording_report.with_interval(1.5, None) == ("1.5", "–", "–", "–")


def test_the_double_finds_the_body_that_it_was_made_of() -> None:
    """Else nothing above would be shown a realistic recording."""
    found = doubles.tactile()
    error = np.abs(found.estimate.values - BODY)
    assert (error < 4 * found.estimate.std_devs).all()
    assert found.estimate.is_physical
    semi_axes, _ = ellipsoid(BODY)
    assert (semi_axes > 0.02).all()


@pytest.mark.parametrize(
    ("form", "begin"), [("png", b"\x89PNG"), ("svg", b"<?xml"), ("pdf", b"%PDF")]
)
def test_figures_are_also_files(tmp_path: Path, form: Any, begin: bytes) -> None:
    found = doubles.turned_about_one_axis()
    recording_report.write_report(found, tmp_path / "report.html", form=form)
    files = sorted(tmp_path.glob(f"report_*.{form}"))
    names = ["excitation", "fit", "parameters", "residuals"]
    assert [file.stem for file in files] == [f"report_{name}" for name in names]
    assert all(file.read_bytes().startswith(begin) for file in files)
    if form == "svg":
        assert ">com z</text>" in (tmp_path / "report_parameters.svg").read_text()


def test_each_figure_has_a_file_of_its_own() -> None:
    names = ["a.1", "a_1", "A 1", "a_1_2", "関節", "軸"]
    files = figure_paths(Path("arm.html"), names, "svg")
    stems = ["a_1", "a_1_2", "A_1_3", "a_1_2_2", "figure", "figure_2"]
    assert files == {name: Path(f"arm_{stem}.svg") for name, stem in zip(names, stems, strict=True)}


def test_a_figure_replaces_no_file_that_was_read(tmp_path: Path) -> None:
    log = tmp_path / "run.mcap"
    log.write_bytes(b"log")
    (tmp_path / "report_point.svg").symlink_to(log)
    found = replace(doubles.tactile(), inputs={"the log": log})
    with pytest.raises(tactid.ArgumentError, match="the figure point of the report and the log"):
        found.write_report(tmp_path / "report.html", figures="svg")
    assert log.read_bytes() == b"log"
    assert not (tmp_path / "report.html").exists()


@pytest.mark.parametrize(
    ("channels", "method", "without_moments", "measured"),
    [
        (["moment z"], "tactile", False, True),
        (["moment z"], "tactile", True, False),
        (["moment z"], "combined", True, True),
        (["force x", *MOMENT_CHANNELS], "tactile", False, False),
    ],
)
def test_only_measured_moments_show_the_inertia(
    channels: list[str], method: Any, without_moments: bool, measured: bool
) -> None:
    data = {"channels": channels, "is_left_out": True, "without_moments": without_moments}
    finding = Finding("constant_channels", data)
    found = replace(doubles.tactile(), method=method, findings=[finding])
    assert remarks.measures_moments(found) == measured


def test_no_motion_is_proposed_for_the_inertia_where_no_moment_is_measured() -> None:
    known = doubles.observability([True] * 4 + [False] * 6)
    std_devs = np.where(np.arange(10) < 4, 1e-6, np.inf)
    found = doubles.with_estimate(doubles.tactile(), std_devs=std_devs, observability=known)
    data = {"source": "/wrench", "frame": "tool0", "channels": MOMENT_CHANNELS, "is_zero": True}
    data |= {"is_left_out": True, "without_moments": True}
    forces = replace(found, findings=[Finding("constant_channels", data)])
    assert outlook.needs_another_motion(found)
    assert not outlook.needs_another_motion(forces)
    turned = doubles.with_estimate(forces, observability=["unobservable"] * 10)
    assert outlook.needs_another_motion(turned)


def test_the_panel_of_an_exact_mass_shows_no_rounding() -> None:
    found = doubles.tactile()
    mass = float(found.estimate.values[0])
    values, std_devs = found.history.values.copy(), found.history.std_devs.copy()
    values[:, 0] = mass * (1 + 1e-10 * np.cos(np.arange(len(values))))
    std_devs[:, 0] = 1e-9 * mass
    found = doubles.with_history(found, values=values, std_devs=std_devs)
    low, high = recording_plots.figures(found)["parameters"].axes[0].get_ylim()
    assert (low, high) == pytest.approx((0.8 * mass, 1.2 * mass))


def test_another_format_of_figures_is_refused(tmp_path: Path) -> None:
    found = doubles.turned_about_one_axis()
    with pytest.raises(tactid.ArgumentError, match="expected one of 'png', 'svg' and 'pdf'"):
        recording_report.write_report(found, tmp_path / "report.html", form="jpg")
    with pytest.raises(tactid.ArgumentError, match=r"ends in \.html"):
        check_report("`path`", tmp_path / "report.pdf", None)
