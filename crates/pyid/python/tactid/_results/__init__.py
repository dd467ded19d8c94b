"""Results as data, their tables, and the forms in which other programs take a payload."""

# The native part makes results of these, whatever of the package is imported.
from tactid._results import (
    calibration_data as _calibration_data,  # noqa: F401
    payload as _payload,  # noqa: F401
)
