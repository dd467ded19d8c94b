"""Recordings in tables: columns by name and unit, and what is wrong with a file."""

import json
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as arrow
import pytest
from pyarrow import parquet

import tactid
from conftest import TactidCommand
from recorded_arm import FIXED, JOINTS, PAYLOAD, ur5e
from recordings import state
from tactid._read import columns, tables

NUMBERS = ["time", *(f"{name}_{k}" for name in ("q", "qd", "wrench") for k in range(6))]
AXES = ["fx", "fy", "fz", "tx", "ty", "tz"]


@pytest.fixture(scope="module")
def rows() -> np.ndarray:
    """Times, positions, velocities and wrenches on the payload: (N, 19)."""
    s = state(FIXED, 8.0, 100.0)
    return np.column_stack([s.time, s.q, s.v, s.wrench])


def write(path: Path, names: Sequence[str], rows: np.ndarray, delimiter: str = ",") -> Path:
    text = [delimiter.join(names), *(delimiter.join(map(repr, row)) for row in rows.tolist())]
    path.write_text("\n".join(text))
    return path


def identified(path: Path, **options: Any) -> tactid.Identification:
    return tactid.identify(path, **{"urdf": ur5e(), "cutoff_hz": 5.0, "delay_s": 0.0} | options)


def assert_right(result: tactid.Identification) -> None:
    np.testing.assert_allclose(result.estimate.values, PAYLOAD.values, rtol=2e-3, atol=2e-4)


def rtde(folder: Path, rows: np.ndarray) -> tuple[Path, dict[str, Any]]:
    """As the RTDE client of Universal Robots writes it: set points, too, and spaces."""
    kinds = ("target_q", "actual_q", "actual_qd", "actual_TCP_force", "actual_current")
    names = ["timestamp", *(f"{kind}_{k}" for kind in kinds for k in range(6))]
    every = np.hstack([rows[:, :1], rows[:, 1:7] + 0.1, rows[:, 1:], rows[:, 7:13]])
    return write(folder / "rtde.csv", names, every, " "), {}


def test_a_motion_with_poses_of_the_tool_needs_the_robot(tmp_path: Path, rows: np.ndarray) -> None:
    kinds = ("actual_q", "actual_TCP_pose", "actual_TCP_force")
    names = ["timestamp", *(f"{kind}_{k}" for kind in kinds for k in range(6))]
    every = np.hstack([rows[:, :7], rows[:, 1:7], rows[:, 13:]])
    with pytest.raises(tactid.ArgumentError, match="give `urdf`"):
        tactid.identify(write(tmp_path / "rtde.csv", names, every))


def named_joints(folder: Path, rows: np.ndarray) -> tuple[Path, dict[str, Any]]:
    """In another order than that of the robot, with the opening of a gripper, and in ms."""
    names = ["time_ms", *JOINTS[::-1], "gripper", *(f"{name}_vel" for name in JOINTS[::-1]), *AXES]
    gripper = np.full((len(rows), 1), 0.04)
    motion = [rows[:, 6:0:-1], gripper, rows[:, 12:6:-1]]
    return write(
        folder / "joints.csv", names, np.hstack([1e3 * rows[:, :1], *motion, rows[:, 13:]])
    ), {}


def degrees(folder: Path, rows: np.ndarray) -> tuple[Path, dict[str, Any]]:
    """Units in brackets, decimal commas between semicolons, velocities as a suffix has them."""
    names = ["Time [ms]", *(f"J{k} [deg]" for k in range(1, 7))]
    names += [f"qd{k}_deg_s" for k in range(1, 7)]
    names += [f"Force.{axis} [N]" for axis in "XYZ"] + [f"Torque.{axis} (Nmm)" for axis in "XYZ"]
    scale = [1e3, *[180 / np.pi] * 12, *[1.0] * 3, *[1e3] * 3]
    path = write(folder / "degrees.csv", names, rows * scale, ";")
    path.write_text(
        path.read_text().replace(".", ",").replace("Force,", "Force.").replace("Torque,", "Torque.")
    )
    return path, {}


def epoch_in_ns(folder: Path, rows: np.ndarray) -> tuple[Path, dict[str, Any]]:
    """Times since 1970 in ns can be nothing else, without a unit."""
    other = rows.copy()
    other[:, 0] = (rows[:, 0] + 1.7e9) * 1e9
    path = folder / "epoch.csv"
    np.savetxt(path, other, "%.20g", ",", header=",".join(NUMBERS))
    return path, {}


