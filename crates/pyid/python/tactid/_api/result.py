"""The result of an identification from a recording, with the formats in which it can be given."""

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from tactid import _native
from tactid._api.compensation import Progress, Source
from tactid._base.errors import IdentificationError
from tactid._base.field_docs import with_fields
from tactid._base.files import atomic_path
from tactid._base.naming import Style, counted
from tactid._base.output_files import FigureFormat, checked_output, checked_report
from tactid._documents import result_json
from tactid._results import records
from tactid._results.compensation import Compensation
from tactid._results.identification import IdentificationData, Recorded
from tactid._results.payload import PaperEstimate
from tactid._show import captions, summary
from tactid._show.outlook import WITHIN
from tactid._show.remarks import is_at_rest, remarks


class Result(Recorded):
    """What every result of one recording offers, by whichever estimator."""

    def to_json(self, within: float = WITHIN) -> str:
        """Returns the result as a JSON document, without time series.

        ``tactid.result_schema(estimator)`` is its JSON schema, which describes every key.

        >>> import json
        >>> record = json.loads(result.to_json())
        >>> record["schema"], record["estimate"]["frame"], record["units"]["mass"]
        ('tactid.result/3', 'tool0', 'kg')

        Args:
            within: Target of ``remaining_s``, as :meth:`Identification.remaining` takes it.
        """
        return result_json.to_json(result_json.record(self, within))

    def write_result(self, path: str | os.PathLike[str], within: float = WITHIN) -> None:
        """Writes the result as a JSON file, with all time series.

        >>> result.write_result("payload.json")

        Args:
            path: The ``.json`` file to write.
            within: Target of ``remaining_s``, as :meth:`Identification.remaining` takes it.

        Raises:
            ArgumentError: The folder does not exist, the name does not end in ``.json``, or the
                file is one that was read.
        """
        result_json.write(self, checked_output(path, self.inputs, ".json"), within)

    def write_report(
        self,
        path: str | os.PathLike[str],
        within: float = WITHIN,
        figures: FigureFormat | None = None,
    ) -> None:
        """Writes the report: one HTML file with the table, the remarks and figures.

        >>> result.write_report("payload.html")

        Args:
            path: The file to write.
            within: Target of the remaining time, as :meth:`Identification.remaining` takes it.
            figures: Writes each figure beside the report, too: as ``png``, ``svg`` or ``pdf``.

        Raises:
            ArgumentError: The folder does not exist, the name does not end in ``.html``, or the
                file is one that was read.
        """
        from tactid._show import recording_report  # imports matplotlib, which takes a while to load

        checked = checked_report(path, self.inputs, figures, captions.RECORDING)
        recording_report.write_report(self, checked, within, form=figures)

    def write_estimates(self, path: str | os.PathLike[str]) -> None:
        """Writes the estimate over time as a log.

        The log has ``geometry_msgs/msg/InertiaStamped`` on ``/tactid/payload`` and, where the
        estimator has intervals, half the width of that of each value on
        ``/tactid/payload_half_width_95``. Stamps are those of the recording; the last message is
        the final estimate.

        >>> result.write_estimates("payload.mcap")

        Args:
            path: The ``.mcap`` file to write.

        Raises:
            ArgumentError: The folder does not exist, the name does not end in ``.mcap``, or the
                file is one that was read.
            IdentificationError: The result is that of poses at rest, which have no times.
            LogError: The file cannot be written.
        """
        self.check_times()
        history, final = self.history, self.estimate
        last, names = slice(None), ["values", "std_devs"]
        if isinstance(history, records.PaperHistory):
            last, names = np.array(history.epoch) == max(history.epoch, default=0), ["values"]
        times = history.times_s[last]
        # The final estimate takes the place of the last point.
        end = times[-1:] if len(times) else np.zeros(1)
        with atomic_path(checked_output(path, self.inputs, ".mcap")) as temporary:
            _native.write_estimates(
                temporary,
                frame=final.frame,
                start_ns=self.start_ns,
                times=np.concatenate([times[:-1], end]),
                **{
                    name: np.vstack([*getattr(history, name)[last][:-1], getattr(final, name)])
                    for name in names
                },
            )

    def check_times(self) -> None:
        """Checks that there is an estimate over time.

        Raises:
            IdentificationError: The result is that of poses at rest, which have no times.
        """
        if is_at_rest(self):
            raise IdentificationError(
                "poses at rest have no times, and so no estimate over time that could be written"
            )

    def worded_remarks(self, style: Style = "keyword") -> list[str]:
        """Says what a reader must know to trust the result; what shows it to be wrong is first."""
        return remarks(self, style)

    def __repr__(self) -> str:
        shown = f"{self.estimate.summary}, {self.method}, {self.estimator}"
        return f"<tactid.{type(self).__name__}: {shown}{self._noticed()}>"

    def __str__(self) -> str:
        return summary.text(self)

    def _repr_html_(self) -> str:
        return summary.html(self)

    def _noticed(self) -> str:
        findings = f", {counted(len(self.findings), 'finding')}" if self.findings else ""
        return findings + (", contradicted by the data" if self.is_contradicted else "")


