"""Results as data, their tables, and the forms in which other programs take a payload."""