def chosen(folder: Path, rows: np.ndarray) -> tuple[Path, dict[str, Any]]:
    names = ["clock", *(f"a{k}" for k in range(6)), *(f"b{k}" for k in range(6)), *"uvwxyz"]
    scale = [1e6, *[180 / np.pi] * 12, *[1.0] * 6]
    given = {"time": "clock[us]", "q": "a*[deg]", "qd": ["b*[deg/s]"], "wrench": list("uvwxyz")}
    return write(folder / "chosen.csv", names, rows * scale), {"columns": given}


def npz(folder: Path, rows: np.ndarray) -> tuple[Path, dict[str, Any]]:
    path = folder / "arrays.npz"
    np.savez(path, time=rows[:, 0], q=rows[:, 1:7], qd=rows[:, 7:13], wrench=rows[:, 13:])
    return path, {}


def sparse(folder: Path, rows: np.ndarray) -> tuple[Path, dict[str, Any]]:
    """Joints and wrenches on rows of their own, and a row without either."""
    lines = [",".join(NUMBERS)]
    for k, row in enumerate(rows.tolist()):
        motion, wrench = ",".join(map(repr, row[1:13])), ",".join(map(repr, row[13:]))
        lines += [f"{row[0]!r},{motion}" + "," * 6, f"{row[0]!r}" + "," * 13 + wrench]
        lines += [f"{row[0] + 1e-3!r}" + "," * 18] if k == 40 else []
    path = folder / "sparse.csv"
    path.write_text("\r\n".join(lines))
    return path, {}


def lists(rows: np.ndarray) -> dict[str, Any]:
    """Columns as LeRobot has them: lists, with the opening of a gripper behind the joints."""
    states = np.hstack([rows[:, 1:7], np.full((len(rows), 1), 0.04)]).tolist()
    return {
        "timestamp": arrow.array(rows[:, 0]),
        "observation.state": arrow.array(states, arrow.list_(arrow.float64())),
        "observation.velocity": arrow.array(
            rows[:, 7:13].tolist(), arrow.list_(arrow.float64(), 6)
        ),
        "observation.wrench": arrow.array(rows[:, 13:].tolist(), arrow.list_(arrow.float64())),
        "action": arrow.array(states, arrow.list_(arrow.float64())),
        "task": arrow.array(["hold"] * len(rows)),
    }


def lone_parquet(folder: Path, rows: np.ndarray) -> tuple[Path, dict[str, Any]]:
    parquet.write_table(arrow.table(lists(rows)), folder / "episode.parquet")
    return folder / "episode.parquet", {}


def parts(folder: Path, rows: np.ndarray) -> tuple[Path, dict[str, Any]]:
    """A folder with the name of a Parquet file, as data frames are written in parts."""
    (folder / "episode.parquet").mkdir()
    for name, part in zip(("part-0", "part-1"), np.array_split(rows, 2), strict=True):
        parquet.write_table(arrow.table(lists(part)), folder / f"episode.parquet/{name}.parquet")
    return folder / "episode.parquet", {}


def data_set(folder: Path, rows: np.ndarray) -> tuple[Path, dict[str, Any]]:
    """Version 3: three episodes one after the other in a file, of which the second is right."""
    every = [rows * np.where(np.arange(19) < 13, 1.0, scale) for scale in (0.5, 1.0, 2.0)]
    table = lists(np.vstack(every))
    table["episode_index"] = arrow.array(np.repeat([0, 1, 2], len(rows)))
    features = {name: {"dtype": "float64", "shape": [6], "names": None} for name in table}
    names = [f"{name}.pos" for name in JOINTS]
    features["observation.state"]["names"] = {"motors": [*names, "gripper.pos"]}
    root = folder / "set"
    for part in ("meta", "data/chunk-000"):
        (root / part).mkdir(parents=True)
    about = {"codebase_version": "v3.0", "total_episodes": 3, "features": features}
    (root / "meta/info.json").write_text(json.dumps(about))
    parquet.write_table(arrow.table(table), root / "data/chunk-000/file-000.parquet")
    return root, {"episode": 1}


FORMS = [rtde, named_joints, degrees, epoch_in_ns, chosen, npz, sparse]
FORMS += [lone_parquet, parts, data_set]


@pytest.mark.parametrize("form", FORMS)
def test_a_table_in_any_form_gives_the_payload(
    form: Callable[[Path, np.ndarray], Any], rows: np.ndarray, tmp_path: Path
) -> None:
    path, options = form(tmp_path, rows)
    result = identified(path, **options)
    assert_right(result)
    assert result.inputs["the log"] == path
    kinds = {finding.kind for finding in result.findings}
    assert ("unknown_joints" in kinds) == (form in (lone_parquet, parts))


