import math
from pathlib import Path

import pytest
from msgspec.structs import replace

from config.loader import load_arm
from robot.errors import RobotConfigError
from robot.hal.fake import FakeArm
from robot.kinematics import Kinematics, ToolChain
from robot.messages import ArmMode, Heading, Outcome
from robot.safety import Gate, GateLimits, Reason
from tests.support.stations import TICK_NS, arm_state, command

ARM = load_arm("ur5e")
CHAIN = ToolChain(ARM)
START = Kinematics(ARM).solve((0.42, 0.0, 0.2), ARM.home_rad)


class Recorder:
    """An arm that writes down what it is told."""

    def __init__(self):
        self.commands, self.n_stops = [], 0

    def write(self, sent):
        self.commands.append(sent)

    def stop(self):
        self.n_stops += 1
        return True


@pytest.fixture
def arm():
    return Recorder()


@pytest.fixture
def gate(arm):
    spec = FakeArm(arm=ARM, tick_s=0.01).spec
    made = Gate(arm=arm, limits=GateLimits.of(ARM, spec, table_m=0.0, tick_s=0.01), chain=CHAIN)
    made.seed(arm_state(START))
    return made


def moved(k, by=0.001):
    """The k-th command of a slow turn of the base, k from 1."""
    return command((START[0] + k * by, *START[1:]), sequence=k, stamp_ns=k * TICK_NS)


def state(k=0, **changes):
    return arm_state(START, stamp_ns=k * TICK_NS, **changes)


def test_what_passes_is_sent_as_it_is(gate, arm):
    sent = [moved(k) for k in (1, 2, 3)]
    assert [gate.write(c, state(c.sequence), now_ns=c.stamp_ns) for c in sent] == [None] * 3
    assert arm.commands == sent
    assert arm.n_stops == 0


HOSTILE = {
    Reason.NOT_FINITE: {"q_rad": (math.nan, *START[1:])},
    Reason.MALFORMED: {"q_rad": START[:3]},
    Reason.SEQUENCE: {"sequence": 7},
    Reason.STALE_STATE: {"stamp_ns": -(10**9)},
    Reason.JOINT_SPEED: {"q_rad": (START[0] + 0.05, *START[1:])},
    Reason.OUTPUTS: {"digital_out": 1 << 20},
}


@pytest.mark.parametrize("expected", HOSTILE)
def test_a_refusal_says_why_stops_the_arm_and_latches(gate, arm, expected):
    verdict = gate.write(command(**({"q_rad": START} | HOSTILE[expected])), state(), now_ns=0)
    assert verdict.outcome is Outcome.REFUSED
    assert verdict.reason == expected
    assert verdict.is_latched
    assert "expected" in verdict.detail
    assert arm.commands == []
    assert arm.n_stops == 1
    again = gate.write(command(START), state(), now_ns=0)
    assert again.reason == expected
    assert gate.is_latched
    assert arm.commands == []
    assert arm.n_stops == 1


def test_finiteness_is_asked_before_anything_else(gate):
    verdict = gate.write(command((math.nan,) * 6, sequence=9, stamp_ns=10**12, digital_out=-1), state(), now_ns=0)
    assert verdict.reason == Reason.NOT_FINITE


def test_speed_is_measured_from_the_last_command_sent(gate):
    step = 0.9 * ARM.joints[0].speed_rad_s * 0.01
    assert gate.write(moved(1, step), state(1), now_ns=TICK_NS) is None
    assert gate.write(moved(2, step), state(2), now_ns=2 * TICK_NS) is None
    verdict = gate.write(moved(3, 0.0), state(3), now_ns=3 * TICK_NS)
    assert verdict.reason == Reason.JOINT_SPEED


def test_holding_still_is_always_allowed(arm, gate):
    outside = Kinematics(ARM).solve((0.70, 0.0, 0.2), ARM.home_rad)
    gate.seed(arm_state(outside))
    late = 10**12
    held = command(outside, stamp_ns=late)
    assert gate.write(held, arm_state(outside, stamp_ns=late), now_ns=late) is None
    further = command((*outside[:5], outside[5] + 1e-4), sequence=2, stamp_ns=late)
    assert gate.write(further, arm_state(outside, stamp_ns=late), now_ns=late).reason == Reason.WORKSPACE


