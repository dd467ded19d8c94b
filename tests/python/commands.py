"""Commands in processes of their own, without the half second in which each loads its libraries.

A server has loaded the command once. Each command is a fork of it, with arguments, folder,
environment and standard streams of its own, and ends as any process of Python does. Its memory
counts what the server has loaded, as that of a process that has loaded the same.
"""

import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

LONGEST_S = 300.0


@dataclass(frozen=True)
class Done:
    """A command that has ended, as ``subprocess`` describes it, and what it has taken."""

    returncode: int
    stdout: str
    stderr: str
    processor_s: float
    memory_mb: float
    """Largest memory."""


class CommandServer:
    """Runs ``tactid`` with arguments, one command after another."""

    def __init__(self, modules: Sequence[str] = ()) -> None:
        """Starts a server that has loaded these modules, too."""
        self._channel, theirs = socket.socketpair()
        # Named as the command is, because the package asks for it while it is loaded.
        code = "import sys; sys.argv = ['tactid', '--version']; import commands; commands.serve()"
        pipe = subprocess.PIPE  # of the kind that each command gets
        path = os.pathsep.join([str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")])
        self._process = subprocess.Popen(
            [sys.executable, "-c", code, str(theirs.fileno()), *modules],
            env={**os.environ, "PYTHONPATH": path, "MPLBACKEND": "agg"},
            pass_fds=[theirs.fileno()],
            stdin=subprocess.DEVNULL,
            stdout=pipe,
            stderr=pipe,
            start_new_session=True,
        )
        theirs.close()

    def run(self, arguments: Sequence[str], folder: Path, longest_s: float = LONGEST_S) -> Done:
        """Runs a command in a folder.

        Raises:
            RuntimeError: It has not ended after so long, or the server has. Both are killed.
        """
        read_ends, write_ends = zip(os.pipe(), os.pipe(), strict=True)
        asked = {"arguments": arguments, "folder": str(folder), "environment": dict(os.environ)}
        socket.send_fds(self._channel, [b"\n"], write_ends)
        self._channel.sendall(json.dumps(asked).encode() + b"\n")
        for end in write_ends:
            os.close(end)
        self._channel.settimeout(longest_s)
        with ThreadPoolExecutor(2) as threads:
            printed = [threads.submit(_read, end) for end in read_ends]
            try:
                ended = json.loads(self._channel.recv(256))
            except (OSError, ValueError) as error:
                raise RuntimeError(self.close()) from error
        return Done(stdout=printed[0].result(), stderr=printed[1].result(), **ended)

    def close(self) -> str:
        """Ends the server, and a command that still runs; returns what the server has said."""
        os.killpg(self._process.pid, signal.SIGKILL)
        self._channel.close()
        return self._process.communicate()[1].decode()


def _read(end: int) -> str:
    with open(end) as stream:
        return stream.read()


def serve() -> None:
    """Forks a command for each message, until the other end is closed."""
    from tactid.__main__ import main
    from tactid._base import startup
    from tactid._cli import cli

    _, descriptor, *modules = sys.orig_argv[2:]
    cli.run()  # loads what every command loads
    for module in modules:
        __import__(module)
    channel = socket.socket(fileno=int(descriptor))
    messages = channel.makefile()
    while True:
        mark, streams, _, _ = socket.recv_fds(channel, 1, 2)
        if not mark:
            return
        asked = json.loads(messages.readline())
        process = os.fork()
        if process == 0:
            break
        for stream in streams:
            os.close(stream)
        channel.send(json.dumps(_waited(process)).encode())
    messages.close()
    channel.close()
    os.chdir(asked["folder"])
    os.environ.clear()
    os.environ.update(asked["environment"])
    for place, stream in enumerate(streams, start=1):
        os.dup2(stream, place)
        os.close(stream)
    sys.argv = ["tactid", *asked["arguments"]]
    startup.bound_width()
    main()


def _waited(process: int) -> dict[str, float]:
    _, status, usage = os.wait4(process, 0)
    return {
        "returncode": os.waitstatus_to_exitcode(status),
        "processor_s": usage.ru_utime + usage.ru_stime,
        "memory_mb": usage.ru_maxrss * 1024 / 1e6,  # Linux counts KiB
    }
