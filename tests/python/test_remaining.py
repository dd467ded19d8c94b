"""How much longer to move: the forecast comes true when the motion goes on."""

from pathlib import Path

import numpy as np
import pytest

import tactid
from tactid._show import outlook
from wrist import EARLY, half_widths, identified


@pytest.mark.parametrize("calm_until", [0.0, EARLY / 2])
def test_the_forecast_time_is_the_time_that_it_takes(calm_until: float) -> None:
    """For half the interval of the worst value, with a calm first half or without.

    Intervals come from residuals, and scatter: the mean over ten draws of the noise is held to four
    of its own standard errors. The mean information of the calm case would promise 24 s.
    """
    ratios = []
    for seed in range(10):
        early = identified(EARLY, seed, calm_until=calm_until)
        widths = half_widths(early)
        worst, within = widths.argmax(), widths.max() / 2
        remaining = early.remaining(within)
        assert remaining.argmax() == worst
        assert remaining[worst] == pytest.approx(14 if calm_until else 23, rel=0.05)
        late = identified(EARLY + remaining[worst], seed, calm_until=calm_until)
        ratios.append(half_widths(late)[worst] / within)
    assert np.std(ratios) < 0.2
    assert abs(np.mean(ratios) - 1) < 4 * np.std(ratios) / np.sqrt(len(ratios)), ratios


def test_what_is_known_takes_no_time_and_what_is_not_excited_for_ever() -> None:
    moving = identified(EARLY, 0)
    still = identified(EARLY, 0, swings=False, wrench_offset="no")
    np.testing.assert_array_equal(moving.remaining(2 * half_widths(moving).max()), np.zeros(10))
    remaining = still.remaining(0.01)
    assert np.isfinite(remaining[0])
    assert np.isinf(remaining[4:]).all()
    sentence = outlook.outlook(still, 0.02)
    assert sentence is not None
    # The remarks name what is not identifiable, and what to do about it.
    unknown = still.estimate.not_identifiable
    assert {"Ixx", "Iyy", "Izz"} <= set(unknown)
    assert not any(name in sentence for name in unknown)
    text = str(still)
    assert all(text.count(name) == 3 for name in ("Ixy", "Ixz")), text
    for wrong in (0.0, -1.0, np.nan):
        with pytest.raises(tactid.ArgumentError, match="within"):
            moving.remaining(wrong)


def test_the_paper_s_filter_knows_of_no_intervals(log: Path, tmp_path: Path) -> None:
    found = tactid.identify(log, estimator="nlms")
    assert isinstance(found, tactid.PaperIdentification)
    assert np.isfinite(found.principal_moments).all()
    assert set(found.estimate.reported_intervals) == {None}
    assert "known within" not in str(found)
    # The log of the estimates is that of the last presentation, and without intervals.
    found.write_estimates(tmp_path / "estimates.mcap")
    counts = {each.name: each.count for each in tactid.info(tmp_path / "estimates.mcap").topics}
    assert counts["/tactid/payload"] == np.count_nonzero(np.array(found.history.epoch) == 1)
    assert counts["/tactid/payload_half_width_95"] == 0
