"""What several recordings say together, as a person reads it: the table, and lines below it."""

from html import escape
from typing import TYPE_CHECKING

import numpy as np

from tactid._base.naming import Style, listed
from tactid._base.text_table import as_text, empty_table
from tactid._native import distance_of_runs, probability
from tactid._results.combination import CombinationData
from tactid._results.provenance import sentence
from tactid._results.table import Column, heading, html_table, plain_text
from tactid._show import reported
from tactid._show.remarks import (
    assumptions,
    losses,
    measures_moments,
    remarks,
    uncertain_values,
    unobservable_values,
)

if TYPE_CHECKING:
    from rich.table import Table

WHOLE = "all"
"""Title of the column of all recordings together."""


MOST_COLUMNS = 4
"""Most recordings that have a column each: more are rows of a table of their own."""


def columns(result: CombinationData) -> list[Column]:
    """Returns the column of all recordings together, then one for each of them if they are few."""
    if len(result.runs) > MOST_COLUMNS:
        return [reported.column_of(WHOLE, result)]
    runs = zip(result.names, result.runs, strict=True)
    return [
        reported.column_of(WHOLE, result),
        *(reported.column_of(name, run) for name, run in runs),
    ]


def verdict(result: CombinationData) -> str | None:
    """Says that the recordings agree, or have nothing in common.

    None where they disagree, which is one of the findings, or where there is only one.
    """
    found = result.agreement
    if not found.agree or len(result.runs) < 2:
        return None
    if found.degrees_of_freedom == 0:
        return "The recordings determine nothing in common, so that they cannot be compared."
    freedom, of_noise = found.degrees_of_freedom, found.noise_degrees_of_freedom
    distance = distance_of_runs(found.chi_square, freedom, of_noise, found.p_value)
    varies = "" if not np.any(result.between_runs > 0) else VARIES
    return f"The {len(result.runs)} recordings agree within their noise ({distance}).{varies}"


def rows(result: CombinationData) -> "Table | None":
    """Returns a table with a row for each recording, where these are too many for columns."""
    if len(result.runs) <= MOST_COLUMNS:
        return None
    table = empty_table()
    for title in ("recording", *ROW_TITLES):
        table.add_column(title, justify="left" if title == "recording" else "right")
    for name, cells in zip(result.names, row_cells(result), strict=True):
        table.add_row(name, *cells)
    return table


def row_cells(result: CombinationData) -> list[list[str]]:
    """Returns what a row says about each recording: see ``ROW_TITLES``."""
    cells = []
    for run, distance in zip(result.runs, result.agreement.runs, strict=True):
        mass = reported.column_of("", run).rows[0]
        freedom = f"{distance.degrees_of_freedom:.4g}"
        chances = [f"{distance.chi_square:.4g}", freedom, probability(distance.p_value)]
        agree = "yes" if distance.others_agree else "no"
        cells.append([mass.number, mass.around, *chances, agree])
    return cells


ROW_TITLES = ("mass kg", "± 95 %", "chi-square", "degrees of freedom", "p", "others agree")
"""What a row says about a recording: its mass, and its distance from the mean of the others."""

VARIES = (
    " Where they differ a little more than noise makes likely, the intervals include the variation"
    " that they show, and may be wider than those of one recording."
)


def combined_remarks(result: CombinationData, style: Style = "keyword") -> list[str]:
    """Says what a reader must know to trust the combined payload, what is wrong with it first."""
    wrong = [run for run in result.runs if run.is_contradicted]
    reason = result.estimate.why_impossible
    agreed = verdict(result)
    return [
        *(
            f"{name}: {remarks(run, style)[0]}"
            for name, run in zip(result.names, result.runs, strict=True)
            if run in wrong
        ),
        *([f"No body can have these parameters: {reason}."] if reason is not None else []),
        *(noticed.worded(style) for noticed in result.findings),
        *([agreed] if agreed is not None else []),
        *_unknown_values(result, advised=not wrong),
    ]


def _unknown_values(result: CombinationData, *, advised: bool) -> list[str]:
    """Says which values are unknown, and why: the motion, the noise or the disagreement."""
    estimate = result.estimate
    if result.agreement.agree:
        return [
            *unobservable_values(
                estimate, advised=advised, moments=any(map(measures_moments, result.runs))
            ),
            *uncertain_values(estimate, advised=advised),
        ]
    unknown = unobservable_values(estimate, advised=False)
    if estimate.uncertain:
        names = listed(estimate.uncertain)
        unknown.append(f"The recordings differ so much that nothing is certain of {names}.")
    return unknown


def lines(result: CombinationData, style: Style = "keyword") -> list[str]:
    """Returns the remarks about all recordings, then those about each, a line each."""
    of_runs = []
    for name, run in zip(result.names, result.runs, strict=True):
        own = remarks(run, style)
        of_runs += [f"{name}: {line}" for line in (own[1:] if run.is_contradicted else own)]
        of_runs += [f"{loss}." for loss in losses(run)]
        of_runs += [f"{name}: {line}" for line in (assumptions(run), sentence(run))]
    return [*combined_remarks(result, style), *of_runs]


def text(result: CombinationData) -> str:
    """Returns the whole as text, for a reader who writes Python."""
    table = plain_text(columns(result), heading(result.estimate.frame))
    each = rows(result)
    below = [] if each is None else ["", as_text(each)]
    return "\n".join([table, *below, "", *lines(result)])


def html(result: CombinationData) -> str:
    """Returns a small table of all recordings together for a notebook, and the verdict."""
    shown = html_table(columns(result)[0], heading(result.estimate.frame))
    return shown + "".join(f"<p>{escape(line)}</p>" for line in combined_remarks(result)[:1])
