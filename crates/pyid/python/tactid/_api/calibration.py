"""A calibrated arm: the model of its joint efforts, with the reasons to trust it."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path

from tactid import _native
from tactid._base.equality import are_equal
from tactid._base.errors import ArgumentError
from tactid._base.field_docs import with_fields
from tactid._base.files import atomic_path
from tactid._base.output_files import FigureFormat, checked_output, checked_report
from tactid._documents import calibration_json
from tactid._results import records
from tactid._results.calibration_data import CalibrationData, CalibrationRecording
from tactid._show import calibration_text


@with_fields
@dataclass(frozen=True, eq=False, repr=False)
class Calibration(CalibrationData):
    """The calibrated model of an arm's joint efforts, as :func:`tactid.calibrate` returns it.

    ``print`` shows a row for each joint. Give it to ``tactid.identify(..., calibration=...)``, or
    write it to a file, from which :meth:`read` gets an equal calibration. The numbers are those of
    its ``model`` and cannot be replaced; a file can be edited.
    """

    def __post_init__(self) -> None:
        """Checks that the numbers are those of the model, which identifications use."""
        super().__post_init__()
        of_model = CalibrationData(**self.model.data(), model=self.model)
        own = (each.name for each in fields(records.Calibration))
        others = (n for n in own if not are_equal(getattr(self, n), getattr(of_model, n)))
        for name in others:
            raise ArgumentError(
                f"`{name}` is not that of the calibration's `model`, which identifications use:"
                " write the calibration to a file, edit the file, and read it"
            )

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Calibration:
        """Reads the file of a calibration, which has all but the recordings.

        Args:
            path: A file that :meth:`write` or ``tactid calibrate`` wrote.

        Raises:
            CalibrationError: The file cannot be read, or is not that of a calibration; the message
                names the line.
        """
        model = _native.ArmModel.read(path)
        return from_model(model, inputs={"the calibration": Path(path).absolute()})

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes the calibration as a TOML file that people can read.

        Args:
            path: The ``.toml`` file to write.

        Raises:
            ArgumentError: The folder does not exist, the name does not end in ``.toml``, or the
                file is one that was read.
            CalibrationError: The file cannot be written.
        """
        inputs = {name: given for name, given in self.inputs.items() if name != "the calibration"}
        with atomic_path(checked_output(path, inputs, ".toml")) as temporary:
            self.model.write(temporary)

    def write_report(
        self, path: str | os.PathLike[str], figures: FigureFormat | None = None
    ) -> None:
        """Writes the report: one HTML file with the table, the remarks and a figure of each joint.

        Args:
            path: The file to write.
            figures: Writes each figure beside the report, too: as ``png``, ``svg`` or ``pdf``.

        Raises:
            ArgumentError: The folder does not exist, the name does not end in ``.html``, or the
                file is one that was read.
        """
        from tactid._show import (
            calibration_report,  # imports matplotlib, which takes a while to load
        )

        checked = checked_report(path, self.inputs, figures, self.joints)
        calibration_report.write_report(self, checked, form=figures)

    def to_json(self) -> str:
        """Returns the numbers of each joint and each recording as a JSON document."""
        return calibration_json.to_json(self)

    def __repr__(self) -> str:
        joints = f"{len(self.joints)} joints to {self.tip}"
        return f"<tactid.Calibration: {joints}, {self.windows} windows>"

    def __str__(self) -> str:
        return calibration_text.text(self)


def from_model(
    model: _native.ArmModel,
    *,
    gain_prior: float | None = None,
    recordings: Sequence[CalibrationRecording] = (),
    inputs: Mapping[str, Path] | None = None,
) -> Calibration:
    """Returns the calibration of a model, with the recordings that it is from, if known."""
    return Calibration(
        model=model,
        gain_prior=gain_prior,
        recordings=recordings,
        inputs=inputs or {},
        **model.data(),
    )
