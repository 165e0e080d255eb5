"""In which order the gate asks, what it remembers, and what it is before anybody seeded it."""

import math

import pytest
from msgspec.structs import replace

from config.limits import Plane
from config.loader import load_arm
from robot.as_came import as_came
from robot.chain import ToolChain
from robot.hal.fake import FakeArm
from robot.kinematics import Kinematics
from robot.messages import ArmMode, GripCommand, Heading, Outcome, Verdict
from robot.safety import Gate, GateLimits, Reason, Refusal
from tests.support.profiles import ANY_RATE, envelope, fenced, open_envelope, profile
from tests.support.stations import TICK_NS, arm_state, command

ARM = load_arm("ur5e")
CHAIN = ToolChain(ARM)
START = Kinematics(ARM).solve((0.42, 0.0, 0.2), ARM.home_rad)
LIMITS = GateLimits.of(ARM, FakeArm(arm=ARM, tick_s=0.01).spec, table_m=0.0, tick_s=0.01)
WIDE = replace(LIMITS, workspace_m=((-3.0,) * 3, (3.0,) * 3), tip_min_m=-3.0)
ZERO = (0.0,) * 6


class Recorder:
    def __init__(self, *, confirms=True):
        self.commands, self.confirms = [], confirms

    def write(self, sent):
        self.commands.append(sent)

    def stop(self):
        return self.confirms


class Stops:
    """A stop check that refuses, and writes down what it was asked."""

    def __init__(self, refusal=None):
        self.refusal, self.asked, self.n_seeds = refusal, [], 0

    def seed(self):
        self.n_seeds += 1

    def check(self, q_rad, before_rad, state):
        self.asked.append((q_rad, before_rad, state))
        return self.refusal


def made(arm=None, *, limits=LIMITS, held=None, stops=None, seeded=True):
    gate = Gate(arm=arm or Recorder(), limits=limits, envelope=held or open_envelope(), chain=CHAIN, stops=stops)
    if seeded:
        gate.seed(arm_state(START))
    return gate


def turned(by, joint=0):
    return tuple(q + (by if i == joint else 0.0) for i, q in enumerate(START))


HARD = (0.0, 0.0, 1e6)
FAULTS = [
    (Reason.NOT_FINITE, {"q_rad": (math.nan, *START[1:])}, {}),
    (Reason.SEQUENCE, {"sequence": 9}, {}),
    (Reason.ARM_MODE, {}, {"mode": ArmMode.STOPPED}),
    (Reason.FORCE, {}, {"force_n": HARD}),
    (Reason.GRIP, {"grip": GripCommand(opening_m=9.0, force_n=20.0, speed_m_s=0.1)}, {}),
    (Reason.OUTPUTS, {"digital_out": 1 << 20}, {}),
    (Reason.JOINT_SPEED, {"q_rad": turned(0.05)}, {}),
]
PAIRS = [(a, b) for i, a in enumerate(FAULTS) for b in FAULTS[i + 1 :]]


@pytest.mark.parametrize(("first", "second"), PAIRS, ids=[f"{a[0]}-{b[0]}" for a, b in PAIRS])
def test_of_two_faults_the_one_that_is_asked_first_is_told(first, second):
    asked = {"q_rad": START} | second[1] | first[1]
    verdict = made().write(command(**asked), arm_state(START, **(second[2] | first[2])), now_ns=0)
    assert verdict.reason == first[0]


def outermost(by):
    q = list(START)
    q[0] = LIMITS.q_max_rad[0] - 1e-3
    return tuple(q), (q[0] + by, *q[1:])


def test_a_joints_range_is_asked_before_its_speed():
    start, there = outermost(0.05)
    gate = made()
    gate.seed(arm_state(start))
    assert gate.write(command(there), arm_state(start), now_ns=0).reason == Reason.JOINT_RANGE


WALL = fenced(planes=(Plane(name="wall", point_m=(0.0, 0.005, 0.0), normal=(0.0, -1.0, 0.0)),))
STALE_NS = 10**10
FREE = tuple(replace(j, **ANY_RATE) for j in profile().joints)


