"""The report of a recording: one HTML file with the result and the reasons to trust it."""

import html
import math
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tactid._base.errors import IdentificationError
from tactid._base.naming import Style, option_name
from tactid._base.output_files import FigureFormat
from tactid._base.values import Z95, Interval, Values, digits_of
from tactid._results.identification import IdentificationData, Recorded
from tactid._results.records import FitReport
from tactid._results.table import OF_SHAPE
from tactid._show import body_plot, captions, page, recording_plots, reported
from tactid._show.drawing import Figures
from tactid._show.outlook import WITHIN, outlook
from tactid._show.remarks import (
    calibration,
    gravity,
    is_at_rest,
    knowledge,
    remarks,
    subtracted_weight,
    wrench_offset,
)

METHODS = {
    "tactile": "measured wrenches, and motion",
    "effort": "joint efforts, and motion",
    "joint-sensing": "momentum of base and joints",
    "combined": "wrenches, joint efforts and momentum together",
}

MAKER_TITLES = {
    "ur": "Universal Robots",
    "franka": "Franka",
    "kuka": "KUKA",
    "abb": "ABB",
}

HELD_OUT = """{} of {} windows are held out. Residuals there should be as small as in the fit.
Windows with outliers count little in the weighted numbers, and as much as any other in the plain
ones: where these are far worse, a contact or another disturbance is in the recording. A channel in
which the motion changes nothing contains only noise, of which little is predicted."""

ALL_POSES = """A pose that was left out counts in the plain numbers alone. A channel in which the
attitudes change nothing contains only noise, of which little is predicted."""

CONTRADICTED = """The data contradict the result, and another program would take it for right:
correct what contradicts it and identify again. {option} gives the result as it is."""

FRICTION = """Friction in the joints is the usual reason for large residuals of joint efforts: no
interval contains its error. An unloaded recording of the same motion ({option}) subtracts most of
it."""


def write_report(
    result: Recorded,
    path: Path,
    within: float = WITHIN,
    style: Style = "keyword",
    form: FigureFormat | None = None,
) -> list[Path]:
    """Writes the report of a result; returns the paths of its figures beside it."""
    figures = Figures(form)
    return figures.write(path, render(result, within, style, figures))


def render(
    result: Recorded,
    within: float = WITHIN,
    style: Style = "keyword",
    figures: Figures | None = None,
) -> str:
    """Returns the report as HTML, figures included.

    Args:
        result: The identification.
        within: Target precision, as :meth:`Identification.remaining` takes it.
        style: Who reads the sentences: it decides how they spell options.
        figures: Draws the figures.
    """
    values, half_widths = result.estimate.reported_values, result.estimate.half_widths
    figures = figures or Figures()
    said = captions.AT_REST if is_at_rest(result) else captions.RECORDING
    shown = {
        name: figures.html(name, drawn, said[name])
        for name, drawn in recording_plots.figures(result).items()
    }
    frame = html.escape(result.estimate.frame)

    fit = advice = ""
    if isinstance(result, IdentificationData):
        advice = _advice(result, within)
        fit = f"""<h2>Measured and predicted</h2>
{_agreement(result.fit, at_rest=is_at_rest(result))}
{shown["fit"]}
<h2>Residuals</h2>
{_friction(result, style)}
{shown["residuals"]}"""
    over_time = ""
    if "parameters" in shown:
        over_time = f"<h2>Over time</h2>\n{shown['parameters']}"
    return page.document(
        f"tactid: the payload at {result.estimate.frame}",
        f"""<h1>The payload at <code>{frame}</code></h1>
<p class="lead">From <code>{html.escape(result.source_name)}</code>. Everything is in the frame
<code>{frame}</code> and along its axes, the inertia about the centre of mass.</p>
{page.contradiction(result.is_contradicted, remarks(result, style))}{_table(result)}
<h2>Remarks</h2>
{_remarks(result, style)}
<h2>Position and size</h2>
{_body(result, values, half_widths, figures)}
{fit}
{over_time}
<h2>Excitation by the {"poses" if is_at_rest(result) else "motion"}</h2>
{advice}
{shown.get("excitation", "")}
<h2>Formats for other programs</h2>
{payload_forms(result, style)}
<h2>The identification</h2>
{page.facts(_facts(result))}""",
    )


def with_interval(value: float, interval: Interval | None) -> tuple[str, str, str, str]:
    """Formats value, half width and both ends of the interval to two figures of the half width.

    An interval that is cut at what a body can have has no half width.
    """
    half_width = 0.0 if interval is None else interval.half_width(value)
    if interval is None or not half_width:
        return f"{value:.6g}", "–", "–", "–"
    digits = digits_of(half_width, most=15)
    numbers = (value, half_width, *interval)
    shown = [f"{round(number, digits) + 0.0:.{digits}f}" for number in numbers]
    return shown[0], "–" if interval.is_cut(value) else shown[1], shown[2], shown[3]


