"""Stops and sweeps worked out by hand."""

import math

import pytest
from msgspec.structs import replace

from config.loader import load_arm
from robot.safety import Braking
from robot.safety.stopping import stop_end, stop_span, stop_time_s
from robot.safety.sweep import Sweep

ARM = load_arm("ur5e")
REST = (0.0,) * 6


def vec(**joints):
    return tuple(joints.get(name, 0.0) for name in "abcdef")


def test_a_stop_brakes_like_the_twins_and_at_the_worst_half_as_hard():
    assert Braking() == Braking(deceleration_rad_s2=16.0, least_share=0.5)
    assert Braking().least_rad_s2 == 8.0
    assert Braking(deceleration_rad_s2=10.0, least_share=0.25).least_rad_s2 == 2.5


@pytest.mark.parametrize("i", range(6))
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_the_fastest_joint_says_how_long_a_stop_takes(i, sign):
    qd = tuple(sign * 3.2 if k == i else 0.1 for k in range(6))
    assert stop_time_s(qd, 16.0) == pytest.approx(0.2)
    end = stop_end((1.0,) * 6, qd, 16.0)
    assert end == pytest.approx(tuple(1.0 + v * 0.1 for v in qd))


def test_a_span_reaches_from_the_soonest_stop_to_the_latest_of_what_is_commanded_and_measured():
    span = stop_span(
        (REST, vec(a=3.2, c=-1.6)), (vec(a=-0.1, c=0.1, e=0.5), vec(a=1.6)), Braking(), tick_s=0.01
    )  # fmt: skip
    # Commanded: 0.2 s and 0.32 rad, the first tick's half off at once, 0.64 rad at half the braking.
    assert span[0] == pytest.approx((-0.1 + 0.08 - 0.008, 0.64))
    assert span[2] == pytest.approx((-0.32, 0.1))
    assert span[4] == pytest.approx((0.0, 0.5))
    assert span[1] == span[3] == span[5] == (0.0, 0.0)


def test_a_span_of_what_alone_is_commanded_begins_a_tick_sooner_than_an_even_stop():
    span = stop_span((REST, vec(b=3.2)), (REST, vec(b=3.2)), Braking(), tick_s=0.01)
    assert span[1] == pytest.approx((0.32 - 0.016, 0.64))


def test_a_stop_shorter_than_a_tick_may_end_where_it_began():
    span = stop_span((REST, vec(d=0.08)), (REST, vec(d=0.08)), Braking(), tick_s=0.01)
    assert span[3] == pytest.approx((0.0, 0.0004), abs=1e-12)


@pytest.mark.parametrize(
    "ask",
    [
        lambda: stop_end(REST[:5], REST, 16.0),
        lambda: stop_span((REST, REST), (REST, REST[:5]), Braking(), tick_s=0.01),
    ],
)
def test_joints_of_another_number_are_an_error(ask):
    with pytest.raises(ValueError, match="zip"):
        ask()


THICK = 0.075
TIP = math.hypot(0.1628 + 0.015, THICK)
FAR = {
    "a": 0.425 + 0.3922 + 0.1333 + 0.0997 + 0.0996 + TIP,
    "d": 0.0997 + 0.0996 + TIP,
    "e": 0.0996 + TIP,
    "f": THICK,
}


@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize(
    ("turn", "bound_m"),
    [
        ({"a": 0.5}, 0.5 * FAR["a"]),
        ({"b": 0.5}, 0.5 * (0.425 + THICK + 0.3922 + THICK + FAR["d"])),
        ({"c": 0.5}, 0.5 * (0.3922 + THICK + FAR["d"])),
        ({"d": 0.5}, 0.5 * FAR["d"]),
        ({"e": 0.5}, 0.5 * FAR["e"]),
        ({"f": 0.5}, 0.5 * FAR["f"]),
        ({"b": 0.5, "c": -0.5}, 0.5 * (0.425 + THICK)),
        ({"c": 0.5, "d": -0.5}, 0.5 * (0.3922 + THICK)),
        ({"b": 0.5, "c": -0.25, "d": -0.125}, 0.5 * (0.425 + THICK) + 0.25 * (0.3922 + THICK) + 0.125 * FAR["d"]),
    ],
)
def test_the_bound_of_a_turn_is_the_reaches_times_the_turns_of_the_links(turn, bound_m, sign):
    assert Sweep(ARM).bound_m(vec(**{k: sign * v for k, v in turn.items()})) == pytest.approx(bound_m)


def bent(*, first=0.1, second=0.0, **tool):
    """The arm with another twist beside its upper arm, offsets along and across everywhere, and another tool."""
    rows = [replace(row, a_m=0.1 * (i + 1), d_m=0.05 * (i + 1)) for i, row in enumerate(ARM.joints)]
    rows[1], rows[2] = replace(rows[1], alpha_rad=first), replace(rows[2], alpha_rad=second)
    return replace(ARM, joints=tuple(rows), tool=replace(ARM.tool, **tool))


@pytest.mark.parametrize(("first", "second"), [(0.1, 0.0), (0.0, 0.1), (0.1, 0.1)])
def test_without_parallel_axes_every_turn_reaches_as_far_as_what_comes_after(first, second):
    sweep = Sweep(bent(first=first, second=second))
    rows = [math.hypot(0.1 * k, 0.05 * k) for k in range(1, 7)]
    for i in range(5):
        turn = tuple(-0.5 if k == i else 0.0 for k in range(6))
        assert sweep.bound_m(turn) == pytest.approx(0.5 * (0.1 * (i + 1) + sum(rows[i + 1 :]) + TIP))
    assert sweep.bound_m(vec(f=0.5)) == pytest.approx(0.5 * math.hypot(0.6, THICK))
    assert sweep.bound_m(vec(f=-0.5)) == pytest.approx(0.5 * math.hypot(0.6, THICK))


@pytest.mark.parametrize(
    ("radius_m", "stroke_m", "aside_m"),
    [(0.09, 0.085, 0.09), (0.02, 0.085, math.hypot(0.032, 0.06)), (0.02, 0.2, 0.1 + 0.012)],
)
def test_what_is_farthest_aside_is_a_link_the_palm_or_the_open_fingers(radius_m, stroke_m, aside_m):
    thin = replace(
        ARM,
        capsules=tuple(replace(c, radius_m=radius_m / (1 + i)) for i, c in enumerate(ARM.capsules)),
        tool=replace(ARM.tool, stroke_m=stroke_m),
    )
    assert Sweep(thin).bound_m(vec(f=1.0)) == pytest.approx(aside_m)
    assert Sweep(thin).bound_m(vec(e=1.0)) == pytest.approx(0.0996 + math.hypot(0.1778, aside_m))


def test_links_behind_the_base_may_lie_on_either_side_of_it():
    rows = [replace(row, a_m=abs(row.a_m)) for row in ARM.joints]
    assert Sweep(replace(ARM, joints=tuple(rows))).bound_m((0.1,) * 6) == Sweep(ARM).bound_m((0.1,) * 6)


def test_an_offset_of_the_base_itself_reaches_out_too():
    parallel, tip = Sweep(bent(first=0.0)), sum(math.hypot(0.1 * k, 0.05 * k) for k in range(2, 7)) + TIP
    assert parallel.bound_m(vec(a=0.5)) == pytest.approx(0.5 * (0.1 + tip))


def test_turns_of_another_number_are_an_error():
    with pytest.raises((TypeError, ValueError), match=r"matching|unpack"):
        Sweep(ARM).bound_m((0.1,) * 5)
