"""A fleet of recordings: rows lost or twice, scaling, memory, kills, bytes read, and the report.

Run by `make bench-fleet`, which takes some minutes; `--recordings 10000` is the size of a fleet. A
server of moto has the bucket; the recordings are 20 different ones under many names, of which some
are damaged.
"""

import argparse
import os
import random
import resource
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import distributed
import obstore
from mcap.reader import make_reader
from mcap.writer import Writer
from obstore.store import S3Store

import tactid
from tactid._fleet import report, run, work
from tactid._fleet.analysis import READ
from tactid._fleet.recordings import find
from tactid._fleet.table import ParquetRows, read_rows

DISTINCT = 20
SECONDS = 10.0
DAMAGED = 3
KILLS = 5
PORT = 5555
ARM = """
[robot]
base = "{base}"
[payload]
mass_kg = {mass}
center_of_mass_m = [0.25, 0.01, 0.08]
inertia_kg_m2 = [0.02, 0.0, 0.0, 0.03, 0.0, 0.02]
[excitation]
mode = "together"
[noise]
finger_force_n = 0.1
finger_moment_nm = 0.01
"""


def main() -> None:
    """Prints a line for each measurement."""
    given = argparse.ArgumentParser(description=__doc__)
    given.add_argument("--recordings", type=int, default=400)
    given.add_argument("--folder", type=int, default=200, help="logs of the run of a folder")
    given.add_argument("--workers", default="1,2", help="numbers of workers, with commas")
    given.add_argument("--report-rows", type=int, default=10_000)
    given.add_argument("--skip", default="", help="words of measurements to leave out")
    asked = given.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        logs = recordings(folder)
        for title, measure in {
            "folder": lambda: of_a_folder(folder, logs, asked.folder),
            "bucket": lambda: of_a_bucket(
                folder, logs, asked.recordings, [int(each) for each in asked.workers.split(",")]
            ),
            "report": lambda: of_the_report(folder, logs, asked.report_rows),
        }.items():
            if title not in asked.skip.split(","):
                measure()


