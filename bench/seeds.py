"""Five seeds of the paper's experiment: the worst error of the ten parameters, and the time taken.

Run by `make bench-seeds`. Each run is 300 s at 1 kHz with 1 % noise on the command, identified from
its log. An error is in percent of the nominal value, or for a zero entry of the largest nominal
entry of its kind.
"""

import tempfile
import time
from pathlib import Path

import numpy as np
from recorded import scales
from rich.console import Console
from rich.table import Table

import tactid
from tactid._base.values import values_of

PAYLOAD = tactid.Experiment.paper().payload
RUNS = {
    "NLMS": {"method": "tactile", "estimator": "nlms"},
    "least squares": {"method": "tactile", "estimator": "least-squares"},
    "joint sensing, least squares": {"method": "joint-sensing", "estimator": "least-squares"},
}


def main() -> None:
    """Prints a row for each seed, and the worst of all."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "run.mcap"
        for seed in range(5):
            experiment = tactid.Experiment.paper().replace(seed=seed)
            start = time.perf_counter()
            tactid.simulate(experiment, log)
            simulated_s = time.perf_counter() - start
            errors = [worst_percent(tactid.identify(log, **options)) for options in RUNS.values()]
            rows.append([*errors, simulated_s])
    rows.append(np.max(rows, axis=0))
    table = Table(title="worst of ten parameters, error in %")
    for name in ["seed", *RUNS, "simulation and log, s"]:
        table.add_column(name, justify="right")
    for label, row in zip([*map(str, range(5)), "worst"], rows, strict=True):
        *errors, simulated_s = row
        table.add_row(label, *(f"{error:.4f}" for error in errors), f"{simulated_s:.1f}")
    Console(width=100).print(table)


def worst_percent(found: tactid.Identification) -> float:
    """The largest of the ten errors."""
    return float(np.max(100 * np.abs(found.estimate.values - values_of(PAYLOAD)) / scales(PAYLOAD)))


if __name__ == "__main__":
    main()
