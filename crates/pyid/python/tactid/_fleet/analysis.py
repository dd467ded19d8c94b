"""What the rows of a fleet say together: equal payloads, changes, drift and what to look at."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np

from tactid._base.values import PATHS, Array
from tactid._fleet.rows import KEY, Row, key_of, place_of

COMPARED = ("mass", "com.x", "com.y", "com.z")
"""Values by which payloads are distinguished, and the mass alone where another is not known."""

CHANCE_Z = 3.09
"""Quantile of the normal distribution that a distance of equal payloads exceeds once in 1000."""

MEAN_RANGE = 30.0
"""Range of the mean of a payload, in standard deviations of a recording, that its description
costs: of many recordings of one payload, variation up to 18 times their standard deviations is
recognised as such, and of three recordings up to 14 times."""

FACTORS = (1.0, 2.0, 4.0, 8.0, 16.0)
"""Candidates of the factor of what varies between recordings; it is refined afterwards."""

MOST_COMPARED = 60
"""Recordings of a robot, evenly chosen, from which the factor is estimated."""

SECONDS_A_DAY = 86400.0

CLOCKLESS_S = 365 * SECONDS_A_DAY
"""Times since 1970 up to here are those of stamps that begin at zero, s."""

OFFSETS = "fit.wrench_offset.values"
"""Column with the offset of the wrench sensors."""

READ = (
    *(*KEY, "robot", "configured", "finished", "outcome", "error"),
    *("start_ns", "duration_s", "begin_s", "end_s", "estimate.covariance", "findings"),
    *("damage", "faults", OFFSETS),
    *(f"estimate.{kind}.{name}" for kind in ("values", "std_devs") for name in COMPARED),
)
"""Columns that a report needs."""


@dataclass
class Payload:
    """The payload of a recording, as it is compared."""

    row: Row
    time_s: float
    """Beginning of the recording, s since the epoch."""
    values: Array
    covariance: Array


@dataclass
class Cluster:
    """Recordings of one robot with equal payloads."""

    members: list[Payload] = field(default_factory=list)
    information: Array = field(default_factory=lambda: np.zeros((4, 4)))
    weighted: Array = field(default_factory=lambda: np.zeros(4))
    _solution: tuple[int, tuple[Array, Array]] | None = None

    def add(self, payload: Payload, covariance: Array) -> None:
        """Adds a recording with its covariance, which includes what varies between recordings."""
        inside = len(payload.values)
        inverse = np.linalg.inv(covariance)
        self.information[:inside, :inside] += inverse
        self.weighted[:inside] += inverse @ payload.values
        self.members.append(payload)

    def with_all_of(self, other: "Cluster") -> "Cluster":
        """Returns one cluster of the recordings of two."""
        return Cluster(
            [*self.members, *other.members],
            self.information + other.information,
            self.weighted + other.weighted,
        )

    def distance(self, payload: Payload, covariance: Array) -> float:
        """Returns the chi-square of a recording's distance from the mean of the cluster."""
        known = min(len(payload.values), self.known)
        mean, own = self.mean[:known], payload.values[:known]
        both = self.covariance[:known, :known] + covariance[:known, :known]
        return _square(own - mean, both)

    @property
    def known(self) -> int:
        """Number of values that the mean has."""
        return len(self.mean)

    @property
    def mean(self) -> Array:
        """Mean of the values, weighted by their information."""
        return self._solved[0]

    @property
    def covariance(self) -> Array:
        """Covariance of the mean."""
        return self._solved[1]

    @property
    def _solved(self) -> tuple[Array, Array]:
        # Thousands of recordings are compared with a mean that stays the same.
        if self._solution is None or self._solution[0] != len(self.members):
            known = len(COMPARED) if self.information[-1, -1] > 0 else 1
            inverse = np.linalg.inv(self.information[:known, :known])
            covariance = np.asarray(inverse, dtype=np.float64)
            self._solution = len(self.members), (covariance @ self.weighted[:known], covariance)
        return self._solution[1]


