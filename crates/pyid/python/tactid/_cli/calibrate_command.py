"""The command ``tactid calibrate``: from recordings of an arm to the model of its joint efforts."""

from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from tactid._api.calibrating import calibrate
from tactid._api.calibration import Calibration
from tactid._base.errors import ArgumentError
from tactid._base.output_files import FigureFormat, check_ending, figure_outputs
from tactid._base.terminal import printable
from tactid._cli import option_flags
from tactid._cli.command import FLAG, interruptible
from tactid._cli.console import (
    FIGURES,
    check_figures,
    check_files,
    notes,
    print_json,
    print_whole,
    printing_after,
    progress,
)
from tactid._documents import calibration_json
from tactid._options.options import OWN, options_for
from tactid._show import calibration_text


def _result(text: str, *flags: str, metavar: str | None = None) -> Any:
    return typer.Option(
        *flags, help=text, metavar=metavar, rich_help_panel="Results", show_default=False
    )


def calibrate_arm(
    out: Annotated[Path, _result("The TOML file to write, for tactid identify --calibration.")],
    report: Annotated[Path | None, _result("An HTML file to write, with plots.")] = None,
    figures: Annotated[
        FigureFormat | None,
        _result(FIGURES),
    ] = None,
    as_json: Annotated[bool, _result("Prints JSON.", "--json", metavar=FLAG)] = False,
    **options: Any,
) -> None:
    """Calibrates the joint efforts of an arm from recordings.

    The numbers of one option are separated by commas or by spaces: --gravity 0 0 -9.81.
    """
    keywords = option_flags.values(options, OWN["calibration"].values())
    unloaded = keywords.pop("unloaded", [])
    hold_out, loaded = (keywords.get(name, []) for name in ("hold_out", "loaded"))
    _check_files(out, report, options["urdf"], unloaded, loaded, hold_out)
    check_figures(report, figures)
    with interruptible("no calibration"), progress("calibrating") as done:
        arm = calibrate(
            unloaded,
            **keywords,
            options=option_flags.read(options, "calibration"),
            progress=done,
        )
    # The figures are those of its joints, which are known now.
    outputs = {"--out": out, "--report": report}
    outputs |= figure_outputs(report, arm.joints, figures)
    replaced = check_files(outputs, arm.inputs)
    reports = {} if report is None else {report: partial(_write_report, arm, figures)}
    with printing_after({out: arm.write, **reports}, replaced):
        _print(arm, as_json=as_json)
    if any(each.contradicts_result for each in arm.contradictions):
        raise typer.Exit(1)


def _check_files(
    out: Path,
    report: Path | None,
    urdf: Path | None,
    unloaded: list[Path],
    loaded: list[Path],
    hold_out: list[Path],
) -> None:
    """Checks that there is a recording, and that no output replaces one."""
    flags = (("--unloaded", unloaded), ("--loaded", loaded), ("--hold-out", hold_out))
    logs = {f"{flag} {path}": path for flag, paths in flags for path in paths}
    check_files({"--out": out, "--report": report}, logs | {"--urdf": urdf})
    check_ending("--out", out, ".toml")
    if not unloaded and not loaded:
        raise ArgumentError("--unloaded is missing: give a recording without a payload")


def _write_report(arm: Calibration, figures: FigureFormat | None, path: Path) -> list[Path]:
    with notes.status("drawing"):
        from tactid._show import (
            calibration_report,  # imports matplotlib, which takes a while to load
        )

        return calibration_report.write_report(arm, path, "command-line", figures)


def _print(arm: Calibration, *, as_json: bool) -> None:
    if as_json:
        print_json(calibration_json.to_json(arm, "command-line"))
        return
    print(printable(calibration_text.heading(arm)))
    print_whole(calibration_text.rich_table(arm))
    for line in calibration_text.lines(arm, "command-line"):
        notes.print(line, markup=False)


option_flags.show(
    calibrate_arm,
    option_flags.parameters([*OWN["calibration"].values(), *options_for("calibration")]),
    last=("out", "report", "figures", "as_json"),
)
