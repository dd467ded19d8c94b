"""Workshop tools moved by others' simulation of a wrist sensor (UTIAS STARS Laboratory, MIT).

There is no robot in these recordings: the motion is that of the sensor, and gravity has the
opposite of the usual sign. They are not part of the project; without them this is skipped.
"""

import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from rosbags.highlevel import AnyReader

from expectations import Identify, Record, half_widths_of, limits_of, remarks_with, values_of
from recorded_arm import Frames
from recordings import STORE
from test_recorded_arm import regressor

DATA = Path(__file__).parents[3] / "shared/data/utias"
TOOLS = ["c_clamp", "hammer", "ruler", "screwdriver"]
ENTRIES = ("xx", "xy", "xz", "yy", "yz", "zz")
UP = ("--gravity", 0, 0, 9.81)

pytestmark = pytest.mark.skipif(
    not DATA.is_dir(), reason="the recordings of UTIAS are not beside the project"
)


@dataclass(frozen=True)
class Truth:
    mass: float
    com: np.ndarray
    inertia: np.ndarray
    """xx xy xz yy yz zz about the centre of mass."""
    gravity: np.ndarray
    sigma: np.ndarray
    """Of force and moment."""


def truth_of(bag: Path) -> Truth:
    record = json.loads((bag / "truth.json").read_text())
    entries = [record["inertia_about_com_kgm2"][f"i{at}"] for at in ENTRIES]
    sigma = [record["noise_sigma"][name] for name in ("force", "torque")]
    com, gravity = np.array(record["com_m"]), np.array(record["gravity_in_world"], dtype=float)
    return Truth(record["mass_kg"], com, np.array(entries), gravity, np.array(sigma))


def xyz(vector: Any) -> list[float]:
    return [vector.x, vector.y, vector.z]


@cache
def weighted_least_squares(bag: Path) -> tuple[float, np.ndarray]:
    """Mass and centre of mass from every row, weighted by the true noise."""
    truth = truth_of(bag)
    topics: dict[str, list[Any]] = {}
    with AnyReader([bag], default_typestore=STORE) as reader:
        for connection, _, data in reader.messages():
            decoded = reader.deserialize(data, connection.msgtype)
            topics.setdefault(connection.topic.rsplit("/", 1)[1], []).append(decoded)
    poses = [m.pose.pose for m in topics["odom"]]
    quaternions = [[*xyz(p.position), *xyz(p.orientation), p.orientation.w] for p in poses]
    frames = Frames(
        np.array([pin.XYZQUATToSE3(np.array(q)).homogeneous for q in quaternions]),
        np.array([xyz(m.twist.twist.linear) for m in topics["odom"]]),
        np.array([xyz(m.twist.twist.angular) for m in topics["odom"]]),
        np.array([xyz(m.accel.linear) for m in topics["accel"]]),
        np.array([xyz(m.accel.angular) for m in topics["accel"]]),
    )
    wrench = np.array([xyz(m.wrench.force) + xyz(m.wrench.torque) for m in topics["wrench"]])
    # Without noise any weight will do.
    weight = 1 / np.repeat(np.where(truth.sigma > 0, truth.sigma, 1), 3)
    rows = regressor(frames, truth.gravity) * weight[:, None]
    solved = np.linalg.lstsq(rows.reshape(-1, 10), (wrench * weight).reshape(-1), rcond=None)[0]
    return float(solved[0]), solved[1:4] / solved[0]


def error(mass: float, com: np.ndarray, truth: Truth) -> float:
    """Norm of both errors, each relative to the truth."""
    relative = [mass / truth.mass - 1, *(com - truth.com) / np.linalg.norm(truth.com)]
    return float(np.linalg.norm(relative))


def is_possible(inertia: np.ndarray) -> bool:
    """Whether a body of positive density can have this inertia about its centre of mass."""
    matrix = np.zeros((3, 3))
    matrix[np.triu_indices(3)] = inertia
    moments = np.linalg.eigvalsh(matrix + np.triu(matrix, 1).T)
    return bool(moments[0] > 0 and moments[2] <= moments[0] + moments[1])


def assert_says_whether_it_is_possible(record: Record) -> None:
    values = values_of(record["estimate"]["values"])
    possible = bool(values[0] > 0 and is_possible(values[4:]))
    assert record["estimate"]["is_physical"] is possible
    remarks = remarks_with(record, "no body can have these parameters")
    assert possible or remarks


@pytest.mark.parametrize("tool", TOOLS)
def test_without_noise_it_is_exact(identify: Identify, tool: str) -> None:
    """To 1e-9 in kg, m and kg m²; the smallest inertia, the ruler's about x, is 2.9e-7."""
    bag = DATA / f"{tool}_none"
    truth = truth_of(bag)
    record = identify(bag, *UP)
    expected = np.array([truth.mass, *truth.com, *truth.inertia])
    np.testing.assert_allclose(values_of(record["estimate"]["values"]), expected, rtol=0, atol=1e-9)
    assert record["estimate"]["frame"] == "ft_sensor"
    assert record["estimate"]["is_physical"] is True
    assert not remarks_with(record, "opposite")


