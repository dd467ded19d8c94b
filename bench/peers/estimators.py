"""Online estimators of ten parameters beside plain C++ with Eigen, and padasip in Python."""

import ctypes
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial

import numpy as np

from peers.harness import TOLERANCE, Array, Comparison, Contender, peer
from peers.native import OWN_PROCESSOR, Kernel, cxx_library, pointer, tactid_library

ROWS = 4098
"""Rows of one measurement: whole blocks of six."""

REPETITIONS = 40

NOISE = 0.1
"""Standard deviation of the noise on the targets, which are about 3: with exact rows, every filter
that converges would reach the same parameters, and an agreement would say nothing."""

HALF_OF_THE_DIGITS = 1e-6
"""Largest difference of recursive least squares from the peers, whose recursion on the covariance
loses half of the digits; the table has the difference."""


@dataclass
class Task:
    """A filter: its kernels in both languages, and how well their parameters must agree."""

    name: str
    ours: str
    theirs: str
    bar: float
    tolerance: float


TASKS = [
    Task("NLMS, a row", "nlms", "nlms", 1.0, TOLERANCE),
    Task("RLS, a row, parameters at the end", "rls", "rls", 1.0, HALF_OF_THE_DIGITS),
    Task(
        "RLS, a row in blocks of six, parameters at the end",
        "rls_blocks",
        "rls",
        1.0,
        HALF_OF_THE_DIGITS,
    ),
]


def comparisons() -> list[Comparison]:
    """A row of each estimator."""
    return [
        Comparison(task.name, "ns", contenders(task), bar=task.bar, tolerance=task.tolerance)
        for task in TASKS
    ]


def contenders(task: Task) -> dict[str, Callable[[], Contender]]:
    """The filter in Rust, in C++, and in Python where it takes single rows."""
    chosen = {
        "tactid": partial(kernel, tactid, task.ours),
        "C++ with Eigen -O3": partial(kernel, cxx, task.theirs),
        f"C++ with Eigen -O3 {OWN_PROCESSOR}": partial(
            kernel, partial(cxx, OWN_PROCESSOR), task.theirs
        ),
    }
    if task.ours == task.theirs:
        chosen["padasip"] = partial(in_python, task.theirs)
    return chosen


@cache
def measured() -> Array:
    """Rows with their targets, which have noise."""
    rng = np.random.default_rng(3)
    rows = rng.normal(size=(ROWS, 10))
    targets = rows @ rng.normal(size=10) + NOISE * rng.normal(size=ROWS)
    return np.column_stack([rows, targets])


def tactid():
    """Runs a kernel of tactid."""
    return tactid_library().tactid_estimator_run


@cache
def cxx(*flags: str):
    """Runs a kernel in C++."""
    function = cxx_library("estimators.cpp", *flags, needs=("eigen3/Eigen/Core",)).estimator_run
    function.restype = ctypes.c_bool
    return function


def kernel(library: Callable, name: str) -> Contender:
    """A kernel behind the C interface."""
    function, rows = library(), measured()

    def run(name: bytes, repetitions: ctypes.c_size_t, out: Array) -> bool:
        return function(name, pointer(rows), ctypes.c_size_t(ROWS), repetitions, pointer(out))

    made = Kernel(run, name, ROWS, np.zeros(10))
    made.repetitions = REPETITIONS
    return Contender(made, made.out)


def in_python(name: str) -> Contender:
    """The same filter of padasip."""
    filters = peer("padasip", "padasip").filters
    rows, targets = measured()[:, :10], measured()[:, 10]

    def new():
        if name == "nlms":
            return filters.FilterNLMS(n=10, mu=1.8, eps=0.9, w="zeros")
        return filters.FilterRLS(n=10, mu=1.0, eps=1e-8, w="zeros")

    def measure() -> float:
        made = new()
        start = time.thread_time()
        made.run(targets, rows)
        return (time.thread_time() - start) / len(rows)

    once = new()
    once.run(targets, rows)
    return Contender(measure, once.w)