@pytest.mark.parametrize(
    ("held", "limits", "late", "stops", "expected"),
    [
        ({"name": "attended", "workspace": WALL}, replace(LIMITS, tip_min_m=0.5), True, True, Reason.TABLE),
        ({"name": "attended", "workspace": WALL}, LIMITS, True, True, Reason.JOINT_ACCELERATION),
        ({"name": "attended", "workspace": WALL, "joints": FREE}, LIMITS, True, True, Reason.FENCE),
        ({"name": "attended", "joints": FREE}, LIMITS, True, True, Reason.PART_SPEED),
        ({"joints": FREE}, LIMITS, True, True, Reason.STALE_INTENT),
        ({"joints": FREE}, LIMITS, False, True, Reason.STOP_RANGE),
        ({"joints": FREE}, LIMITS, False, False, Reason.TRACKING),
    ],
)
def test_of_what_moves_the_place_is_asked_first_then_the_intent_the_stop_and_the_measured_joints(
    held, limits, late, stops, expected
):
    refuse = Stops(Refusal(Reason.STOP_RANGE, "far") if stops else None)
    gate = made(limits=limits, held=envelope(0.01, **held), stops=refuse)
    now_ns = STALE_NS if late else TICK_NS
    away = replace(arm_state(START, stamp_ns=now_ns), q_rad=turned(1.0, joint=5))
    verdict = gate.write(command(turned(0.019), stamp_ns=now_ns), away, now_ns=now_ns)
    assert verdict.reason == expected


def test_the_stop_is_verified_from_the_last_command_to_the_next_and_for_motion_only():
    stops = Stops()
    gate = made(stops=stops)
    assert stops.n_seeds == 1
    one, two = turned(0.001), turned(0.002)
    state = arm_state(START)
    assert gate.write(command(START), state, now_ns=0) is None
    assert gate.write(command(one, sequence=2), state, now_ns=0) is None
    assert gate.write(command(two, sequence=3), state, now_ns=0) is None
    assert stops.asked == [(one, START, state), (two, one, state)]


def test_a_verdict_is_whole():
    gate = made()
    assert gate.write(command(START), arm_state(START), now_ns=0) is None
    bad = command(turned(0.25), sequence=2, stamp_ns=7)
    first = gate.write(bad, arm_state(START, stamp_ns=7), now_ns=7)
    assert first == Verdict(
        stamp_ns=7, sequence=2, outcome=Outcome.REFUSED, reason="joint_speed", detail=first.detail,
        amount=first.amount, is_latched=True, refused=as_came(bad),
    )  # fmt: skip
    assert first.detail.startswith("joint 1: expected a change of at most ")
    assert first.amount == pytest.approx(0.25 - LIMITS.joint_step_rad[0])
    up = Heading(heading_rad=0.0, distance_m=0.0, height_m=0.2)
    again = gate.admit(up, now_ns=9)
    assert again == replace(first, stamp_ns=9, refused=as_came(up))
    still = command(START, sequence=2)
    later = gate.write(still, arm_state(START), now_ns=11)
    assert later == replace(first, stamp_ns=11, refused=as_came(still))
    told = made().latch(Reason.WIRE, "the hand is gone", now_ns=13)
    assert told == Verdict(
        stamp_ns=13, sequence=1, outcome=Outcome.REFUSED, reason="wire", detail="the hand is gone", amount=0.0,
        is_latched=True,
    )  # fmt: skip
    untaken = made().latch(Reason.ARM_REFUSED, "not taken", now_ns=13, refused=bad)
    assert untaken.refused == as_came(bad)


def test_the_last_command_sent_is_kept_and_a_refused_one_is_not():
    assert made(seeded=False).sent is None
    gate = made()
    assert gate.sent is None
    sent = command(START)
    assert gate.write(sent, arm_state(START), now_ns=0) is None
    assert gate.sent is sent
    assert gate.write(command(turned(0.25), sequence=2), arm_state(START), now_ns=0) is not None
    assert gate.sent is sent
    gate.seed(arm_state(START))
    assert gate.sent is None


@pytest.mark.parametrize("confirms", [True, False])
def test_whether_the_plant_confirmed_the_stop_is_kept(confirms):
    gate = made(Recorder(confirms=confirms))
    assert gate.is_stop_confirmed is True
    gate.latch(Reason.WIRE, "gone", now_ns=0)
    assert gate.is_stop_confirmed is confirms


def test_numbers_go_on_from_what_was_sent_and_begin_anew_with_a_seed():
    gate = made()
    assert gate.next_sequence == 1
    gate.write(command(START), arm_state(START), now_ns=0)
    assert gate.next_sequence == 2
    gate.write(command(START, sequence=2), arm_state(START), now_ns=0)
    assert gate.next_sequence == 3
    gate.seed(arm_state(START))
    assert gate.next_sequence == 1


