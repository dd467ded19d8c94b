"""The command ``tactid``."""
