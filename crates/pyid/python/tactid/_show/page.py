"""HTML that both reports share: one file that needs nothing else, and its parts."""

import base64
import html
from collections.abc import Mapping, Sequence

from tactid._native import __version__

STYLE = """
:root { color-scheme: light; --ink: #1d2329; --dim: #5b6570; --line: #d9dde2; --warn: #c8502d; }
body { font: 16px/1.5 system-ui, sans-serif; color: var(--ink); max-width: 66rem; margin: 2rem auto;
  padding: 0 1rem; }
h1 { font-size: 1.6rem; margin-bottom: 0; } h2 { font-size: 1.2rem; margin-top: 2.5rem; }
p.lead, figcaption, caption { color: var(--dim); }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: .95rem; }
caption { caption-side: bottom; text-align: left; padding-top: .5rem; font-size: .9rem; }
th, td { padding: .25rem .6rem; text-align: right; white-space: nowrap; } th { font-weight: 600; }
th:first-child, td:first-child, td.unit { text-align: left; } td.unit { color: var(--dim); }
thead tr:last-child th, tr.last td { border-bottom: 1px solid var(--line); }
thead tr:first-child th { text-align: center; }
td.none { color: var(--warn); text-align: center; } td.value { font-weight: 600; }
p.warn { border-left: 4px solid var(--warn); padding-left: .8rem; font-weight: 600; }
div.wide { overflow-x: auto; }
div.worst th, div.worst td { text-align: left; vertical-align: top; white-space: normal;
  overflow-wrap: anywhere; min-width: 5.5rem; }
div.worst td:nth-child(2) { min-width: 12rem; } div.worst td:nth-last-child(2) { min-width: 24rem; }
figure { margin: 1.5rem 0; } figure img { max-width: 100%; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: .15rem 1.5rem; }
dt { color: var(--dim); } dd { margin: 0; font-variant-numeric: tabular-nums; }
pre { background: #f4f6f8; padding: .8rem; overflow-x: auto; font-size: .85rem; }
"""


def document(title: str, body: str) -> str:
    """Returns a whole page around its body."""
    return f"""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="generator" content="tactid {__version__}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{html.escape(title)}</title>
<style>{STYLE}</style>
</head>
<body>
{body}
<p class="lead">tactid {__version__}</p>
</body>
</html>
"""


def contradiction(is_contradicted: bool, remarks: Sequence[str]) -> str:
    """Returns the head of a page whose result the data contradict; empty for another result.

    The first of the ``remarks`` says what shows the result to be wrong.
    """
    if not is_contradicted:
        return ""
    said = html.escape(" ".join(["The data contradict this result.", *remarks[:1]]))
    return f'<p class="warn">{said}</p>\n'


def figure(png: bytes, caption: str) -> str:
    """Returns a figure with its caption."""
    escaped = html.escape(caption)
    data = base64.b64encode(png).decode()
    return (
        f'<figure><img alt="{escaped}" src="data:image/png;base64,{data}">'
        f"<figcaption>{escaped}</figcaption></figure>\n"
    )


def facts(named: Mapping[str, str]) -> str:
    """Returns facts by name as a list of definitions."""
    rows = (f"<dt>{html.escape(k)}</dt><dd>{html.escape(v)}</dd>" for k, v in named.items())
    return f"<dl>{''.join(rows)}</dl>"
