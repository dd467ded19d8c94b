"""No small input takes much memory, or ends in more text than a reader can use."""

from pathlib import Path

import bombs

MOST_LINES = 1100
"""Lines of an answer: ``info`` lists a thousand topics."""
LONGEST = 2000
"""Characters of a line."""


def test_small_inputs_take_little_memory(tmp_path: Path) -> None:
    for case in bombs.cases(tmp_path):
        cost = bombs.run(case)
        about = f"{case.name}, {case.arguments[0]}: {cost.text[-300:]}"
        assert cost.code in (0, 1, 2), about
        assert cost.memory_mb < bombs.LIMIT_MB, f"{cost.memory_mb} MB, {about}"
        lines = cost.text.splitlines()
        assert len(lines) < MOST_LINES, about
        assert max(map(len, lines), default=0) < LONGEST, about
