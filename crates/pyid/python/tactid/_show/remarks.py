"""Remarks: what a reader must know to trust a result, and the motion that would determine more.

A sentence that names an option spells it as its reader would write it, see
:mod:`tactid._base.naming`.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tactid._base.findings import Finding
from tactid._base.naming import Style, counted, duration, listed, option_name
from tactid._base.values import KIND_NAMES, KINDS, Z95, digits_of
from tactid._native import VALUE_NAMES
from tactid._read.tables import TABLES
from tactid._results.identification import IdentificationData, Recorded
from tactid._results.payload import Payload, PayloadEstimate
from tactid._results.records import GravityEstimate, WeightEstimate
from tactid._show.reported import offsets

TOO_LONG = 10.0
"""A motion that would have to go on for more than this many times the recording's length does not
determine a value: what information there is comes from noise and from the filter's transients."""

MOTION = {
    "with-payload": "motion estimated with the payload",
    "no-velocities": "motion smoothed before (velocities of joints or base are not measured)",
    "too-few": "motion smoothed before (too few samples for splines)",
    "given-cutoff": "motion smoothed before (the cutoff is given)",
    "too-fast": "motion smoothed before (it is faster than 10 Hz, or its noise not white)",
    "unexplained": "motion smoothed before (the model leaves more than noise: compare the methods)",
}
"""How the motion entered the estimate, where a user may do something about it."""


def remarks(result: Recorded, style: Style = "keyword") -> list[str]:
    """Says what a reader must know to trust a result, in sentences; there may be none.

    What shows the result to be wrong comes first, then what makes its intervals too narrow. Where
    the recordings are wrong, the consequences are left out: ``findings`` has them all.
    """
    findings = _without_consequences(result.findings)
    grave = sorted((each for each in findings if each.severity != "notes"), key=lambda x: x.rank)
    others = [each for each in findings if each.severity == "notes"]
    return list(
        dict.fromkeys(
            [
                *(noticed.worded(style) for noticed in grave),
                *_of_the_body(result),
                *_of_the_unknown(result, style),
                *_of_the_samples(result),
                *(noticed.worded(style) for noticed in others),
                *map(str, result.faults),
            ]
        )
    )


def _without_consequences(findings: Sequence[Finding]) -> list[Finding]:
    """Returns the findings without those that other findings explain."""
    is_explained = any(each.subject == "measurements" for each in findings)
    return [each for each in findings if not (is_explained and each.subject == "consequence")]


def _of_the_body(result: Recorded) -> list[str]:
    reason = result.estimate.why_impossible
    explained = any(each.kind in ("negative_mass", "nothing_held") for each in result.findings)
    return [] if reason is None or explained else [f"No body can have these parameters: {reason}."]


def _of_the_unknown(result: Recorded, style: Style) -> list[str]:
    if any(each.kind == "nothing_held" for each in result.findings):
        return []
    if is_at_rest(result) and all(name[0] == "I" for name in result.estimate.not_identifiable):
        return []  # The finding about the poses says that they never show the inertia.
    # Of poses at rest, the finding about them says what helps.
    advised = not result.is_contradicted and not is_at_rest(result)
    moments = measures_moments(result)
    cutoff = _given_cutoff(result, style)
    unobservable = unobservable_values(
        result.estimate, advised=advised, moments=moments, cutoff=cutoff
    )
    if not isinstance(result, IdentificationData):
        return unobservable
    is_advised = advised and bool(result.estimate.uncertain)
    more = [*_longer(result), *_in_a_box(result, style)] if is_advised else []
    at_rest = is_at_rest(result)
    uncertain = uncertain_values(result.estimate, advised=advised, more=more, at_rest=at_rest)
    return unobservable + uncertain


def measures_moments(result: Recorded) -> bool:
    """Returns whether moments are measured: joint efforts are, and those of wrenches are used.

    Those of a wrench may be left out. Without one of a sensor, the others may be left out, too.
    """
    left_out = (
        each.data
        for each in result.findings
        if each.kind == "constant_channels" and each.data["is_left_out"]
    )
    return result.method != "tactile" or not any(
        data["without_moments"] or {"moment x", "moment y", "moment z"} <= {*data["channels"]}
        for data in left_out
    )


