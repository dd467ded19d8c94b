"""Recordings of half a second: what they cannot show, they do not blame."""

from pathlib import Path

import numpy as np
import pytest

import tactid
from recorded_arm import FIXED, ur5e
from recordings import state

# During some cuts the tool hardly turns: weight and zero of the sensor are then one.
ACCEPTED = {"nothing_held", "too_few_windows", "inconsistent", "weight_or_offset"}


@pytest.mark.parametrize("rate_hz", [100.0, 125.0, 250.0])
@pytest.mark.parametrize("length_s", [0.3, 0.4, 0.5, 0.6, 1.0])
def test_cuts_of_a_sound_recording_blame_no_assumption(
    rate_hz: float,
    length_s: float,
    rng: np.random.Generator,
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    urdf = tmp_path_factory.mktemp("arm") / "arm.urdf"
    urdf.write_text(ur5e(), encoding="utf-8")
    arm = tactid.Manipulator.from_urdf(urdf)
    s = state(FIXED, 20.0, rate_hz)
    noise = np.array([0.1, 0.1, 0.1, 0.001, 0.001, 0.001])
    wrench = s.wrench + noise * rng.normal(size=s.wrench.shape)
    q = s.q + 1e-5 * rng.normal(size=s.q.shape)
    for start_s in np.arange(0.5, 18.0, 0.9):
        cut = (s.time >= start_s) & (s.time < start_s + length_s)
        found = tactid.identify(s.time[cut], robot=arm, q=q[cut], wrench=wrench[cut])
        kinds = {each.kind for each in found.findings if each.severity != "notes"}
        assert kinds <= ACCEPTED, (start_s, kinds)


def test_a_longer_recording_names_the_cause(rng: np.random.Generator, tmp_path: Path) -> None:
    """From two seconds on, gravity of the opposite sign is named."""
    urdf = tmp_path / "arm.urdf"
    urdf.write_text(ur5e(), encoding="utf-8")
    arm = tactid.Manipulator.from_urdf(urdf)
    s = state(FIXED, 2.5, 125.0)
    wrench = s.wrench + 0.05 * rng.normal(size=s.wrench.shape)
    found = tactid.identify(
        s.time, robot=arm, q=s.q, qd=s.v, wrench=wrench, gravity=[0.0, 0.0, 9.81]
    )
    kinds = {each.kind for each in found.findings if each.severity == "contradicts"}
    assert kinds
    assert "too_few_windows" not in kinds
