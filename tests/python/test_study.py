"""Studies: simulations of one experiment, and the errors of methods."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from pyarrow import parquet
from typer.testing import CliRunner

import tactid
from tactid._base.values import PATHS, values_of
from tactid._cli import cli
from tactid._fleet import run, study, work

pytestmark = [
    # Threads and sockets of Dask that are closed while Python collects them.
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
    pytest.mark.filterwarnings("ignore::DeprecationWarning"),
]

EXPERIMENT = """
duration_s = 1.0
[excitation]
mode = "together"
[noise]
finger_force_n = 5.0
finger_moment_nm = 0.5
"""


@pytest.fixture
def path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The file of an experiment in the working directory."""
    monkeypatch.chdir(tmp_path)
    found = tmp_path / "e.toml"
    found.write_text(EXPERIMENT)
    return found


def tasks_of(
    experiment: Any, seeds: int = 1, methods: Any = ("tactile",), **options: Any
) -> list[Any]:
    return study.tasks_of_study(experiment, seeds, methods, tactid.Options(**options))


def test_a_later_call_adds_what_is_missing(path: Path, client: Any) -> None:
    """Of seeds, methods and experiments; what is there stays, and a seed is simulated once."""

    def run_on(*arguments: Any, **options: Any) -> list[dict[str, Any]]:
        return tactid.study(*arguments, out="study.parquet", client=client, **options)

    first = run_on(path, seeds=1)
    (other,) = run_on("./e.toml", seeds=1, methods=["combined"])
    experiment = tactid.Experiment.from_file(path)
    (louder,) = run_on(experiment.replace(noise={"finger_force_n": 50.0}), seeds=1)
    rows = run_on(path, seeds=2, methods=["tactile", "combined"])
    assert [(row["seed"], row["method"]) for row in rows] == [
        (0, "combined"),
        (0, "tactile"),
        (1, "combined"),
        (1, "tactile"),
    ]
    assert rows[:2] == [other, *first]
    assert rows[0]["estimate.values.mass"] != rows[2]["estimate.values.mass"]
    assert rows[2]["seconds"] == rows[3]["seconds"]
    assert louder["address"] not in (str(path), "experiment")
    assert parquet.read_table("study.parquet").num_rows == 5
    tactid.simulate(experiment.replace(seed=1), "run.mcap")
    alone = tactid.identify("run.mcap", method="combined")
    assert rows[2]["estimate.values.mass"] == alone.estimate.values[0]


def test_what_an_experiment_says_and_its_files_are_the_state(path: Path) -> None:
    """The seed is not; and paths are absolute, because a worker may be in another folder."""
    Path("arm.urdf").write_text(tactid.Experiment.paper().urdf)
    text = f'[robot]\nurdf = "arm.urdf"\n[excitation]\n{EXPERIMENT.partition("[excitation]")[2]}'
    path.write_text(text)
    (first,) = tasks_of("e.toml")
    path.write_text(f"seed = 7\n{text}")
    (same,) = tasks_of(path)
    assert (first.key, first.state) == (same.key, same.state)
    assert str(path.with_name("arm.urdf")) in first.recording.experiment
    assert first.recording.address == str(path)
    Path("arm.urdf").write_text(tactid.Experiment.paper().urdf + "\n")
    (changed,) = tasks_of(path)
    assert changed.key == first.key
    assert changed.state != first.state
    path.write_text(text.replace("5.0", "6.0"))
    assert tasks_of(path)[0].state not in (first.state, changed.state)


@pytest.mark.parametrize(
    ("methods", "options", "words"),
    [
        ("tactile", {}, "`methods` is tactile: expected a list of some of tactile, effort"),
        (["best"], {}, "`methods` is best: expected a list of some of"),
        (["effort", "effort"], {}, "once each"),
        ([], {}, "once each"),
        (["tactile"], {"method": "effort"}, "`method` does not apply to a study"),
        (["tactile"], {"episode": 3}, "`episode` does not apply to a study"),
        (["tactile"], {"known_tool": [1.0] * 10}, "`known_tool` does not apply to a study"),
        (["tactile"], {"tip": "link_2"}, "`tip` is link_2, but the true values are those in tool0"),
        (["tactile"], {"cutoff_hz": -1.0}, "`cutoff_hz`"),
    ],
)
def test_what_does_not_apply_is_refused_before_the_run(
    methods: Any, options: dict[str, Any], words: str
) -> None:
    with pytest.raises(tactid.ArgumentError, match=words):
        tasks_of(tactid.Experiment.paper(), 1, methods, **options)


