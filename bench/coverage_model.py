"""How often 95 % intervals hold the truth where the error is that of the model, not noise.

Run by `make bench-coverage`. Recordings of 0.5 to 14.5 s are simulated without noise: what is left
is the compliance of the grasp. Joints move one after the other, or together, on a spacecraft and on
the ground. Half of the recordings have one payload, the others have random ones like it.
"""

import tempfile
from pathlib import Path

import numpy as np
from recorded import Array

import tactid
from tactid._base.values import values_of

LENGTHS_S = np.linspace(0.5, 14.5, 12)

MOTIONS = {
    "one after the other": "",
    "together": '[excitation]\nmode = "together"\n',
    "together, on the ground": (
        '[robot]\nbase = "fixed"\n[payload]\nmass_kg = 4.0\ncenter_of_mass_m = [0.25, 0.01, 0.08]\n'
        'inertia_kg_m2 = [0.02, 0.001, 0.0, 0.03, 0.0, 0.02]\n[excitation]\nmode = "together"\n'
    ),
}
"""Experiments by what moves: what their files have beyond the paper's."""


def main() -> None:
    """Prints for each motion how many intervals hold the truth, and the farthest one of all."""
    random = np.random.default_rng(3)
    for name, text in MOTIONS.items():
        first = tactid.Experiment.from_toml(text)
        experiments = [first.replace(duration=length) for length in LENGTHS_S]
        experiments += [each.replace(payload=other(each, random)) for each in experiments]
        distances = np.array([distance(each) for each in experiments])
        inside = np.count_nonzero(distances <= 1)
        print(
            f"{name}: {inside} of {distances.size} intervals of 95 % hold the truth;"
            f" the farthest one misses it by {distances.max() - 1:.2f} of its half-width"
        )


def other(experiment: tactid.Experiment, random: np.random.Generator) -> tactid.MassProperties:
    """A body like that of an experiment, with other mass, moments and centre of mass."""
    body = experiment.payload
    trace = np.trace(body.inertia) / 3
    moments = trace * random.uniform(0.5, 1.5, size=3)
    moments[moments.argmax()] = min(moments.max(), 0.9 * (moments.sum() - moments.max()))
    center = np.array(body.com) + random.uniform(-0.1, 0.1, size=3) * abs(body.com[0])
    return tactid.MassProperties(body.mass * random.uniform(0.3, 1.4), center, np.diag(moments))


def distance(experiment: tactid.Experiment) -> Array:
    """Distances of the truth from the ten estimates, in half-widths of the intervals."""
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "run.mcap"
        tactid.simulate(experiment, log)
        low, high = tactid.identify(log).estimate.intervals.T
    truth = values_of(experiment.payload)
    return np.abs(truth - (low + high) / 2) / ((high - low) / 2)


if __name__ == "__main__":
    main()
