"""Between time steps: a grid that a station's own time does not shift, and an arm that does not go on for long."""

import math

import msgspec
import pytest

from robot.hal.fake import FakePlant
from robot.messages import ArmMode, Heading
from robot.servo_messages import Failure, StrideReply
from tests.support.hand_served import HandServed
from tests.support.stations import fake_rig

N_TICKS, STEP_M, SLOW_M_S = 5, 0.02, 0.05
AHEAD = Heading(heading_rad=math.pi / 2, distance_m=STEP_M, height_m=0.225)
NO_INTENT = ("no_intent",)


def served(**motion):
    rig = fake_rig()
    arm = msgspec.structs.replace(rig.arm, motion=msgspec.structs.replace(rig.arm.motion, **motion))
    rig = msgspec.structs.replace(rig, arm=arm)
    server = HandServed(rig, FakePlant(arm=arm, scenario=rig.scenario, rig=rig.rig))
    server.seed()
    return server


def ticks_of(server, n_decided):
    """Return how many ticks passed from one time step's end to the next one's."""
    tick_ns = round(fake_rig().rig.tick_s * 1e9)
    before_ns = server.loop.state.stamp_ns
    after_ns = server.stride(AHEAD, n_ticks=N_TICKS, n_decided=n_decided).after.stamp_ns
    return (after_ns - before_ns) // tick_ns


def test_what_a_station_takes_to_decide_is_part_of_its_time_step():
    server = served()
    assert [ticks_of(server, n) for n in (0, 1, 2, 0, 1)] == [N_TICKS] * 5


def test_a_station_that_takes_more_than_half_a_time_step_gets_half_of_one_more():
    server = served()
    server.stride(AHEAD, n_ticks=N_TICKS)
    assert [ticks_of(server, n) for n in (3, 5, 0)] == [6, 8, 5]


def test_a_decision_in_good_time_begins_when_any_other_does():
    at_once, later = served(), served()
    for n_decided in (1, 0, 1, 1, 0, 0, 1):
        one = at_once.stride(AHEAD, n_ticks=N_TICKS)
        other = later.stride(AHEAD, n_ticks=N_TICKS, n_decided=n_decided)
        assert other.target_m == pytest.approx(one.target_m, abs=1e-4)
        assert other.after.q_rad == pytest.approx(one.after.q_rad, abs=1e-4)


def test_a_time_step_of_one_tick_takes_one():
    server = served()
    server.stride(AHEAD, n_ticks=1)
    before_ns = server.loop.state.stamp_ns
    assert server.stride(AHEAD, n_ticks=1).after.stamp_ns - before_ns == round(fake_rig().rig.tick_s * 1e9)


def test_the_arm_goes_on_between_time_steps_until_the_intent_is_too_old_and_not_a_tick_longer():
    server = served(speed_m_s=SLOW_M_S)
    for _ in range(6):
        server.stride(AHEAD, n_ticks=N_TICKS)
    led_to_m = server.loop.report(None, is_begun=True).target_m
    age_ticks, n_left = round(fake_rig().arm.motion.intent_max_age_s / fake_rig().rig.tick_s), N_TICKS
    for _ in range(n_left, age_ticks - 1):
        before_m = server.loop.state.tcp_position_m
        after_m = server.wait(1).tcp_position_m
        assert math.dist(before_m, after_m) == pytest.approx(SLOW_M_S * fake_rig().rig.tick_s, rel=0.1)
        assert server.loop.report(None, is_begun=True).limiters != NO_INTENT
    stopped_at_m = server.wait(1).tcp_position_m
    braked = server.loop.report(None, is_begun=True)
    assert braked.limiters == NO_INTENT
    rest_m = server.wait(30).tcp_position_m
    lag_m = SLOW_M_S * 0.06
    assert math.dist(stopped_at_m, rest_m) < 0.001 + lag_m
    assert math.dist(rest_m, led_to_m) > STEP_M
    assert server.wait(100).tcp_position_m == pytest.approx(rest_m, abs=1e-6)
    assert server.replies() == []


def test_a_long_time_step_leaves_nothing_to_go_on_with():
    server = served(speed_m_s=SLOW_M_S)
    server.stride(AHEAD, n_ticks=12)
    server.wait(1)
    assert server.loop.report(None, is_begun=True).limiters == NO_INTENT


def test_after_a_rest_the_next_time_step_is_a_whole_one():
    server = served()
    server.stride(AHEAD, n_ticks=N_TICKS)
    server.wait(50)
    assert ticks_of(server, 0) == N_TICKS


def test_what_latches_while_a_time_step_waits_to_begin_is_told_and_the_step_refused():
    server = served()
    server.plant.arm.mode = ArmMode.PROTECTIVE_STOP
    at_rad = server.wait(1).q_rad
    server.begin(AHEAD, n_ticks=N_TICKS)
    told, refused = server.replies()
    assert isinstance(told, StrideReply)
    assert (told.stride.verdict.reason, told.is_asked) == ("arm_mode", False)
    assert isinstance(refused, Failure)
    assert server.loop.state.q_rad == at_rad


def test_a_button_that_is_held_until_the_reset_is_not_pressed_in_the_next_epoch():
    server = served()
    button = fake_rig().scenario.buttons[0]
    server.plant.arm.digital_in = 1 << button.input
    lit = server.wait(2).digital_out
    assert lit & 1 << button.lamp_output
    dark = server.begin_epoch(1)
    assert not dark & 1 << button.lamp_output
    server.wait(2)  # the finger is on it still
    server.plant.arm.digital_in = 0
    server.plant.resetter.reset(seed=1, epoch=1, digital_out=dark)
    server.seed()
    assert server.wait(2).digital_out == dark
