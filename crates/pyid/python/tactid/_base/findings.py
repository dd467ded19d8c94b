"""What was noticed about a recording: findings, and faults of its messages, for a program to match.

How grave they are, and the words for them, are Rust's.
"""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Literal, get_args

from tactid import _native
from tactid._base.field_docs import with_fields
from tactid._base.naming import Style

Severity = Literal["contradicts", "doubts", "notes"]
"""How grave a finding is: the result is wrong; no precision is promised, because the values may be
off by more than their intervals, or there is no payload to be known; or neither."""

Subject = Literal["measurements", "assumption", "result", "consequence"]
"""What a finding is about, in the order in which findings of one severity are read. A consequence
is caused by wrong measurements as well, and guesses at another cause."""


@with_fields
@dataclass(frozen=True)
class Finding:
    """Something that a reader of the result should know; ``print`` shows it as a sentence."""

    kind: str
    """Name of what was noticed, such as ``negative_mass``."""
    data: Mapping[str, Any] = field(default_factory=dict)
    """The numbers and names that belong to the kind."""
    style: Style = field(default="keyword", compare=False, repr=False)
    """Who reads the sentence: it decides which options it names."""

    def __str__(self) -> str:
        return self.worded(self.style)

    @property
    def severity(self) -> Severity:
        """How grave the finding is: ``"contradicts"``, ``"doubts"`` or ``"notes"``."""
        return self._grade[0]

    @property
    def subject(self) -> Subject:
        """What the finding is about.

        Remarks leave out a ``"consequence"`` beside a finding about ``"measurements"``.
        """
        return self._grade[1]

    @property
    def contradicts_result(self) -> bool:
        """Whether the finding shows the result to be wrong."""
        return self.severity == "contradicts"

    @property
    def rank(self) -> tuple[int, int]:
        """Place among other findings: the gravest first, and what may cause others before them."""
        return get_args(Severity).index(self.severity), get_args(Subject).index(self.subject)

    def worded(self, style: Style) -> str:
        """Returns the finding in sentences, with options as the reader would write them."""
        return _native.finding_words(self.kind, self.data, style)

    @property
    def _grade(self) -> tuple[Severity, Subject]:
        grade: tuple[Severity, Subject] = _native.finding_grade(self.kind, self.data)
        return grade


@with_fields
@dataclass(frozen=True)
class DataFault:
    """One kind of fault in the messages of one topic; ``print`` shows it as a sentence."""

    topic: str
    """Topic of the messages or name of the array, or ``samples`` for what could not be aligned."""
    kind: str
    """Kind of the fault, such as ``out_of_order``."""
    count: int
    """Number of occurrences."""
    first_s: float = math.nan
    """Time of the first occurrence on the recording's clock, s; NaN where it is not known."""
    joint: str | None = None
    """Name of the joint, where the fault is that of one joint; else None."""

    def __str__(self) -> str:
        return f"{self.clause}."

    @property
    def clause(self) -> str:
        """The topic, how often the fault occurred, what was done about it, and the first time."""
        return _native.fault_words(asdict(self) | {"joint": self.joint or ""})
