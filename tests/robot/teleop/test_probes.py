"""The probe list: short, slow, inside a box that is never wider than what was allowed before."""

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from config.loader import resolve
from robot.errors import SafetyError
from robot.messages import JointTarget, Twist
from robot.motion.follower import ALIGN_RAD
from robot.teleop.probes import (
    MARGIN_M,
    MOST_M_S,
    ROOM_M,
    STEP_S,
    UPRIGHT_RAD,
    WALL_M,
    Kind,
    asks_of,
    plan,
    probe_rig_of,
)

ROOM = ((0.24, -0.36, 0.03), (0.64, 0.36, 0.32))
MIDDLE = (0.44, 0.05, 0.225)
Q = (2.8, -1.7, 2.0, -1.8, -1.57, 6.2)
PLACES = st.tuples(*(st.floats(low - 0.02, high + 0.02) for low, high in zip(*ROOM, strict=True)))


def way_m(probe):
    """Where the asks of a probe lead, by themselves."""
    twists = [ask for ask in asks_of(probe, Q) if isinstance(ask, Twist)]
    return tuple(sum(t.linear_m_s[i] * STEP_S for t in twists) for i in range(3))


@given(PLACES)
def test_every_probe_is_short_slow_and_inside_of_its_box_or_refused(tool_m):
    try:
        probes, box = plan(tool_m, ROOM, tilt_rad=0.0)
    except SafetyError:
        return
    for low, at, high, room_low, room_high in zip(box.low_m, tool_m, box.high_m, *ROOM, strict=True):
        assert room_low <= low + 1e-9 < at < high <= room_high + 1e-9
    assert [p.kind for p in probes][-1] is Kind.SILENCE
    for probe in probes:
        asked = asks_of(probe, Q)
        assert all(math.hypot(*a.linear_m_s) <= MOST_M_S for a in asked if isinstance(a, Twist))
        assert math.hypot(*way_m(probe)) <= 0.05 + 1e-9
        ends = [t + w for t, w in zip(tool_m, way_m(probe), strict=True)]
        is_inside = all(a < e < b for a, e, b in zip(box.low_m, ends, box.high_m, strict=True))
        assert is_inside is (probe.kind is not Kind.WALL)


@given(PLACES)
def test_the_wall_stands_three_centimetres_beside_the_tool_where_it_is_driven_at(tool_m):
    try:
        probes, box = plan(tool_m, ROOM, tilt_rad=0.0)
    except SafetyError:
        return
    (wall,) = [p for p in probes if p.kind is Kind.WALL]
    face = box.high_m[1] if wall.along[1] > 0.0 else box.low_m[1]
    assert abs(face - tool_m[1]) == pytest.approx(WALL_M)
    assert math.hypot(*way_m(wall)) > WALL_M + 0.01


@pytest.mark.parametrize(
    ("axis", "corner", "least_m"),
    [
        (0, 0, ROOM_M),
        (0, 1, ROOM_M),
        (1, 0, WALL_M + MARGIN_M),
        (1, 1, WALL_M + MARGIN_M),
        (2, 0, MARGIN_M),
        (2, 1, MARGIN_M),
    ],
)
def test_so_much_room_is_enough_and_less_is_refused(axis, corner, least_m):
    sign = 1.0 if corner == 0 else -1.0
    for off_m, is_refused in ((1e-9, False), (-1e-9, True)):
        tool_m = list(MIDDLE)
        tool_m[axis] = ROOM[corner][axis] + sign * (least_m + off_m)
        if is_refused:
            with pytest.raises(SafetyError, match=f"along {'xyz'[axis]}"):
                plan(tuple(tool_m), ROOM, tilt_rad=0.0)
        else:
            plan(tuple(tool_m), ROOM, tilt_rad=0.0)


@pytest.mark.parametrize(("z_m", "up"), [(0.225, 1.0), (0.2649, 1.0), (0.2651, -1.0), (0.30, -1.0)])
def test_the_tool_goes_up_where_there_is_room_and_down_where_there_is_none(z_m, up):
    probes, _ = plan((0.44, 0.0, z_m), ROOM, tilt_rad=0.0)
    (vertical,) = [p for p in probes if p.name == "z"]
    assert vertical.along == (0.0, 0.0, up)
    assert ("up" if up > 0.0 else "down") in vertical.told


@pytest.mark.parametrize("tilt", [math.nextafter(UPRIGHT_RAD, 1.0), 0.1, math.nan])
def test_a_tilted_tool_which_motion_would_right_first_is_refused(tilt):
    plan(MIDDLE, ROOM, tilt_rad=UPRIGHT_RAD)
    with pytest.raises(SafetyError, match="points straight down"):
        plan(MIDDLE, ROOM, tilt_rad=tilt)
    assert UPRIGHT_RAD < ALIGN_RAD


def test_one_joint_alone_is_turned_by_a_tenth_at_most():
    probes, _ = plan(MIDDLE, ROOM, tilt_rad=0.0)
    turns = [ask.q_rad for ask in asks_of(probes[0], Q) if isinstance(ask, JointTarget)]
    assert {q[:5] for q in turns} == {Q[:5]}
    assert max(abs(q[5] - Q[5]) for q in turns) <= 0.1 + 1e-12
    steps = [b[5] - a[5] for a, b in pairwise(turns)]
    assert max(steps) <= 0.1 * STEP_S + 1e-12


@pytest.mark.parametrize("name", ["attended", "unattended"])
def test_the_rig_for_the_list_is_narrower_than_its_profile_in_everything_and_wider_in_nothing(name):
    from msgspec.structs import replace

    resolved = resolve(rig="virtual_lab")
    resolved = replace(resolved, rig=replace(resolved.rig, profile=name))
    _, box = plan(MIDDLE, ROOM, tilt_rad=0.0)
    before, after = resolved.profile, probe_rig_of(resolved, box).profile
    for key in ("tcp_m_s", "elbow_m_s", "flange_m_s"):
        assert getattr(after.speeds, key) <= min(MOST_M_S, getattr(before.speeds, key))
    assert after.workspace.boxes == (*before.workspace.boxes, box)
    assert all(b.speed_rad_s < a.speed_rad_s for a, b in zip(before.joints, after.joints, strict=True))
    same = {"name": before.name, "speeds": before.speeds, "workspace": before.workspace, "joints": before.joints}
    assert replace(after, **same) == before
    assert replace(after.workspace, boxes=before.workspace.boxes) == before.workspace
