"""What a probe's sights say: each figure at its bound passes, and beyond it does not."""

import math

import msgspec
import pytest

from config.limits import Stopping
from robot.hal.sight import Sight
from robot.messages import ArmMode
from robot.teleop.probe_judge import Carried, Marks, judge_probe
from robot.teleop.probes import Kind, Probe

STOPPING = Stopping(distance_m=0.1, time_s=0.5, deceleration_m_s2=2.0)
START_M = (0.4, 0.1, 0.2)
MS = 1_000_000
LINE = Probe(name="y", kind=Kind.LINE, told="", along=(0.0, 1.0, 0.0))
WALL = Probe(name="wall", kind=Kind.WALL, told="", along=(0.0, -1.0, 0.0))
RELEASE = Probe(name="release", kind=Kind.RELEASE, told="", along=(0.0, 1.0, 0.0))
SILENCE = Probe(name="silence", kind=Kind.SILENCE, told="", along=(0.0, 1.0, 0.0))
TURN = Probe(name="wrist_3", kind=Kind.TURN, told="")


def sight(t_ms, off_m=(0.0, 0.0, 0.0), *, speed=0.0, q5=0.0, q0=0.0, qd=0.0):
    x, y, z = (a + b for a, b in zip(START_M, off_m, strict=True))
    return Sight(
        seen_ns=round(t_ms * MS), plant_s=t_ms / 1e3, q_rad=(q0, 0.0, 0.0, 0.0, 0.0, q5), qd_rad_s=(qd, *(0.0,) * 5),
        tcp_m=(x, y, z), tcp_speed_m_s=(0.0, speed, 0.0), digital_out=0, mode=ArmMode.RUNNING, is_program_running=True,
    )  # fmt: skip


def marks(**values):
    plain = Marks(
        begun_ns=0, last_asked_ns=1000 * MS, released_ns=1000 * MS, rested_ns=2000 * MS, ended_ns=3000 * MS,
        start_m=START_M,
    )  # fmt: skip
    return msgspec.structs.replace(plain, **values)


def judged(probe, sights, **values):
    return judge_probe(Carried(probe=probe, marks=marks(**values), sights=tuple(sights)), STOPPING)


def figures(probe, sights, **values):
    return {row.name: row for row in judged(probe, sights, **values)}


def went(probe, far_m, *, aside_m=0.0, back_m=0.0):
    """Out, a little aside half-way, and back but for something."""
    x, y, z = probe.along
    return [
        sight(0.0),
        sight(500.0, (x * far_m / 2 + aside_m, y * far_m / 2, z * far_m / 2), speed=0.04),
        sight(1500.0, (x * far_m, y * far_m, z * far_m)),
        sight(2900.0, (0.0, back_m, 0.0)),
    ]


@pytest.mark.parametrize(
    ("figure", "good", "bad"),
    [
        ("y_way_mm", {"far_m": 0.0381}, {"far_m": 0.0379}),
        ("y_way_mm", {"far_m": 0.0419}, {"far_m": 0.0421}),
        ("y_off_line_mm", {"far_m": 0.04, "aside_m": 0.0029}, {"far_m": 0.04, "aside_m": 0.0031}),
        ("y_off_line_mm", {"far_m": 0.04, "aside_m": -0.0029}, {"far_m": 0.04, "aside_m": -0.0031}),
        ("y_back_off_mm", {"far_m": 0.04, "back_m": 0.0019}, {"far_m": 0.04, "back_m": 0.0021}),
    ],
)
def test_a_line_is_as_long_as_asked_straight_and_ends_where_it_began(figure, good, bad):
    came = figures(LINE, went(LINE, **good))
    assert all(row.ok for row in came.values()), came
    assert [row.name for row in figures(LINE, went(LINE, **bad)).values() if not row.ok] == [figure]


@pytest.mark.parametrize(("speed", "ok"), [(0.05, True), (math.nextafter(0.05, 1.0), False), (math.nan, False)])
def test_no_tool_is_faster_than_fifty_millimetres_a_second(speed, ok):
    sights = went(LINE, 0.04)
    sights[1] = msgspec.structs.replace(sights[1], tcp_speed_m_s=(0.0, 0.0, -speed))
    assert figures(LINE, sights)["y_speed_mm_s"].ok is ok


