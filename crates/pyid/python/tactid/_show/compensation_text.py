"""The table of a compensation: the wrench before and after, and the greatest contact."""

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
        table.add_row(name, f"{before:.4g}", f"{after:.4g}", unit)
    return table


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
        size = sum(value * value for value in contact[part]) ** 0.5
        around = f"standard deviation {max(std_devs[part]):.2g} {unit}"
        found.append(
            f"The greatest {name} of the contact is {size:.3g} {unit} at {time:.3f} s ({around})."
        )
    found.append(
        f"{with_wrench} of {samples} samples have a wrench, on {' and '.join(written.topics)}"
        f" (low-pass of {written.cutoff_hz:.3g} Hz, without delay)."
    )
    return found