def test_findings_and_faults_name_the_columns(rows: np.ndarray, tmp_path: Path) -> None:
    other = np.vstack([rows[:400], rows[390:]])
    other[100, 3] = np.nan
    result = identified(write(tmp_path / "a.csv", NUMBERS, other))
    assert_right(result)
    faults = {(fault.topic, fault.kind): fault.count for fault in result.faults}
    assert faults == {
        ("/q", "out_of_order"): 10,
        ("/wrench", "out_of_order"): 10,
        ("/q", "not_finite"): 1,
    }


def test_several_tables_and_a_log_of_them_are_combined(rows: np.ndarray, tmp_path: Path) -> None:
    other = rows.copy()
    noise = np.random.default_rng(0).normal(size=(len(rows), 6))
    other[:, 13:] += noise * [0.1, 0.1, 0.1, 0.01, 0.01, 0.01]
    paths = [npz(tmp_path, rows)[0], write(tmp_path / "b.csv", NUMBERS, other)]
    both = tactid.identify(paths, urdf=ur5e(), cutoff_hz=5.0)
    assert both.names == ["arrays.npz", "b.csv"]


def test_efforts_and_an_unloaded_reference_come_from_tables(tmp_path: Path) -> None:
    s = state(FIXED, 8.0, 100.0)
    names = ["t", *(f"{name}{k}" for name in ("q", "tau") for k in range(6))]
    loaded = write(tmp_path / "loaded.csv", names, np.column_stack([s.time, s.q, s.effort]))
    unloaded = write(
        tmp_path / "free.csv", names, np.column_stack([s.time, s.q, s.unloaded_effort])
    )
    assert_right(identified(loaded, unloaded=unloaded))
    arm = tactid.calibrate([unloaded], urdf=ur5e())
    assert [each.path for each in arm.recordings] == [unloaded]
    # A calibration needs the efforts also of a table that has a wrench.
    names += AXES
    every = np.column_stack([s.time, s.q, s.unloaded_effort, s.wrench])
    arm = tactid.calibrate([write(tmp_path / "both.csv", names, every)], urdf=ur5e())
    assert len(arm.recordings) == 1


def test_currents_are_no_torques(rows: np.ndarray, tmp_path: Path) -> None:
    path, _ = rtde(tmp_path, rows)
    with pytest.raises(tactid.ArgumentError, match="are currents") as refused:
        identified(path, method="effort")
    assert refused.value.option == "effort_gain"


def edited(text: str, change: Callable[[list[str]], list[str]]) -> str:
    return "\n".join(change(text.split("\n")))


BAD: dict[str, tuple[Callable[[list[str]], list[str]], str]] = {
    "empty": (lambda _: [""], r"bad.csv is empty"),
    "only names": (lambda lines: lines[:1], "no row of numbers"),
    "no names": (lambda lines: lines[1:], "no names of columns: line 1"),
    "ragged": (
        lambda lines: [*lines[:30], lines[30] + ",1", *lines[31:]],
        "line 31: it has 20 cells, but there are 19 columns",
    ),
    "text": (
        lambda lines: [*lines[:30], "0.29,oops" + "," * 17, *lines[31:]],
        "line 31, column `q_0`: 'oops' is no number",
    ),
    "no time": (
        lambda lines: [*lines[:30], "nan," + lines[30].split(",", 1)[1], *lines[31:]],
        "column `time`: row 30 has no time",
    ),
    "twice": (
        lambda lines: [lines[0].replace("q_1", "q_0", 1), *lines[1:]],
        "two columns .* `q_0`",
    ),
    "five joints": (
        lambda lines: [lines[0].replace("q_5", "other", 1), *lines[1:]],
        "5 numbers a row for `q`, but the robot has 6 joints up to `tool0`",
    ),
    "two candidates": (
        lambda lines: [lines[0].replace("qd_", "position_"), *lines[1:]],
        "",
    ),
    "unknown": (lambda lines: [lines[0].replace("time", "clock"), *lines[1:]], "known as `time`"),
}


@pytest.mark.parametrize("fault", BAD)
def test_what_is_wrong_with_a_table_is_named_with_its_place(
    fault: str, rows: np.ndarray, tmp_path: Path
) -> None:
    path = write(tmp_path / "bad.csv", NUMBERS, rows)
    change, message = BAD[fault]
    path.write_text(edited(path.read_text(), change))
    if not message:  # the preferred name is taken
        assert_right(identified(path))
        return
    with pytest.raises(tactid.TactidError, match=message):
        identified(path)