def test_the_tip_is_that_of_the_experiment(path: Path) -> None:
    urdf = tactid.Experiment.paper().urdf.replace('"tool0"', '"flange"')
    Path("arm.urdf").write_text(urdf)
    path.write_text(EXPERIMENT + '[robot]\nurdf = "arm.urdf"\ntool = "flange"\n')
    (task,) = tasks_of(path)
    (row,) = work.identify_recording(task)
    assert row["estimate.frame"] == "flange", row["error"]


def test_the_error_of_a_method_leaves_the_others() -> None:
    wrong, right = tasks_of(tactid.Experiment.from_toml(EXPERIMENT), 1, ["effort", "tactile"])
    wrong = replace(wrong, options=wrong.options.replace(tip="nowhere"))
    rows = work.identify_recording(wrong, right)
    assert [(row["method"], row["outcome"]) for row in rows] == [
        ("effort", "refused"),
        ("tactile", "identified"),
    ]


def row(error: float, method: str, outcome: str = "identified") -> dict[str, Any]:
    """A row whose intervals reach 1 below and 4 above the estimates."""
    names = [".".join(path) for path in PATHS]
    truth = values_of(tactid.Experiment.paper().payload)
    values = {name: true + error for name, true in zip(names, truth, strict=True)}
    return {
        "method": method,
        "outcome": outcome,
        **{f"estimate.values.{name}": value for name, value in values.items()},
        **{f"estimate.intervals.{name}": [v - 1.0, v + 4.0] for name, v in values.items()},
        "estimate.values.com.x": None,
    }


def test_errors_are_those_of_the_estimates() -> None:
    """And the intervals are the reported ones, which may be wider to one side."""
    rows = [row(3.0, "tactile"), row(-3.0, "tactile"), row(9.0, "tactile", "refused")]
    found = tactid.study_errors([*rows, row(1.0, "effort")], tactid.Experiment.paper())
    assert [each.value for each in found if each.method == "effort"] == [
        name for name in tactid.VALUE_NAMES if name != "com x"
    ]
    mass = found[0]
    assert (mass.method, mass.value, mass.runs) == ("tactile", "mass", 2)
    assert (mass.rms, mass.bias, mass.coverage) == pytest.approx((3.0, 0.0, 0.5))


def run_here(tasks: Any, table: Any, *_: object) -> int:
    """Runs tasks in this process, without Dask."""
    for task in tasks:
        table.add(work.identify_recording(task))
    table.close()
    return 0


def test_the_command_prints_the_errors(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run, "run", run_here)
    arguments = ["study", str(path), "--seeds", "1", "--out", "study.csv"]
    done = CliRunner().invoke(cli.app, arguments)
    assert done.exit_code == 0, done.output
    mass = next(line for line in done.stdout.splitlines() if " mass " in line)
    assert mass.split()[:4] == ["tactile", "mass", "kg", "1"]
    assert done.stderr.splitlines() == ["1 identification: 1 identified.", "Wrote study.csv."]
    path.write_text(EXPERIMENT + "[bounds]\ngrasp_drift_m = 1e-12\n")
    done = CliRunner().invoke(cli.app, [*arguments, "--methods", "tactile, effort"])
    assert done.exit_code == 1, done.exception
    assert done.stdout == ""
    lines = done.stderr.splitlines()
    assert lines[0] == "2 identifications: 2 refused."
    assert lines[1].startswith("1 time: tactile: at 0.010 s: the payload's displacement")
    assert lines[1].endswith("take a lighter payload.")


def test_the_command_names_its_flags(path: Path) -> None:
    for arguments, words in {
        ("--methods", "tactile,best"): "--methods is tactile, best: expected",
        ("--scheduler", "localhost"): "--scheduler is localhost: expected the address",
        ("--tip", "link_2"): "--tip is link_2, but",
        ("--seeds", "0"): "--seeds is 0: expected at least 1",
    }.items():
        error = CliRunner().invoke(cli.app, ["study", str(path), *arguments]).exception
        assert isinstance(error, tactid.ArgumentError)
        assert error.worded("command-line").startswith(words)
