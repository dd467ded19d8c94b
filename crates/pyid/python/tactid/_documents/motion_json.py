"""The result of a design as JSON, which ``tactid.motion_schema()`` describes."""

from typing import Any

from tactid._documents.result_json import UNITS, plain, to_json as to_text
from tactid._results import records

SCHEMA = "tactid.motion/2"
"""Name and version of the layout: a change that breaks a reader increments the version."""


VIEWS: dict[str, dict[str, Any]] = {
    "files_speed": {
        "type": "number",
        "description": "Fraction of the designed speed at which the files beside this one run,"
        " without a unit; null where there are none.",
    },
}
"""What the document has besides the fields of the motion, as JSON schemas."""


def to_json(motion: records.DesignedMotion, speed: float | None = None) -> str:
    """Returns the result of a design as JSON; ``speed`` is that of the files beside it."""
    return to_text(record(motion, speed))


def record(motion: records.DesignedMotion, speed: float | None = None) -> dict[str, Any]:
    """Returns the result of a design as JSON has it; ``speed`` is that of the files beside it."""
    return {"schema": SCHEMA, "units": UNITS, **plain(motion), "files_speed": speed}
