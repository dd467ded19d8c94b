"""How often 95 % intervals hold the truth where the error is that of the model, not noise.

Run by `make bench-coverage`. Recordings of 0.5 to 14.5 s are simulated without noise: what is left
is how the payload gives way in its grasp. Half of them have the paper's payload, the others have
random ones.
"""

import tempfile
from pathlib import Path

import numpy as np
from recorded import Array

import tactid
from tactid.values import values_of

LENGTHS_S = np.linspace(0.5, 14.5, 12)


def main() -> None:
    """Prints the number of intervals that hold the truth, and the farthest one that does not."""
    random = np.random.default_rng(3)
    paper = tactid.Experiment.paper()
    experiments = [paper.replace(duration=length) for length in LENGTHS_S]
    experiments += [each.replace(payload=payload(random)) for each in experiments]
    distances = np.array([distance(each) for each in experiments])
    inside = np.count_nonzero(distances <= 1)
    print(f"{inside} of {distances.size} intervals of 95 % hold the truth; the farthest one misses")
    print(f"it by {distances.max() - 1:.2f} of its half-width, {distances.shape[0]} recordings")


def payload(random: np.random.Generator) -> tactid.MassProperties:
    """A random body that the gripper can hold."""
    moments = random.uniform(5.0, 20.0, size=3)
    moments[moments.argmax()] = min(moments.max(), 0.9 * (moments.sum() - moments.max()))
    center = np.array([0.5, 0.0, 0.0]) + random.uniform(-0.1, 0.1, size=3)
    return tactid.MassProperties(random.uniform(20.0, 150.0), center, np.diag(moments))


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
