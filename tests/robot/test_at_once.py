"""What the gate passes at once, every check passes: the shortcut may be too strict, never too lax."""

import numpy as np
import pytest
from msgspec.structs import replace

from config.loader import load_arm, load_scenario
from robot.chain import ToolChain
from robot.hal.fake import FakeArm
from robot.messages import ArmMode, GripCommand
from robot.motion.follower import Follower
from robot.safety import Braking, Clearance, CrossCheck, Gate, GateLimits, Hard, Reason, StopCheck
from robot.safety.at_once import FREE, PLAIN, UNSURE
from robot.safety.cross_check import tool_speed
from tests.support.profiles import envelope
from tests.support.stations import arm_state, command

ARM, SCENARIO = load_arm("ur5e"), load_scenario("paper")
CHAIN, DT = ToolChain(ARM), 0.01
TICK_NS = round(DT * 1e9)
LIMITS = GateLimits.of(ARM, FakeArm(arm=ARM, tick_s=DT).spec, table_m=0.0, tick_s=DT)
OPEN = GripCommand(opening_m=0.05, force_n=ARM.tool.force_n[0], speed_m_s=ARM.tool.speed_m_s[0])
PERCEPT_NS, INTENT_NS = LIMITS.percept_max_age_ns, LIMITS.intent_max_age_ns


class Arm:
    def write(self, sent):
        self.sent = sent

    def stop(self):
        return True


def vec(values):
    return tuple(float(v) for v in values)


def made(*, with_stops=True, with_cross=True):
    hard, held = Hard(), envelope(DT)
    stops = StopCheck(
        ARM, Clearance(ARM, SCENARIO, hard=hard), limits=LIMITS, tick_s=DT, braking=Braking(), envelope=held
    )
    cross = CrossCheck(CHAIN) if with_cross else None
    gate = Gate(
        arm=Arm(), limits=LIMITS, envelope=held, chain=CHAIN, stops=stops if with_stops else None, cross=cross
    )  # fmt: skip
    gate.said = []
    at_once = gate._at_once
    gate._at_once = lambda *asked: gate.said.append(at_once(*asked)) or gate.said[-1]
    return gate


def one_by_one(gate):
    gate._at_once = lambda *_: UNSURE
    return gate


class Ride:
    """A follower on its way, its arm a tick behind it, and the gates that are to judge each command alike."""

    def __init__(self, *gates):
        self.gates, self.follower = gates, Follower(ARM, envelope=envelope(DT), tick_s=DT)
        self.k, self.q = 0, self.follower.q_rad
        self.state = arm_state(self.q)
        for gate in gates:
            gate.seed(self.state)

    def tick(self, **odd):
        """Let each gate judge one command more, this and that of it odd, and return what they all say."""
        self.k += 1
        before, self.q = self.q, self.follower.step()
        qd = vec(np.subtract(self.q, before) / DT)
        now_ns = self.k * TICK_NS
        state = arm_state(before, stamp_ns=now_ns, qd_rad_s=qd)
        state = replace(state, tcp_speed_m_s=tool_speed(CHAIN, state))
        asked = command(self.q, sequence=self.k, stamp_ns=now_ns)
        asked = replace(asked, grip=OPEN)
        for name, value in odd.items():
            if name in ("q_rad", "sequence", "grip", "digital_out"):
                asked = replace(asked, **{name: value(asked) if callable(value) else value})
            elif name == "command_ns":
                asked = replace(asked, stamp_ns=now_ns + value)
            elif name == "state_ns":
                state = replace(state, stamp_ns=now_ns + value)
            elif name == "late_ns":
                now_ns += value
                state, asked = replace(state, stamp_ns=now_ns), replace(asked, stamp_ns=now_ns)
            else:
                state = replace(state, **{name: value(state) if callable(value) else value})
        verdicts = [gate.write(asked, state, now_ns=now_ns) for gate in self.gates]
        assert all(repr(verdict) == repr(verdicts[0]) for verdict in verdicts)  # what is not a number is not its like
        return verdicts[0]

    def go(self, n, target_m=(0.40, 0.12, 0.2)):
        assert self.follower.aim(target_m, ARM.tool_yaw_rad)
        for _ in range(n):
            assert self.tick() is None


def beyond(i, by):
    return lambda asked: tuple(v + by if k == i else v for k, v in enumerate(asked.q_rad))


