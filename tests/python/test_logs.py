"""A log is what other tools read, too, and what a killed run leaves is readable."""

import json
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from mcap.exceptions import EndOfFile
from mcap.reader import NonSeekingReader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

import tactid

# Seconds after the first bytes of the log, chosen once and for all.
MOMENTS = np.random.default_rng(20161009).uniform(0, 0.6, 20).round(3)


def counts_of(log: Path) -> dict[str, int]:
    """How many messages each topic has, as ``tactid info`` says."""
    return {topic.name: topic.count for topic in tactid.info(log).topics if topic.count}


def decoded_by_mcap_ros2(log: Path) -> tuple[Counter[str], bool]:
    """Messages that ``mcap-ros2-support`` decodes from start to end; whether the end is missing."""
    counts: Counter[str] = Counter()
    with log.open("rb") as file:
        reader = NonSeekingReader(file, decoder_factories=[DecoderFactory()])
        try:
            # In the order of the file: sorting would ask for all of it first.
            for _, channel, _, message in reader.iter_decoded_messages(log_time_order=False):
                assert message is not None
                counts[channel.topic] += 1
        except EndOfFile:
            return counts, True
    return counts, False


def stopped(folder: Path, how: signal.Signals, moment: float) -> tuple[int, str, float]:
    """Sends a signal to ``tactid simulate``: its exit code, what it said, and how long it took."""
    running = subprocess.Popen(
        [sys.executable, "-m", "tactid", "simulate", "--out", "run.mcap"],
        cwd=folder,
        stderr=subprocess.PIPE,
        text=True,
        # A shell lets what it runs in the background ignore Ctrl-C, and so these tests.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    log = folder / "run.mcap"
    deadline = time.monotonic() + 120
    while not (log.exists() and log.stat().st_size > 0):
        assert running.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.002)
    time.sleep(moment)
    running.send_signal(how)
    start = time.monotonic()
    _, errors = running.communicate(timeout=30)
    return running.returncode, errors, time.monotonic() - start


def test_mcap_ros2_support_reads_every_message(log: Path) -> None:
    assert decoded_by_mcap_ros2(log) == (counts_of(log), False)


def test_rosbags_reads_every_message(log: Path) -> None:
    counts: Counter[str] = Counter()
    # The definitions are the log's own: there are none to fall back on.
    with AnyReader([log], default_typestore=get_typestore(Stores.EMPTY)) as reader:
        for connection, _, data in reader.messages():
            reader.deserialize(data, connection.msgtype)
            counts[connection.topic] += 1
    assert counts == counts_of(log)


def test_rerun_finds_every_channel_ok(log: Path) -> None:
    rerun = shutil.which("rerun", path=Path(sys.executable).parent)
    assert rerun is not None
    command = [rerun, "mcap", "check", "--full", str(log)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    channels = [
        line.split() for line in done.stdout.partition("─\n")[2].splitlines() if line.strip()
    ]
    assert {channel[3] for channel in channels} >= counts_of(log).keys()
    assert {channel[0] for channel in channels} == {"ok"}, done.stdout


@pytest.mark.parametrize("moment", MOMENTS)
def test_a_killed_run_leaves_a_readable_log(tmp_path: Path, moment: float) -> None:
    code, _, _ = stopped(tmp_path, signal.SIGKILL, moment)
    assert code == -signal.SIGKILL
    log = tmp_path / "run.mcap"
    assert tactid.info(log).damage
    complete, truncated = decoded_by_mcap_ros2(log)
    assert truncated
    counts = Counter(counts_of(log))
    # A chunk of at most a second may be cut, of which the other reader has nothing.
    assert complete <= counts
    assert counts["/joint_states"] - complete["/joint_states"] < 1000
    if counts["/joint_states"] >= 100:
        found = tactid.identify(log)
        assert found.damage
        assert found.duration_s == pytest.approx(1e-3 * counts["/joint_states"], abs=5e-3)


@pytest.mark.parametrize("moment", MOMENTS[:5])
def test_ctrl_c_leaves_a_complete_log(tmp_path: Path, moment: float) -> None:
    code, errors, took = stopped(tmp_path, signal.SIGINT, moment)
    assert code == 130
    assert errors == "tactid: interrupted: run.mcap holds the run up to here\n"
    assert took < 1.0
    log = tmp_path / "run.mcap"
    info = tactid.info(log)
    assert info.damage == []
    assert json.loads(info.metadata["tactid.report"]["json"])["interrupted"] is True
    assert decoded_by_mcap_ros2(log) == (counts_of(log), False)


def test_the_seed_alone_decides_the_log(tmp_path: Path) -> None:
    logs = [tmp_path / name for name in ("a.mcap", "b.mcap", "c.mcap")]
    for path, seed in zip(logs, (1, 1, 2), strict=True):
        tactid.simulate(tactid.Experiment.paper().replace(seed=seed, duration=0.5), path)
    first, again, other = (path.read_bytes() for path in logs)
    assert first == again
    assert first != other
