"""Builds the native halves of comparisons with Cargo and a C++ compiler."""

import ctypes
import hashlib
import importlib.metadata
import os
import shutil
import subprocess
import sysconfig
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path

from peers.cores import all_cores
from peers.harness import Array, MissingPeerError

BENCH = Path(__file__).parents[1]
BUILD = BENCH.parent / "target" / "bench"

OWN_PROCESSOR = "-march=native"
"""The flag with which a peer is built for the processor of this machine."""

CXX_FLAGS = ["-std=c++17", "-O3", "-DNDEBUG", "-shared", "-fPIC"]
# As in an executable: calls within the library are inlined.
CXX_FLAGS += ["-fvisibility=hidden", "-fno-semantic-interposition", "-fno-gnu-unique", "-w"]
# What Pinocchio's own build defines: its list of joints is longer than Boost's headers expect.
CXX_FLAGS += ["-DBOOST_MPL_LIMIT_LIST_SIZE=30", "-DBOOST_MPL_LIMIT_VECTOR_SIZE=30"]
CXX_FLAGS += ["-DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS", "-DBOOST_FUSION_INVOKE_MAX_ARITY=10"]


class Kernel:
    """A kernel of one library on a series of inputs: its results, and the time of one input."""

    def __init__(self, run: Callable[..., bool], name: str, inputs: int, out: Array) -> None:
        """Runs the kernel once. `run` takes its name, repetitions and the array of results."""
        self.run, self.name, self.inputs, self.out = run, name, inputs, out
        self.repetitions = 1
        self()

    def __call__(self) -> float:
        """Seconds of one input in the time of this thread: other processes do not count.

        Raises:
            SystemExit: The library has no kernel of this name, or the kernel failed.
        """
        start = time.thread_time()
        is_done = self.run(self.name.encode(), ctypes.c_size_t(self.repetitions), self.out)
        passed = time.thread_time() - start
        if not is_done:
            raise SystemExit(f"the kernel {self.name} does not exist, or has failed")
        return passed / (self.repetitions * self.inputs)


def pointer(array: Array) -> ctypes.c_void_p:
    """The place of an array for a C function."""
    return array.ctypes.data_as(ctypes.c_void_p)


def handle(pointer: int | None, what: str) -> ctypes.c_void_p:
    """What a constructor behind the C interface returned.

    Raises:
        SystemExit: It is null: the robot or its link could not be used.
    """
    if not pointer:
        raise SystemExit(f"{what} could not be made: is the link in the URDF?")
    return ctypes.c_void_p(pointer)


@cache
def tactid_library() -> ctypes.CDLL:
    """The kernels of tactid, with the flags of the product."""
    command = ["cargo", "build", "--release", "--quiet", "--locked", "-p", "tactid-bench"]
    with all_cores():
        subprocess.run(command, cwd=BENCH, check=True)
    library = ctypes.CDLL(str(BUILD.parent / "release" / "libtactid_bench.so"))
    library.tactid_dynamics_new.restype = ctypes.c_void_p
    library.tactid_dynamics_run.restype = ctypes.c_bool
    library.tactid_estimator_run.restype = ctypes.c_bool
    library.tactid_online_new.restype = ctypes.c_void_p
    library.tactid_online_run.restype = ctypes.c_bool
    return library


def compiler() -> str:
    """The C++ compiler."""
    return os.environ.get("CXX", "g++")


@cache
def robot_library(name: str, *flags: str) -> ctypes.CDLL:
    """Kernels in C++ with Pinocchio, whose source, constructor and runner have the same name.

    Raises:
        MissingPeerError: There is no compiler, or no headers.
    """
    needs = ("pinocchio/algorithm/regressor.hpp", "eigen3/Eigen/Core")
    loaded = cxx_library(f"{name}.cpp", *flags, needs=needs)
    getattr(loaded, f"{name}_new").restype = ctypes.c_void_p
    getattr(loaded, f"{name}_run").restype = ctypes.c_bool
    return loaded


@cache
def cxx_library(name: str, *flags: str, needs: tuple[str, ...]) -> ctypes.CDLL:
    """A source file of this folder, compiled with further flags against the headers of the wheels.

    Raises:
        MissingPeerError: There is no compiler, or not all headers that it needs.
    """
    if shutil.which(compiler()) is None:
        raise MissingPeerError(f"no C++ compiler {compiler()}")
    include = Path(sysconfig.get_paths()["purelib"]) / "cmeel.prefix" / "include"
    for header in needs:
        if not (include / header).exists():
            raise MissingPeerError(f"no {header}: pip install pin cmeel-eigen")
    source = BENCH / "peers" / name
    headers = [f"-I{include}", f"-I{include / 'eigen3'}"]
    command = [compiler(), *CXX_FLAGS, *flags, *headers, str(source)]
    texts = [path.read_text() for path in [source, *sorted(source.parent.glob("*.hpp"))]]
    key = "\n".join([*command, *texts, importlib.metadata.version("pin")])
    library = BUILD / f"{source.stem}-{hashlib.sha256(key.encode()).hexdigest()[:16]}.so"
    if not library.exists():
        with all_cores():
            subprocess.run([*command, "-o", library], check=True)
    return ctypes.CDLL(str(library))
