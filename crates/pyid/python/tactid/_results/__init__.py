"""Results as data, their tables, and the forms in which other programs take a payload."""

# The native part makes estimates with these methods, whatever of the package is imported.
from tactid._results import payload as _payload  # noqa: F401