def _given_cutoff(result: Recorded, style: Style) -> str:
    """Names the cutoff where it was given; empty where it was chosen from the motion."""
    if "cutoff_hz" not in result.given:
        return ""
    return f"the cutoff of {result.cutoff_hz:.3g} Hz ({option_name('cutoff_hz', style)})"


def unobservable_values(
    estimate: Payload, *, advised: bool, moments: bool = True, cutoff: str = ""
) -> list[str]:
    """Says which values are unobservable, and with ``advised`` what helps.

    A given ``cutoff`` may be so high that noise hides the motion, or so low that it removes the
    motion.
    """
    unknown = estimate.unobservable
    known = [name for name in VALUE_NAMES if name not in estimate.not_identifiable]
    if not unknown:
        return []
    if len(unknown) == len(VALUE_NAMES):
        after = f" after {cutoff}" if cutoff else ""
        sentence = f"Nothing is identifiable: the motion{after} does not exceed its noise."
    else:
        sentence = f"Unobservable: {', '.join(unknown)}; known: {', '.join(known) or 'nothing'}."
    advice = [f"Omit {cutoff} to have one chosen from the motion."] if cutoff else []
    advice += motion_advice(unknown, moments=moments)
    return [" ".join([sentence, *(advice if advised else [])])]


def uncertain_values(
    estimate: PayloadEstimate,
    *,
    advised: bool,
    more: Sequence[str] = (),
    at_rest: bool = False,
) -> list[str]:
    """Says which values are uncertain, with ``advised`` the motion that helps, then ``more``."""
    uncertain = estimate.uncertain
    if not uncertain:
        return []
    excites = "poses show" if at_rest else "motion excites"
    sentences = [
        f"Uncertain: {', '.join(uncertain)}. The {excites} them, but noise leaves wide"
        " intervals: 1.96 standard deviations of each are more than the largest value of its kind,"
        " or than half of the mass."
    ]
    given = estimate.reported_values
    open_ended = [
        name
        for name, value in zip(VALUE_NAMES, given, strict=True)
        if name in uncertain and value is None
    ]
    if open_ended:
        sentences.append(f"Nothing limits {listed(open_ended)}: the mass is not known.")
    return [" ".join([*sentences, *(motion_advice(uncertain) if advised else []), *more])]


def _longer(result: IdentificationData) -> list[str]:
    """Says how much longer this motion makes what is uncertain identifiable."""
    is_uncertain = np.array([each == "uncertain" for each in result.estimate.observability])
    longest = float(result.remaining(1.0)[is_uncertain].max())
    if not longest <= TOO_LONG * result.duration_s:
        return []
    return [f"Or go on for another {duration(longest)} with this motion."]


def _in_a_box(result: IdentificationData, style: Style) -> list[str]:
    if result.bounding_box is not None:
        return []
    option = option_name("bounding_box", style)
    return [f"A box that contains the payload ({option}) limits the intervals."]


def _of_the_samples(result: Recorded) -> list[str]:
    sentences, estimate = [], result.estimate
    if estimate.rejected:
        samples, were = counted(estimate.rejected, "sample"), _were(estimate.rejected)
        sentences.append(f"{samples} {were} rejected: not finite, or out of order.")
    # The faults say where a gap is.
    if estimate.gaps and not any(fault.kind == "gap" for fault in result.faults):
        gaps, were = counted(estimate.gaps, "gap"), _were(estimate.gaps)
        sentences.append(f"{gaps} in the recording {were} not bridged.")
    return sentences


def losses(result: Recorded) -> list[str]:
    """Says what of a damaged log is lost, and how much of it was used; empty for a whole one."""
    used = f"what could be read, {duration(result.duration_s)}, was used"
    return [f"{damage}; {used}" for damage in result.damage]


def is_at_rest(result: Recorded) -> bool:
    """Returns whether the result is that of poses at rest, which have no times."""
    return result.clock == "none"


def is_of_table(result: Recorded) -> bool:
    """Returns whether the result is that of a table or of a data set, which has no messages."""
    names = result.hashes.get("the log", {})
    return any(name.lower().endswith(TABLES) for name in names)


def _were(count: int) -> str:
    return "was" if count == 1 else "were"


