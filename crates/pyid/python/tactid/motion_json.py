"""The result of a design as JSON, which ``motion.schema.json`` describes."""

from dataclasses import asdict
from typing import Any

from tactid.motion_data import MotionData
from tactid.result_json import UNITS
from tactid.result_json import to_json as to_text
from tactid.values import all_finite, finite

SCHEMA = "tactid.motion/1"
"""Name and version of the layout: a change that breaks a reader increments the version."""


def to_json(motion: MotionData, speed: float | None = None) -> str:
    """Returns the result of a design as JSON; ``speed`` is that of the files beside it."""
    return to_text(record(motion, speed))


def record(motion: MotionData, speed: float | None = None) -> dict[str, Any]:
    """Returns the result of a design as JSON has it; ``speed`` is that of the files beside it."""
    return {
        "schema": SCHEMA,
        "units": {name: UNITS[name] for name in ("mass", "com", "inertia", "time")},
        "frame": motion.tip,
        "method": motion.method,
        "joints": list(motion.joints),
        "moving_joints": list(motion.moving),
        "duration_s": motion.duration_s,
        "files_speed": speed,
        "seed": motion.seed,
        "expected_payload": dict(motion.expected_payload),
        "predicted_std_dev": dict(motion.predicted_std_dev),
        "within": motion.within,
        "interval_ratio": dict(motion.interval_ratio),
        "assumed_noise": list(motion.assumed_noise),
        "base_attitude_deg": motion.base_attitude_deg,
        "base_position_m": motion.base_position_m,
        # JSON has no infinity, of which a payload that pulls off a pad uses its grip.
        "margins": [asdict(each) | {"used": finite(each.used)} for each in motion.margins],
        "binding_constraints": list(motion.binding_constraints),
        "collision_findings": None
        if motion.collision_findings is None
        else [asdict(each) for each in motion.collision_findings],
        "payload_tested": motion.payload_tested,
        "surroundings": list(motion.surroundings),
        "series": {
            "time": motion.history_time.tolist(),
            "std_dev": [all_finite(row) for row in motion.history_std_devs.tolist()],
            "base_attitude_deg": motion.history_base_attitude_deg.tolist(),
        },
    }