def explained(
    fit: FitReport, windows: NDArray[np.bool_], *, weighted: bool = True
) -> list[float | None]:
    """Returns the fraction of each channel's variance in these windows that is predicted.

    The windows have their robust weights, or count alike.
    """
    measured, predicted = fit.measured[windows], fit.predicted[windows]
    weight = np.nan_to_num(fit.weights[windows], nan=0.0, posinf=0.0)
    # Held-out windows without any weight have the full one.
    weight = weight if weighted and weight.any() else np.ones_like(weight)
    total = weight.sum()
    fractions: list[float | None] = []
    for values, fitted in zip(measured.T, predicted.T, strict=True):
        mean = weight @ values / total if total > 0 else 0.0
        variance = weight @ (values - mean) ** 2
        fraction = 1 - weight @ (values - fitted) ** 2 / variance if variance > 0 else math.nan
        fractions.append(float(fraction) if math.isfinite(fraction) else None)
    return fractions


def _table(result: Recorded) -> str:
    rows, column = [], reported.column(result)
    title, empty = (
        ("", "") if column.shape_fractions is None else (f"<th>{OF_SHAPE}</th>", "<th></th>")
    )
    for row in column.rows:
        cells = f'<td>{row.name}</td><td class="unit">{row.unit}</td>'
        if row.value is None:
            cells += f'<td class="none" colspan="4">{row.number}</td>'
        else:
            shown, around, low, high = with_interval(row.value, row.interval)
            cells += f'<td class="value">{shown}</td><td>{around}</td><td>{low}</td><td>{high}</td>'
        cells += f"<td>{row.of_shape}</td>" if title else ""
        rows.append(f"<tr{' class=last' if row.ends_kind else ''}>{cells}</tr>\n")
    return f"""<div class="wide"><table>
<caption>The interval contains the true value with 95 % probability, if noise is the only error.
Moments 1 to 3 are the principal moments of inertia about the centre of mass, ascending. Moments
that noise could make equal have wider intervals, which contain the truth more often. No interval
reaches further than a body can; one that is cut there has no ±.</caption>
<thead><tr><th></th><th></th><th></th><th colspan="3">95 % interval</th>{empty}</tr>
<tr><th>parameter</th><th></th><th>value</th><th>±</th><th>from</th><th>to</th>{title}</tr></thead>
<tbody>{"".join(rows)}</tbody></table></div>"""


def _remarks(result: Recorded, style: Style) -> str:
    lines = [*remarks(result, style), *(f"Damage: {line}" for line in result.damage)]
    if not lines:
        return "<p>Nothing was noticed: see the held-out windows below.</p>"
    return f"<ul>{''.join(f'<li>{html.escape(line)}</li>' for line in lines)}</ul>"


def _friction(result: IdentificationData, style: Style) -> str:
    is_corrected = result.subtracts_unloaded or result.calibrated is not None
    if result.method not in ("effort", "combined") or is_corrected:
        return ""
    return f"<p>{html.escape(FRICTION.format(option=option_name('unloaded', style)))}</p>"


def _advice(result: IdentificationData, within: float) -> str:
    sentence = outlook(result, within)
    if sentence is None:
        return ""
    bias = "An error of the model, such as a sign or a frame, is a bias that no time reduces."
    return f"<p>{html.escape(sentence)} {bias}</p>"


def _body(result: Recorded, values: Values, half_widths: Values, figures: Figures) -> str:
    solid = None not in values and result.estimate.is_physical
    drawn = body_plot.ellipsoid(values, half_widths, solid=solid)
    if drawn is None:
        return "<p>The centre of mass is not known.</p>"
    if solid:
        return figures.html("ellipsoid", drawn, captions.RECORDING["ellipsoid"])
    reason = "the inertia is not known" if None in values else "no body can have this inertia"
    point = figures.html("point", drawn, captions.RECORDING["point"])
    return f"<p>There is no ellipsoid to draw: {reason}.</p>{point}"


def _agreement(fit: FitReport, *, at_rest: bool) -> str:
    residuals = fit.measured - fit.predicted
    plain = np.sqrt(np.mean(residuals**2, axis=0)) if len(residuals) else fit.residual_rms
    groups = (
        (fit.residual_rms, fit.held_out_rms, _fractions(fit, weighted=True)),
        (plain, fit.held_out_plain_rms, _fractions(fit, weighted=False)),
    )
    shown = 1 if at_rest else 2  # of poses, none are held out
    rows = []
    for index, channel in enumerate(fit.channels):
        cells = "".join(
            "".join(pair[:shown])
            for fitted, held, (seen, unseen) in groups
            for pair in (
                _pair(_rms(float(fitted[index])), _rms(float(held[index]))),
                _pair(_percent(seen[index]), _percent(unseen[index])),
            )
        )
        rows.append(
            f"<tr><td>{html.escape(channel.name)}</td>"
            f'<td class="unit">{html.escape(channel.unit)}</td>{cells}</tr>\n'
        )
    counts = np.count_nonzero(fit.held_out), len(fit.held_out)
    columns = "".join(("<th>fit</th>", "<th>held out</th>")[:shown]) * 4
    kinds = "".join(
        f'<th colspan="{shown}">{kind}</th>' for kind in ("rms residual", "variance predicted")
    )
    groups_of = "".join(f'<th colspan="{2 * shown}">{name}</th>' for name in ("weighted", "plain"))
    return f"""<div class="wide"><table>
<caption>{ALL_POSES if at_rest else HELD_OUT.format(*counts)}</caption>
<thead><tr><th></th><th></th>{groups_of}</tr>
<tr><th></th><th></th>{kinds * 2}</tr>
<tr><th>channel</th><th></th>{columns}</tr></thead>
<tbody>{"".join(rows)}</tbody></table></div>"""


