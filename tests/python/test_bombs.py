"""No small input takes much memory, or ends in more text than a reader can use."""

from pathlib import Path

import bombs

MOST_LINES = 1100
"""Lines of an answer: ``info`` lists a thousand topics."""
LONGEST = 2000
"""Characters of a line."""


def test_small_inputs_take_little_memory(tmp_path: Path) -> None:
    wrong = []
    for case in bombs.cases(tmp_path):
        cost = bombs.run(case)
        lines = cost.text.splitlines()
        is_short = len(lines) < MOST_LINES and max(map(len, lines), default=0) < LONGEST
        if cost.code not in (0, 1, 2) or cost.memory_mb > bombs.LIMIT_MB or not is_short:
            wrong.append((case.name, case.arguments[0], cost.code, cost.memory_mb, lines[-1:]))
    assert wrong == []