def recordings(folder: Path) -> list[Path]:
    """Simulates recordings of two robots with different payloads, of which the last are damaged."""
    logs = []
    for seed in range(DISTINCT):
        log = folder / f"distinct{seed:02}.mcap"
        base = "floating" if seed % 5 == 0 else "fixed"
        experiment = tactid.Experiment.from_toml(ARM.format(base=base, mass=1.0 + 0.2 * seed))
        tactid.simulate(experiment.replace(duration=SECONDS, seed=seed), folder / "all.mcap")
        thin_out(folder / "all.mcap", log)
        if seed >= DISTINCT - DAMAGED:
            content = log.read_bytes()
            log.write_bytes(content[: len(content) * (seed - DISTINCT + DAMAGED) // DAMAGED])
        logs.append(log)
    print(
        f"{DISTINCT} recordings of {SECONDS:g} s, {size(logs):.0f} MB, {DAMAGED} damaged",
        flush=True,
    )
    return logs


def thin_out(log: Path, out: Path) -> None:
    """Writes every fourth message of each topic: the simulator's 1 kHz become 250 Hz."""
    with log.open("rb") as source, out.open("wb") as target:
        reader, writer = make_reader(source), Writer(target)
        writer.start("ros2")
        schemas: dict[int, int] = {}
        channels: dict[int, int] = {}
        seen = Counter[int]()
        for schema, channel, message in reader.iter_messages():
            assert schema is not None
            if channel.id not in channels:
                if schema.id not in schemas:
                    schemas[schema.id] = writer.register_schema(
                        schema.name, schema.encoding, schema.data
                    )
                channels[channel.id] = writer.register_channel(
                    channel.topic, channel.message_encoding, schemas[schema.id]
                )
            seen[channel.id] += 1
            if seen[channel.id] % 4 == 1:
                writer.add_message(
                    channels[channel.id], message.log_time, message.data, message.publish_time
                )
        writer.finish()
    log.unlink()


def size(paths: Sequence[Path]) -> float:
    """Returns the bytes of files, MB."""
    return sum(path.stat().st_size for path in paths) / 1e6


def of_a_folder(folder: Path, logs: Sequence[Path], count: int) -> None:
    """Prints the time of the logs of a folder beside that of the identifications alone."""
    many = folder / "many"
    many.mkdir()
    for k in range(count):
        os.link(logs[k % (DISTINCT - DAMAGED)], many / f"{k:05}.mcap")
    begun = time.monotonic()
    for k in range(count):
        tactid.identify(many / f"{k:05}.mcap")
    alone = time.monotonic() - begun
    cores = len(os.sched_getaffinity(0))
    begun, first = time.monotonic(), [0.0]

    def note(done: int, _: int) -> None:
        first[0] = first[0] or (time.monotonic() - begun if done else 0.0)

    tactid.fleet(many, out=folder / "folder.parquet", progress=note)
    whole = time.monotonic() - begun
    print(
        f"{count} logs of a folder: {whole:.1f} s, first row after {first[0]:.1f} s; identified one"
        f" after the other in one process {alone:.1f} s, on {cores} cores",
        flush=True,
    )


@contextmanager
def bucket(logs: Sequence[Path], count: int) -> Iterator[int]:
    """Serves a bucket with many names of the recordings; its value is the server's process."""
    server = subprocess.Popen(
        [sys.executable, "-m", "moto.server", "-p", str(PORT)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    url = f"http://127.0.0.1:{PORT}"
    os.environ |= {
        "AWS_ACCESS_KEY_ID": "key",
        "AWS_SECRET_ACCESS_KEY": "secret",
        "AWS_REGION": "us-east-1",
        "AWS_ENDPOINT_URL": url,
        "AWS_ALLOW_HTTP": "true",
    }
    try:
        import boto3

        client = boto3.client("s3", endpoint_url=url, region_name="us-east-1")
        for _ in range(100):
            try:
                client.create_bucket(Bucket="fleet")
                break
            except Exception:
                time.sleep(0.1)
        store = S3Store("fleet", client_options={"allow_http": True})
        contents = [log.read_bytes() for log in logs]
        for k in range(count):
            obstore.put(store, f"day{k % 7}/{k:05}.mcap", contents[k % DISTINCT])
        yield server.pid
    finally:
        server.terminate()
        server.wait()


def of_a_bucket(folder: Path, logs: Sequence[Path], count: int, numbers: Sequence[int]) -> None:
    """Prints what has become of recordings in a bucket: some workers, and kills."""
    with bucket(logs, count) as server:
        times, tables = {}, {}
        for workers in numbers:
            out = folder / f"workers{workers}.parquet"
            begun, served = time.monotonic(), processor_seconds(server)
            memory = computed(out, workers)
            times[workers] = time.monotonic() - begun
            served = processor_seconds(server) - served
            tables[workers] = payloads_of(out)
            print(
                f"{workers} workers: {describe(out, count)}, {times[workers]:.1f} s, of which the"
                f" server took {served:.1f} s of a core, {memory}",
                flush=True,
            )
        if {1, 2} <= times.keys():
            print(f"{times[1] / times[2] / 2:.2f} of ideal on two workers", flush=True)
        out = folder / "killed.parquet"
        kills = computed_with_kills(out)
        same = payloads_of(out) == tables[numbers[-1]]
        print(
            f"{kills} kills, one connection cut, one stop: {describe(out, count)},"
            f" same table: {same}",
            flush=True,
        )


def computed(out: Path, workers: int, kill: Any = None) -> str:
    """Computes the rows of the bucket, and returns the memory of the workers in words."""
    tasks = run.tasks_of(find(["s3://fleet"]), tactid.Options())
    with (
        distributed.LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            dashboard_address="127.0.0.1:0",
            silence_logs=50,
        ) as cluster,
        distributed.Client(cluster.scheduler_address, set_as_default=False) as client,
    ):
        client.wait_for_workers(workers)
        halves: list[int] = []
        seen: dict[str, int] = {}

        def note(done: int, total: int) -> None:
            if done == total // 2 and kill is None:
                halves.extend(client.run(peak).values())
            if kill is not None:
                kill(cluster, client, done, total)

        run.run(tasks, ParquetRows(out), client, note)
        seen = client.run(peak)
    half = f", {max(halves)} MB at half" if halves else ""
    return f"memory of a worker {max(seen.values())} MB at the end{half}"


def processor_seconds(process: int) -> float:
    """Returns the processor time of a process, s."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def peak() -> int:
    """Returns the largest memory of this process, MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 // 1_000_000


def computed_with_kills(out: Path) -> int:
    """Computes the rows, kills workers, cuts the connection and stops once, then goes on."""
    chosen, killed = random.Random(1), []

    def kill(cluster: Any, client: Any, done: int, total: int) -> None:
        due = [(k + 1) * total // (KILLS + 2) for k in range(KILLS)]
        if done in due and len(killed) < KILLS:
            nanny = chosen.choice(list(cluster.workers.values()))
            os.kill(nanny.pid, signal.SIGKILL)
            killed.append(done)
        if done == 3 * total // 4 and not cut:
            cut.append(done)
            client.loop.add_callback(client.scheduler_comm.comm.abort)
        if (
            done == total // 2
            and threading.current_thread() is threading.main_thread()
            and not stopped
        ):
            stopped.append(done)
            raise KeyboardInterrupt

    stopped: list[int] = []
    cut: list[int] = []
    try:
        computed(out, 2, kill)
    except KeyboardInterrupt:
        computed(out, 2, kill)
    return len(killed)


def payloads_of(out: Path) -> list[dict[str, Any]]:
    """Returns the rows without what differs from run to run."""
    passing = ("finished", "seconds", "requests", "bytes_read")
    return [{k: v for k, v in row.items() if k not in passing} for row in read_rows(out)]


def describe(out: Path, count: int) -> str:
    """Returns rows, those that are lost or twice, and outcomes in words."""
    found = read_rows(out)
    stored = sum(table_rows(path) for path in out.glob("*.parquet"))
    outcomes = ", ".join(
        f"{n} {name}" for name, n in Counter(r["outcome"] for r in found).most_common()
    )
    bytes_read, requests = (sum(r[name] or 0 for r in found) for name in ("bytes_read", "requests"))
    return (
        f"{len(found)} rows, {count - len(found)} lost, {stored - len(found)} twice ({outcomes}),"
        f" {bytes_read / count / 1e6:.2f} MB and {requests / count:.1f} requests a recording"
    )


def table_rows(path: Path) -> int:
    """Returns the number of rows of a file."""
    from pyarrow import parquet

    return int(parquet.read_metadata(path).num_rows)


def of_the_report(folder: Path, logs: Sequence[Path], count: int) -> None:
    """Prints seconds and size of the report of many rows, which differ by drawn errors."""
    tasks = run.tasks_of(find([str(log) for log in logs]), tactid.Options())
    rows = [row for task in tasks for row in work.identify_recording(task)]
    drawn = random.Random(2)
    table = ParquetRows(folder / "report.parquet")
    for k in range(count):
        row = dict(rows[k % len(rows)])
        robot = k % 8
        row |= {"address": f"{k:05}.mcap", "robot": f"arm{robot}"}
        if "start_ns" in row:
            row["start_ns"] = 1_790_000_000_000_000_000 + k * 600_000_000_000
            change = 1.0 + 0.2 * (k // (count // 3) + robot % 2)
            error = drawn.gauss(0.0, row["estimate.std_devs.mass"] or 0.0)
            row["estimate.values.mass"] = change * row["estimate.values.mass"] + error
        table.add([row])
    table.close()
    begun = time.monotonic()
    out = folder / "fleet.html"
    report.write_report(read_rows(folder / "report.parquet", READ), out)
    took = time.monotonic() - begun
    print(f"report of {count} rows: {took:.1f} s, {out.stat().st_size / 1e6:.2f} MB", flush=True)
    if "FLEET_REPORT" in os.environ:
        out.rename(os.environ["FLEET_REPORT"])


if __name__ == "__main__":
    main()