def test_times_without_a_unit_are_not_guessed(rows: np.ndarray, tmp_path: Path) -> None:
    rows = rows * np.r_[1e3, np.ones(18)]
    path = write(tmp_path / "ms.csv", NUMBERS, rows)
    with pytest.raises(tactid.ArgumentError, match=r"such as time=time\[ms\]"):
        identified(path)
    assert_right(identified(path, columns={"time": "time[ms]"}))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"time": "clock"}, "no column `clock`"),
        ({"speed": "time"}, "names `speed`: expected time, q"),
        ({"time": "time[kg]"}, "expected a unit of time"),
        ({"q": "q_0"}, "1 numbers a row|1 number a row"),
    ],
)
def test_wrong_columns_are_refused(
    given: dict[str, str], message: str, rows: np.ndarray, tmp_path: Path
) -> None:
    path = write(tmp_path / "a.csv", NUMBERS, rows)
    with pytest.raises(tactid.ArgumentError, match=message):
        identified(path, columns=given)


def test_options_of_tables_belong_to_tables(log: Path, rows: np.ndarray, tmp_path: Path) -> None:
    with pytest.raises(tactid.ArgumentError, match="`columns` does not apply to a log"):
        tactid.identify(log, columns={"q": "a"})
    path = write(tmp_path / "a.csv", NUMBERS, rows)
    with pytest.raises(tactid.ArgumentError, match="it is one recording"):
        identified(path, episode=1)
    with pytest.raises(tactid.ArgumentError, match="give `urdf`"):
        tactid.identify(path)
    root, _ = data_set(tmp_path, rows)
    with pytest.raises(tactid.ArgumentError, match="3 episodes: `episode` chooses one"):
        identified(root)
    with pytest.raises(tactid.ArgumentError, match="expected 0 to 2"):
        identified(root, episode=3)


def test_a_file_of_another_kind_leads_to_arrays(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    path.write_bytes(b"\x89HDF\r\n")
    with pytest.raises(tactid.LogError, match=r"docs/how-to/data\.md"):
        tactid.identify(path)


def test_a_missing_package_is_named_with_a_command_that_works(
    rows: np.ndarray, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, _ = lone_parquet(tmp_path, rows)
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(tactid.ArgumentError, match=r"is Parquet, .*: pip install pyarrow$"):
        identified(path)


def test_an_array_of_texts_or_ragged_lists_is_refused(rows: np.ndarray, tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", time=rows[:, 0].astype(str), q=rows[:, 1:7], wrench=rows[:, 13:])
    with pytest.raises(tactid.LogError, match="array `time`: its entries are <U"):
        identified(tmp_path / "a.npz")
    table = lists(rows)
    table["observation.state"] = arrow.array([[0.0] * (6 + (k == 7)) for k in range(len(rows))])
    parquet.write_table(arrow.table(table), tmp_path / "b.parquet")
    with pytest.raises(tactid.LogError, match="row 8 has 7 numbers, but the first has 6 numbers"):
        identified(tmp_path / "b.parquet")


def test_info_shows_what_columns_are_known_as(
    rows: np.ndarray, tmp_path: Path, command: TactidCommand
) -> None:
    path, _ = rtde(tmp_path, rows)
    shown = command("info", path)
    known = dict(line.split() for line in shown.stdout.splitlines() if len(line.split()) == 2)
    assert shown.returncode == 0
    assert known["target_q_0"] == "–"
    assert (known["actual_q_5"], known["actual_TCP_force_0"]) == ("q", "wrench")
    assert known["timestamp"] == "time"
    path = tmp_path / "named.csv"
    path.write_text("time,q_elbow_joint,q_wrist_joint,note\n0,0,0,0\n1,0,0,0\n")
    lines = command("info", path).stdout.splitlines()
    known = {line.split()[0]: " ".join(line.split()[1:]) for line in lines if line.strip()}
    assert known["q_elbow_joint"] == "q, with a URDF that has this joint"
    assert known["q_wrist_joint"] == "q, with a URDF that has this joint"
    assert (known["time"], known["note"]) == ("time", "–")


@pytest.mark.parametrize(
    ("names", "array", "found"),
    [
        (["/joint_states/position[0]", "/joint_states/position[1]"], "q", 2),
        (["joint1_velocity", "joint2_velocity"], "qd", 2),
        (["tau_1", "tau_2", "t_x"], "effort", 2),
        (["/ft/wrench/force/x", "/ft/wrench/force/y", "/ft/wrench/torque/z"], "wrench", 6),
        (["x [mm]", "y [mm]", "z [mm]", "rx", "ry", "rz"], "pose", 6),
        (["px", "x", "y", "z", "qx", "qy", "qz", "qw"], "pose", 7),
        (["target_q_0", "cmd_q_0", "action.joint_position_0"], "q", 0),
        (["stamp_ns"], "time", 1),
    ],
)
def test_known_names(names: list[str], array: str, found: int, tmp_path: Path) -> None:
    table = tables.open_table(write(tmp_path / "a.csv", names, np.ones((2, len(names)))))
    assert table is not None
    known = columns.find(table, [array])
    assert len(known[array].columns if array in known else ()) == found


def test_progress_can_stop_the_reading_of_a_table(rows: np.ndarray, tmp_path: Path) -> None:
    path = write(tmp_path / "long.csv", NUMBERS, np.tile(rows, (50, 1)))
    done: list[float] = []

    def stop(fraction: float) -> None:
        done.append(fraction)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        identified(path, progress=stop)
    assert len(done) == 1
    assert 0 < done[0] < 0.5


def test_the_command_chooses_an_episode(
    command: TactidCommand, rows: np.ndarray, tmp_path: Path
) -> None:
    """Also what follows the identification, such as the table of a comparison, has the episode."""
    folder, _ = data_set(tmp_path, rows)
    (tmp_path / "arm.urdf").write_text(ur5e())
    options = (folder, "--episode", "1", "--urdf", tmp_path / "arm.urdf", "--cutoff-hz", "5")
    for name in ("identify", "compare"):
        done = command(name, *options)
        assert done.returncode == 0, done.stderr
    record = json.loads(command("identify", *options, "--json").stdout)
    assert list(record["sha256"]["log"]) == [
        "data/chunk-000/file-000.parquet",
        "meta/info.json",
    ]


def test_arrays_with_other_numbers_of_rows_are_an_error(rows: np.ndarray, tmp_path: Path) -> None:
    path = tmp_path / "rates.npz"
    np.savez(path, time=rows[:, 0], q=rows[:, 1:7], wrench=np.repeat(rows[:, 13:], 2, axis=0))
    with pytest.raises(tactid.LogError, match=r"`wrench` has 1\d\d\d rows, but `\w+` has \d+"):
        identified(path)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"columns": "q=a"}, "`columns` is 'q=a'"),
        ({"columns": {"q": [1]}}, "`columns` is"),
        ({"columns": {"q": []}}, "`columns` is"),
        ({"episode": "1"}, "`episode` is '1': expected a whole number"),
    ],
)
def test_an_option_of_tables_of_another_type_is_refused(
    rows: np.ndarray, tmp_path: Path, given: dict[str, Any], message: str
) -> None:
    path = write(tmp_path / "a.csv", NUMBERS, rows)
    with pytest.raises(tactid.ArgumentError, match=message):
        identified(path, **given)


