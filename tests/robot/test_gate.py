import ast
import math
from pathlib import Path

import pytest
from msgspec.structs import replace

from config.limited import limited
from config.limits import Plane, Workspace
from config.loader import load_arm
from robot.chain import ToolChain
from robot.envelope import Envelope
from robot.errors import RobotConfigError
from robot.hal.fake import FakeArm
from robot.kinematics import Kinematics
from robot.messages import ArmMode, GripCommand, Heading, Outcome
from robot.safety import Block, Gate, GateLimits, Reason
from tests.support.profiles import ANY_RATE, envelope, open_envelope, profile
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
    limits = GateLimits.of(ARM, spec, table_m=0.0, tick_s=0.01)
    made = Gate(arm=arm, limits=limits, envelope=open_envelope(), chain=CHAIN)
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
    Reason.GRIP: {"grip": GripCommand(opening_m=0.085, force_n=500.0, speed_m_s=0.1)},
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


def test_what_stands_around_reaches_the_stop_check_and_nothing_where_there_is_none(arm, gate):
    class Stops:
        def __init__(self):
            self.blocks = []

        def put(self, blocks):
            self.blocks.append(blocks)

    stops, blocks = Stops(), (Block(name="a", centre_m=(0.4, 0.0, 0.1), half_m=(0.1, 0.1, 0.1)),)
    made = Gate(arm=arm, limits=gate.limits, envelope=open_envelope(), chain=CHAIN, stops=stops)
    made.surround(blocks)
    assert stops.blocks == [blocks]
    gate.surround(blocks)
    assert gate.write(command(START), state(), now_ns=0) is None


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


def test_motion_long_after_the_last_percept_is_refused_and_holding_still_is_not(gate):
    late = gate.limits.percept_max_age_ns + TICK_NS
    gate.perceive(0)
    assert gate.write(command(START, stamp_ns=late), arm_state(START, stamp_ns=late), now_ns=late) is None
    assert gate.admit(Heading(heading_rad=0.0, distance_m=0.01, height_m=0.2), now_ns=late) is None
    nudge = command((START[0] + 0.001, *START[1:]), sequence=2, stamp_ns=late)
    assert gate.write(nudge, arm_state(START, stamp_ns=late), now_ns=late).reason == Reason.STALE_PERCEPT


def test_a_fresh_percept_lets_motion_go_on_and_none_is_asked_for_before_the_first(gate):
    late = gate.limits.percept_max_age_ns + TICK_NS
    intent = Heading(heading_rad=0.0, distance_m=0.01, height_m=0.2)
    for k, perceive in enumerate((lambda: None, lambda: gate.perceive(late))):
        perceive()
        assert gate.admit(intent, now_ns=late) is None
        nudge = command((START[0] + 0.001 * (k + 1), *START[1:]), sequence=k + 1, stamp_ns=late)
        assert gate.write(nudge, arm_state(START, stamp_ns=late), now_ns=late) is None


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("way", [-1.0, 1.0])
def test_a_push_that_rises_is_not_pressed_on_but_given_way_to(gate, axis, way):
    at_m, solver = (0.42, 0.12, 0.2), Kinematics(ARM)
    start = solver.solve(at_m, START)
    there = solver.solve(tuple(x + 0.001 * way * (i == axis) for i, x in enumerate(at_m)), start)
    onwards = tuple(b - a for a, b in zip(start, there, strict=True))
    for sign, expected in ((-1.0, None), (1.0, Reason.FORCE)):
        gate.seed(arm_state(start))
        for k, force in enumerate((200.0, 230.0)):
            force_n = tuple(-way * force * (i == axis) for i in range(3))
            pushed = arm_state(start, force_n=force_n, stamp_ns=k * TICK_NS)
            q = tuple(a + sign * k * d for a, d in zip(start, onwards, strict=True))
            verdict = gate.write(command(q, sequence=k + 1, stamp_ns=k * TICK_NS), pushed, now_ns=k * TICK_NS)
        assert (verdict and verdict.reason) == expected