def _pair(of_fit: str, of_held_out: str) -> tuple[str, str]:
    """Returns a cell of the fit, and one of the held-out windows."""
    return f"<td>{of_fit}</td>", f'<td class="value">{of_held_out}</td>'


def _fractions(fit: FitReport, *, weighted: bool) -> tuple[list[float | None], list[float | None]]:
    """Returns which part of the variance is predicted in the fit, and in the held-out windows."""
    seen = explained(fit, ~fit.held_out, weighted=weighted)
    return seen, explained(fit, fit.held_out, weighted=weighted)


def _rms(value: float) -> str:
    return f"{value:.3g}" if math.isfinite(value) else "–"


def _percent(fraction: float | None) -> str:
    return "–" if fraction is None else f"{round(100 * fraction, 2) + 0.0:.2f} %"


def payload_forms(result: reported.Result, style: Style) -> str:
    """Returns the payload in the formats of other programs as HTML, each to unfold.

    Lines for the controllers of makers are there as far as the values they need are known. There
    are none where the data contradict the result; of what can be no body, each says so itself.
    """
    if result.is_contradicted and result.estimate.why_impossible is None:
        option = option_name("accept_contradicted", style)
        return f"<p>{html.escape(CONTRADICTED.format(option=option))}</p>"
    forms: dict[str, Callable[..., str]] = {
        "For a robot controller": result.to_controller,
        "URDF": result.to_urdf,
        "MuJoCo": result.to_mujoco,
    }
    parts = []
    for title, form in forms.items():
        try:
            text = f"<pre>{html.escape(form(accept_contradicted=True))}</pre>"
        except IdentificationError as error:
            text = f"<p>{html.escape(str(error))}</p>"
        parts.append(_folded(title, text))
    for maker, title in MAKER_TITLES.items():
        with suppress(IdentificationError):
            line = result.to_controller(maker, accept_contradicted=True)
            parts.append(_folded(title, f"<pre>{html.escape(line)}</pre>"))
    return "".join(parts)


def _folded(title: str, content: str) -> str:
    return f"<details><summary>{title}</summary>{content}</details>\n"


def _facts(result: Recorded) -> dict[str, str]:
    facts = {
        "frame": result.estimate.frame,
        "method": METHODS.get(result.method, result.method),
        "estimator": result.estimator,
    }
    if is_at_rest(result):
        facts["poses"] = f"{result.estimate.windows}"
    else:
        facts |= _of_motion(result)
    if isinstance(result, IdentificationData):
        facts |= _of_least_squares(result)
    return facts | {"gravity": gravity(result)} | result.provenance


def _of_motion(result: Recorded) -> dict[str, str]:
    windows, delay = f"{result.estimate.windows}", _quantity(1e3 * result.delay_s, "ms")
    if isinstance(result, IdentificationData):
        stride = _quantity(result.fit.stride_s, "s")
        windows = f"{len(result.fit.times_s)}, one every {stride}"
        if result.estimated_delay is not None:
            delay += f" ± {1e3 * Z95 * result.estimated_delay.std_dev_s:.2g} ms"
    return {
        "duration": _quantity(result.duration_s, "s"),
        "windows": windows,
        "cutoff": _quantity(result.cutoff_hz, "Hz"),
        "delay of the wrenches": delay,
    }


def _of_least_squares(result: IdentificationData) -> dict[str, str]:
    return {
        "wrench offset": wrench_offset(result) or "assumed to be zero",
        **(
            {"weight subtracted by the driver": weight}
            if (weight := subtracted_weight(result))
            else {}
        ),
        **_calibration(result),
        "given of the payload": ", ".join(knowledge(result)) or "nothing",
    }


def _calibration(result: IdentificationData) -> dict[str, str]:
    fit = result.calibrated
    if fit is None:
        return {}
    misfits = zip(fit.joints, fit.misfit, strict=True)
    return {
        "calibration": calibration(result),
        "misfit of each joint": ", ".join(f"{joint} {misfit:.2g}" for joint, misfit in misfits),
    }


def _quantity(value: float, unit: str) -> str:
    return f"{value:.4g} {unit}" if math.isfinite(value) else "not known"
