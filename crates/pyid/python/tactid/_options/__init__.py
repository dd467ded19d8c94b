"""Options and arrays: declared once, for keywords, flags and documentation."""
