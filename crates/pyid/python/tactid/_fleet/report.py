"""The report of a fleet: one HTML file."""

import html
import shlex
from collections import Counter
from collections.abc import Iterable, Sequence
from datetime import datetime, timezone
from itertools import compress
from pathlib import Path
from typing import Any

from tactid._base.naming import command_line_flag, counted
from tactid._base.values import Z95, Interval
from tactid._fleet import plots
from tactid._fleet.analysis import (
    CLOCKLESS_S,
    Robot,
    disagreements,
    kinds_of,
    robots_of,
    severity,
    without_copies,
)
from tactid._fleet.rows import Row, key_of
from tactid._fleet.stores import is_address
from tactid._options.options import OPTIONS
from tactid._results.table import number
from tactid._show import page
from tactid._show.drawing import Figures

MOST_ROBOTS = 12
"""Robots with a panel of a figure: those with the most recordings."""

MOST_LINES = 100
"""Lines of a table; it says how many there are."""

DRIFTING = 1e-4
"""Probability of a drift by noise alone below which it is listed: one in 10,000 channels."""

PAYLOADS = """Mass of each recording over time with its 95 % interval. Recordings of one colour have
equal payloads, with the number that the table below has: their mass and centre of mass agree within
their covariances and what varies between recordings of one payload."""

CONFIGURED = " The line is the payload that the controller was configured with."

ORDER = " Robots whose stamps begin at zero have their recordings in the order of their addresses."

NO_DRIFT = "<p>No drift is larger than what the offsets vary by.</p>"

OFFSETS = (
    "Offset of the forces of each recording over time, which the identification has estimated."
)


def write_report(rows: Sequence[Row], path: Path) -> None:
    """Writes the report of rows."""
    figures = Figures()
    figures.write(path, render(rows, figures))


def render(rows: Sequence[Row], figures: Figures) -> str:
    """Returns the report of rows as HTML, figures included."""
    rows, copies = without_copies(rows)
    robots = robots_of(rows)
    shown = sorted(robots[:MOST_ROBOTS], key=lambda robot: robot.name)
    robots = sorted(robots, key=lambda robot: robot.name)
    names = len({row["robot"] for row in rows if row["robot"]})
    count = len({key_of(row) for row in rows})
    recordings = counted(count, "recording")
    title, many = recordings, "recordings"
    if names:
        title += f" of {counted(names, 'robot')}"
    if len(rows) > count:
        title, many = f"{len(rows)} segments of {title}", "segments"
    body = [
        f"<h1>{title}</h1>",
        f'<p class="lead">{html.escape(_period(robots))}</p>',
        _copied(copies),
        "<h2>Outcomes</h2>",
        _table(("outcome", many), _outcomes(rows)),
    ]
    if shown:
        body += [
            "<h2>Payloads</h2>",
            figures.html("payloads", plots.payloads(shown), _caption(shown)),
        ]
        body += [_clusters(robots, many), "<h2>Changes</h2>", _changes(robots)]
    with_offsets = [robot for robot in shown if len(robot.offsets()[0])]
    if with_offsets:
        drawn = figures.html("offsets", plots.offsets(with_offsets), OFFSETS)
        body += ["<h2>Drift of offsets</h2>", drawn, _drifts(robots) or NO_DRIFT]
    body += ["<h2>Configured payloads</h2>", _disagreements(rows, robots)]
    body += ["<h2>Findings</h2>", _table(("finding", "severity", many), kinds_of(rows))]
    body += ["<h2>Recordings to look at</h2>", _worst(rows)]
    return page.document(f"tactid: a fleet of {recordings}", "\n".join(body))


def _caption(robots: Sequence[Robot]) -> str:
    payloads = [each for robot in robots for each in robot.payloads]
    has_line = any(each.row.get("configured") for each in payloads)
    return PAYLOADS + CONFIGURED * has_line + ORDER * (not all(one.has_clock for one in robots))


