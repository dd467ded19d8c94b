"""One payload from several recordings, with the formats in which it can be given."""

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from tactid import _native
from tactid._base.errors import ArgumentError, IdentificationError
from tactid._base.field_docs import with_fields
from tactid._base.naming import Style
from tactid._base.output_files import FigureFormat, checked_output, checked_report
from tactid._base.values import listed_fields
from tactid._documents import combination_json, result_json
from tactid._results.combination import CombinationData
from tactid._results.identification import IdentificationData, Recorded
from tactid._show import captions, combination_text
from tactid._show.outlook import WITHIN


@with_fields
@dataclass(frozen=True, eq=False, repr=False)
class Combination(CombinationData):
    """One payload identified from several recordings, and whether they agree.

    ``print`` shows all recordings together and each alone.

    >>> experiment = tactid.Experiment.paper().replace(duration=2.0, frequency=0.5)
    >>> _ = tactid.simulate(experiment, "one.mcap")
    >>> _ = tactid.simulate(experiment.replace(seed=2), "two.mcap")
    >>> both = tactid.identify(["one.mcap", "two.mcap"])
    >>> both
    <tactid.Combination: ... kg in tool0, 10 of 10 values identifiable, 2 recordings that agree>
    """

    def to_json(self, within: float = WITHIN) -> str:
        """Returns the combined result as a JSON document, without time series.

        ``tactid.combination_schema()`` is its JSON schema, which describes every key.

        >>> import json
        >>> record = json.loads(both.to_json())
        >>> record["schema"], record["names"]
        ('tactid.combination/3', ['one.mcap', 'two.mcap'])

        Args:
            within: Target of ``remaining_s`` of each recording.
        """
        return result_json.to_json(combination_json.record(self, within))

    def write_result(self, path: str | os.PathLike[str], within: float = WITHIN) -> None:
        """Writes the JSON of :meth:`to_json` with the time series of each recording.

        >>> both.write_result("both.json")

        Args:
            path: The ``.json`` file to write.
            within: Target of ``remaining_s`` of each recording.

        Raises:
            ArgumentError: The folder does not exist, the name does not end in ``.json``, or the
                file is one that was read.
        """
        combination_json.write(self, checked_output(path, self.inputs, ".json"), within)

    def write_report(
        self, path: str | os.PathLike[str], figures: FigureFormat | None = None
    ) -> None:
        """Writes the report: one HTML file with each recording beside the whole.

        >>> both.write_report("both.html")

        Args:
            path: The file to write.
            figures: Writes each figure beside the report, too: as ``png``, ``svg`` or ``pdf``.

        Raises:
            ArgumentError: The folder does not exist, the name does not end in ``.html``, or the
                file is one that was read.
        """
        from tactid._show import (
            combination_report,  # imports matplotlib, which takes a while to load
        )

        checked = checked_report(path, self.inputs, figures, captions.COMBINATION)
        combination_report.write_report(self, checked, form=figures)

    def worded_remarks(self, style: Style = "keyword") -> list[str]:
        """Says what a reader must know to trust the result; what shows it to be wrong is first."""
        return combination_text.combined_remarks(self, style)

    def __repr__(self) -> str:
        verdict = "agree" if self.agreement.agree else "disagree"
        contradicted = ", contradicted by the data" if self.is_contradicted else ""
        runs = f"{len(self.runs)} recordings that {verdict}"
        return f"<tactid.Combination: {self.estimate.summary}, {runs}{contradicted}>"

    def __str__(self) -> str:
        return combination_text.text(self)

    def _repr_html_(self) -> str:
        return combination_text.html(self)


def combine(results: Sequence[Recorded]) -> Combination:
    """Combines the results of several recordings of one payload.

    The results are those of :func:`tactid.identify`, of logs or of arrays, by least squares and in
    the same frame. They are weighted by their information, so that motions which determine
    different values complement each other. Where they differ by more than their noise, the
    intervals grow to what varies from recording to recording, a finding names the recording that
    differs most, and a long recording does not outvote the others. Of two recordings that disagree
    none is known to be right: the intervals become very wide.

    A known mass, a bounding box and a shape count once. What the gains of a robot's efforts or its
    calibration leave unknown is the same in all recordings: no number of them reduces it, and it is
    in the combined interval. The same holds for a known tool. Other errors that the recordings
    share (an unloaded reference, the gain of a sensor) show in no difference between them and are
    in no interval.

    >>> runs = [tactid.identify("one.mcap"), tactid.identify("two.mcap")]
    >>> tactid.combine(runs).agreement.agree
    True

    Args:
        results: The recordings' results, in any order. One alone is its own combination.

    Returns:
        The payload from all recordings, with the verdict on whether they agree.

    Raises:
        ArgumentError: There is no result, or the results have different frames, known masses,
            bounding boxes or shapes, or one is a copy or the beginning of another.
        IdentificationError: A result is that of the paper's filter, which has no information.
    """
    results = _checked(results)
    names = _names(results)
    runs = [_by_least_squares(name, run) for name, run in zip(names, results, strict=True)]
    data = _native.combine([_contribution(*each) for each in zip(names, runs, strict=True)])
    return Combination(**data, runs=tuple(runs), names=names)


def _checked(results: Sequence[Recorded]) -> Sequence[Recorded]:
    """Checks that there are results, and that each is one of a recording."""
    expected = "expected a list of results of tactid.identify, one for each recording"
    if isinstance(results, str | bytes) or not isinstance(results, Iterable):
        raise ArgumentError(f"`results` is {_kind(results)}: {expected}")
    results = tuple(results)
    if not results:
        raise ArgumentError("`results` is empty: there is no recording to combine")
    for index, result in enumerate(results):
        if isinstance(result, CombinationData):
            raise ArgumentError(
                f"`results[{index}]` is a combination: combine its `runs` together with the others"
            )
        if not isinstance(result, Recorded):
            raise ArgumentError(f"`results[{index}]` is {_kind(result)}: {expected}")
    return results


def _kind(given: object) -> str:
    return f"of type {type(given).__name__}"


def _names(results: Sequence[Recorded]) -> list[str]:
    """Returns a different name for each recording: that of its log, or its path, or its number."""
    logs = [result.inputs.get("the log") for result in results]
    short = [None if log is None else log.name for log in logs]
    names = []
    for index, (log, name) in enumerate(zip(logs, short, strict=True)):
        if log is None or name is None or logs.count(log) > 1:
            names.append(f"recording {index + 1}")
        else:
            names.append(name if short.count(name) == 1 else f"{log.parent.name}/{name}")
    if len(set(names)) < len(names):
        return [f"recording {index + 1}" for index in range(len(names))]
    return names


def _by_least_squares(name: str, result: Recorded) -> IdentificationData:
    if not isinstance(result, IdentificationData):
        raise IdentificationError(
            f"{name} has no information to combine: several recordings need least squares"
        )
    return result


def _contribution(name: str, result: IdentificationData) -> dict[str, Any]:
    """Returns what a result contributes to a combination."""
    known = {key: getattr(result, key) for key in ("linear", "known_mass", "bounding_box")}
    known["shape"] = None if result.shape is None else result.shape.prior
    return {
        "name": name,
        "beginning": result.setup.beginning,
        **{key: None if each is None else listed_fields(each) for key, each in known.items()},
        **{key: getattr(result.estimate, key) for key in ("frame", "windows", "rejected", "gaps")},
    }
