"""What is timed runs on one core; what is built, on all of them."""

import os
from collections.abc import Iterator
from contextlib import contextmanager

USABLE = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else None
"""Cores of this process when it began, where the system lets a process choose."""


def use_one_core() -> None:
    """Keeps this thread, and the threads and processes that it starts from now on, on one core."""
    if USABLE is not None:
        os.sched_setaffinity(0, {max(USABLE)})


@contextmanager
def all_cores() -> Iterator[None]:
    """Lets processes that the block starts run on all cores."""
    if USABLE is None:
        yield
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, USABLE)
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)
