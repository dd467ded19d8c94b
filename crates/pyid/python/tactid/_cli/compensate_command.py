"""The command ``tactid compensate``: a copy of a log with the wrench of the contact."""

from pathlib import Path
from typing import Annotated, Any

import typer

from tactid._api.compensated_log import compensate_into
from tactid._api.compensation import Load, load_of
from tactid._api.offline import identify
from tactid._api.result import Identification
from tactid._base.files import whole_folder, write_atomically
from tactid._base.output_files import check_inputs_of_folder
from tactid._base.terminal import printable
from tactid._cli import option_flags
from tactid._cli.command import interruptible
from tactid._cli.console import notes, print_whole, progress
from tactid._options.options import Options, options_for
from tactid._results.compensation import CompensatedLog
from tactid._show import compensation_text

PICTURE = "contact_wrench.png"
"""Name of the picture in the folder of the copy."""


def _result(text: str, metavar: str | None = None) -> Any:
    return typer.Option(help=text, metavar=metavar, rich_help_panel="Results", show_default=False)


def compensate_log(
    log: Annotated[
        Path,
        typer.Argument(
            help="A rosbag2 folder, or an .mcap or .db3 file; a table (.csv, .npz, .parquet), a"
            " data set of LeRobot, or a ROS 1 bag."
        ),
    ],
    out: Annotated[
        Path,
        _result(
            "The folder to write, a rosbag2 bag: the log with the topics load_wrench and"
            " contact_wrench, and a picture."
        ),
    ],
    payload: Annotated[
        Path | None,
        _result(
            "The result of tactid identify --result, whose options hold for the log, too. Default:"
            " identified from the log."
        ),
    ] = None,
    point: Annotated[
        str | None,
        _result(
            "The link about whose origin the moments are, which moves with the tip. Default: the"
            " frame of the only sensor, or the tip.",
            "LINK",
        ),
    ] = None,
    axes: Annotated[
        str | None,
        _result(
            "The link along whose axes the wrenches are, or world. Default: that of --point.",
            "LINK",
        ),
    ] = None,
    **options: Any,
) -> None:
    """Adds the wrench of the contact to a copy of a log: measured less offset and load.

    The numbers of one option are separated by commas or by spaces: --gravity 0 0 -9.81.
    """
    check_inputs_of_folder(
        "--out", out, {"the log": log, "--payload": payload, "--urdf": options["urdf"]}
    )
    given = option_flags.read(options, "compensation")
    with interruptible("nothing was written"), whole_folder(out, "--out") as folder:
        load = load_of(payload if payload is not None else _identified(log, given))
        file, used = f"{out.name}_0.mcap", load.completed(given)
        with progress("compensating") as done:
            written = compensate_into(log, folder, file, used, load, (point, axes), done)
        with notes.status("drawing"):
            from tactid._show import compensation_plot  # imports matplotlib

            write_atomically(folder / PICTURE, compensation_plot.picture(written))
    _print(written, load)
    notes.print(f"Wrote {out}.", markup=False)


option_flags.show(
    compensate_log,
    option_flags.parameters(options_for("compensation")),
    last=("out", "payload", "point", "axes"),
)


def _identified(log: Path, options: Options) -> Identification:
    """Identifies the payload from the log itself, and prints what a reader must know of it."""
    with progress("identifying") as done:
        result = identify(log, options=options, progress=done)
    for remark in result.worded_remarks("command-line"):
        notes.print(remark, markup=False)
    return result


def _print(written: CompensatedLog, load: Load) -> None:
    """Prints the table and what was noticed."""
    print(printable(compensation_text.heading(written)))
    print_whole(compensation_text.rich_table(written))
    noticed = (*written.findings, *written.faults)
    for line in (*compensation_text.lines(written), *map(str, noticed)):
        notes.print(line, markup=False)
    for damage in written.damage:
        notes.print(f"tactid: note: {damage}; what could be read was used", style="yellow")
    if load.is_contradicted:
        notes.print(
            "tactid: warning: the data of the payload's recording contradict its result, and the"
            " wrench of the contact may be wrong, too",
            style="yellow",
        )
