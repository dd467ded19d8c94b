"""Arguments of a design that do not fit: each error names its argument and what would be right."""

import math
import re
from pathlib import Path

import pytest

import tactid
from conftest import TactidCommand
from tactid import CollisionFinding
from tactid._show.motion_text import collision_line

URDF = Path(__file__).parents[2] / "crates" / "sim" / "robots" / "tactid.urdf"
START = [0.0, -1.2, 1.6, -0.4, 1.5, 0.0]
BOX = [[-0.1, -0.1, 0.0], [0.1, 0.1, 0.2]]
CENTRED = [[-0.05, -0.05, -0.05], [0.05, 0.05, 0.05]]


def _design(**keywords: object) -> tactid.DesignedMotion:
    robot = tactid.Manipulator.from_urdf(URDF)
    given = {
        "start": START,
        "payload_mass_max": 2.0,
        "payload_box": BOX,
        "duration": 1.0,
        "rate": 100.0,
        "sample_rate": 1000.0,
        **keywords,
    }
    return tactid.design_excitation(robot, **given)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("keywords", "expected"),
    [
        ({"seed": -1}, "`seed` is -1: expected a whole number from 0"),
        ({"seed": 1.5}, "`seed` is 1.5: expected a whole number"),
        ({"payload": {"mass": 2}}, "`payload` is {'mass': 2}: expected a tactid.MassProperties"),
        ({"within": "1%", "duration": None}, "`within` is '1%': expected a number"),
        ({"within": 5, "duration": None}, "`within` is 5, but must be a fraction .* 0.01 is 1 %"),
        ({"duration": "3"}, "`duration` is '3': expected a number"),
        ({"keep_out": BOX}, "`keep_out` is .*: expected boxes by their names"),
        ({"grip": list(range(10))}, r"`grip` is \[0, .*: expected a tactid.Grip"),
        (
            {"grip": tactid.Grip(1.0, [0, 1, 0], 0.04, 1500.0, 0.8, 0.06)},
            r"`grip` is {'center': 1.0.* three",
        ),
        (
            {"grip": tactid.Grip([0, 0, 0], None, 0.04, 1500.0, 0.8, 0.06)},
            r"`grip` is .*'normal': None.* three",
        ),
        (
            {"payload_box": [[0, 0, 1], [1, 1, 0]]},
            "`payload_box`: the box goes from 1 to 0 m along z",
        ),
        (
            {"payload_box": [[0, 0, 0], [1, 1, 1e7]]},
            "`payload_box`.* is 5000000; expected at most 1000000 m",
        ),
        (
            {"payload_box": BOX[0]},
            r"`payload_box` is .*: expected the least and the largest corner, .* \(2, 3\)",
        ),
        (
            {"keep_out": {"wall": [[0, 0, 0], [0, 1, 1]]}},
            "`keep_out` of wall: the box goes from 0 to 0 m along x",
        ),
        ({"tip": "base_link"}, "`tip` is base_link, which no joint moves"),
        ({"sample_rate": 10.0}, "has too few samples at 10 Hz: raise `sample_rate`"),
    ],
)
def test_errors_name_the_argument(keywords: dict[str, object], expected: str) -> None:
    with pytest.raises(tactid.TactidError, match=expected) as raised:
        _design(**keywords)
    assert raised.value.option is not None


def test_the_path_of_a_urdf_is_no_robot() -> None:
    with pytest.raises(tactid.ArgumentError, match=r"`robot` is of type str: .*from_urdf"):
        tactid.design_excitation("arm.urdf")  # type: ignore[arg-type]


def test_a_start_out_of_range_has_value_limits_and_unit() -> None:
    robot = tactid.Manipulator.from_urdf(URDF)
    far = {"joint_3": 7.0}
    with pytest.raises(tactid.ArgumentError, match=r"joint_3 is 7 rad, outside of its limits of"):
        tactid.design_excitation(robot, start=far, payload_mass_max=1.0, payload_box=BOX)
    degrees = [math.degrees(position) for position in START]
    expected = r"joint_2 is -68.75.* rad, outside of .*; -68.75.*° would be -1.2 rad"
    with pytest.raises(tactid.ArgumentError, match=expected):
        _design(start=degrees)


def test_rates_that_do_not_fit_the_cutoff_are_named(command: TactidCommand, tmp_path: Path) -> None:
    arm = ("excite", "--urdf", URDF, "--from", "0,-1.2,1.6,-0.4,1.5,0", "--out", tmp_path / "m")
    payload = ("--payload-mass-max", "2", "--payload-box", "-0.1 -0.1 0 0.1 0.1 0.2")
    for wrong in (("--rate", "10"), ("--cutoff-hz", "600")):
        done = command(*arm, *payload, "--duration", "3", *wrong)
        assert done.returncode == 2
        assert "too few samples at" in done.stderr
        assert "raise --sample-rate, or lower the cutoff" in done.stderr
        assert "too short" not in done.stderr


def test_a_payload_that_is_centred_on_the_tip_has_a_precision() -> None:
    """The precision of its centre of mass is a fraction of a tenth of its radius of gyration."""
    motion = _design(payload_box=CENTRED, collisions=False)
    gyration = math.sqrt(0.5 * 3 * (0.1**2 + 0.1**2) / 12)
    target = 0.01 * 0.1 * gyration
    half_width = 1.96 * motion.predicted_std_devs[1]
    ratio = motion.interval_ratios[1]
    assert ratio == pytest.approx(half_width / target, rel=1e-3)
    point = tactid.MassProperties(2.0, [0.1, 0, 0], [[0.0] * 3] * 3)
    with pytest.raises(tactid.ArgumentError, match="the inertia of the expected payload is zero"):
        _design(payload=point, payload_mass_max=None, payload_box=None)


def test_a_link_in_the_payload_is_an_error(command: TactidCommand, tmp_path: Path) -> None:
    with pytest.raises(tactid.ExcitationError, match="forearm_link and the payload touch"):
        _design(payload_box=[[-1.5, -0.1, -0.1], [0.2, 0.1, 0.1]])
    arm = ("excite", "--urdf", URDF, "--from", "0,-1.2,1.6,-0.4,1.5,0", "--out", tmp_path / "m")
    box = ("--payload-mass-max", "2", "--payload-box", "-1.5 -0.1 -0.1 0.2 0.1 0.1")
    done = command(*arm, *box)
    assert done.returncode == 2
    assert "and the payload touch at the start; --payload-box gives the box" in done.stderr
    assert not (tmp_path / "m").exists()


def test_a_recording_is_no_folder_for_a_motion(command: TactidCommand, tmp_path: Path) -> None:
    bag = tmp_path / "bag"
    bag.mkdir()
    (bag / "metadata.yaml").write_text("rosbag2_bagfile_information: {}")
    done = command("excite", "--urdf", URDF, "--payload-mass-max", "2", "--out", bag)
    assert done.returncode == 2
    assert f"--out {bag} is the folder of a recording: give another one" in done.stderr
    assert [file.name for file in bag.iterdir()] == ["metadata.yaml"]


def test_every_pair_that_touches_is_named() -> None:
    pairs = tuple((f"link_{k}", "hand") for k in range(6))
    line = collision_line(CollisionFinding("not tested", pairs))
    assert all(f"link_{k} and hand" in line for k in range(6))


def test_what_is_out_of_reach_says_by_how_much() -> None:
    short = _design()
    assert re.search(r"a motion of [\d.]+ s is long enough for ", str(short))
    still = _design(acceleration=1e-6)
    assert "times its target, which no motion within these limits reaches in an hour" in str(still)
