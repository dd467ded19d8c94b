"""The numbers of the paper's Table 2: the payload, and what the paper's filter identified."""

from tactid._results.truth import Truth

PAPER_NOMINAL = (100.0, 0.5, 0.0, 0.0, 10.0, 0.0, 0.0, 20.0, 0.0, 10.0)
PAPER_VALUES = (101.6, 0.51, 0.0, 0.0, 10.1, 0.0, 0.0, 20.22, 0.0, 10.13)
PAPER_ERRORS = (1.6, 2.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.1, 0.0, 1.3)


def is_the_papers(truth: Truth) -> bool:
    """Whether the payload is the one whose identification the paper's table shows."""
    return tuple(truth.nominal) == PAPER_NOMINAL
