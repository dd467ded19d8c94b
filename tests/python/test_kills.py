"""Whatever ends a run, and whenever, its inputs are unchanged and its files are whole or absent."""

from pathlib import Path

import kills


def test_ended_runs_leave_whole_files(tmp_path: Path) -> None:
    """Every command once; ``kills.py`` ends as many as are asked for."""
    assert kills.run(len(kills.DURATION_S), 3, tmp_path) == []
