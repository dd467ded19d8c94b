"""How much longer a motion must go on, in words."""

import math

import numpy as np
from numpy.typing import NDArray

from tactid._base.naming import duration, listed
from tactid._base.values import KIND_NAMES, KINDS, Z95, Array
from tactid._native import VALUE_NAMES
from tactid._results.identification import IdentificationData
from tactid._show.remarks import TOO_LONG, constant_errors, measures_moments, motion_advice

WITHIN = 0.01
"""Target for half of each 95 % interval, as a fraction of the largest value of its kind."""

STEPS = ((36_000.0, "10 h"), (3_600.0, "1 h"), (600.0, "10 min"), (60.0, "1 min"), (10.0, "10 s"))
"""Lower bounds that stand for a longer time, s, with their names."""


def outlook(result: IdentificationData, within: float = WITHIN) -> str | None:
    """Says how much longer the motion must go on, or which motion would determine what it cannot.

    It concerns the values that are identifiable: the remarks name the others, with advice. Returns
    None where there are none, and where the data contradict the result: then no interval contains
    the truth, however long the motion goes on.
    """
    if result.is_contradicted or any(noticed.severity != "notes" for noticed in result.findings):
        return None
    remaining, identifiable = result.remaining(within), np.array(result.estimate.identifiable)
    if np.isnan(remaining).any() or not identifiable.any():
        return None
    every = "Every value" if identifiable.all() else "Every other value"
    remaining = np.where(identifiable, remaining, 0.0)
    target = f"within {100 * within:g} %"
    if not remaining.any():
        return f"{every} is known {target}."
    limited = np.isinf(remaining) & _limited_by_gains(result, within)
    if limited.any():
        listed_names = listed(np.array(VALUE_NAMES)[limited].tolist())
        constant = constant_errors(result)
        return f"The uncertainty of {constant} alone keeps {listed_names} from {target}."
    hopeless = remaining > TOO_LONG * result.duration_s
    if hopeless.any():
        names = np.array(VALUE_NAMES)[hopeless].tolist()
        advice = motion_advice(names, moments=measures_moments(result))
        return " ".join([*_undetermined(remaining, hopeless, target), *advice])
    last = VALUE_NAMES[int(remaining.argmax())]
    more = duration(float(remaining.max()))
    return f"{every} is known {target} after another {more} of this motion, {last} last."


def needs_another_motion(result: IdentificationData, within: float = WITHIN) -> bool:
    """Returns whether some value stays unknown however long this motion goes on, or almost so."""
    if result.is_contradicted or any(noticed.severity != "notes" for noticed in result.findings):
        return False
    identifiable = np.array(result.estimate.identifiable)
    remaining = result.remaining(within)
    hopeless = (remaining > TOO_LONG * result.duration_s) & ~_limited_by_gains(result, within)
    unknown = hopeless | ~identifiable
    if not measures_moments(result):  # without them, no motion shows the inertia
        unknown[KINDS[2]] = False
    return not np.isnan(remaining).any() and bool(unknown.any())


def _limited_by_gains(result: IdentificationData, within: float) -> NDArray[np.bool_]:
    """Returns the values that the uncertainty of the gains alone keeps from the target."""
    limited = np.zeros(len(VALUE_NAMES), bool)
    known = np.where(result.estimate.identifiable, result.estimate.std_devs, 0.0)
    of_gains = Z95 * known * np.sqrt(1 - result.fit.noise_fraction)
    for kind in KINDS:
        largest = np.abs(result.estimate.values[kind]).max()
        limited[kind] = of_gains[kind] > within * largest
    return limited


def _undetermined(remaining: Array, hopeless: NDArray[np.bool_], target: str) -> list[str]:
    sentences = []
    for kind, name in zip(KINDS, KIND_NAMES, strict=True):
        if hopeless[kind].any():
            worst = kind.start + int(remaining[kind].argmax())
            need = _need(VALUE_NAMES[worst], float(remaining[worst]))
            sentences.append(f"This motion does not determine the {name} {target} ({need}).")
    return sentences


def _need(name: str, seconds: float) -> str:
    if math.isinf(seconds):
        return f"{name} stays unknown however long it goes on"
    bound = next((text for step, text in STEPS if seconds >= step), duration(seconds))
    return f"{name} would need more than {bound}"
