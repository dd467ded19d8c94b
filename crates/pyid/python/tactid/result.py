"""A result as plain data: the layout of ``result.json``."""

import json
import math
import os
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import tactid

Way = Literal["tactile", "joint-sensing"]
Filter = Literal["nlms", "rls"]

Values = Sequence[float | None]
"""Mass, kg; centre of mass, m; inertia about it, kg m²: ten, in the order of ``VALUE_NAMES``."""

PATHS = (
    ("mass",),
    *(("com", axis) for axis in ("x", "y", "z")),
    *(("inertia", axes) for axes in ("xx", "xy", "xz", "yy", "yz", "zz")),
)
"""Where each of the ten values stands in a nested result."""

KINDS = (slice(0, 1), slice(1, 4), slice(4, 10))
"""Mass, centre of mass and inertia among the ten."""


def nested(values: Values) -> dict[str, Any]:
    """Lays ten values out as ``mass``, ``com`` and ``inertia``; None for what is not finite."""
    result: dict[str, Any] = {"com": {}, "inertia": {}}
    for path, value in zip(PATHS, values, strict=True):
        place = result if len(path) == 1 else result[path[0]]
        place[path[-1]] = None if value is None or not math.isfinite(value) else float(value)
    return {"mass": result["mass"], **result}


def flat(record: dict[str, Any]) -> list[float]:
    """The inverse of :func:`nested`."""
    return [float(record[p[0]] if len(p) == 1 else record[p[0]][p[1]]) for p in PATHS]


def values_of(body: tactid.MassProperties) -> list[float]:
    """The ten values of a body."""
    i = body.inertia
    inertia = (i[0, 0], i[0, 1], i[0, 2], i[1, 1], i[1, 2], i[2, 2])
    return [body.mass, *map(float, body.com), *map(float, inertia)]


@dataclass(frozen=True)
class Truth:
    """What only a simulation can know of the payload, in the tool frame."""

    actual: list[float]
    """As it sits in the grasp."""
    nominal: list[float]
    """As it was asked for."""

    @property
    def scales(self) -> list[float]:
        """What an error is a fraction of: the nominal value, or the largest of its kind for 0."""
        scales: list[float] = []
        for kind in KINDS:
            largest = max(abs(value) for value in self.nominal[kind])
            scales += [abs(value) or largest for value in self.nominal[kind]]
        return scales

    def errors_percent(self, values: Values) -> list[float | None]:
        """Error of each value in percent of its scale; None where there is no value."""
        return [
            None if value is None or scale == 0 else 100 * (value - actual) / scale
            for value, actual, scale in zip(values, self.actual, self.scales, strict=True)
        ]


def read_truth(info: tactid.LogInfo) -> Truth | None:
    """The truth that a simulated log carries; None for any other log."""
    record = _record(info, "tactid.truth")
    if record is None:
        return None
    try:
        return Truth(actual=flat(record), nominal=flat(record.get("nominal", record)))
    except (KeyError, TypeError, ValueError):
        return None


def read_checks(info: tactid.LogInfo) -> dict[str, Any]:
    """How the run behind a simulated log went; empty for any other log."""
    record = _record(info, "tactid.report")
    if record is None:
        return {}
    checks = {
        "momentum_drift": {
            "linear": record.get("linear_momentum_drift"),
            "angular": record.get("angular_momentum_drift"),
        }
    }
    names = ("grasp_drift_m", "grasp_drift_rad", "newton_residual", "euler_residual")
    return checks | {name: record.get(name) for name in names}


def _record(info: tactid.LogInfo, name: str) -> dict[str, Any] | None:
    try:
        record = json.loads(info.metadata[name]["json"])
    except (KeyError, ValueError):
        return None
    return record if isinstance(record, dict) else None


def estimate_values(found: tactid.Identification) -> list[float | None]:
    """The ten values as they are told: None where the motion did not determine one."""
    estimate = found.estimate
    pairs = zip(estimate.values, estimate.identifiable, strict=True)
    return [float(value) if known else None for value, known in pairs]


def diagnostics(found: tactid.Identification) -> dict[str, Any]:
    """The reasons to trust an estimate, or not to."""
    estimate = found.estimate
    told = {
        "way": found.way,
        "tool": found.tool,
        "average_s": found.average,
        "gravity": [float(entry) for entry in found.gravity],
        "duration_s": found.duration,
        "interval_s": found.interval,
        "epochs": found.epochs,
        "intervals": estimate.intervals,
        "refused": estimate.refused,
        "gaps": estimate.gaps,
        "not_identifiable": estimate.not_identifiable,
        "singular_values": {
            "mass": [float(value) for value in estimate.mass_singular_values],
            "inertia": [float(value) for value in estimate.inertia_singular_values],
        },
        "is_physical": estimate.is_physical,
        "damage": found.damage,
    }
    if estimate.composite is not None:
        told["composite"] = nested(values_of(estimate.composite))
    return told


def remarks_on(found: tactid.Identification) -> list[str]:
    """What a reader must know to trust an identification."""
    estimate = found.estimate
    remarks = []
    if estimate.not_identifiable:
        names = ", ".join(estimate.not_identifiable)
        remarks.append(
            f"Not identifiable: {names}. The motion does not turn the payload about enough axes;"
            " another posture, or driving other joints, would."
        )
    # An inertia that is partly unknown is no wonder; a mass below zero always is.
    explained = estimate.not_identifiable and estimate.body.mass > 0
    if not estimate.is_physical and not explained:
        remarks.append("No body can have these parameters: the estimate has not converged.")
    if estimate.refused:
        remarks.append(f"{estimate.refused} samples were not finite or out of order, and refused.")
    if estimate.gaps:
        remarks.append(f"{estimate.gaps} gaps in the log were not bridged.")
    return remarks


@contextmanager
def atomic_path(path: Path) -> Iterator[Path]:
    """A path to write to, whose file is under ``path`` whole afterwards, or not at all."""
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    os.close(handle)
    try:
        yield Path(temporary)
        umask = os.umask(0)
        os.umask(umask)
        os.chmod(temporary, 0o666 & ~umask)  # mkstemp's file is for its owner alone
        os.replace(temporary, path)
    except BaseException:
        os.unlink(temporary)
        raise


def write_atomically(path: Path, content: str | bytes) -> None:
    """Writes a file so that it is there whole or not at all."""
    with atomic_path(path) as temporary:
        temporary.write_bytes(content.encode() if isinstance(content, str) else content)


def to_json(record: dict[str, Any]) -> str:
    """JSON for people, too; never NaN."""
    return json.dumps(record, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
