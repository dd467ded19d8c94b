"""Findings and faults as JSON has them."""

from collections.abc import Iterable, Mapping
from typing import Any

from tactid._base.findings import DataFault, Finding
from tactid._base.naming import Style
from tactid._base.values import finite


def findings(noticed: Iterable[Finding], style: Style) -> list[dict[str, Any]]:
    """Returns findings as JSON has them: the kind, how grave it is, its data, and the sentences."""
    return [
        {
            "kind": each.kind,
            "severity": each.severity,
            **_plain(each.data),
            "text": each.worded(style),
        }
        for each in noticed
    ]


def faults(noticed: Iterable[DataFault]) -> list[dict[str, Any]]:
    """Returns faults as JSON has them: topic, kind and count, and the sentence."""
    return [_fault(fault) for fault in noticed]


def _fault(fault: DataFault) -> dict[str, Any]:
    return {
        "topic": fault.topic,
        "kind": fault.kind,
        "joint": fault.joint,
        "text": str(fault),
        "count": fault.count,
        "first_s": finite(fault.first_s),
    }


def _plain(value: Any) -> Any:
    """Returns the data of a finding with numbers that JSON has."""
    if isinstance(value, float):
        return finite(value)
    if isinstance(value, Mapping):
        return {name: _plain(entry) for name, entry in value.items()}
    if isinstance(value, Iterable) and not isinstance(value, str):
        return [_plain(entry) for entry in value]
    return value
