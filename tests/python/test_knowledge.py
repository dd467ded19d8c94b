"""What is known of the payload already: its mass, and where it is."""

from pathlib import Path

import numpy as np
import pytest

import tactid
from conftest import TactidCommand
from test_cli import assert_refused
from wrist import BODY, EARLY, NOISE, TRUTH, identified

ROOM = [[-0.2, -0.2, -0.1], [0.2, 0.2, 0.3]]
DULL = NOISE * [100, 100, 100, 1, 1, 1]
"""Of a sensor whose forces say little: it tells the centre of mass only beside the mass."""


def test_a_known_mass_makes_the_others_known_better() -> None:
    alone = identified(EARLY, 1, noise=DULL)
    exact = identified(EARLY, 1, noise=DULL, known_mass_kg=BODY.mass)
    weighed = identified(EARLY, 1, noise=DULL, known_mass_kg=1.85, known_mass_std_dev_kg=0.01)
    assert exact.estimate.body.mass == pytest.approx(BODY.mass, rel=1e-6)
    assert exact.estimate.std_devs[0] == 0
    assert weighed.estimate.std_devs[0] == pytest.approx(0.01, rel=0.02)
    assert weighed.estimate.body.mass == pytest.approx(1.85, abs=0.002)
    assert alone.estimate.std_devs[0] > 0.1
    assert (
        exact.estimate.std_devs[3] < weighed.estimate.std_devs[3] < 0.5 * alone.estimate.std_devs[3]
    )
    for found in (alone, exact, weighed):
        error = np.abs(found.estimate.values - TRUTH)
        assert (error <= 4 * found.estimate.std_devs + 1e-6).all()
    assert (alone.known_mass, exact.known_mass) == (None, tactid.KnownMass(BODY.mass, 0))
    assert weighed.history.std_devs[-1, 0] == pytest.approx(0.01, rel=0.02)


def test_a_mass_that_the_data_contradict_is_reported() -> None:
    (finding,) = identified(EARLY, 1, known_mass_kg=2.0).findings
    remark = str(finding)
    assert finding.kind == "mass_contradicted"
    assert remark.startswith("The given mass is 2 kg, but the data alone give 1.839")
    assert identified(EARLY, 1, known_mass_kg=BODY.mass).findings == []


def test_a_body_that_fits_into_the_box_stays_and_another_is_brought_in() -> None:
    free = identified(EARLY, 1)
    inside = identified(EARLY, 1, bounding_box=ROOM)
    np.testing.assert_array_equal(inside.estimate.values, free.estimate.values)
    assert inside.bounding_box == tactid.BoundingBox(*ROOM)
    low = [ROOM[0], [0.2, 0.2, 0.09]]
    brought = identified(EARLY, 1, bounding_box=low)
    assert free.estimate.body.com[2] > 0.09 > brought.estimate.body.com[2]
    assert brought.estimate.is_physical
    (finding,) = brought.findings
    assert finding.kind == "inconsistent"
    assert str(finding).startswith("No physically consistent body within the box explains the data")


def test_a_box_helps_where_the_recording_says_little() -> None:
    """Rms errors over 20 draws of the noise: all less in the box, and of the inertia by half."""
    squares = np.zeros((2, 2))
    box = [[-0.05, -0.1, 0.0], [0.08, 0.04, 0.2]]
    for seed in range(20):
        for k, options in enumerate(({}, {"bounding_box": box})):
            found = identified(2.0, seed, noise=200 * NOISE, known_mass_kg=BODY.mass, **options)
            error = found.estimate.values - TRUTH
            squares[k] += (error[1:4] @ error[1:4], error[4:] @ error[4:])
            com = found.estimate.body.com
            assert k == 0 or ((com > box[0]) & (com < box[1])).all()
    com_gain, inertia_gain = np.sqrt(squares[1] / squares[0])
    assert com_gain < 1
    assert inertia_gain < 0.5


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"known_mass_kg": -1.0}, "`known_mass_kg` is -1, but must be a positive number"),
        ({"known_mass_kg": np.nan}, "known_mass_kg"),
        ({"known_mass_kg": 0.9e-12}, "from 1e-12 to 1e12"),
        ({"known_mass_kg": 1.1e12}, "from 1e-12 to 1e12"),
        ({"known_mass_kg": 1.0, "known_mass_std_dev_kg": 1.1e12}, "up to 1e12"),
        ({"known_mass_kg": 1.0, "known_mass_std_dev_kg": -0.1}, "`known_mass_std_dev_kg` is -0.1"),
        (
            {"known_mass_std_dev_kg": 0.1},
            "`known_mass_kg` is missing, but its standard deviation is given",
        ),
        ({"bounding_box": ROOM[::-1]}, "goes from 0.2 to -0.2 m along x"),
        ({"bounding_box": [[0, 0, 0], [1, 1, np.inf]]}, "along z"),
        ({"bounding_box": [0, 0, 0, 1, 1, 1]}, "bounding_box"),
    ],
)
def test_what_cannot_be_known_is_refused(options: dict[str, object], message: str) -> None:
    with pytest.raises(tactid.ArgumentError, match=message):
        identified(EARLY, 1, **options)


def test_the_paper_s_filter_takes_no_knowledge(log: Path) -> None:
    for options, what in (({"known_mass_kg": 100.0}, "mass"), ({"bounding_box": ROOM}, "box")):
        with pytest.raises(tactid.ArgumentError, match=f"{what} needs least squares"):
            tactid.identify(log, estimator="nlms", **options)


def test_the_command_takes_mass_and_box(command: TactidCommand, log: Path) -> None:
    done = command("identify", log, "--known-mass-kg", 100, "--bounding-box", "-1,-1,-1,2,1,1")
    assert done.returncode == 0
    assert "mass 100 kg (given); within a box from -1 -1 -1 to 2 1 1 m (given);" in done.stderr
    assert_refused(command("identify", log, "--known-mass-kg", "-1"), "--known-mass-kg is -1")
    assert_refused(
        command("identify", log, "--bounding-box", "1,2,3"), "--bounding-box", "6 numbers"
    )
    assert_refused(
        command("identify", log, "--bounding-box", "1,1,1,0,2,2"), "from 1 to 0 m along x"
    )