@pytest.mark.parametrize(
    ("by_rad", "expected"), [((0.0007,), None), ((0.0007, 0.0021, 0.0042), Reason.JOINT_ACCELERATION)]
)
def test_holding_still_is_refused_where_motion_was_too_fast_to_end_in_one_tick(arm, by_rad, expected):
    limits = GateLimits.of(ARM, FakeArm(arm=ARM, tick_s=0.01).spec, table_m=0.0, tick_s=0.01)
    made = Gate(arm=arm, limits=limits, envelope=envelope(0.01, "attended"), chain=CHAIN)
    made.seed(arm_state(START))
    for k in range(len(by_rad)):
        q = (START[0] + sum(by_rad[: k + 1]), *START[1:])
        assert made.write(command(q, sequence=k + 1), arm_state(q), now_ns=0) is None
    verdict = made.write(command(q, sequence=len(by_rad) + 1), arm_state(q), now_ns=0)
    assert (verdict and verdict.reason) == expected


def test_a_wrong_intent_latches_before_any_command(gate, arm):
    verdict = gate.admit(Heading(heading_rad=math.nan, distance_m=0.0, height_m=0.2), now_ns=0)
    assert verdict.reason == Reason.NOT_FINITE
    assert arm.n_stops == 1
    assert gate.write(command(START), state(), now_ns=0).reason == Reason.NOT_FINITE
    assert arm.commands == []
    assert arm.n_stops == 1


def at_its_end(joint, by):
    """A gate seeded with one joint a hair inside its range, and the command that brings it to the end and by more."""
    q = list(START)
    q[joint] = ARM.joints[joint].range_rad[1] - 1e-3
    return tuple(q), tuple(v + (1e-3 + by if i == joint else 0.0) for i, v in enumerate(q))


@pytest.mark.parametrize("joint", range(6))
def test_a_joint_may_come_to_the_end_of_its_range_and_not_past_it(arm, joint):
    spec = FakeArm(arm=ARM, tick_s=0.01).spec
    wide = replace(ARM, motion=replace(ARM.motion, workspace_m=((-3.0, -3.0, -3.0), (3.0, 3.0, 3.0))))
    limits = replace(GateLimits.of(wide, spec, table_m=-3.0, tick_s=0.01), tip_min_m=-9.0)
    for by, expected in ((0.0, None), (1e-6, Reason.JOINT_RANGE)):
        gate = Gate(arm=arm, limits=limits, envelope=open_envelope(), chain=CHAIN)
        start, there = at_its_end(joint, by)
        gate.seed(arm_state(start))
        verdict = gate.write(command(there), arm_state(start), now_ns=0)
        assert (verdict and verdict.reason) == expected


@pytest.mark.parametrize(
    ("place", "expected"),
    [((0.42, -0.436, 0.2), None), ((0.42, -0.445, 0.2), Reason.WORKSPACE), ((0.42, 0.0, 0.0125), Reason.TABLE)],
)
def test_the_tool_may_bow_out_of_the_workspace_by_a_centimetre_and_never_down_to_the_table(gate, place, expected):
    q = Kinematics(ARM).solve(place, ARM.home_rad)
    near = (*q[:5], q[5] + 1e-4)
    gate.seed(arm_state(near))
    verdict = gate.write(command(q), arm_state(near), now_ns=0)
    assert (verdict and verdict.reason) == expected


def test_a_blow_before_an_engagement_is_not_held_against_the_one_after(gate):
    hard = (0.0, 0.0, 1.5 * gate.limits.force_max_n)
    assert gate.write(moved(1), state(1, force_n=hard), now_ns=TICK_NS) is None
    gate.seed(arm_state(START))
    assert gate.write(moved(1), state(1, force_n=hard), now_ns=TICK_NS) is None


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


@pytest.mark.parametrize("listener_fails", [False, True])
def test_a_refusal_is_told_once_before_the_arm_is_stopped_and_stops_it_whoever_listens(arm, listener_fails):
    told = []

    def listen(verdict):
        told.append((verdict.reason, arm.n_stops))
        if listener_fails:
            raise BrokenPipeError

    spec = FakeArm(arm=ARM, tick_s=0.01).spec
    limits = GateLimits.of(ARM, spec, table_m=0.0, tick_s=0.01)
    gate = Gate(arm=arm, limits=limits, envelope=envelope(0.01), chain=CHAIN, when_latched=listen)
    gate.seed(arm_state(START))
    if listener_fails:
        with pytest.raises(BrokenPipeError):
            gate.latch(Reason.WIRE, "the hand is gone", now_ns=0)
    else:
        gate.latch(Reason.WIRE, "the hand is gone", now_ns=0)
    assert gate.write(command(START), state(), now_ns=0).reason == Reason.WIRE
    assert told == [("wire", 0)]
    assert arm.n_stops == 1


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


