"""What is known of the sensors: a constant offset of the wrenches, and their noise."""

import json
from pathlib import Path

import numpy as np
import pytest

import tactid
from conftest import TactidCommand
from test_cli import assert_refused
from wrist import BODY, EARLY, NOISE, TRUTH, identified

OFFSET = np.array([1.5, -2.0, 3.0, 0.05, 0.1, -0.08])


def normalised(found: tactid.Identification) -> np.ndarray:
    return (found.estimate.values - TRUTH) / found.estimate.std_devs


def test_an_offset_is_suspected_and_found() -> None:
    taken_for_none = identified(EARLY, 1, offset=OFFSET, wrench_offset="no")
    found = identified(EARLY, 1, offset=OFFSET, wrench_offset="yes")
    shown = identified(EARLY, 1, offset=OFFSET)
    np.testing.assert_array_equal(shown.estimate.values, found.estimate.values)
    assert [each.severity for each in shown.findings] == ["notes"]
    assert np.abs(normalised(taken_for_none)).max() > 10
    assert np.abs(normalised(found)).max() < 3.5
    offset = found.fit.wrench_offset
    assert offset is not None
    assert offset.frame == found.estimate.frame
    assert (np.abs(offset.values - OFFSET) < 3.5 * offset.std_devs).all()
    assert (offset.std_devs < 0.1).all()
    (finding,) = (each for each in taken_for_none.findings if each.kind == "wrong_assumption")
    remark = finding.worded("command-line")
    assert "constant offset" in remark
    assert "or let `--wrench-offset yes` identify it together with the payload." in remark
    assert '`wrench_offset="yes"` identify it' in str(finding)
    assert "`--wrench-offset no` turns this off." in shown.findings[0].worded("command-line")
    assert (np.abs(finding.data["values"] - offset.values) < offset.std_devs).all()
    assert found.findings == []
    # The history ends where the estimate is, and the prediction has the offset in it.
    np.testing.assert_allclose(
        found.history.values[-1], found.estimate.values, rtol=1e-3, atol=1e-5
    )
    without = identified(EARLY, 1).fit
    assert (found.fit.residual_rms < 1.2 * without.residual_rms).all()


def test_an_offset_has_the_sign_of_the_recorded_wrenches() -> None:
    recorded = {"offset": -OFFSET, "sign": -1.0, "wrench_acts_on": "sensor"}
    for asked in ({"wrench_offset": "no"}, {"wrench_offset": "yes"}):
        found = identified(EARLY, 1, **recorded, **asked)
        suspected = [each.data for each in found.findings if each.kind == "wrong_assumption"]
        offset = found.fit.wrench_offset
        values = np.array(suspected[0]["values"]) if offset is None else offset.values
        assert np.linalg.norm(values[:3] + OFFSET[:3]) < 0.1 * np.linalg.norm(OFFSET[:3])
        tared = identified(EARLY, 1, **(recorded | {"offset": -OFFSET - values}))
        assert tared.findings == []
        # What is left of the offset is within its own uncertainty, and the residuals are noise.
        residuals, of_noise = (each.fit.residual_rms for each in (tared, identified(EARLY, 1)))
        assert (residuals < 1.02 * of_noise).all()
        assert np.abs(tared.estimate.body.com - BODY.com).max() < 2e-3


def test_without_an_offset_nothing_is_suspected_and_asking_costs_little() -> None:
    plain, asked = identified(EARLY, 2), identified(EARLY, 2, wrench_offset="yes")
    assert plain.findings == asked.findings == []
    assert plain.fit.wrench_offset is None
    # Variances that are estimated window by window scatter.
    assert (asked.estimate.std_devs >= 0.8 * plain.estimate.std_devs).all()
    assert np.abs(normalised(asked)).max() < 3.5


def test_at_rest_an_offset_cannot_be_separated_from_a_mass() -> None:
    found = identified(EARLY, 3, swings=False, wrench_offset="yes")
    assert not any(found.estimate.identifiable)
    assert found.estimate.std_devs[0] > 1e6


def test_given_noise_weighs_the_channels() -> None:
    """In less than a second the residuals hardly tell the noise: rms errors over 60 draws."""
    # Forces that differ by far, and moments that say most.
    noise = NOISE * [1, 20, 5, 1, 4, 0.3]
    squares = np.zeros((2, 10))
    for seed in range(60):
        for k, options in enumerate(({}, {"wrench_noise": noise})):
            found = identified(0.8, seed, noise=noise, **options)
            squares[k] += (found.estimate.values - TRUTH) ** 2
    gain = np.sqrt(squares[1] / squares[0])
    assert np.median(gain) < 0.95, gain
    assert gain.max() < 1.02, gain


@pytest.mark.parametrize(
    ("options", "what"),
    [
        ({"wrench_noise": [0.1] * 5}, "wrench_noise"),
        ({"wrench_noise": [0.0, 1, 1, 1, 1, 1]}, "`wrench_noise` is 0, but must be a standard"),
        ({"wrench_noise": np.ones((3, 6))}, "`wrench_noise` has 3 entries: give one for all"),
        ({"wrench_offset": "yes", "estimator": "nlms"}, "an unknown offset of the wrenches needs"),
        ({"wrench_noise": NOISE, "estimator": "nlms"}, "the noise of the sensors needs"),
    ],
)
def test_what_cannot_be_is_refused(options: dict[str, object], what: str) -> None:
    with pytest.raises(tactid.TactidError, match=what):
        identified(EARLY, 1, **options)


def test_the_command_takes_offset_and_noise(command: TactidCommand, log: Path) -> None:
    noise = ["--wrench-noise", "1,1,1,.1,.1,.1"]
    done = command("identify", log, "--wrench-offset", "yes", *noise, *noise, "--json")
    assert done.returncode == 0, done.stderr
    reported = json.loads(done.stdout)["fit"]["wrench_offset"]
    assert reported["frame"] == "tool0"
    assert len(reported["std_devs"]) == 6
    assert abs(reported["values"][0]) < 0.01
    assert "; wrench offset force x " in command("identify", log, "--wrench-offset", "yes").stderr
    assert_refused(
        command("identify", log, "--wrench-noise", "1,2,3"), "--wrench-noise", "6 numbers"
    )
    three = [word for _ in range(3) for word in noise]
    assert_refused(command("identify", log, *three), "--wrench-noise has 3 entries", "2 sensors")
    assert_refused(
        command("identify", log, "--effort-noise", "1,2"), "--effort-noise has 2 entries"
    )