def test_a_text_of_a_robot_may_begin_with_a_byte_order_mark(
    rows: np.ndarray, tmp_path: Path
) -> None:
    result = identified(write(tmp_path / "a.csv", NUMBERS, rows), urdf="\ufeff" + ur5e())
    assert result.given["urdf"] == "as text"
    assert "`urdf`" not in result.inputs


@pytest.mark.parametrize(
    ("options", "arrays"),
    [
        ({}, "`wrench` or `effort`"),
        ({"method": "tactile"}, "`wrench`"),
        ({"method": "effort"}, "`effort`"),
    ],
)
def test_a_table_without_a_load_is_refused_in_words_of_tables(
    tmp_path: Path, rows: np.ndarray, options: dict[str, Any], arrays: str
) -> None:
    path = write(tmp_path / "motion.csv", NUMBERS[:13], rows[:, :13])
    with pytest.raises(tactid.ArgumentError) as error:
        identified(path, **options)
    assert f"motion.csv has no columns that are known as {arrays}: name them" in str(error.value)
    for word in ("log", "topic", "message", "stamp"):
        assert word not in str(error.value).removeprefix(str(tmp_path))


def test_the_times_of_a_table_are_no_header_stamps(tmp_path: Path, rows: np.ndarray) -> None:
    result = identified(write(tmp_path / "arm.csv", NUMBERS, rows))
    assert "; times from the table.\n" in str(result)


def test_columns_of_two_arrays_in_one_option_are_refused(
    rows: np.ndarray, tmp_path: Path, command: TactidCommand
) -> None:
    path, _ = rtde(tmp_path, rows)
    refused = command("identify", path, "--columns", "wrench=w_*,v,time=t,q=q_*")
    assert refused.returncode == 2
    message = "for each array: --columns wrench=w_*,v --columns time=t --columns q=q_*"
    assert message in " ".join(refused.stderr.split())