def test_speeds_of_parts_are_those_from_the_last_command_to_the_next():
    gate = made(held=envelope(0.01, name="attended", joints=FREE))
    step = 0.9 * 0.25 * 0.01 / 0.45
    q = START
    for k in range(1, 6):
        q = turned(k * step)
        assert gate.write(command(q, sequence=k), arm_state(q), now_ns=0) is None
    verdict = gate.write(command(turned(7 * step), sequence=6), arm_state(q), now_ns=0)
    assert verdict.reason == Reason.PART_SPEED


def test_what_gives_way_to_where_it_is_measured_is_not_too_fast():
    gate = made(held=envelope(0.01, name="attended", joints=FREE))
    pushed = turned(0.02)
    force_n = (0.0, 0.0, LIMITS.hard_n + 1.0)
    assert gate.write(command(turned(0.015)), arm_state(pushed, force_n=force_n), now_ns=0) is None


def test_accelerations_are_told_from_the_last_two_commands():
    held = envelope(
        0.01, joints=tuple(replace(j, **ANY_RATE | {"acceleration_rad_s2": 50.0}) for j in profile().joints)
    )
    gate, most = made(held=held), held.joints[0].gain_rad
    for k, at in enumerate((0.9 * most, 2.7 * most), start=1):
        assert gate.write(command(turned(at), sequence=k), arm_state(START), now_ns=0) is None
    verdict = gate.write(command(turned(2.7 * most + 2.9 * most), sequence=3), arm_state(START), now_ns=0)
    assert verdict.reason == Reason.JOINT_ACCELERATION
    gate.seed(arm_state(START))
    assert gate.write(command(turned(1.1 * most)), arm_state(START), now_ns=0).reason == Reason.JOINT_ACCELERATION


def test_the_force_is_the_length_of_its_vector():
    share = 0.6 * LIMITS.force_max_n
    gate = made()
    for k in (1, 2):
        assert gate.write(command(START, sequence=k), arm_state(START, force_n=(share,) * 2 + (0.0,)), now_ns=0) is None
    third = arm_state(START, force_n=(share,) * 3)
    assert gate.write(command(START, sequence=3), third, now_ns=0) is None
    assert gate.write(command(START, sequence=4), third, now_ns=0).reason == Reason.FORCE


def test_seeding_forgets_a_push_however_low_its_limit():
    low = replace(LIMITS, force_max_n=0.5)
    blow = arm_state(START, force_n=(0.0, 0.0, 0.75))
    for gate in (made(limits=low), made(limits=low, seeded=False)):
        gate.seed(arm_state(START))
        assert gate.write(command(START), blow, now_ns=0) is None
        gate.seed(arm_state(START))
        assert gate.write(command(START), blow, now_ns=0) is None


def test_a_seed_is_as_fresh_as_the_measurement_it_is_of():
    gate = made()
    gate.seed(arm_state(START, stamp_ns=STALE_NS))
    for by, expected in ((0, None), (1, Reason.STALE_INTENT)):
        now_ns = STALE_NS + LIMITS.intent_max_age_ns + by
        gate.seed(arm_state(START, stamp_ns=STALE_NS))
        verdict = gate.write(command(turned(1e-4), stamp_ns=now_ns), arm_state(START, stamp_ns=now_ns), now_ns=now_ns)
        assert (verdict and verdict.reason) == expected


def test_a_gate_that_nobody_seeded_knows_an_arm_at_zero_and_nothing_else():
    gate = made(limits=replace(WIDE, force_max_n=0.5), held=envelope(0.01, workspace=fenced()), seeded=False)
    assert (gate.is_latched, gate.next_sequence, gate.is_stop_confirmed) == (False, 1, True)
    blow = arm_state(ZERO, force_n=(0.0, 0.0, 0.75))
    assert gate.write(command((1e-4, *ZERO[1:])), blow, now_ns=0) is None
    late = made(limits=WIDE, seeded=False)
    now_ns = LIMITS.intent_max_age_ns
    nudge = command((1e-4, *ZERO[1:]), stamp_ns=now_ns)
    assert late.write(nudge, arm_state(ZERO, stamp_ns=now_ns), now_ns=now_ns) is None
    elsewhere = made(seeded=False)
    assert elsewhere.write(command(START), arm_state(START), now_ns=0).reason == Reason.JOINT_SPEED