AGE_NS = LIMITS.state_max_age_ns
ODD = [
    ({"sequence": 99}, Reason.SEQUENCE),
    ({"sequence": lambda asked: asked.sequence - 1}, Reason.SEQUENCE),
    ({"state_ns": 1}, Reason.STALE_STATE),
    ({"state_ns": -AGE_NS - 1}, Reason.STALE_STATE),
    ({"state_ns": -AGE_NS}, None),
    ({"command_ns": 1}, Reason.STALE_STATE),
    ({"command_ns": -AGE_NS - 1}, Reason.STALE_STATE),
    ({"command_ns": -AGE_NS}, None),
    ({"mode": ArmMode.STOPPED}, Reason.ARM_MODE),
    ({"grip": replace(OPEN, opening_m=0.2)}, Reason.GRIP),
    ({"grip": replace(OPEN, opening_m=0.04)}, None),
    ({"digital_out": LIMITS.output_mask + 1}, Reason.OUTPUTS),
    ({"digital_out": LIMITS.output_mask}, None),
    ({"tcp_force_n": (0.0, 0.0, LIMITS.impact_max_n + 1.0)}, Reason.FORCE),
    ({"tcp_force_n": (float("nan"), 0.0, 0.0)}, Reason.FORCE),
    ({"tcp_force_n": (0.0, 0.0, LIMITS.hard_n + 0.1)}, None),
    ({"tcp_speed_m_s": (float("nan"), 0.0, 0.0)}, Reason.KINEMATICS),
    ({"q_rad": beyond(1, float("nan"))}, Reason.NOT_FINITE),
    ({"q_rad": beyond(2, 0.1)}, Reason.JOINT_SPEED),
    ({"q_rad": beyond(3, 0.02)}, Reason.JOINT_ACCELERATION),
    ({"q_rad": lambda asked: asked.q_rad[:5]}, Reason.MALFORMED),
    ({"q_rad": lambda _: ("a",) * 6}, Reason.MALFORMED),
    ({"q_rad": lambda asked: vec(np.add(asked.q_rad, LIMITS.tracking_error_rad))}, Reason.JOINT_SPEED),
    ({"late_ns": INTENT_NS}, Reason.STALE_INTENT),
    ({}, None),
]  # fmt: skip


@pytest.fixture(scope="module")
def pair():
    return made(), one_by_one(made())


@pytest.mark.parametrize(("odd", "reason"), ODD)
def test_what_is_odd_in_one_respect_is_refused_as_the_checks_one_by_one_refuse_it(pair, odd, reason):
    ride = Ride(*pair)
    pair[0].said.clear()
    ride.go(12)
    assert pair[0].said[-4:].count(UNSURE) == 0, "on an honest way it must save its time"
    verdict = ride.tick(**odd)
    assert (None if verdict is None else verdict.reason) == (None if reason is None else reason.value)
    if reason is None:
        ride.go(6)


def test_motion_longer_after_a_percept_than_may_be_is_refused(pair):
    ride = Ride(*pair)
    ride.go(8)
    for gate in pair:
        gate.perceive(ride.k * TICK_NS + TICK_NS - PERCEPT_NS)
    assert ride.tick() is None
    for gate in pair:
        gate.perceive(ride.k * TICK_NS + TICK_NS - PERCEPT_NS - 1)
    assert ride.tick().reason == Reason.STALE_PERCEPT.value
    ride = Ride(*pair)
    ride.go(8)
    for gate in pair:
        gate.perceive((ride.k + 1) * TICK_NS + 1)
    assert ride.tick().reason == Reason.STALE_PERCEPT.value


def test_two_speeds_that_stay_apart_are_refused_as_late_as_by_the_check_itself_and_forgotten_in_between(pair):
    ride = Ride(*pair)
    ride.go(8)
    apart = {"tcp_speed_m_s": lambda state: (*state.tcp_speed_m_s[:2], state.tcp_speed_m_s[2] + 0.2)}
    for _ in range(4):
        assert ride.tick(**apart) is None
    assert ride.tick() is None
    for _ in range(5):
        assert ride.tick(**apart) is None
    assert ride.tick(**apart).reason == Reason.KINEMATICS.value


def test_any_way_over_the_table_is_judged_alike_and_what_is_known_of_stops_is_the_same(pair):
    """Targets anywhere, pushes now and then, a command that nobody checked: every bit of memory is the same."""
    rng, (low, high) = np.random.default_rng(5), ARM.motion.workspace_m
    pair[0].said.clear()
    for _ in range(6):
        ride = Ride(*pair)
        for _ in range(12):
            ride.follower.aim(vec(rng.uniform(low, high)), ARM.tool_yaw_rad)
            for _ in range(rng.integers(3, 12)):
                push = (0.0, 0.0, float(rng.uniform(0.0, 1.5) * LIMITS.contact_n)) if rng.random() < 0.1 else (0.0,) * 3
                if ride.tick(tcp_force_n=push) is not None:
                    break
                stops, parted = pair[0]._stops, pair[1]._stops
                assert (stops.known == parted.known).all()
                assert (stops.seen == parted.seen).all()
                assert pair[0]._points == pair[1]._points
            if pair[0].is_latched:
                break
    said = pair[0].said
    assert said.count(FREE) > 100
    assert said.count(PLAIN) > 10
    assert said.count(UNSURE) > 10


def test_without_a_stop_check_nothing_of_stops_is_said_and_without_a_cross_check_nothing_at_all():
    blind, parted = made(with_stops=False), one_by_one(made(with_stops=False))
    Ride(blind, parted).go(12)
    assert set(blind.said) == {UNSURE, PLAIN}
    alone, parted = made(with_cross=False), one_by_one(made(with_cross=False))
    Ride(alone, parted).go(12)
    assert alone.said == []
