"""What the tests share: our robot, and one short run with its log."""

import json
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tactid
from commands import CommandServer, Done
from expectations import Identify, Record, assert_fits_schema
from tactid._base.values import values_of

TactidCommand = Callable[..., Done]

# A shell starts what runs in the background with Ctrl-C ignored, and processes inherit that.
signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20161009)


@pytest.fixture(scope="session")
def urdf() -> str:
    return tactid.Experiment.paper().urdf


@pytest.fixture(scope="session")
def robot(urdf: str) -> tactid.Manipulator:
    return tactid.Manipulator.from_urdf(urdf, base="floating")


@pytest.fixture(scope="session")
def experiment() -> tactid.Experiment:
    """The paper's experiment with its three joints driven together, for three seconds."""
    return tactid.Experiment.from_toml('duration_s = 3.0\n[excitation]\nmode = "together"\n')


@pytest.fixture(scope="session")
def log(experiment: tactid.Experiment, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("run") / "run.mcap"
    tactid.simulate(experiment, path)
    return path


@pytest.fixture(scope="session")
def command_server() -> Iterator[CommandServer]:
    server = CommandServer(["tactid._show.recording_report"])
    yield server
    server.close()


@pytest.fixture
def command(tmp_path: Path, command_server: CommandServer) -> TactidCommand:
    """Runs ``tactid`` with arguments in a folder of its own."""
    return lambda *arguments: command_server.run([*map(str, arguments)], tmp_path)


@pytest.fixture
def identify(command: TactidCommand) -> Identify:
    """``identify(bag, *options)`` runs the command and returns its JSON."""

    def run(*arguments: object) -> Record:
        done = command("identify", *arguments, "--json")
        assert done.returncode in (0, 1), done.stderr
        record: Record = json.loads(done.stdout)
        assert_fits_schema(record)
        assert done.returncode == record["is_contradicted"]
        return record

    return run


@pytest.fixture(params=range(20))
def values(request: pytest.FixtureRequest) -> list[float]:
    """A cloud of points: no symmetry, nothing round, so that no exchange of entries goes unseen."""
    rng = np.random.default_rng(request.param)
    points = rng.normal(size=(9, 3)) * [0.03, 0.1, 0.2]
    points -= points.mean(axis=0)
    second = 0.3 * points.T @ points
    inertia = np.trace(second) * np.eye(3) - second
    return values_of(tactid.MassProperties(2.7, rng.normal(size=3), inertia))


@pytest.fixture(scope="module")
def client() -> Iterator[Any]:
    """A client of Dask whose worker is a thread of this process."""
    import distributed

    with (
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=2, processes=False, dashboard_address="127.0.0.1:0"
        ) as cluster,
        distributed.Client(cluster, set_as_default=False) as connection,
    ):
        yield connection