@pytest.mark.parametrize(("far_m", "ok"), [(0.0199, False), (0.0201, True), (0.0299, True), (0.0301, False)])
def test_a_drive_at_the_wall_ends_before_it_and_not_far_from_it(far_m, ok):
    assert figures(WALL, went(WALL, far_m))["wall_reached_mm"].ok is ok


def stopped(rest_ms, way_m, *, since_ms=1000.0):
    """Under way by 25 mm, then at rest so long after, so much farther."""
    return [
        sight(0.0),
        sight(since_ms, (0.0, 0.025, 0.0), speed=0.04, qd=0.1),
        sight(since_ms + rest_ms - 4.0, (0.0, 0.025 + way_m, 0.0), qd=0.02),
        sight(since_ms + rest_ms, (0.0, 0.025 + way_m, 0.0)),
        sight(1990.0, (0.0, 0.025 + way_m, 0.0)),
        sight(2500.0, (0.0, 0.01, 0.0), qd=0.2),
        sight(2990.0),
    ]


@pytest.mark.parametrize(
    ("rest_ms", "way_m", "bad"),
    [
        (500.0, 0.002, []),
        (504.0, 0.002, ["release_rest_ms"]),
        (100.0, 0.0249, []),
        (100.0, 0.0251, ["release_stop_mm"]),
    ],
)
def test_a_release_rests_in_the_limits_files_time_and_way(rest_ms, way_m, bad):
    came = figures(RELEASE, stopped(rest_ms, way_m))
    assert [row.name for row in came.values() if not row.ok] == bad


def test_an_arm_that_goes_on_after_a_release_never_rested():
    sights = [sight(0.0), sight(1000.0, (0.0, 0.025, 0.0), qd=0.1), sight(1990.0, (0.0, 0.06, 0.0), qd=0.1)]
    came = figures(RELEASE, sights)
    assert came["release_rest_ms"].value == math.inf
    assert not came["release_rest_ms"].ok
    assert not came["release_stop_mm"].ok


def test_an_arm_that_was_not_under_way_shows_no_stop():
    came = figures(RELEASE, [sight(0.0), sight(1000.0), sight(1900.0), sight(2900.0)])
    assert not came["release_under_way_mm"].ok


@pytest.mark.parametrize(("rest_ms", "ok"), [(620.0, True), (624.0, False)])
def test_silence_may_last_the_ramp_longer_and_must_latch(rest_ms, ok):
    came = figures(SILENCE, stopped(rest_ms, 0.002), refusal="stale_intent", is_latched=True)
    assert came["silence_rest_ms"].ok is ok
    assert came["silence_latched"].ok
    assert not figures(SILENCE, stopped(100.0, 0.002), is_latched=False)["silence_latched"].ok


@pytest.mark.parametrize(
    ("q5", "q0", "bad"),
    [
        (0.1, 0.0, []), (0.0951, 0.0, []), (0.0949, 0.0, ["turn_rad"]), (0.1051, 0.0, ["turn_rad"]),
        (0.1, 0.0051, ["other_joints_rad"]),
    ],
)  # fmt: skip
def test_a_turn_is_of_one_joint_and_as_far_as_asked(q5, q0, bad):
    came = figures(TURN, [sight(0.0), sight(1500.0, q5=q5, q0=q0), sight(2900.0)])
    assert [row.name.removeprefix("wrist_3_") for row in came.values() if not row.ok] == bad


@pytest.mark.parametrize("probe", [LINE, SILENCE], ids=lambda probe: probe.name)
def test_a_probe_is_done_at_its_end_which_is_a_refusal_of_silence_alone(probe):
    done = {why: Carried(probe=probe, marks=marks(refusal=why), sights=()).is_done for why in ("", "stale_intent")}
    assert done == {"": probe is LINE, "stale_intent": probe is SILENCE}


def test_a_refused_step_and_an_arm_that_was_not_seen_fail_whatever_else_came():
    came = figures(LINE, went(LINE, 0.04), refusal="fence: beyond")
    assert not came["y_refused"].ok
    assert came["y_refused"].details == {"by": "fence: beyond"}
    assert [row.ok for row in judged(LINE, [])] == [False]
