"""No small input takes much memory, or ends in more text than a reader can use."""

from pathlib import Path

import bombs

MOST_LINES = 1100
"""Lines of an answer: ``info`` lists a thousand topics."""
MOST_PROCESSOR_S = 20.0
"""Processor time of a command, s. The bar is 5 s on an idle core."""
LONGEST = 2000
"""Characters of a line."""


def test_small_inputs_take_little_memory(tmp_path: Path) -> None:
    wrong = []
    for case in bombs.cases(tmp_path):
        cost = bombs.run(case)
        lines = cost.text.splitlines()
        is_short = len(lines) < MOST_LINES and max(map(len, lines), default=0) < LONGEST
        is_small = cost.memory_mb < bombs.LIMIT_MB and cost.processor_s < MOST_PROCESSOR_S
        if cost.code not in (0, 1, 2) or not is_small or not is_short:
            wrong.append((case.name, case.arguments[0], cost, lines[-1:]))
    assert wrong == []