@dataclass
class Robot:
    """The recordings of one robot over time."""

    name: str
    payloads: list[Payload]
    clusters: list[Cluster]
    scatter: float
    """Factor from the standard deviations of recordings to what varies between recordings."""
    labels: list[int]
    """Number of the cluster of each payload."""

    @property
    def has_clock(self) -> bool:
        """Whether the times of the recordings are those of a clock, and not since its start."""
        return all(each.time_s > CLOCKLESS_S for each in self.payloads)

    @property
    def changes(self) -> Iterator[tuple[Payload, int, int]]:
        """The first recording after each change, and the clusters before and after it."""
        pairs = zip(self.payloads[1:], self.labels, self.labels[1:], strict=False)
        return ((payload, a, b) for payload, a, b in pairs if a != b)

    @property
    def merged(self) -> list[Payload]:
        """Segments of one payload with the one before, from which they differ by their intervals.

        What varies between recordings, which makes them equal, does not vary within one.
        """
        by_place = sorted(zip(self.payloads, self.labels, strict=True), key=_segment)
        return [
            payload
            for (before, a), (payload, b) in pairwise(by_place)
            if a == b and key_of(before.row) == key_of(payload.row) and _differ(before, payload)
        ]

    def drift(self) -> list[tuple[str, float, float]]:
        """Returns the slope of the sensor's offset by channel, per day, and its probability.

        It is the probability that noise alone has such a slope.
        """
        found = []
        times, offsets = self.offsets()
        days = (times - times.mean()) / SECONDS_A_DAY if len(times) else times
        if len(times) < 4 or not np.ptp(days) or not self.has_clock:
            return []
        for name, values in zip(("Fx", "Fy", "Fz", "Mx", "My", "Mz"), offsets.T, strict=False):
            slope = float(days @ values / (days @ days))
            residual = values - values.mean() - slope * days
            error = math.sqrt(float(residual @ residual) / (len(days) - 2) / float(days @ days))
            ratio = slope / error if error else math.copysign(math.inf, slope)
            found.append((name, slope, chance(ratio, len(days) - 2)))
        return found

    def offsets(self) -> tuple[Array, Array]:
        """Returns the times and the offsets of the first wrench sensor, N and N m."""
        rows = [(each.time_s, each.row.get(OFFSETS)) for each in self.payloads]
        known = [(time, values[:6]) for time, values in rows if values and None not in values[:6]]
        times = np.array([time for time, _ in known])
        return times, np.array([values for _, values in known], dtype=float).reshape(-1, 6)


def _segment(labelled: tuple[Payload, int]) -> tuple[Any, ...]:
    return place_of(labelled[0].row)


def _differ(a: Payload, b: Payload) -> bool:
    """Returns whether payloads differ by more than their covariances allow."""
    known = min(len(a.values), len(b.values))
    difference = a.values[:known] - b.values[:known]
    both = a.covariance[:known, :known] + b.covariance[:known, :known]
    return _square(difference, both) > _largest(known)


def without_copies(rows: Sequence[Row]) -> tuple[list[Row], list[tuple[Row, Row]]]:
    """Returns rows without copies, and each copy with the row that stays.

    A copy has the values, the beginning and the duration of another row: its noise, which is the
    same, would count as agreement.
    """
    own = ("robot", "seed", "start_ns", "duration_s", "begin_s")
    columns = (*own, *(f"estimate.values.{name}" for name in COMPARED))
    kept: dict[tuple[Any, ...], Row] = {}
    copies = []
    for row in rows:
        has_mass = row.get("estimate.values.mass") is not None
        key = tuple(map(row.get, columns)) if has_mass else (len(kept),)
        if kept.setdefault(key, row) is not row:
            copies.append((row, kept[key]))
    return list(kept.values()), copies


def robots_of(rows: Sequence[Row]) -> list[Robot]:
    """Returns the robots with payloads, those with the most recordings first."""
    by_name: dict[str, list[Payload]] = {}
    for row in rows:
        payload = payload_of(row)
        if payload is not None:
            by_name.setdefault(row["robot"] or "robot", []).append(payload)
    found = [_robot(name, payloads) for name, payloads in by_name.items()]
    return sorted(found, key=lambda robot: (-len(robot.payloads), robot.name))


