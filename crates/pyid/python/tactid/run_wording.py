"""Several recordings in words: how far they are from each other."""

import math
from collections.abc import Callable, Mapping
from typing import Any

from tactid.naming import Style, at_most

Data = Mapping[str, Any]

P_RARE = 0.01
"""Probability below which all parameters of several recordings together show a disagreement."""

P_SHOWN = 1e-6
"""Probability below which the number itself is not shown."""


def probability(p_value: float) -> str:
    """Returns a probability as a table shows it: a tiny one is an upper limit."""
    return f"{p_value:.2g}" if p_value >= P_SHOWN else f"< {P_SHOWN:g}"


def equals(p_value: float) -> str:
    """Returns a probability as a sentence shows it."""
    shown = probability(p_value)
    return f"p {shown}" if shown.startswith("<") else f"p = {shown}"


def distance_of_runs(
    chi_square: float, degrees_of_freedom: float, of_noise: float | None, p_value: float
) -> str:
    """Returns how far recordings are from each other, such that the probability can be followed.

    It is that of Fisher's distribution with both degrees of freedom.
    """
    known = of_noise is None or math.isinf(of_noise)
    noise = "" if known else f" and noise from {of_noise:.0f}"
    return (
        f"chi-square {chi_square:.4g} for {degrees_of_freedom:.4g} degrees of freedom{noise},"
        f" {equals(p_value)}"
    )


def _runs_disagree(data: Data, _: Style) -> str:
    keys = ("chi_square", "degrees_of_freedom", "noise_degrees_of_freedom", "p_value")
    distance = distance_of_runs(*(data[key] for key in keys))
    alone = ""
    if data["p_value"] >= P_RARE:
        # All parameters together may hide a single value that differs.
        alone = f" in {data['least_probable']}"
        distance = f"{equals(data['least_p_value'])}; all values together: {distance}"
    sentences = [
        f"The {data['runs']} recordings disagree{alone} by more than their noise ({distance})."
    ]
    if data["value"] is not None:
        sentences.append(_difference(data))
    sentences.append(
        "The intervals include what varies between the recordings, but not what is wrong in all of"
        " them."
    )
    return " ".join(sentences)


def _difference(data: Data) -> str:
    """Says which recording differs most from the others, and in which value."""
    difference, others = data["difference"], data["of_others"]
    relative = f"{100 * difference / others:+.1f} % " if abs(difference) < abs(others) else ""
    sigmas = abs(data["sigmas"])
    distance = at_most(sigmas)
    unit = {"m": "kg", "c": "m", "I": "kg m²"}[data["value"][0]]
    size = f"{difference:+.3g} {unit}"
    amount = (
        f"{relative}({size}, {distance} standard deviations)"
        if relative
        else f"{size} ({distance} standard deviations)"
    )
    if data["run"] is None:
        first, second = data["recordings"]
        return f"{second} differs from {first} most in {data['value']}, by {amount}."
    agree = "agree" if data["others_agree"] else "disagree, too"
    return (
        f"{data['run']} differs most from the others, which {agree}: its {data['value']} by"
        f" {amount}."
    )


RUN_FINDINGS: dict[str, Callable[[Data, Style], str]] = {
    "runs_disagree": _runs_disagree,
}
