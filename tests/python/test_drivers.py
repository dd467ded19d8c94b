"""Topics with the names that drivers give them: the option that reads each is proposed."""

from pathlib import Path

import numpy as np
import pytest

import tactid
from recorded_arm import FIXED, ur5e
from recordings import description, joint_states, state, wrenches, write_bag

WRENCHES = {
    "/franka_state_controller/F_ext": ("wrench_is", "contact"),
    "/robot/external_wrench_in_stiffness_frame": ("wrench_is", "contact"),
    "/O_F_ext_hat_K": ("wrench_axes", "base_link"),
    "/my_gen3/tool_external_wrench": ("wrench_is", "contact"),
}
EFFORTS = {
    "/franka/external_joint_torques": ("efforts_are", "external"),
    "/lbr/external_torque": ("efforts_are", "external"),
    "/dsr01/actual_ejt": ("efforts_are", "external"),
}


def proposals(found: tactid.Identification) -> list[tuple[str, str]]:
    kind = "topic_recognized"
    assert all(each.severity == "notes" for each in found.findings if each.kind == kind)
    return [
        (each.data["option"], each.data["value"]) for each in found.findings if each.kind == kind
    ]


@pytest.mark.parametrize("topic", [*WRENCHES, *EFFORTS])
def test_the_option_of_a_known_topic_is_proposed(topic: str, tmp_path: Path) -> None:
    s = state(FIXED, 6.0, 100.0)
    is_wrench = topic in WRENCHES
    joints = joint_states(s) if is_wrench else joint_states(s, topic=topic, effort=s.effort)
    sensor = wrenches(s.time, s.wrench, topic=topic) if is_wrench else []
    bag = write_bag(tmp_path / "bag", [description(), *joints, *sensor])
    option, value = (WRENCHES | EFFORTS)[topic]
    found = tactid.identify(bag)
    assert proposals(found) == [(option, value)]
    (sentence,) = (str(each) for each in found.findings if each.kind == "topic_recognized")
    assert f"`{value}` as `{option}`" in sentence
    # Whatever the user says about it settles it.
    given = {"wrench_is": "raw", "wrench_axes": "tool0", "efforts_are": "measured"}[option]
    assert proposals(tactid.identify(bag, **{option: given})) == []


@pytest.mark.parametrize(("noise", "is_proposed"), [(3.0, True), (0.01, False)])
def test_a_weight_is_proposed_where_the_data_do_not_exclude_it(
    noise: float, is_proposed: bool, tmp_path: Path
) -> None:
    s = state(FIXED, 6.0, 100.0)
    wrench = s.wrench + noise * np.random.default_rng(0).normal(size=s.wrench.shape)
    topic = "/force_torque_sensor_broadcaster/wrench"
    messages = [description(), *joint_states(s), *wrenches(s.time, wrench, topic=topic)]
    found = tactid.identify(write_bag(tmp_path / "bag", messages))
    assert proposals(found) == ([("wrench_is", "without-weight")] if is_proposed else [])


@pytest.mark.parametrize(
    "topic", ["/wrench", "/my_force_torque_sensor_broadcaster/wrench", "/tool_get_tool_force"]
)
def test_other_topics_have_no_proposal(topic: str, tmp_path: Path) -> None:
    s = state(FIXED, 6.0, 100.0)
    messages = [description(), *joint_states(s), *wrenches(s.time, s.wrench, topic=topic)]
    assert proposals(tactid.identify(write_bag(tmp_path / "bag", messages))) == []


def test_the_columns_of_rtde_have_a_proposal(tmp_path: Path) -> None:
    s = state(FIXED, 6.0, 125.0)
    q = [f"actual_q_{k}" for k in range(6)]
    force = [f"actual_TCP_force_{k}" for k in range(6)]
    table = tmp_path / "rtde.csv"
    rows = np.column_stack([s.time + 1, s.q, s.wrench])
    np.savetxt(table, rows, delimiter=",", header=",".join(["timestamp", *q, *force]), comments="")
    urdf = tmp_path / "arm.urdf"
    urdf.write_text(ur5e(), encoding="utf-8")
    assert proposals(tactid.identify(table, urdf=urdf)) == [("wrench_axes", "base")]
    assert proposals(tactid.identify(table, urdf=urdf, wrench_axes="base")) == []


def test_the_columns_of_external_torques_have_a_proposal(tmp_path: Path) -> None:
    s = state(FIXED, 6.0, 100.0)
    names = [f"{name}_{k}" for name in ("q", "external_torque") for k in range(6)]
    table = tmp_path / "fri.csv"
    columns = np.column_stack([s.time, s.q, s.effort])
    np.savetxt(table, columns, delimiter=",", header=",".join(["time", *names]), comments="")
    (tmp_path / "arm.urdf").write_text(ur5e())
    found = tactid.identify(table, urdf=tmp_path / "arm.urdf")
    assert proposals(found) == [("efforts_are", "external")]
