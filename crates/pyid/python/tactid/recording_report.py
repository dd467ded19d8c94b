"""The report of a recording: one HTML file that says what was found and why to believe it."""

import html
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tactid import body_plot, forms, page, recording_plots, result
from tactid.errors import IdentificationError
from tactid.recording import Recording
from tactid.result import KINDS, Values
from tactid.table import MOMENT_NAMES, MOMENT_UNIT, NAMES, NOT_IDENTIFIABLE, UNITS

WAYS = {
    "tactile": "wrenches felt, and motion",
    "effort": "joint efforts, and motion",
    "joint-sensing": "momentum of base and joints",
    "combined": "wrenches, joint efforts and momentum together",
}

CAPTIONS = {
    "fit": "Each channel as it was measured, and as the estimate predicts it. What is held out was "
    "not shown to the estimator: there the two lines agree only if the estimate is right.",
    "residuals": "What is left over time, and its spectrum beside that of the signal. A level "
    "spectrum is noise; a peak is a vibration, a cable or a wrong delay. The dotted line is where "
    "measurements are smoothed away.",
    "parameters": "What the recording had told up to each moment. The dashed line is the result.",
    "excitation": "Ten directions in the space of the parameters, each named by what it is made "
    "of; the inertia is that about the frame's origin here, and m·x the first moment. A faint one "
    "is known badly.",
    "ellipsoid": "The uniform solid ellipsoid with this mass and inertia where it sits in the "
    "frame. The payload should have about its size and attitude.",
    "point": "The centre of mass in the frame.",
}


def write_report(
    found: Recording, source_name: str, path: Path, within: float = result.WITHIN
) -> None:
    """Writes the report of what a source, a log say, has told."""
    result.write_atomically(path, render(found, source_name, within))


def render(found: Recording, source_name: str, within: float = result.WITHIN) -> str:
    """The report as HTML, figures included; ``within`` is the precision to be reached."""
    values, half_widths = result.estimate_values(found), result.half_widths(found)
    figures = recording_plots.figures(found)

    def figure(name: str) -> str:
        return page.figure(figures[name], CAPTIONS[name])

    return page.document(
        f"tactid: what {found.tool} holds",
        f"""<h1>What <code>{html.escape(found.tool)}</code> holds</h1>
<p class="lead">From <code>{html.escape(source_name)}</code>. Everything is in the frame
<code>{html.escape(found.tool)}</code> and along its axes, the inertia about the centre of mass.</p>
{_table(found)}
<h2>Before you trust it</h2>
{_remarks(found)}
<h2>Where it sits</h2>
{_body(found, values, half_widths)}
<h2>Measured and predicted</h2>
{_agreement(found)}
{figure("fit")}
<h2>What is left</h2>
{figure("residuals")}
<h2>Over time</h2>
{figure("parameters")}
<h2>What the motion told</h2>
{_advice(found, within)}
{figure("excitation")}
<h2>To take along</h2>
{_forms(values, found.tool)}
<h2>The identification</h2>
{page.facts(_facts(found))}""",
    )


def with_interval(value: float, half_width: float | None) -> tuple[str, str, str, str]:
    """Value, half width and both ends of the interval, to two figures of the half width."""
    if not half_width:
        return f"{value:.6g}", "–", "–", "–"
    digits = min(max(1 - math.floor(math.log10(half_width)), 0), 15)
    ends = (value, half_width, value - half_width, value + half_width)
    told = [f"{round(end, digits) + 0.0:.{digits}f}" for end in ends]
    return told[0], told[1], told[2], told[3]


def explained(found: Recording, part: NDArray[np.bool_]) -> list[float | None]:
    """How much of each channel's variance in these windows is predicted; 1 is all of it."""
    measured, predicted = found.fit_measured[part], found.fit_predicted[part]
    weight = np.nan_to_num(found.fit_weight[part], nan=0.0, posinf=0.0)
    # Where the estimator gave windows held out no weight, each counts in full.
    weight = np.where(weight.any(axis=0), weight, 1.0)
    fractions: list[float | None] = []
    for values, fitted, share in zip(measured.T, predicted.T, weight.T, strict=True):
        total = share.sum()
        mean = share @ values / total if total > 0 else 0.0
        spread = share @ (values - mean) ** 2
        fraction = 1 - share @ (values - fitted) ** 2 / spread if spread > 0 else math.nan
        fractions.append(float(fraction) if math.isfinite(fraction) else None)
    return fractions