@pytest.mark.parametrize("noise", ["none", "high"])
@pytest.mark.parametrize("tool", TOOLS)
def test_the_usual_gravity_is_suspected(identify: Identify, tool: str, noise: str) -> None:
    """It is the default. Residuals look like noise then, and the answer is wrong.

    Under noise only the sign of the mass tells, and it cannot say whose sign is the wrong one.
    """
    bag = DATA / f"{tool}_{noise}"
    record = identify(bag)
    suspects = ("gravity",) if noise == "none" else ("gravity", "wrench")
    assert any(remarks_with(record, suspect, "opposite") for suspect in suspects)
    # Nothing is switched.
    assert record["gravity_m_s2"] == [0, 0, -9.81]
    mass = record["estimate"]["values"]["mass"]
    assert mass is None or abs(mass / truth_of(bag).mass - 1) > 0.05


def error_ratio(record: Record, tool: str) -> float:
    """The error in mass and centre over that of weighted least squares."""
    bag = DATA / f"{tool}_high"
    truth = truth_of(bag)
    values = values_of(record["estimate"]["values"])
    ours = error(values[0], values[1:4], truth)
    return ours / error(*weighted_least_squares(bag), truth)


@pytest.mark.parametrize("tool", TOOLS)
def test_under_noise_it_is_no_worse_than_weighted_least_squares(
    identify: Identify, tool: str
) -> None:
    """Within 5 % of its error: that much is chance, as the noise of the wrench is what limits."""
    assert error_ratio(identify(DATA / f"{tool}_high", *UP), tool) <= 1.05


def test_under_noise_it_is_better_than_weighted_least_squares(identify: Identify) -> None:
    """In the geometric mean over the tools, and for each within a quarter."""
    ratios = []
    for tool in TOOLS:
        record = identify(DATA / f"{tool}_high", *UP)
        ratios.append(error_ratio(record, tool))
        assert_says_whether_it_is_possible(record)
    assert max(ratios) < 1.25
    assert np.exp(np.log(ratios).mean()) < 0.8


def test_under_noise_the_intervals_hold_the_truth(identify: Identify) -> None:
    """Each with 95 %, so that of 40 two are outside; and the body is a possible one.

    Six of 40 would be once in 70 times, and any one beyond 3.29 std_devs once in a thousand. The
    inertia of the two light tools drowns in noise, but the motion excites it.
    """
    distances, inside, uncertain = [], [], []
    for tool in TOOLS:
        bag = DATA / f"{tool}_high"
        record, truth = identify(bag, *UP), truth_of(bag)
        assert record["estimate"]["is_physical"] is True
        expected = np.array([truth.mass, *truth.com, *truth.inertia])
        low, high = limits_of(record)
        inside.extend((low <= expected) & (expected <= high))
        distances.extend(
            1.96
            * np.abs(values_of(record["estimate"]["values"]) - expected)
            / half_widths_of(record)
        )
        uncertain.append(record["not_identifiable"])
        # No interval claims an inertia that is negative.
        assert (low[[0, 4, 7, 9]] >= 0).all()
    assert np.sum(inside) >= 35
    assert max(distances) < 3.29
    inertia = ["Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz"]
    assert dict(zip(TOOLS, uncertain, strict=True)) == {
        "c_clamp": [],
        "hammer": [],
        "ruler": inertia,
        "screwdriver": inertia,
    }


def test_a_box_makes_what_is_uncertain_more_certain(identify: Identify) -> None:
    """A ruler of 0.3 m in a box of its size: the noise leaves its inertia 100 times as wide."""
    bag = DATA / "ruler_high"
    truth = truth_of(bag)
    free = identify(bag, *UP)
    boxed = identify(bag, *UP, "--bounding-box", "-0.1,-0.02,-0.01,0.25,0.02,0.01")
    widths = []
    for record in (free, boxed):
        low, high = (side[4:] for side in limits_of(record))
        assert ((low <= truth.inertia) & (truth.inertia <= high)).all()
        widths.append(high - low)
    assert (widths[1] < 0.7 * widths[0]).all()
    assert not remarks_with(boxed, "--bounding-box")
    assert remarks_with(free, "Uncertain", "--bounding-box")


@pytest.mark.parametrize("tool", TOOLS)
def test_the_yardstick_is_exact_without_noise(tool: str) -> None:
    bag = DATA / f"{tool}_none"
    assert error(*weighted_least_squares(bag), truth_of(bag)) < 1e-12
