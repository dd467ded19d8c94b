"""Online estimators of ten parameters beside plain C++ with Eigen, and padasip in Python."""

import ctypes
import time
from collections.abc import Iterator
from functools import cache

import numpy as np

from peers.harness import TOLERANCE, Array, Comparison, Contender
from peers.native import MissingPeerError, cxx_library, tactid_library, thread_seconds

try:
    import padasip
except ImportError:
    padasip = None

ROWS = 4098
"""Rows of one measurement: whole blocks of six."""

REPETITIONS = 40

NOISE = 0.1
"""Standard deviation of the noise on the targets, which are about 3: with exact rows, every filter
that converges would reach the same parameters, and an agreement would say nothing."""

HALF_OF_THE_DIGITS = 1e-6
"""Largest difference of recursive least squares from the peers, whose recursion on the covariance
loses half of the digits; the table has the difference."""


def comparisons() -> Iterator[Comparison]:
    """A row of each estimator."""
    rng = np.random.default_rng(3)
    rows = rng.normal(size=(ROWS, 10))
    targets = rows @ rng.normal(size=10) + NOISE * rng.normal(size=ROWS)
    numbers = np.column_stack([rows, targets])
    tasks = [
        ("NLMS, a row", "nlms", "nlms", 1.0, TOLERANCE),
        ("RLS, a row, parameters at the end", "rls", "rls", 0.6, HALF_OF_THE_DIGITS),
        (
            "RLS, a row in blocks of six, parameters at the end",
            "rls_blocks",
            "rls",
            1.0,
            HALF_OF_THE_DIGITS,
        ),
    ]
    for task, ours, theirs, bar, tolerance in tasks:
        contenders = [kernel("tactid", tactid(), ours, numbers)]
        for label, flags in (("-O3", ()), ("-O3 -march=native", ("-march=native",))):
            name = f"C++ with Eigen {label}"
            try:
                contenders.append(kernel(name, cxx(*flags), theirs, numbers))
            except MissingPeerError as missing:
                contenders.append(Contender(name, missing=str(missing)))
        if ours != "rls_blocks":
            contenders.append(in_python(theirs, numbers))
        yield Comparison(task, "ns", contenders, bar=bar, tolerance=tolerance)


def tactid():
    """Runs a kernel of tactid."""
    return tactid_library().tactid_estimator_run


@cache
def cxx(*flags: str):
    """Runs a kernel in C++."""
    function = cxx_library("estimators.cpp", *flags, needs=("eigen3/Eigen/Core",)).estimator_run
    function.restype = ctypes.c_bool
    return function


def kernel(label: str, function, name: str, numbers: Array) -> Contender:
    """A kernel behind the C interface."""
    out = np.zeros(10)

    def measure() -> float:
        at = [array.ctypes.data_as(ctypes.c_void_p) for array in (numbers, out)]
        counts = [ctypes.c_size_t(count) for count in (len(numbers), REPETITIONS)]
        run = lambda: function(name.encode(), at[0], *counts, at[1])  # noqa: E731
        return thread_seconds(run, name) / (REPETITIONS * len(numbers))

    measure()
    return Contender(label, measure, out)


def in_python(name: str, numbers: Array) -> Contender:
    """The same filter of padasip."""
    if padasip is None:
        return Contender("padasip", missing="pip install padasip")
    rows, targets = numbers[:, :10], numbers[:, 10]

    def new():
        if name == "nlms":
            return padasip.filters.FilterNLMS(n=10, mu=1.8, eps=0.9, w="zeros")
        return padasip.filters.FilterRLS(n=10, mu=1.0, eps=1e-8, w="zeros")

    def measure() -> float:
        made = new()
        start = time.thread_time()
        made.run(targets, rows)
        return (time.thread_time() - start) / len(rows)

    once = new()
    once.run(targets, rows)
    return Contender("padasip", measure, once.w)
