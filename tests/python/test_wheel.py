"""The wheel: fresh environments without a Rust toolchain install it and identify a payload."""

import json
import os
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Callable, Mapping, Sequence
from importlib import metadata
from pathlib import Path
from urllib.parse import urlparse
from urllib.request import url2pathname

import pytest

from tactid import _native

RUNNING = "{}.{}".format(*sys.version_info)
VERSIONS = ("3.10", "3.13")
"""The oldest Python that is supported, and the newest that is tested."""

Run = Callable[..., str]

IMPORT_ALL = """
import importlib, pkgutil, tactid
for module in pkgutil.walk_packages(tactid.__path__, "tactid."):
    # The viewer needs the extra, and the node needs ROS 2.
    if not module.name.startswith(("tactid._view", "tactid._ros")):
        importlib.import_module(module.name)
"""

EXPERIMENT = 'duration_s = 3.0\n[excitation]\nmode = "together"\n'


@pytest.fixture(scope="module")
def wheel() -> Path:
    """The wheel from which the package of these tests is installed."""
    source = metadata.distribution("tactid").read_text("direct_url.json") or "{}"
    path = Path(url2pathname(urlparse(json.loads(source).get("url", "")).path))
    extension = Path(_native.__file__)
    if path.suffix != ".whl" or "site-packages" not in extension.parts:
        pytest.skip("tactid is not installed from a wheel, as `make test-python` installs it")
    with zipfile.ZipFile(path) as archive:
        assert archive.read(f"tactid/{extension.name}") == extension.read_bytes()
    return path


def test_one_wheel_serves_every_supported_python(wheel: Path) -> None:
    *_, python, abi, platform = wheel.stem.split("-")
    assert (python, abi) == ("cp310", "abi3")
    if sys.platform == "linux":
        assert "manylinux2014" in platform


@pytest.mark.parametrize("version", VERSIONS)
def test_a_fresh_environment_identifies_without_a_rust_toolchain(
    version: str, wheel: Path, tmp_path: Path
) -> None:
    """What it finds is equal to the digit to what another version of Python finds."""
    run = fresh_environment(version, tmp_path / "environment", wheel)
    run("python", "-c", IMPORT_ALL)
    (tmp_path / "short.toml").write_text(EXPERIMENT, encoding="utf-8")
    log = tmp_path / "run.mcap"
    run("tactid", "simulate", tmp_path / "short.toml", "--out", log)
    printed = run("tactid", "identify", log, "--json", "--report", tmp_path / "report.html")
    found = json.loads(printed)["estimate"]
    assert found["values"]["mass"] == pytest.approx(100, rel=0.01)
    assert "data:image/png" in (tmp_path / "report.html").read_text(encoding="utf-8")
    here = output_of([sys.executable, "-m", "tactid", "identify", log, "--json"], os.environ)
    assert found == json.loads(here)["estimate"]


def fresh_environment(version: str, folder: Path, wheel: Path) -> Run:
    """Makes a virtual environment of a version of Python with a wheel and what that needs.

    Returns what runs programs of it and no others.
    """
    python = interpreter(version)
    if python is None:
        pytest.skip(f"there is no Python {version} here")
    # The pip of these tests installs into it, because one of its own takes seconds.
    subprocess.run([python, "-m", "venv", "--without-pip", folder], check=True)
    pip = [sys.executable, "-m", "pip", "--python", folder, "--disable-pip-version-check"]
    install = ["install", "--quiet", "--no-compile", "--only-binary", ":all:", wheel]
    subprocess.run([*pip, *install], check=True)
    programs = folder / "bin"
    environment = {**os.environ, "PATH": str(programs)}
    environment.pop("PYTHONPATH", None)
    assert shutil.which("cargo", path=environment["PATH"]) is None
    return lambda name, *arguments: output_of([programs / name, *arguments], environment)


def output_of(command: Sequence[str | Path], environment: Mapping[str, str]) -> str:
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def interpreter(version: str) -> Path | None:
    """Finds a Python of a version: the running one, one on the path, or one of pyenv's."""
    if version == RUNNING:
        return Path(sys.executable)
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"))
    candidates = [shutil.which(f"python{version}"), *pyenv.glob(f"versions/{version}.*/bin/python")]
    for candidate in filter(None, candidates):
        has_venv = [candidate, "-c", "import venv, ensurepip"]
        if subprocess.run(has_venv, capture_output=True, check=False).returncode == 0:
            return Path(candidate)
    return None