def writers(path):
    """Return the functions of a file that call a method named write on something that may be an arm."""
    harmless = {
        "gate",
        "os",
        "sys",
        "stream",
        "file",
        "handle",
        "out",
        "stdout",
        "console",
        "writer",
        "table",
        "recorder",
        "logs",
    }
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "write":
            target = ast.unparse(node.func.value).split(".")[-1].lstrip("_")
            if target not in harmless:
                yield target


def test_only_the_gate_writes_to_an_arm():
    """Nothing in the product but the gate calls write on an arm, by whatever name it knows it (STYLE 18)."""
    root = Path(__file__).parents[2]
    callers = {
        str(path.relative_to(root))
        for package in ("robot", "perception", "sim_twin")  # learning may not import an arm at all
        for path in (root / package).rglob("*.py")
        if "controller" not in path.parts and list(writers(path))
    }
    assert callers == {"robot/safety/gate.py"}


FREE = tuple(replace(j, **ANY_RATE) for j in profile().joints)
LOW_JERK = tuple(replace(j, stop_jerk_rad_s3=1000.0) for j in profile().joints)
NEAR_ENDS = tuple(replace(j, range_rad=(j.range_rad[0], q + 0.03)) for j, q in zip(FREE, START, strict=True))
WALL = Plane(name="wall", point_m=(0.0, 0.005, 0.0), normal=(0.0, -1.0, 0.0))


@pytest.mark.parametrize(
    ("name", "changes", "joint", "step", "expected"),
    [
        ("attended", {}, 0, 0.0026, Reason.JOINT_ACCELERATION),
        ("attended", {"joints": FREE}, 0, 0.01, Reason.PART_SPEED),
        ("unattended", {"joints": NEAR_ENDS}, 0, 0.019, Reason.SOFT_MARGIN),
        ("unattended", {"joints": FREE, "workspace": Workspace(planes=(WALL,))}, 0, 0.019, Reason.FENCE),
        ("unattended", {"joints": FREE, "workspace": Workspace(tool_cone_rad=0.01)}, 3, 0.019, Reason.CONE),
        ("unattended", {"joints": LOW_JERK}, 0, 0.002, Reason.JOINT_JERK),
        ("unattended", {"joints": FREE}, 0, 0.019, None),
        ("unattended", {"joints": FREE}, 3, 0.019, None),
    ],
)
def test_each_limit_of_the_profile_latches_the_gate(arm, name, changes, joint, step, expected):
    spec, held = FakeArm(arm=ARM, tick_s=0.01).spec, profile(name, **changes)
    limits = GateLimits.of(ARM, spec, table_m=0.0, tick_s=0.01)
    gate = Gate(arm=arm, limits=limits, envelope=Envelope.of(held, limited(ARM, held), tick_s=0.01), chain=CHAIN)
    gate.seed(arm_state(START))
    there = tuple(q + (step if i == joint else 0.0) for i, q in enumerate(START))
    verdict = gate.write(command(there), arm_state(START), now_ns=0)
    assert (None if verdict is None else verdict.reason) == expected
    assert gate.is_latched == (expected is not None)
    assert len(arm.commands) == (expected is None)


@pytest.mark.parametrize(("force_n", "is_sent"), [(90.0, False), (math.nextafter(90.0, 91.0), True)])
@pytest.mark.parametrize(
    ("by_rad", "reason"), [((0.02,), Reason.JOINT_ACCELERATION), ((0.0007, 0.0021, 0.0042, 0.0064), Reason.PART_SPEED)]
)
def test_only_a_command_that_something_pushes_may_give_way_faster_than_it_may_go(arm, force_n, is_sent, by_rad, reason):
    spec = FakeArm(arm=ARM, tick_s=0.01).spec
    limits = GateLimits.of(ARM, spec, table_m=0.0, tick_s=0.01)
    made = Gate(arm=arm, limits=limits, envelope=envelope(0.01, "attended"), chain=CHAIN)
    made.seed(arm_state(START))
    places = [(START[0] + sum(by_rad[: k + 1]), *START[1:]) for k in range(len(by_rad))]
    pushed = arm_state(places[-1], force_n=(0.0, 0.0, force_n))
    verdicts = [made.write(command(q, sequence=k + 1), pushed, now_ns=0) for k, q in enumerate(places)]
    reasons = [v.reason for v in verdicts if v is not None]
    assert reasons[:1] == ([] if is_sent else [reason])