def motion_advice(names: Sequence[str], *, moments: bool = True) -> list[str]:
    """Says which motion determines these values: a sentence for each kind.

    By the structure of the regressor, forces determine the mass by any acceleration against gravity
    and the first moments by rotation; moments determine the inertia by angular accelerations, (45).

    Args:
        names: Names of values that are not determined, as in ``VALUE_NAMES``.
        moments: Whether the sensor measures moments.
    """
    advice = []
    if "mass" in names:
        advice.append("Accelerate the tool, or hold it still under gravity, for the mass.")
    axes = [name[-1] for name in names if name.startswith("com ")]
    if len(axes) == 1:
        first, second = (axis for axis in "xyz" if axis not in axes)
        advice.append(
            f"Rotate the tool about its {first} or {second} axis, or tilt its {axes[0]} axis away"
            f" from the vertical, for com {axes[0]}."
        )
    elif axes:
        advice.append(
            "Hold the tool at another angle to the vertical, or rotate it about two of its axes,"
            f" for {listed([f'com {axis}' for axis in axes])}."
        )
    inertia = [name for name in names if name.startswith("I")]
    if inertia and not moments:
        advice.append("The inertia shows in moments alone, which the sensor does not measure.")
    elif inertia:
        axes = sorted({name[1] for name in inertia if name[1] == name[2]})
        # A product of inertia is determined by rotation about either of its two axes.
        either = [f"{n[1]} or {n[2]}" for n in inertia if n[1] != n[2] and not {*n[1:]} & {*axes}]
        about = [*axes, *either]
        several = "axes" if len(about) > 1 else "axis"
        advice.append(
            f"Rotate the tool faster about its {listed(about)} {several}, for {listed(inertia)}."
        )
    return advice


def assumptions(result: Recorded) -> str:
    """Says what was assumed, and what was chosen from the data: a line for every result."""
    parts = [f"Frame {result.estimate.frame}", f"method {result.method}"]
    parts.append(f"gravity {gravity(result)}")
    # Motion and payload at once follow what splines follow, whatever the windows do.
    has_cutoff = not (is_at_rest(result) or _motion(result) == "with-payload")
    parts += [f"cutoff {result.cutoff_hz:.3g} Hz"] if has_cutoff else []
    parts += [delay] if (delay := _delay(result)) else []
    parts += _of_least_squares(result) if isinstance(result, IdentificationData) else []
    stamps = "the table" if is_of_table(result) else "header stamps"
    clocks = {"stamps": [f"times from {stamps}"], "log times": ["times from the log"]}
    parts += clocks.get(result.clock, [])
    return "; ".join(parts) + "."


def _motion(result: Recorded) -> str:
    return result.fit.motion if isinstance(result, IdentificationData) else ""


def _beginning(result: IdentificationData) -> str:
    """Names the beginning of the recording that the motion is of; empty where that is all of it."""
    until_s = result.fit.motion_until_s
    if until_s is None:
        return ""
    first = duration(until_s - result.fit.times_s[0])
    return f" from the first {first}, more precisely than from windows of the whole recording"


def _of_least_squares(result: IdentificationData) -> list[str]:
    parts = knowledge(result)
    parts += [motion + _beginning(result)] if (motion := MOTION.get(_motion(result), "")) else []
    parts += [f"wrench offset {offset}"] if (offset := wrench_offset(result)) else []
    parts += [f"weight subtracted by the driver {w}"] if (w := subtracted_weight(result)) else []
    parts += ["efforts of the unloaded recording subtracted"] if result.subtracts_unloaded else []
    parts += [given] if (given := calibration(result)) else []
    parts += [uncertain] if (uncertain := gains(result)) else []
    return parts


def calibration(result: IdentificationData) -> str:
    """Says which calibration was used, and how much of the variances it contributed."""
    fit = result.calibrated
    if fit is None:
        return ""
    path = result.inputs.get("`calibration`")
    name = "calibration" if path is None else f"calibration {path.name}"
    updated = ", updated by the unloaded recording" if fit.updated_by_unloaded else ""
    shares = _noise_shares(fit.noise_fraction)
    return f"{name}{updated}, whose uncertainty is in the intervals {shares}"


def gains(result: IdentificationData) -> str:
    """Says how much of the intervals is noise; empty where gains and known tool are exact."""
    if result.calibrated is not None or (result.fit.noise_fraction == 1).all():
        return ""
    shares = _noise_shares(result.fit.noise_fraction)
    return f"the uncertainty of {constant_errors(result)} is in the intervals {shares}"


