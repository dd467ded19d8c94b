"""The report of several recordings: one HTML file with each of them beside the whole."""

import html
from pathlib import Path

from tactid._base.naming import Style
from tactid._base.output_files import FigureFormat
from tactid._results.combination import CombinationData
from tactid._show import captions, page
from tactid._show.combination_text import (
    ROW_TITLES,
    columns,
    combined_remarks,
    lines,
    row_cells,
)
from tactid._show.drawing import Figures
from tactid._show.forest_plot import forest
from tactid._show.recording_report import payload_forms

CAPTION = """Each value with its 95 % interval, from all recordings together and, for up to four,
from each alone. If noise is the only error, the interval contains the true value with 95 %
probability. That of all also includes what varies from recording to recording, and neither
includes what is wrong in all recordings alike, except for the uncertainty of gains and of a
calibration."""

DISTANCES = """Mass of each recording alone, and its distance from all others together, whose
probability is that of at least this distance if noise were the only difference. A recording that
differs while the others agree is the one to look at."""


def write_report(
    result: CombinationData,
    path: Path,
    style: Style = "keyword",
    form: FigureFormat | None = None,
) -> list[Path]:
    """Writes the report of several recordings; returns the paths of its figure beside it."""
    figures = Figures(form)
    return figures.write(path, render(result, style, figures))


def render(
    result: CombinationData, style: Style = "keyword", figures: Figures | None = None
) -> str:
    """Returns the report as HTML, figures included.

    Args:
        result: The combination.
        style: Who reads the sentences: it decides how they spell options.
        figures: Draws the figures.
    """
    frame = html.escape(result.estimate.frame)
    remarks = "".join(f"<li>{html.escape(line)}</li>" for line in lines(result, style))
    return page.document(
        f"tactid: the payload at {result.estimate.frame} from {len(result.runs)} recordings",
        f"""<h1>The payload at <code>{frame}</code> from {len(result.runs)} recordings</h1>
<p class="lead">Everything is in the frame <code>{frame}</code> and along its axes, the inertia
about the centre of mass.</p>
{page.contradiction(result.is_contradicted, combined_remarks(result, style))}{_table(result)}
<h2>Remarks</h2>
<ul>{remarks}</ul>
<h2>The recordings beside the whole</h2>
{(figures or Figures()).html("values", forest(result), captions.COMBINATION["values"])}
<h2>Agreement</h2>
{_distances(result)}
<h2>Formats for other programs</h2>
{payload_forms(result, style)}""",
    )


def _table(result: CombinationData) -> str:
    heads = [column.title for column in columns(result)]
    titles = "".join(f'<th colspan="2">{html.escape(head)}</th>' for head in heads)
    below = "<th>value</th><th>±</th>" * len(heads)
    rows = []
    for row in zip(*(column.rows for column in columns(result)), strict=True):
        cells = f'<td>{row[0].name}</td><td class="unit">{row[0].unit}</td>'
        for place, entry in enumerate(row):
            if entry.value is None:
                cells += f'<td class="none" colspan="2">{entry.number}</td>'
                continue
            kind = ' class="value"' if place == 0 else ""
            cells += f"<td{kind}>{entry.number}</td><td>{entry.around}</td>"
        rows.append(f"<tr{' class=last' if row[0].ends_kind else ''}>{cells}</tr>\n")
    return f"""<div class="wide"><table>
<caption>{CAPTION}</caption>
<thead><tr><th></th><th></th>{titles}</tr>
<tr><th>parameter</th><th></th>{below}</tr></thead>
<tbody>{"".join(rows)}</tbody></table></div>"""


def _distances(result: CombinationData) -> str:
    shown = zip(result.names, row_cells(result), strict=True)
    rows = "".join(
        f"<tr>{''.join(f'<td>{html.escape(cell)}</td>' for cell in (name, *cells))}</tr>\n"
        for name, cells in shown
    )
    titles = "".join(f"<th>{title}</th>" for title in ("recording", *ROW_TITLES))
    return f"""<div class="wide"><table>
<caption>{DISTANCES}</caption>
<thead><tr>{titles}</tr></thead>
<tbody>{rows}</tbody></table></div>"""
