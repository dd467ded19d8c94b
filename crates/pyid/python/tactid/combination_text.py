"""What several recordings say together, as a person reads it: the table, and lines below it."""

from html import escape

from tactid import reported
from tactid.combination import CombinationData
from tactid.naming import Style
from tactid.remarks import assumptions, remarks, uncertain_values, unobservable_values
from tactid.table import Column, heading, html_table, plain_text

WHOLE = "all"
"""Title of the column of all recordings together."""


def columns(result: CombinationData) -> list[Column]:
    """Returns the column of all recordings together, then one for each of them."""
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
    return (
        f"The {len(result.runs)} recordings agree within their noise (chi-square"
        f" {found.chi_square:.4g} for {found.degrees_of_freedom} degrees of freedom,"
        f" p = {found.p_value:.2g})."
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
        *_of_the_unknown(result, advised=not wrong),
    ]


def _of_the_unknown(result: CombinationData, *, advised: bool) -> list[str]:
    """Says which values are not identifiable.

    Where recordings disagree, another motion does not help with what one of them determines alone.
    """
    unknown = result.estimate.not_identifiable
    alone = [
        name
        for name in unknown
        if any(name not in run.estimate.not_identifiable for run in result.runs)
    ]
    if result.agreement.agree or not alone:
        return [
            *unobservable_values(result.estimate, advised=advised),
            *uncertain_values(result.estimate, advised=advised),
        ]
    return [
        f"Not identifiable together: {', '.join(unknown)}. The recordings determine"
        f" {'some of ' if len(alone) < len(unknown) else ''}them, but disagree: identify each"
        " alone, and combine those of one payload."
    ]


def lines(result: CombinationData, style: Style = "keyword") -> list[str]:
    """Returns the remarks about all recordings, then those about each, a line each."""
    of_runs = []
    for name, run in zip(result.names, result.runs, strict=True):
        own = remarks(run, style)
        of_runs += [f"{name}: {line}" for line in (own[1:] if run.is_contradicted else own)]
        of_runs += [f"{name}: {damage}; what stands before was used." for damage in run.damage]
        of_runs.append(f"{name}: {assumptions(run)}")
    return [*combined_remarks(result, style), *of_runs]


def text(result: CombinationData) -> str:
    """Returns the whole as text, for a reader who writes Python."""
    table = plain_text(columns(result), heading(result.estimate.frame))
    return "\n".join([table, "", *lines(result)])


def html(result: CombinationData) -> str:
    """Returns a small table of all recordings together for a notebook, and the verdict."""
    shown = html_table(columns(result)[0], heading(result.estimate.frame))
    return shown + "".join(f"<p>{escape(line)}</p>" for line in combined_remarks(result)[:1])