@with_fields
@dataclass(frozen=True, eq=False, repr=False)
class Identification(Result, IdentificationData):
    """The payload identified from a recording by least squares, with the reasons to trust it.

    ``print`` shows the table of the command line, with a line for each thing to know. ``to_...``
    returns a text, ``write_...`` writes a file; each is an option of ``tactid identify``, too.

    >>> experiment = tactid.Experiment.paper().replace(duration=2.0, frequency=0.5)
    >>> _ = tactid.simulate(experiment, "run.mcap")
    >>> result = tactid.identify("run.mcap")
    >>> result
    <tactid.Identification: ... kg in tool0, 10 of 10 values identifiable, tactile...>
    """

    _source: ClassVar[Source | None] = None
    """The recording that the result comes from, where it was computed in this process."""

    def __getstate__(self) -> dict[str, Any]:
        """Returns what a copy of the result has: not the recording."""
        return {name: value for name, value in vars(self).items() if name != "_source"}

    def of_source(self, source: Source) -> "Identification":
        """Returns the result with the recording that it comes from, for as long as it is used."""
        object.__setattr__(self, "_source", source)
        return self

    def contact_wrench(
        self, point: str | None = None, axes: str | None = None, progress: Progress = None
    ) -> Compensation:
        """Returns the wrench of the contact at each sample: measured less offset and load.

        The recording is read once more, with the options of the identification.
        :func:`tactid.compensate` takes another recording.

        >>> wrenches = result.contact_wrench()
        >>> wrenches.contact.shape == (len(wrenches.times_s), 6)
        True

        Args:
            point: The link about whose origin the moments are; it moves with the tip. Default: the
                frame of the only sensor, or the tip.
            axes: The link along whose axes the wrenches are, which moves with the tip or is fixed
                to the ground, or "world". Default: that of ``point``.
            progress: Called with the fraction done, about twenty times a second.

        Raises:
            IdentificationError: The result was not computed by :func:`tactid.identify` in this
                process.
            ArgumentError: The result has no offset and no load of wrench sensors, or the link does
                not move with the tip.
            ModelError: The robot has no such link.
            LogError: The log cannot be read any more.
        """
        if self._source is None:
            raise IdentificationError(
                "the recording of this result is not known here: `tactid.compensate` takes it with"
                " the result"
            )
        return self._source.compensation(self, (point, axes), progress)


@with_fields
@dataclass(frozen=True, eq=False, repr=False)
class PaperIdentification(Result, records.PaperIdentification):
    """The payload identified from a recording by the paper's filter, which knows no uncertainty.

    >>> tactid.identify("run.mcap", estimator="nlms")
    <tactid.PaperIdentification: ... kg in tool0, 10 of 10 values identifiable, tactile, nlms...>
    """

    if TYPE_CHECKING:
        estimate: PaperEstimate