def _period(robots: Sequence[Robot]) -> str:
    times = [each.time_s for robot in robots for each in robot.payloads]
    if not times:
        return "There is no payload."
    known = [time for time in times if time > CLOCKLESS_S]
    if not known:
        return "Recordings have stamps that begin at zero: when they were made is not known."
    others = {
        key_of(each.row) for one in robots for each in one.payloads if each.time_s <= CLOCKLESS_S
    }
    verb = "has" if len(others) == 1 else "have"
    without = f"; {counted(len(others), 'recording')} {verb} stamps that begin at zero"
    return f"From {_date(min(known))} to {_date(max(known))}, in UTC{without * bool(others)}."


def _copied(copies: Sequence[tuple[Row, Row]]) -> str:
    """Says which rows are copies; nothing where none is."""
    if not copies:
        return ""
    count = len({key_of(copy) for copy, _ in copies})
    verb = "is a copy of another" if count == 1 else "are copies of others"
    copy, original = (row["address"] for row in copies[0])
    text = f"{counted(count, 'recording')} {verb}, such as {copy} of {original}: not counted."
    return f"<p>{html.escape(text)}</p>"


def _date(time_s: float) -> str:
    if time_s <= CLOCKLESS_S:
        return "not known"
    return datetime.fromtimestamp(time_s, timezone.utc).strftime("%Y-%m-%d %H:%M")


def _outcomes(rows: Sequence[Row]) -> list[tuple[str, int]]:
    return Counter(row["outcome"] for row in rows).most_common()


def _table(
    heads: Sequence[str], lines: Iterable[Sequence[Any]], note: str = "", style: str = "wide"
) -> str:
    """Returns a table of the first lines, without columns in which all of them have nothing.

    It is a sentence where there is no line.
    """
    listed = list(lines)
    if not listed:
        return "<p>There are none.</p>"
    filled = [any(cell is not None for cell in column) for column in zip(*listed, strict=True)]
    cells = (
        "<tr>" + "".join(f"<td>{_cell(cell)}</td>" for cell in compress(line, filled)) + "</tr>\n"
        for line in listed[:MOST_LINES]
    )
    more = f"The first {MOST_LINES} of {len(listed)} lines. " if len(listed) > MOST_LINES else ""
    caption = f"<caption>{html.escape(more + note)}</caption>" if more + note else ""
    titles = "".join(f"<th>{html.escape(head)}</th>" for head in compress(heads, filled))
    return (
        f'<div class="{style}"><table>{caption}<thead><tr>{titles}</tr></thead>'
        f"<tbody>{''.join(cells)}</tbody></table></div>"
    )


def _cell(cell: Any) -> str:
    """Returns a cell as HTML: an address on the web is a link."""
    text = html.escape(_text(cell))
    is_link = isinstance(cell, str) and cell.startswith(("https://", "http://"))
    return f'<a href="{text}">{text}</a>' if is_link else text


def _text(cell: Any) -> str:
    if isinstance(cell, float):
        return f"{cell:.4g}"
    return "" if cell is None else str(cell)


PLACE = ("recording", "episode", "seed", "from / s")
"""Heads of the columns that name a recording, or a part of it."""


def _place(row: Row) -> tuple[Any, ...]:
    """Returns the cells that name the recording of a row; one that does not apply is None."""
    begin_s = row.get("begin_s")
    begin = None if begin_s is None else f"{begin_s:.10g}"
    return row["address"], row["episode"], row.get("seed"), begin