def payload_of(row: Row) -> Payload | None:
    """Returns the payload of a row; None where its mass is not known, or where data contradict."""
    if row["outcome"] != "identified" or row.get("estimate.values.mass") is None:
        return None
    values = [row.get(f"estimate.values.{name}") for name in COMPARED]
    known = len(COMPARED) if None not in values else 1
    places = [".".join(path) for path in PATHS]
    chosen = [places.index(name) for name in COMPARED[:known]]
    whole = row.get("estimate.covariance")
    std_devs = [row.get(f"estimate.std_devs.{name}") or 0.0 for name in COMPARED[:known]]
    covariance = np.diag(np.square(std_devs))
    if whole is not None:
        matrix = np.array(whole, dtype=float)[np.ix_(chosen, chosen)]
        if np.isfinite(matrix).all():
            covariance = matrix
    if not np.all(np.diag(covariance) > 0):
        return None
    time_s = float(row["start_ns"] or 0) * 1e-9 + float(row.get("begin_s") or 0.0)
    return Payload(row, time_s, np.array(values[:known], dtype=float), covariance)


def _robot(name: str, payloads: list[Payload]) -> Robot:
    if all(each.time_s > CLOCKLESS_S for each in payloads):
        payloads = sorted(payloads, key=lambda each: each.time_s)
    scatter = _scatter(payloads)
    clusters, labels = _clustered(payloads, scatter)
    return Robot(name, payloads, clusters, scatter, labels)


def _clustered(payloads: Sequence[Payload], scatter: float) -> tuple[list[Cluster], list[int]]:
    """Returns the clusters of equal payloads, and the number of that of each recording."""
    labels: list[int] = []
    clusters: list[Cluster] = []
    for payload in payloads:
        covariance = scatter**2 * payload.covariance
        nearest = _nearest(payload, covariance, clusters)
        if nearest is None:
            clusters.append(Cluster())
            nearest = len(clusters) - 1
        clusters[nearest].add(payload, covariance)
        labels.append(nearest)
    joined = _joined(clusters, scatter)
    numbers = {label: number for number, label in enumerate(dict.fromkeys(map(joined.get, labels)))}
    labels = [numbers[joined[label]] for label in labels]
    clusters = [Cluster() for _ in numbers]
    for payload, label in zip(payloads, labels, strict=True):
        clusters[label].add(payload, scatter**2 * payload.covariance)
    return clusters, labels


def _joined(clusters: Sequence[Cluster], scatter: float) -> dict[int, int]:
    """Returns the cluster that each one is part of.

    A cluster that begins with a recording far from the mean attracts others of the same payload. It
    is part of a larger one where most of its recordings are near the mean of both.
    """
    part_of = {place: place for place in range(len(clusters))}
    kept = dict(enumerate(clusters))
    for place in sorted(kept, key=lambda k: len(clusters[k].members)):
        small = kept.pop(place)
        covariance = scatter**2 * small.members[0].covariance
        mean = replace(small.members[0], values=small.mean)
        distances = {k: each.distance(mean, covariance) for k, each in kept.items()}
        nearest = min(distances, key=distances.__getitem__, default=place)
        if nearest != place:
            both = kept[nearest].with_all_of(small)
            each = ((one, scatter**2 * one.covariance) for one in small.members)
            near = [_nearest(one, covariance, [both]) is not None for one, covariance in each]
            if 2 * sum(near) > len(near):
                kept[nearest], part_of[place] = both, nearest
                continue
        kept[place] = small
    # What was joined first may be part of what was joined later.
    for place in part_of:
        while part_of[place] != part_of[part_of[place]]:
            part_of[place] = part_of[part_of[place]]
    return part_of


def _nearest(payload: Payload, covariance: Array, clusters: Sequence[Cluster]) -> int | None:
    """Returns the place of the cluster that a recording belongs to; None where there is none."""
    distances = [each.distance(payload, covariance) for each in clusters]
    if not distances:
        return None
    nearest = int(np.argmin(distances))
    known = min(len(payload.values), clusters[nearest].known)
    return nearest if distances[nearest] <= _largest(known) else None


