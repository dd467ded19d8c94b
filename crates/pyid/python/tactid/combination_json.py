"""Several recordings together as JSON: the layout of ``tactid identify --json`` for several logs.

The file ``combination.schema.json`` in this package describes every key.
"""

from pathlib import Path
from typing import Any

from tactid import findings_json, reported, result_json
from tactid.combination import CombinationData
from tactid.combination_text import combined_remarks
from tactid.files import write_atomically
from tactid.naming import Style
from tactid.outlook import WITHIN
from tactid.values import all_finite, finite, nested

SCHEMA = "tactid.combination/1"
"""Name and version of the layout: a change that breaks a reader increments the version."""


def write(
    result: CombinationData, path: Path, within: float = WITHIN, style: Style = "keyword"
) -> None:
    """Writes the combined result; each of its recordings has its time series."""
    shown = record(result, within, style)
    for entry, run in zip(shown["recordings"], result.runs, strict=True):
        entry["result"] |= {"series": result_json.series(run)}
    write_atomically(path, result_json.to_json(shown))


def record(
    result: CombinationData, within: float = WITHIN, style: Style = "keyword"
) -> dict[str, Any]:
    """Returns the combined result as JSON has it, without time series.

    Args:
        result: The combination.
        within: Target for the remaining time of each recording.
        style: Who reads the sentences: it decides how they spell options.
    """
    estimate, found = result.estimate, result.agreement
    return {
        "schema": SCHEMA,
        "frame": estimate.frame,
        "inertia_about": "centre of mass",
        "units": result_json.UNITS,
        "estimate": nested(estimate.reported_values),
        "half_width_95": nested(estimate.half_widths),
        **result_json.intervals_and_observability(estimate),
        "principal_moments": {
            "values": reported.moments(result),
            "half_width_95": reported.moment_half_widths(result),
            "interval_95": result_json.limits(reported.moment_intervals(result)),
        },
        "is_contradicted": result.is_contradicted,
        "agreement": {
            "agree": found.agree,
            "chi_square": found.chi_square,
            "degrees_of_freedom": found.degrees_of_freedom,
            "noise_degrees_of_freedom": finite(found.noise_degrees_of_freedom),
            "p_value": found.p_value,
            "value_p_values": nested(all_finite(found.value_p_values)),
            "between_runs_std_dev": nested(all_finite(found.between_runs)),
        },
        "findings": findings_json.findings(result.findings, style),
        "remarks": combined_remarks(result, style),
        "recordings": [
            {
                "name": name,
                "distance": {
                    "chi_square": distance.chi_square,
                    "degrees_of_freedom": distance.degrees_of_freedom,
                    "p_value": distance.p_value,
                    "others_agree": distance.others_agree,
                },
                "result": result_json.record(run, within, style),
            }
            for name, distance, run in zip(result.names, found.runs, result.runs, strict=True)
        ],
    }
