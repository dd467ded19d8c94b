"""Comparison of the methods and estimators on one recording."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from tactid._api.offline import identify
from tactid._api.result import Identification, PaperIdentification
from tactid._base.equality import ComparedByValue
from tactid._base.errors import ArgumentError, LogError, TactidError
from tactid._base.field_docs import with_fields
from tactid._base.naming import Style, option_name
from tactid._options.options import Estimator, Method, Options

CANDIDATES: tuple[tuple[Method, Estimator], ...] = (
    ("tactile", "least-squares"),
    ("effort", "least-squares"),
    ("joint-sensing", "least-squares"),
    ("combined", "least-squares"),
    ("tactile", "nlms"),
    ("joint-sensing", "nlms"),
)
"""Every method with least squares, and the methods that the paper's filter (``nlms``) can use."""

CHOSEN = ("method", "estimator")
"""The options that a comparison does not have, because it runs each of their choices."""


@with_fields
@dataclass(frozen=True, eq=False)
class Attempt(ComparedByValue):
    """An identification by one method and estimator, or the reason why there is none."""

    method: Method
    """Measurements that the payload was to be identified from."""
    estimator: Estimator
    """How equations were to become parameters."""
    result: Identification | PaperIdentification | None
    """The identification; None where the recording does not permit it."""
    error: TactidError | None
    """Why the recording does not permit it; None where there is a result."""

    @property
    def title(self) -> str:
        """Name of the attempt in a table: the method, and the estimator unless least squares."""
        return self.method if self.estimator == "least-squares" else f"{self.method}, NLMS"

    def reason(self, style: Style = "keyword") -> str | None:
        """Returns why there is no result, in one line; None where there is one."""
        if self.error is None:
            return None
        text = " ".join(self.error.worded(style).split())
        # Without the advice on an option that a comparison chooses itself.
        advice = tuple(option_name(name, style) for name in CHOSEN)
        return "; ".join(part for part in text.split("; ") if not part.startswith(advice))


def compare(
    source: Any,
    *,
    options: Options | None = None,
    progress: Callable[[float], object] | None = None,
    **keywords: Any,
) -> list[Attempt]:
    """Identifies the payload by every method and estimator that a recording permits.

    Args:
        source: The log's path, or the times of the samples, as :func:`tactid.identify` takes them.
        options: Options to start from; keywords replace them.
        progress: Called with the fraction done. An exception that it raises stops the work.
        **keywords: Arrays and options of :func:`tactid.identify`, but for ``method`` and
            ``estimator``. An option that one of the attempts cannot use is the reason of that one.

    Returns:
        One attempt for each method with least squares, then two with the paper's filter.

    Raises:
        LogError: The log cannot be read.
        TactidError: No method is possible. The error is that of the first attempt.
    """
    _check_choice(options, keywords)
    attempts = []
    for index, (method, estimator) in enumerate(CANDIDATES):

        def advance(done: float, index: int = index) -> None:
            if progress is not None:
                progress((index + done) / len(CANDIDATES))

        keywords |= {"method": method, "estimator": estimator}
        result, error = None, None
        try:
            result = identify(source, options=options, progress=advance, **keywords)
        except LogError:
            raise
        except TactidError as refused:
            error = refused
        attempts.append(Attempt(method, estimator, result, error))
    _check_any(attempts)
    return attempts


def _check_choice(options: Options | None, keywords: dict[str, Any]) -> None:
    for name in CHOSEN:
        if keywords.get(name, getattr(options, name, None)) is not None:
            message = f"a comparison runs every method and estimator: leave `{name}` out"
            raise ArgumentError(message, option=name)


def _check_any(attempts: Sequence[Attempt]) -> None:
    errors = [attempt.error for attempt in attempts]
    if errors[0] is not None and None not in errors:
        raise errors[0]
