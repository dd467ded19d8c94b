"""No small input takes much memory, or ends in more text than a reader can use."""

from pathlib import Path

import bombs
from commands import CommandServer

MOST_LINES = 1100
"""Lines of an answer: ``info`` lists a thousand topics."""
MOST_PROCESSOR_S = 10.0
"""Processor time of a command, s. The bar is 5 s on an idle core; a loaded one takes twice that."""
MAX_LINE_LENGTH = 2000
"""Characters of a line of an answer."""


def test_small_inputs_take_little_memory_and_time(tmp_path: Path) -> None:
    wrong = []
    server = CommandServer()
    for case in bombs.cases(tmp_path):
        cost = bombs.run(case, server, tmp_path)
        lines = [*cost.stdout.splitlines(), *cost.stderr.splitlines()]
        is_short = len(lines) < MOST_LINES and max(map(len, lines), default=0) < MAX_LINE_LENGTH
        is_small = cost.memory_mb < bombs.LIMIT_MB and cost.processor_s < MOST_PROCESSOR_S
        errors = [line for line in lines if line.startswith("tactid: error: ")]
        # Each input either is read, or ends in one error, which is the last line.
        is_clear = len(errors) == (cost.returncode == 2) and errors == lines[-1:][: len(errors)]
        if cost.returncode not in (0, 2) or not is_clear or not is_small or not is_short:
            wrong.append((case.name, case.arguments[0], cost, lines[-1:]))
    server.close()
    assert wrong == []