def constant_errors(result: IdentificationData) -> str:
    """Names what is uncertain besides the noise of the recording, which no motion reduces."""
    uses_efforts = result.method in ("effort", "combined")
    has_tool = result.setup.known_tool is not None and np.any(result.setup.known_tool_std_devs)
    return listed(
        [
            *(["the effort gains"] if uses_efforts or not has_tool else []),
            *(["the known tool"] if has_tool else []),
        ]
    )


def _noise_shares(noise_fraction: NDArray[np.float64]) -> str:
    """Says how much of the intervals of each kind is noise of the recording."""
    fractions = (np.median(noise_fraction[kind]) for kind in KINDS)
    shares = listed([f"{100 * part:.0f} %" for part in fractions])
    of_kinds = f"the variances of {listed(KIND_NAMES)}"
    return f"({shares} of {of_kinds} are noise of this recording)"


def gravity(result: Recorded) -> str:
    """Says which gravitational acceleration was assumed, in world axes."""
    identified = result.fit.gravity if isinstance(result, IdentificationData) else None
    if identified is not None:
        return f"{_with_intervals(identified)} m/s² (direction identified)"
    known = all(map(math.isfinite, result.gravity_m_s2))
    return (
        " ".join(f"{entry:g}" for entry in result.gravity_m_s2) + " m/s²" if known else "not known"
    )


def _with_intervals(found: GravityEstimate | WeightEstimate) -> str:
    """Returns values with their 95 % intervals."""
    half_widths = Z95 * np.asarray(found.std_devs)
    return " ".join(
        f"{value:.{digits}f} ± {half_width:.{digits}f}"
        for value, half_width in zip(found.values, half_widths, strict=True)
        for digits in [digits_of(half_width) if math.isfinite(half_width) else 3]
    )


def subtracted_weight(result: IdentificationData) -> str:
    """Says which weight was subtracted from the wrenches; empty where it was not unknown."""
    found = result.fit.subtracted_weight
    if found is None:
        return ""
    along = found.along_m_s2
    direction = "" if along is None else f" along {' '.join(f'{each:g}' for each in along)} m/s²"
    return f"{_with_intervals(found)} (kg, m){direction}"


def _delay(result: Recorded) -> str:
    """Says the delay of the wrenches and its origin; empty where none was estimated or given."""
    estimated = result.estimated_delay if isinstance(result, IdentificationData) else None
    if estimated is None:
        return (
            f"delay of the wrenches {1e3 * result.delay_s:g} ms (given)" if result.delay_s else ""
        )
    half_width = 1e3 * Z95 * estimated.std_dev_s
    digits = digits_of(half_width)
    value = round(1e3 * estimated.delay_s, digits) + 0.0
    shown = f"{value:.{digits}f} ± {half_width:.{digits}f} ms"
    if result.delay_s:
        return f"delay of the wrenches {shown} (estimated and corrected)"
    return f"delay of the wrenches {shown} (estimated, too small to correct)"


def knowledge(result: IdentificationData) -> list[str]:
    """Says what was given of the payload."""
    parts = []
    mass = result.known_mass
    if mass is not None:
        around = f" ± {Z95 * mass.std_dev_kg:.2g}" if mass.std_dev_kg else ""
        parts.append(f"mass {mass.mass_kg:g}{around} kg (given)")
    box = result.bounding_box
    if box is not None:
        low, high = (" ".join(f"{entry:g}" for entry in corner) for corner in (box.min, box.max))
        parts.append(f"within a box from {low} to {high} m (given)")
    if result.shape is not None and (path := result.inputs.get("`shape`")) is not None:
        parts.append(f"shape {path.name} (given)")
    return parts


def wrench_offset(result: IdentificationData) -> str:
    """Says the offset of the wrenches with its 95 % intervals; empty where it is not known.

    It is that of the recorded wrenches, in the frame of the sensor where there is one sensor.
    """
    entries = ", ".join(
        f"{name} {value:.3g} ± {half_width:.2g} {unit}"
        for name, unit, value, half_width in offsets(result)
        if math.isfinite(value) and math.isfinite(half_width)
    )
    if result.fit.wrench_offset is None or not entries:
        return ""
    return f"{entries}, in the frame {result.fit.wrench_offset.frame} and with the sign as recorded"