def _scatter(payloads: Sequence[Payload]) -> float:
    """Returns by how much recordings of one payload differ beyond their standard deviations.

    Each candidate gives other clusters. The best one describes all recordings in the fewest words:
    those of a cluster by their distances from its mean, which cost more the larger the factor is,
    and each mean by its place in a range of :data:`MEAN_RANGE`. So the difference of two payloads
    is no variation, in whatever order they come. Fewer than three recordings of a payload show no
    variation beyond their intervals.
    """
    chosen = payloads[:: -(-len(payloads) // MOST_COMPARED) or 1]
    best_cost, best = math.inf, 1.0
    for factor in FACTORS:
        clusters, _ = _clustered(chosen, factor)
        several = [each for each in clusters if len(each.members) >= 3]
        if factor > 1.0 and not several:
            continue
        values = sum(len(each.values) for each in chosen) - sum(each.known for each in clusters)
        cost = sum(map(_within, clusters)) / factor**2 + values * 2.0 * math.log(factor)
        cost += sum(
            each.known * (math.log(len(each.members)) + 2.0 * math.log(MEAN_RANGE))
            for each in clusters
        )
        if cost < best_cost:
            free = sum(sum(len(one.values) for one in c.members) - c.known for c in several)
            variance = sum(map(_within, several)) / free if free else 1.0
            best_cost, best = cost, math.sqrt(max(1.0, variance))
    return best


def _within(cluster: Cluster) -> float:
    """Returns the chi-square of recordings about the mean of their cluster, by their intervals."""
    total = 0.0
    for each in cluster.members:
        known = min(len(each.values), cluster.known)
        difference = each.values[:known] - cluster.mean[:known]
        total += _square(difference, each.covariance[:known, :known])
    return total


def _square(difference: Array, covariance: Array) -> float:
    """Returns the square of a difference relative to its covariance."""
    return float(difference @ np.linalg.solve(covariance, difference))


def _largest(known: int) -> float:
    """Returns the quantile of chi-square, by that of the normal distribution (Wilson, Hilferty)."""
    part = 2.0 / (9.0 * known)
    return float(known * (1.0 - part + CHANCE_Z * math.sqrt(part)) ** 3)


def severity(row: Row) -> tuple[int, int, int, int, float]:
    """Returns how much a recording needs a look: more first."""
    order = ("internal error", "contradicted", "refused", "unreachable", "undetermined")
    outcome = row["outcome"]
    place = len(order) - order.index(outcome) if outcome in order else 0
    grades = [each["severity"] for each in row.get("findings") or ()]
    width = row.get("estimate.std_devs.mass") or 0.0
    return (
        place,
        grades.count("contradicts"),
        grades.count("doubts"),
        len(row.get("damage") or ()),
        width,
    )


def disagreements(robots: Sequence[Robot]) -> list[tuple[Robot, Row, Array]]:
    """Returns recordings whose payload is not the configured one, with all differences.

    The covariance includes what varies between the recordings of the robot.
    """
    found = []
    for robot in robots:
        for payload in robot.payloads:
            configured = np.array(payload.row.get("configured") or [], dtype=float)
            known = min(len(payload.values), len(configured))
            if not known:
                continue
            difference = payload.values[:known] - configured[:known]
            covariance = robot.scatter**2 * payload.covariance[:known, :known]
            square = _square(difference, covariance)
            if square > _largest(known):
                found.append((square, (robot, payload.row, difference)))
    return [each for _, each in sorted(found, key=lambda each: -each[0])]


def chance(t_value: float, degrees: int) -> float:
    """Returns the probability that Student's t-value is as large or larger, by either sign.

    The finite series of Abramowitz and Stegun, 26.7.3 and 26.7.4, for whole degrees of freedom.
    """
    angle = math.atan(abs(t_value) / math.sqrt(degrees))
    square = math.cos(angle) ** 2
    is_odd = degrees % 2 == 1
    term = total = math.cos(angle) if is_odd else 1.0
    for k in range(3 if is_odd else 2, degrees - 1, 2):
        term *= square * (k - 1) / k
        total += term
    inside = math.sin(angle) * total
    if is_odd:
        inside = 2.0 / math.pi * (angle + (inside if degrees > 1 else 0.0))
    return max(0.0, 1.0 - inside)


def kinds_of(rows: Sequence[Row]) -> list[tuple[str, str, int]]:
    """Returns the findings by kind, the gravest first, with the number of recordings of each.

    Damage of a log and messages that could not be used have the severity ``data``.
    """
    counts: dict[tuple[str, str], int] = {}
    for row in rows:
        each = {(one["kind"], one["severity"]) for one in row.get("findings") or ()}
        each |= {(one["kind"], "data") for one in row.get("faults") or ()}
        each |= {("damage", "data")} if row.get("damage") else set()
        for key in each:
            counts[key] = counts.get(key, 0) + 1
    order = ("contradicts", "doubts", "notes", "data")
    listed: list[Any] = [(kind, grade, count) for (kind, grade), count in counts.items()]
    return sorted(listed, key=lambda each: (order.index(each[1]), -each[2], each[0]))
