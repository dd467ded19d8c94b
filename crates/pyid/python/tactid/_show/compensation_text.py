"""The table of a compensation: the wrench before and after, and the greatest contact."""

import math

from rich.table import Table

from tactid._results.compensation import CompensatedLog

CHANNELS = tuple(
    (f"{kind}{axis}", unit) for kind, unit in (("f", "N"), ("n", "N m")) for axis in "xyz"
)
"""Names and units of the entries of a wrench."""


def heading(written: CompensatedLog) -> str:
    """Says what the table shows."""
    about = "" if written.axes == written.point else f", moments about {written.point}"
    return f"Wrench on the {written.acts_on} along the axes of {written.axes}{about}"


def rich_table(written: CompensatedLog) -> Table:
    """Returns the rms of each entry before and after, through the filter."""
    table = Table("", "measured rms", "contact rms", "unit", box=None)
    for column in table.columns[1:3]:
        column.justify = "right"
    rows = zip(CHANNELS, written.measured_rms, written.contact_rms, strict=True)
    for (name, unit), before, after in rows:
        table.add_row(name, _number(before), _number(after), unit)
    return table


def _number(value: float) -> str:
    return "not measured" if math.isnan(value) else f"{value:.4g}"


def lines(written: CompensatedLog) -> list[str]:
    """Says what the greatest contact is, and on which topics the wrenches are."""
    samples, with_wrench = written.samples
    found = []
    for (time, contact, std_devs), part, name, unit in zip(
        written.greatest,
        (slice(3), slice(3, 6)),
        ("force", "moment"),
        ("N", "N m"),
        strict=False,
    ):
        measured = [
            (value, std_dev)
            for value, std_dev in zip(contact[part], std_devs[part], strict=True)
            if not math.isnan(value)
        ]
        if not measured:
            continue
        size = math.hypot(*(value for value, _ in measured))
        around = f"standard deviation {max(std_dev for _, std_dev in measured):.2g} {unit}"
        found.append(
            f"The greatest {name} of the contact is {size:.3g} {unit} at {time:.3f} s ({around})."
        )
    found.append(
        f"{with_wrench} of {samples} samples have a wrench, on {' and '.join(written.topics)}"
        f" (low-pass of {written.cutoff_hz:.3g} Hz, without delay)."
    )
    return found
