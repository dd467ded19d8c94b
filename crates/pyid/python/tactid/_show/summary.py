"""A result as a person reads it: the table, and below it a line for each thing to know."""

from html import escape

from tactid._base.naming import Style
from tactid._results.identification import IdentificationData, Recorded
from tactid._results.provenance import sentence
from tactid._results.table import heading, html_table, plain_text
from tactid._show.outlook import WITHIN, outlook
from tactid._show.remarks import assumptions, remarks
from tactid._show.reported import column


def lines(result: Recorded, within: float = WITHIN, style: Style = "keyword") -> list[str]:
    """Returns remarks, outlook, assumptions and where the result comes from, a line each.

    What shows the result to be wrong comes first.
    """
    longer = outlook(result, within) if isinstance(result, IdentificationData) else None
    ahead = [] if longer is None else [longer]
    return [*remarks(result, style), *ahead, assumptions(result), sentence(result)]


def text(result: Recorded) -> str:
    """Returns the whole as text, for a reader who writes Python."""
    table = plain_text([column(result)], heading(result.estimate.frame))
    return "\n".join([table, "", *lines(result)])


def html(result: Recorded) -> str:
    """Returns a small table for a notebook, and what shows the result to be wrong."""
    shown = html_table(column(result), heading(result.estimate.frame))
    first = remarks(result)[:1] if result.is_contradicted else []
    return shown + "".join(f"<p>{escape(line)}</p>" for line in first)
