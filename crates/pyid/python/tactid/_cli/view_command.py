"""The command ``tactid view``: a recording, a result or a designed motion in the Rerun viewer."""

import tempfile
from pathlib import Path
from typing import Annotated

import typer

from tactid._base.output_files import check_ending
from tactid._cli.command import interruptible
from tactid._cli.console import check_files, notes, print_written


def show_view(
    log: Annotated[
        Path,
        typer.Argument(
            help="A rosbag2 folder, or an .mcap or .db3 file; or a designed motion: the folder that"
            " tactid excite wrote, its trajectory.mcap or trajectory.csv."
        ),
    ],
    result_file: Annotated[
        Path | None,
        typer.Option("--result", help="The result of tactid identify --result for this log."),
    ] = None,
    urdf: Annotated[
        Path | None,
        typer.Option(help="The robot, where the log has no /robot_description, or of a motion."),
    ] = None,
    save: Annotated[
        Path | None, typer.Option(help="An .rrd file to write instead of opening the viewer.")
    ] = None,
    tip: Annotated[
        str | None, typer.Option(help="The frame that holds the payload: the result's by default.")
    ] = None,
) -> None:
    """Shows the robot, the forces that it feels and the payload in the Rerun viewer.

    A designed motion has the joints alone, and needs --urdf.
    """
    inputs = {"the log": log, "--result": result_file, "--urdf": urdf}
    replaced = check_files({"--save": save}, inputs)
    check_ending("--save", save, ".rrd")
    from tactid import _view as viewer

    with tempfile.TemporaryDirectory(prefix="tactid-") as folder:
        recording = save or Path(folder, f"{log.stem}.rrd")
        with interruptible("nothing was written"), notes.status("reading"):
            remarks = viewer.record(log, recording, result=result_file, urdf=urdf, tip=tip)
        for remark in remarks:
            notes.print(f"tactid: note: {remark}", style="yellow")
        if save is None:
            with interruptible("the viewer is closed"):
                viewer.open_viewer(recording)
        else:
            print_written(f"Wrote {save}: open it with rerun {save}", replaced)
