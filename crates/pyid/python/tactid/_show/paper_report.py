"""The report of the paper's experiment: one HTML file that needs nothing else."""

import html
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from tactid._base.values import KINDS, UNITS
from tactid._native import VALUE_NAMES
from tactid._results import table
from tactid._results.paper_values import PAPER_ERRORS, PAPER_VALUES, is_the_papers
from tactid._results.truth import Truth
from tactid._show import page

CAPTIONS = {
    "figure_05": "All ten parameters in the last pass: the largest error within each "
    "150th of the run, in percent of the nominal value, or for a zero of the largest of its kind.",
    "figure_06": "Mass and centre of mass along x.",
    "figure_07": "Centre of mass along y and z.",
    "figure_08": "Moment of inertia about x and product xy.",
    "figure_09": "Moment of inertia about y and product xz.",
    "figure_10": "Moment of inertia about z and product yz.",
}


@dataclass(frozen=True)
class Report:
    """Content of a report."""

    truth: Truth
    columns: Sequence[table.Column]
    facts: dict[str, str]
    """Facts about the run, by name."""
    notes: Sequence[str]
    """What a reader must know to trust the numbers."""
    experiment: str
    """The experiment as TOML."""
    figures: str
    """Figures as HTML."""


def render(report: Report) -> str:
    """The report as HTML, figures included."""
    notes = "".join(f"<p>{html.escape(note)}</p>" for note in report.notes)
    return page.document(
        "tactid: the payload of a free-floating robot",
        f"""<h1>The payload, identified</h1>
<p class="lead">A free-floating spacecraft with a six-joint arm holds an unknown payload between two
fingers; its mass, centre of mass and inertia follow from what fingers and joints feel. After Hou,
Lu, Yu, Wang, Journal of Astronautics 37(10), 2016, section 4. Everything is in the end-effector
frame <code>{html.escape(report.facts["end-effector frame"])}</code>, the inertia about the centre
of mass.</p>
<h2>Table 2</h2>
{_table(report)}
{notes}
<h2>Over time</h2>
{report.figures}
<h2>The run</h2>
{page.facts(report.facts)}
<h2>The experiment</h2>
<pre>{html.escape(report.experiment.strip())}</pre>""",
    )


def _table(report: Report) -> str:
    with_paper = is_the_papers(report.truth)
    titles = (["paper"] if with_paper else []) + [column.title for column in report.columns]
    groups = "".join(f'<th colspan="2">{html.escape(title)}</th>' for title in titles)
    heads = "<th>value</th><th>error %</th>" * len(titles)
    rows = "".join(_row(report, index, with_paper) for index in range(len(VALUE_NAMES)))
    worst = "".join(
        f'<td></td><td class="value">{table.percent(table.worst(column.errors or []))}</td>'
        for column in report.columns
    )
    paper = f"<td></td><td>{max(PAPER_ERRORS):.2f}</td>" if with_paper else ""
    return f"""<div class="wide"><table>
<caption>Errors in percent of the nominal value; for a zero, of the largest nominal value of its
kind.</caption>
<thead><tr><th></th><th></th><th></th>{groups}</tr>
<tr><th>parameter</th><th></th><th>nominal</th>{heads}</tr></thead>
<tbody>{rows}
<tr><td>largest error</td><td></td><td></td>{paper}{worst}</tr></tbody></table></div>"""


def _row(report: Report, index: int, with_paper: bool) -> str:
    cells = [
        f"<td>{VALUE_NAMES[index]}</td>",
        f'<td class="unit">{UNITS[index]}</td>',
        f"<td>{report.truth.nominal[index]:.2f}</td>",
    ]
    if with_paper:
        cells.append(f"<td>{PAPER_VALUES[index]:.2f}</td>")
        cells.append(f"<td>{PAPER_ERRORS[index]:.2f}</td>")
    for column in report.columns:
        value = column.values[index]
        if value is None:
            cells.append('<td class="none" colspan="2">unobservable</td>')
        else:
            error: Any = None if column.errors is None else column.errors[index]
            cells.append(f'<td class="value">{table.number(value)}</td>')
            cells.append(f"<td>{table.percent(error)}</td>")
    last = any(index == kind.stop - 1 for kind in KINDS)
    return f"<tr{' class=last' if last else ''}>{''.join(cells)}</tr>\n"