def test_motion_long_after_the_last_intent_is_refused(gate):
    late = gate.limits.intent_max_age_ns + TICK_NS
    nudge = command((START[0] + 0.001, *START[1:]), stamp_ns=late)
    assert gate.write(nudge, arm_state(START, stamp_ns=late), now_ns=late).reason == Reason.STALE_INTENT


def test_a_fresh_intent_lets_motion_go_on(gate):
    late = gate.limits.intent_max_age_ns + TICK_NS
    intent = Heading(heading_rad=0.0, distance_m=0.01, height_m=0.2)
    assert gate.admit(intent, now_ns=late) is None
    nudge = command((START[0] + 0.001, *START[1:]), stamp_ns=late)
    assert gate.write(nudge, arm_state(START, stamp_ns=late), now_ns=late) is None


def test_a_wrong_intent_latches_before_any_command(gate, arm):
    verdict = gate.admit(Heading(heading_rad=math.nan, distance_m=0.0, height_m=0.2), now_ns=0)
    assert verdict.reason == Reason.NOT_FINITE
    assert gate.write(command(START), state(), now_ns=0).reason == Reason.NOT_FINITE
    assert arm.commands == []


def test_one_blow_passes_and_a_push_does_not(gate):
    hard = (0.0, 0.0, 1.5 * gate.limits.force_max_n)
    assert gate.write(moved(1), state(1, force_n=hard), now_ns=TICK_NS) is None
    assert gate.write(moved(2), state(2), now_ns=2 * TICK_NS) is None
    assert gate.write(moved(3), state(3, force_n=hard), now_ns=3 * TICK_NS) is None
    assert gate.write(moved(4), state(4, force_n=hard), now_ns=4 * TICK_NS).reason == Reason.FORCE


@pytest.mark.parametrize("mode", [m for m in ArmMode if m is not ArmMode.RUNNING])
def test_an_arm_that_does_not_run_is_not_commanded(gate, mode):
    assert gate.write(command(START), state(mode=mode), now_ns=0).reason == Reason.ARM_MODE


def test_an_arm_that_does_not_follow_is_stopped(gate):
    elsewhere = arm_state((START[0] + 0.3, *START[1:]))
    assert gate.write(command(START), elsewhere, now_ns=0).reason == Reason.TRACKING


def test_seeding_clears_the_latch_and_starts_from_the_measured_joints(gate, arm):
    gate.latch(Reason.STALE_STATE, "expected a state, came none", now_ns=0)
    moved_on = (START[0] + 0.2, *START[1:])
    gate.seed(arm_state(moved_on))
    assert not gate.is_latched
    assert gate.write(command(moved_on), arm_state(moved_on), now_ns=0) is None


def test_limits_are_the_narrower_of_the_arms_file_and_the_arm_itself():
    spec = FakeArm(arm=ARM, tick_s=0.01).spec
    narrow = replace(spec, q_max_rad=(1.0,) * 6, qd_max_rad_s=(0.5,) * 6, grip_stroke_m=0.05)
    limits = GateLimits.of(ARM, narrow, table_m=0.0, tick_s=0.01)
    assert limits.q_max_rad == (1.0,) * 6
    assert limits.joint_step_rad == pytest.approx((0.005,) * 6)
    assert limits.opening_m == (0.0, 0.05)
    with pytest.raises(RobotConfigError, match="no range"):
        GateLimits.of(ARM, replace(spec, q_min_rad=(7.0,) * 6), table_m=0.0, tick_s=0.01)
    with pytest.raises(RobotConfigError, match="ur10e"):
        GateLimits.of(ARM, replace(spec, model="ur10e"), table_m=0.0, tick_s=0.01)


def test_only_the_gate_writes_to_an_arm():
    """Nothing in the product but the gate calls write on an arm (STYLE 18)."""
    root = Path(__file__).parents[2]
    callers = {
        str(path.relative_to(root))
        for package in ("robot", "perception", "sim_twin", "learning")
        for path in (root / package).rglob("*.py")
        if "arm.write(" in path.read_text(encoding="utf-8")
    }
    assert callers == {"robot/safety/gate.py"}
