"""Numbers of an option on the command line, by commas or by spaces, negative ones too."""

from pathlib import Path

import pytest

from conftest import TactidCommand
from expectations import Identify
from tactid._cli.number_lists import joined
from test_cli import assert_refused

COUNTS = {"--gravity": 3, "--effort-gain": None}


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        ("a --gravity 0 0 -9.81 b", "a --gravity 0,0,-9.81 b"),
        ("--gravity 0,0,-9.81 7", "--gravity 0,0,-9.81 7"),
        ("--gravity -1, -2 -3 -4", "--gravity -1,-2,-3 -4"),
        ("--gravity=-1 -2 -3", "--gravity -1,-2,-3"),
        ("--gravity=", "--gravity "),
        ("--gravity down b", "--gravity down b"),
        ("--effort-gain 1 -1 1e-3 --tip 3", "--effort-gain 1,-1,1e-3 --tip 3"),
        ("--delay-s -0.1", "--delay-s -0.1"),
        ("-- --gravity 0 0", "-- --gravity 0 0"),
        ("--gravity", "--gravity"),
    ],
)
def test_the_numbers_of_an_option_are_joined(arguments: str, expected: str) -> None:
    assert list(joined(arguments.split(), COUNTS)) == expected.split(" ")


def test_lists_of_the_command_take_commas_and_spaces(log: Path, identify: Identify) -> None:
    by_commas = ["--gravity", "0,0,-0.5", "--bounding-box", "-1,-1,-1,1,1,1"]
    by_spaces = ["--gravity", "0", "0", "-0.5", "--bounding-box", "-1", "-1", "-1", "1", "1", "1"]
    options = ["--method", "tactile", "--cutoff-hz", "10", "--delay-s", "-0.0"]
    one = identify(log, *by_commas, *options)
    assert identify(*by_spaces, log, *options)["estimate"] == one["estimate"]
    assert identify(log, *options)["estimate"] != one["estimate"]


def test_wrong_lists_are_named(log: Path, command: TactidCommand) -> None:
    expected = "separated by commas or spaces"
    two = command("identify", log, "--gravity", "0", "-9.81")
    assert_refused(two, "--gravity is '0,-9.81': expected 3 numbers", expected)
    text = command("identify", log, "--bounding-box", "big")
    assert_refused(text, "--bounding-box is 'big': expected 6 numbers")
    posture = command("paper", "--posture", "0", "-1.2", "--out", "out")
    assert_refused(posture, "posture")
