"""Takes a picture of what ``tactid view`` shows of a simulation, without a screen.

It needs the viewer, ``pip install '.[view]'``, and a Vulkan driver that renders without a screen,
such as Mesa's lavapipe:

    python docs/tools/screenshot.py docs/images/view.png
"""

import argparse
import io
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from PIL import Image
from rerun.experimental import ViewerClient

import tactid
from tactid import _view

EXPERIMENT = tactid.Experiment.from_toml('duration_s = 60.0\n[excitation]\nmode = "together"\n')
SIZE = (1440, 860)
MOMENT_S = 24.7
PORT = 9899
TOP_BAR = 37
"""Pixels at the top that are the viewer's and not the log's."""


def main() -> None:
    """Reads the arguments, and writes the picture."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("picture", type=Path)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        log, result, recording = (Path(folder, f"run.{kind}") for kind in ("mcap", "json", "rrd"))
        tactid.simulate(EXPERIMENT, log)
        tactid.identify(log).write_result(result)
        _view.record(log, recording, result=result)
        picture = take(recording).crop((0, TOP_BAR, *SIZE))
    # Few colours are all that there are, but for the edges.
    picture.quantize(256, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE).save(
        given.picture, optimize=True
    )


def take(recording: Path) -> Image.Image:
    """A picture of the whole window, at one moment of the recording."""
    window = f"{SIZE[0]}x{SIZE[1]}"
    options = ["--headless", "--port", str(PORT), "--window-size", window]
    command = [sys.executable, "-m", "rerun", *options, str(recording)]
    # In a group of its own: the command starts the viewer as a child, which must end with it.
    viewer = subprocess.Popen(command, stderr=subprocess.DEVNULL, start_new_session=True)
    try:
        client = connected()
        while client.get_state().loading or not client.get_state().views:
            time.sleep(0.2)
        time.sleep(8.0)  # until its greeting has gone
        client.set_time("time", duration=MOMENT_S, play_state="paused")
        time.sleep(2.0)
        return Image.open(io.BytesIO(client.take_screenshot())).convert("RGB")
    finally:
        os.killpg(viewer.pid, signal.SIGTERM)
        viewer.wait()


def connected() -> ViewerClient:
    """A connection, when the viewer has come so far."""
    for _ in range(100):
        try:
            client = ViewerClient.connect(f"rerun+http://127.0.0.1:{PORT}/proxy")
            client.get_state()
        except Exception:
            time.sleep(0.2)
        else:
            return client
    sys.exit("the viewer does not answer")


if __name__ == "__main__":
    main()
