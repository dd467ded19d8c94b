"""Runs a command and writes what it costs.

``python -I -S measure.py DEADLINE_S FILE COMMAND...`` writes the exit code, wall and processor time
(s) and the largest memory (MB) of the command as JSON. The kernel counts what the process that
starts a command occupies as memory of the command; this script imports little and occupies 10 MB.
"""

import json
import os
import subprocess
import sys
import threading
import time


def main() -> None:
    """Runs the command of the arguments."""
    deadline_s, path, *command = sys.argv[1:]
    start_s = time.perf_counter()
    process = subprocess.Popen(command)
    deadline = threading.Timer(float(deadline_s), process.kill)
    deadline.start()
    _, status, usage = os.wait4(process.pid, 0)
    deadline.cancel()
    cost = {
        "code": os.waitstatus_to_exitcode(status),
        "wall_s": time.perf_counter() - start_s,
        "processor_s": usage.ru_utime + usage.ru_stime,
        "memory_mb": usage.ru_maxrss * 1024 / 1e6,  # Linux counts KiB
    }
    with open(path, "w", encoding="utf-8") as file:
        json.dump(cost, file)


if __name__ == "__main__":
    main()
