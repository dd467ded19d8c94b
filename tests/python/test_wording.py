"""Findings, faults and advice in words."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import doubles
from expectations import assert_fits_schema
from tactid import Finding, remarks, result_json
from tactid.faults import PHRASES, DataFault
from tactid.remarks import motion_advice
from tactid.wording import CONTRADICTIONS, DOUBTS, FINDING_KINDS, finding

NATIVE = Path(__file__).parents[2] / "crates/pyid/src"

FINDINGS = [
    Finding(
        "gravity_contradicted",
        {"better": [0.0, 0.0, 9.81], "residual_ratio": 1e-3, "method": "tactile"},
    ),
    Finding("negative_mass", {"method": "tactile", "or_gravity": True}),
    Finding("known_bodies_too_heavy", {"known_kg": 3.0, "load_kg": 2.0}),
    Finding(
        "offset_suspected",
        {
            "frame": "tool0",
            "values": [1.5, 0.0, 0.2, 0.0, 0.01, 0.0],
            "std_devs": [0.1, 0.1, 0.1, 0.01, 0.01, 0.01],
        },
    ),
    Finding(
        "load_unexplained",
        {
            "unit": "N m",
            "residual_rms": 3.0,
            "load_rms": 10.0,
            "noise_rms": 0.07,
            "method": "effort",
        },
    ),
    Finding(
        "mass_contradicted",
        {
            "known_kg": 2.0,
            "known_std_dev_kg": 0.0,
            "found_kg": 1.8391,
            "std_dev_kg": 0.001,
            "distance": 160.9,
        },
    ),
    Finding(
        "known_mass_not_kept",
        {"known_kg": 2.0, "known_std_dev_kg": 0.0, "estimated_kg": 4.0, "within_box": True},
    ),
    Finding("inconsistent", {"distance": 7.0, "within_box": True}),
    Finding("outliers", {"outliers": 3, "windows": 100}),
    Finding(
        "acceleration_not_used",
        {"topic": "/accel", "explains_better": True, "residual_ratio": 0.5, "power_ratio": 0.4},
    ),
    Finding(
        "option_not_used", {"option": "effort_noise", "because": "method", "method": "tactile"}
    ),
    Finding("frame_assumed", {"topic": "/wrench", "frame": "tool0"}),
    Finding("wrenches_summed", {"topics": ["/left", "/right"]}),
    Finding("unknown_joints", {"joints": ["finger"]}),
    Finding("absent_joints", {"joints": ["head"]}),
    Finding("late_start", {"topic": "/wrench", "late_s": 1.5}),
    Finding("early_end", {"topic": "/wrench", "end_s": 8.0, "early_s": 7.0}),
    Finding(
        "velocities_contradicted",
        {"joints": ["joint_1"], "relative_difference": 2.0, "cause": "degrees", "other": None},
    ),
    Finding(
        "twist_contradicted",
        {"source": "/odom", "relative_difference": 0.8, "better_axes": "world"},
    ),
    Finding(
        "constant_channels",
        {"source": "/wrench", "frame": "tool0", "channels": ["force x"], "is_zero": True},
    ),
    Finding("no_stamps"),
    Finding("delay_corrected", {"applied_s": 0.037, "estimated_s": 0.037, "std_dev_s": 1e-4}),
    Finding("delay_doubtful", {"delay_s": -0.488, "residual_ratio": 0.9, "is_at_end": False}),
    Finding("impossible_inertia", {"link": "arm", "moments": [-1e-8, 3.5e-8, 9.087e-8]}),
    Finding("impossible_mass", {"link": "foot", "mass_kg": 0.0}),
    Finding("unknown_numbers", {"link": "arm", "element": "inertia", "attributes": ["ixx", "ixy"]}),
    Finding("massless", {"links": [f"finger_{k}" for k in range(8)]}),
    Finding("joint_taken_as_fixed", {"joint": "drive", "joint_type": "planar"}),
    Finding("mimic_not_followed", {"joint": "a", "leader": "b", "because": "circular"}),
    Finding(
        "part_ignored",
        {"part": "unknown_element", "name": "contact", "inside": "link", "owners": ["a", "b"]},
    ),
]


def test_every_kind_of_the_native_part_has_its_words() -> None:
    findings = (NATIVE / "findings.rs").read_text()
    assert set(re.findall(r'^ *\(?"([a-z_]+)", *(?:data!|$)', findings, re.M)) | set(
        re.findall(r'\("([a-z_]+)", (?:data|fields)', findings)
    ) == set(FINDING_KINDS)
    faults = (NATIVE / "faults.rs").read_text()
    assert set(re.findall(r'FaultKind::\w+(?:\(joint\))? => \("([a-z_]+)"', faults)) == set(PHRASES)


def test_every_finding_is_sentences() -> None:
    assert {each.kind for each in FINDINGS} == set(FINDING_KINDS)
    for each in FINDINGS:
        for style in ("keyword", "command-line"):
            assert re.fullmatch(r"\S.*\.", finding(each, style)), each.kind
        assert "--" not in finding(each)
        assert str(each) == finding(each)
    assert set(CONTRADICTIONS + DOUBTS) < set(FINDING_KINDS)


@pytest.mark.parametrize(
    ("kind", "keyword"),
    [
        ("gravity_contradicted", "gravity"),
        ("negative_mass", "wrench_acts_on"),
        ("known_bodies_too_heavy", "known_tool"),
        ("offset_suspected", "wrench_offset"),
        ("load_unexplained", "unloaded"),
        ("acceleration_not_used", "acceleration_topic"),
        ("option_not_used", "effort_noise"),
        ("delay_doubtful", "delay"),
    ],
)
def test_a_finding_names_options_as_its_reader_writes_them(kind: str, keyword: str) -> None:
    (found,) = (each for each in FINDINGS if each.kind == kind)
    assert f"`{keyword}`" in finding(found, "keyword")
    assert f"--{keyword.replace('_', '-')}" in finding(found, "command-line")
    assert "`" not in finding(found, "command-line")


def test_a_fault_says_what_how_often_and_when_first() -> None:
    fault = DataFault("/joint_states", "effort_not_finite", 12, 3.5, "elbow")
    assert fault.sentence == (
        "/joint_states: 12 × effort of elbow that is not finite, message left out, the first at"
        " 3.500 s."
    )
    assert DataFault("samples", "incomplete", 1).sentence.endswith("left out.")
    for kind in PHRASES:
        assert "{" not in DataFault("/topic", kind, 1, joint="elbow").phrase


def test_advice_names_the_least_motion_that_determines_all() -> None:
    assert motion_advice([]) == []
    assert motion_advice(["Iyy"]) == ["Rotate the tool faster about its y axis, for Iyy."]
    assert motion_advice(["Ixx", "Ixy", "Iyz"]) == [
        "Rotate the tool faster about its x and y or z axes, for Ixx, Ixy and Iyz."
    ]
    mass, com = motion_advice(["mass", "com.z"])
    assert "under gravity" in mass
    assert "its x or y axis" in com


@pytest.mark.parametrize(
    ("kind", "changed", "words"),
    [
        ("gravity_contradicted", {"residual_ratio": 0.135}, "its residuals are 14 % as large"),
        ("gravity_contradicted", {"residual_ratio": 1e-9}, "residuals are under 0.001 % as large"),
        ("acceleration_not_used", {"power_ratio": 2.5}, "residuals 50 % as large, power 250 %"),
        ("delay_corrected", {}, "stamped 37.00 ms later than the motion: this delay was corrected"),
        ("load_unexplained", {}, "30 % of the load (rms 3.0 of 10.0 N m, 43 times the noise)"),
        ("offset_suspected", {}, "force (1.50 ± 0.20, 0.00 ± 0.20, 0.20 ± 0.20) N, moment (0.000"),
        ("delay_corrected", {"applied_s": -0.012}, "stamped 12.00 ms earlier than the motion"),
        ("impossible_inertia", {}, "principal moments -1e-08, 3.5e-08, 9.09e-08 kg m²"),
        ("impossible_mass", {}, "it has an inertia, but a mass of zero."),
        ("impossible_mass", {"mass_kg": -2.0}, "its mass of -2 kg is negative."),
        ("unknown_numbers", {}, "ixx and ixy of <inertia> in its <inertial> are no finite numbers"),
        ("massless", {}, "Links `finger_0`, `finger_1`, `finger_2`, `finger_3`, `finger_4` and 3"),
        ("massless", {"links": ["a"]}, "Link `a` moves but has no mass, and was taken to be"),
        ("mimic_not_followed", {}, "Joint `a` mimics `b`, which mimics it in turn: it was taken"),
        ("mimic_not_followed", {"leader": ""}, "Joint `a` mimics no joint by name"),
        ("part_ignored", {}, "<contact> in <link>, which URDF does not have, was ignored: in `a`"),
        ("part_ignored", {"part": "repeated_element"}, "Every <contact> in <link> but the first"),
        ("part_ignored", {"part": "unknown_attribute"}, "The attribute `contact` of <link>, which"),
    ],
)
def test_a_finding_is_in_words(kind: str, changed: dict[str, Any], words: str) -> None:
    (found,) = (each for each in FINDINGS if each.kind == kind)
    assert words in finding(Finding(kind, {**found.data, **changed}))


def test_the_schema_describes_the_data_of_every_finding() -> None:
    found = replace(doubles.tactile(duration=4.0), findings=FINDINGS)
    assert_fits_schema(result_json.record(found))


def test_remarks_of_a_sound_result_are_none() -> None:
    assert remarks.remarks(doubles.tactile()) == []