def _table(found: Recording) -> str:
    values = result.estimate_values(found) + result.moments(found)
    half_widths = result.half_widths(found) + result.moment_half_widths(found)
    names, units = NAMES + MOMENT_NAMES, UNITS + (MOMENT_UNIT,) * 3
    rows = []
    for index, (value, half) in enumerate(zip(values, half_widths, strict=True)):
        cells = f'<td>{names[index]}</td><td class="unit">{units[index]}</td>'
        if value is None:
            cells += f'<td class="none" colspan="4">{NOT_IDENTIFIABLE}</td>'
        else:
            told, around, low, high = with_interval(value, half)
            cells += f'<td class="value">{told}</td><td>{around}</td><td>{low}</td><td>{high}</td>'
        last = any(index == kind.stop - 1 for kind in KINDS)
        rows.append(f"<tr{' class=last' if last else ''}>{cells}</tr>\n")
    return f"""<div class="wide"><table>
<caption>The interval holds the true value with 95 % probability, if nothing but noise disturbs.
Moments 1 to 3 are the principal moments of inertia about the centre of mass, ascending; of those
that noise could make equal the intervals are wider, and hold the truth more often.</caption>
<thead><tr><th></th><th></th><th></th><th colspan="3">95 % interval</th></tr>
<tr><th>parameter</th><th></th><th>value</th><th>±</th><th>from</th><th>to</th></tr></thead>
<tbody>{"".join(rows)}</tbody></table></div>"""


def _remarks(found: Recording) -> str:
    remarks = [*result.recording_remarks(found), *(f"Damage: {each}" for each in found.damage)]
    if not remarks:
        return "<p>Nothing conspicuous: see the windows held out below.</p>"
    return f"<ul>{''.join(f'<li>{html.escape(remark)}</li>' for remark in remarks)}</ul>"


def _advice(found: Recording, within: float) -> str:
    # Where something is not identifiable it stands among the remarks.
    lines = [] if found.estimate.not_identifiable else list(found.motion_advice)
    outlook = result.outlook(found, within)
    if outlook is not None:
        lines.append(f"{outlook} An error of the model, a sign or a frame, no time takes away.")
    return "".join(f"<p>{html.escape(line)}</p>" for line in lines)


def _body(found: Recording, values: Values, half_widths: Values) -> str:
    solid = None not in values and found.estimate.is_physical
    drawn = body_plot.ellipsoid(values, half_widths, solid=solid)
    if drawn is None:
        return "<p>The centre of mass is not known.</p>"
    if solid:
        return page.figure(drawn, CAPTIONS["ellipsoid"])
    reason = "the inertia is not known" if None in values else "no body can have this inertia"
    told = f"<p>There is no ellipsoid to draw: {reason}.</p>"
    return told + page.figure(drawn, CAPTIONS["point"])


def _agreement(found: Recording) -> str:
    held_out = found.fit_held_out
    seen, unseen = explained(found, ~held_out), explained(found, held_out)
    rows = []
    for index, name in enumerate(found.channels):
        fit, held = float(found.residual_rms[index]), float(found.held_out_rms[index])
        rows.append(
            f"<tr><td>{html.escape(name)}</td>"
            f'<td class="unit">{html.escape(found.channel_units[index])}</td>'
            f'<td>{_rms(fit)}</td><td class="value">{_rms(held)}</td>'
            f"<td>{_percent(seen[index])}</td>"
            f'<td class="value">{_percent(unseen[index])}</td></tr>\n'
        )
    return f"""<div class="wide"><table>
<caption>Held out are {np.count_nonzero(held_out)} of {len(held_out)} windows. As little left over
there as in the fit is a good sign; much more is not. Little can be predicted of a channel in which
the motion changes nothing: what varies there is noise.</caption>
<thead><tr><th></th><th></th><th colspan="2">rms left over</th>
<th colspan="2">of the variance predicted</th></tr>
<tr><th>channel</th><th></th><th>fit</th><th>held out</th><th>fit</th><th>held out</th></tr></thead>
<tbody>{"".join(rows)}</tbody></table></div>"""


def _rms(value: float) -> str:
    return f"{value:.3g}" if math.isfinite(value) else "–"


def _percent(fraction: float | None) -> str:
    return "–" if fraction is None else f"{round(100 * fraction, 2) + 0.0:.2f} %"


def _forms(values: Values, frame: str) -> str:
    parts = []
    titles: dict[forms.Form, str] = {
        "controller": "For a robot controller",
        "urdf": "URDF",
        "mujoco": "MuJoCo",
    }
    for form, title in titles.items():
        write: Callable[[Values, str], str] = forms.FORMS[form]
        try:
            text = f"<pre>{html.escape(write(values, frame))}</pre>"
        except IdentificationError as error:
            text = f"<p>{html.escape(str(error))}</p>"
        parts.append(f"<details><summary>{title}</summary>{text}</details>\n")
    return "".join(parts)


def _facts(found: Recording) -> dict[str, str]:
    delay = _told(1e3 * found.delay, "ms")
    if found.delay_deviation is not None:
        delay += f" ± {1e3 * result.Z95 * found.delay_deviation:.2g} ms"
    return {
        "from": WAYS.get(found.way, found.way),
        "estimator": found.estimator,
        "duration": _told(found.duration, "s"),
        "windows": f"{len(found.fit_time)}, one every {_told(found.stride, 's')}",
        "smoothed above": _told(found.cutoff, "Hz"),
        "delay of what is felt": delay,
        "offsets": "; ".join(result.told_offsets(found)) or "taken to be none",
        "given of the payload": ", ".join(result.known(found)) or "nothing",
        "gravity": ", ".join(_told(entry, "m/s²") for entry in found.gravity),
    }


def _told(value: float, unit: str) -> str:
    return f"{value:.4g} {unit}" if math.isfinite(value) else "not known"