def _clusters(robots: Sequence[Robot], many: str) -> str:
    lines = []
    for robot in robots:
        for place, cluster in enumerate(robot.clusters, start=1):
            times = [each.time_s for each in cluster.members]
            mass, *center = (float(value) for value in cluster.mean)
            around = Z95 * float(cluster.covariance[0, 0]) ** 0.5
            shown = number(mass, Interval(mass - around, mass + around))
            values = [shown, f"{around:.2g}", *(f"{1e3 * value:.2f}" for value in center)]
            values += [""] * (5 - len(values))
            ends = (_date(min(times)), _date(max(times)))
            lines.append((robot.name, place, len(cluster.members), *values, *ends))
    heads = ["robot", "payload", many, "mass / kg", "± 95 %"]
    heads += ["com x / mm", "com y / mm", "com z / mm", "first", "last"]
    return _table(heads, lines)


def _changes(robots: Sequence[Robot]) -> str:
    lines = [
        (robot.name, _date(payload.time_s), a + 1, b + 1, *_place(payload.row))
        for robot in robots
        for payload, a, b in robot.changes
    ]
    table = _table(("robot", "time", "payload before", "payload after", *PLACE), lines)
    return table + _merged([payload.row for robot in robots for payload in robot.merged])


def _merged(rows: Sequence[Row]) -> str:
    """Says which changes within a recording are none by what varies between recordings."""
    if not rows:
        return ""
    verb = "separates" if len(rows) == 1 else "separate"
    text = (
        f"{counted(len(rows), 'cut')} {verb} segments that differ beyond their intervals, but not"
        " beyond what varies between recordings, so that they are one payload here: the first is"
        f" that of {rows[0]['address']} at {rows[0]['begin_s']:.4g} s."
    )
    return f"<p>{html.escape(text)}</p>"


def _drifts(robots: Sequence[Robot]) -> str:
    """Returns the table of drifts; nothing where there is none."""
    lines = [
        (robot.name, name, slope, probability)
        for robot in robots
        for name, slope, probability in robot.drift()
        if probability < DRIFTING
    ]
    lines.sort(key=lambda line: line[3])
    heads = ("robot", "channel", "drift a day / N or N m", "probability by noise alone")
    return _table(heads, lines) if lines else ""


def _disagreements(rows: Sequence[Row], robots: Sequence[Robot]) -> str:
    if not any(row.get("configured") for row in rows):
        return "<p>No recording was identified with a configured payload.</p>"
    lines = [
        (
            robot.name,
            row["configured"][0],
            row["estimate.values.mass"],
            float(difference[0]),
            " ".join(f"{1e3 * each:.1f}" for each in difference[1:]),
            *_place(row),
        )
        for robot, row, difference in disagreements(robots)
    ]
    heads = ["robot", "configured / kg", "identified / kg", "difference / kg"]
    heads += ["of the centre of mass / mm", *PLACE]
    return _table(heads, lines)


def _worst(rows: Sequence[Row]) -> str:
    ranked = sorted(rows, key=severity, reverse=True)
    lines = [
        (row["robot"], *_place(row), row["outcome"], _reason(row), _command(row))
        for row in ranked
        if any(severity(row)[:-1])
    ]
    note = (
        "The commands write the report of one recording, with the options of the fleet besides, and"
        " those of its robot in --table."
    )
    return _table(("robot", *PLACE, "outcome", "why", "report"), lines, note, "wide worst")


def _command(row: Row) -> str:
    """Returns the command that reports on a recording on this computer; none for another one.

    There is none for a simulation, whose log is not kept.
    """
    if is_address(row["address"]) or row.get("seed") is not None:
        return ""
    words = ["tactid", "identify", row["address"]]
    for name in ("episode", "begin_s", "end_s"):
        if row.get(name) is not None:
            words += [OPTIONS[name].flag, repr(row[name])]
    return shlex.join([*words, command_line_flag("report"), "report.html"])


def _reason(row: Row) -> str:
    if row["error"]:
        return str(row["error"])
    graver = ("contradicts", "doubts")
    found = [
        each for grade in graver for each in row.get("findings") or () if each["severity"] == grade
    ]
    said = [str(each["text"]) for each in found] + list(row.get("damage") or ())
    return said[0] if said else ""
