import math

import numpy as np
import pytest

from config.loader import load_arm
from robot.kinematics import Kinematics
from robot.messages import Heading, Hold, JointTarget, Twist
from robot.motion import Mover
from robot.motion.approach import N_PIECES
from robot.servo import lag_s
from tests.support.profiles import envelope
from tests.support.stations import arm_state

ARM = load_arm("ur5e")
DT = 0.01
KINEMATICS = Kinematics(ARM)
START = (0.42, 0.0, 0.21)
Q_START = KINEMATICS.solve(START, ARM.home_rad)
CONTACT, HARD = ARM.motion.contact_force_n, ARM.motion.hard_force_n


class Perfect:
    """An arm that is where it was told, with a force that a test sets."""

    def __init__(self):
        self.mover = Mover(ARM, envelope=envelope(DT), table_m=0.0, tick_s=DT)
        self.q, self.force = Q_START, (0.0, 0.0, 0.0)
        self.mover.seed(self.state)

    @property
    def state(self):
        return arm_state(self.q, tcp_m=KINEMATICS.tcp(self.q), force_n=self.force)

    @property
    def tcp(self):
        return KINEMATICS.tcp(self.q)

    def step(self, intent, n_ticks=5):
        self.mover.begin_step(intent, self.state, duration_s=n_ticks * DT)
        for _ in range(n_ticks):
            self.q = self.mover.tick(self.state)
        return self.mover.limiters


@pytest.fixture
def arm():
    return Perfect()


def go(angle=0.0, distance=0.022, height=0.21):
    return Heading(heading_rad=angle, distance_m=distance, height_m=height)


def test_the_tool_trails_the_target_by_at_most_three_steps_and_rests_on_it(arm):
    lags = []
    for _ in range(8):
        arm.step(go(angle=0.5))
        lags.append(math.dist(arm.tcp, arm.mover.target_m))
    assert max(lags) < 3 * 0.022
    assert arm.mover.target_m[0] == pytest.approx(START[0] + 8 * 0.022 * math.cos(0.5), abs=1e-4)
    for _ in range(10):
        arm.step(go(distance=0.0))
    assert arm.tcp == pytest.approx(arm.mover.target_m, abs=1e-5)


def test_turning_back_does_not_carry_the_tool_past_where_the_target_was(arm):
    for _ in range(6):
        arm.step(go())
    furthest = arm.mover.target_m[0]
    xs = []
    for _ in range(10):
        arm.step(go(angle=math.pi))
        xs.append(arm.tcp[0])
    assert max(xs) <= furthest + 1e-4


def test_a_hold_stops_short_of_the_target(arm):
    for _ in range(2):
        arm.step(go())
    ahead = arm.mover.target_m
    arm.step(Hold())
    assert math.dist(arm.mover.target_m, START) < 0.9 * math.dist(ahead, START)
    for _ in range(8):
        arm.step(Hold())
    assert arm.tcp == pytest.approx(arm.mover.target_m, abs=1e-5)


def test_waiting_for_the_hand_the_tool_comes_back_over_the_place_it_has_passed(arm):
    for _ in range(6):
        arm.step(go(distance=0.02, height=0.1))
    passed = arm.tcp
    farthest = passed[0]
    for _ in range(12):
        arm.mover.wait_at(passed, arm.state)
        for _ in range(5):
            arm.q = arm.mover.tick(arm.state)
            farthest = max(farthest, arm.tcp[0])
    assert arm.mover.limiters == ("hand",)
    assert farthest > passed[0] + 0.005
    assert arm.tcp[:2] == pytest.approx(passed[:2], abs=1e-4)
    assert passed[2] - 0.06 < arm.tcp[2] < passed[2]


def test_the_workspace_and_the_table_stop_the_target(arm):
    for _ in range(30):
        limiters = arm.step(go(angle=0.0))
    assert "workspace" in limiters
    assert arm.mover.target_m[0] == pytest.approx(ARM.motion.workspace_m[1][0])
    for _ in range(60):
        limiters = arm.step(Twist(linear_m_s=(0.0, 0.0, -1.0)))
    assert "workspace" in limiters
    assert arm.tcp[2] - ARM.tool.tip_below_tcp_m >= ARM.motion.table_clearance_m


@pytest.mark.parametrize(("force_n", "most_m"), [(CONTACT + 1.0, 6e-3), (HARD + 1.0, 2e-3)])
def test_a_push_stops_a_descent_as_joints_brake_or_at_once_if_it_is_hard_and_is_reported(arm, force_n, most_m):
    for _ in range(12):
        arm.step(go(distance=0.0, height=0.03))
    z = arm.tcp[2]
    arm.force = (0.0, 0.0, force_n)
    limiters = arm.step(go(distance=0.0, height=0.03))
    assert "contact" in limiters
    assert arm.mover.is_in_contact
    assert arm.tcp[2] == pytest.approx(z, abs=most_m)
    for _ in range(10):
        arm.step(go(distance=0.0, height=0.03))
    assert arm.tcp[2] > z - most_m
    arm.force = (0.0, 0.0, 0.0)
    arm.step(go(distance=0.0, height=0.21))
    assert not arm.mover.is_in_contact


def test_falling_back_from_a_push_keeps_every_joints_speed(arm):
    mover, measured = arm.mover, arm.q
    path = [arm.q]
    mover.begin_step(go(distance=0.0, height=0.03), arm_state(measured, tcp_m=START), duration_s=0.2)
    path += [mover.tick(arm_state(measured, tcp_m=START)) for _ in range(20)]
    pushed = arm_state(measured, tcp_m=START, force_n=(0.0, 0.0, HARD + 1.0))
    path += [mover.tick(pushed) for _ in range(6)]
    assert (np.abs(np.diff(path, axis=0)).max(0) <= [DT * j.speed_rad_s for j in ARM.joints]).all()
    assert path[-1] == pytest.approx(measured, abs=2e-3)


def test_joint_targets_go_in_steps_of_the_tool(arm):
    wanted = KINEMATICS.solve((0.5, 0.15, 0.25), ARM.home_rad)
    before = arm.mover.target_m
    assert "max_step" in arm.step(JointTarget(q_rad=wanted))
    assert math.dist(before, arm.mover.target_m) <= 0.022 * 1.001
    for _ in range(30):
        limiters = arm.step(JointTarget(q_rad=wanted))
    assert limiters == ()
    assert arm.q == pytest.approx(wanted, abs=1e-5)


def test_joint_targets_outside_range_or_workspace_are_stopped_and_said(arm):
    far = (*Q_START[:5], 50.0)
    assert "joint_range" in arm.step(JointTarget(q_rad=far))
    up = (Q_START[0], Q_START[1] - 1.0, *Q_START[2:])
    for _ in range(40):
        limiters = arm.step(JointTarget(q_rad=up))
    assert "workspace" in limiters
    assert arm.tcp[2] <= ARM.motion.workspace_m[1][2] + 1e-6


def test_a_twist_turns_the_tool(arm):
    for _ in range(20):
        arm.step(Twist(linear_m_s=(0.0, 0.0, 0.0), angular_rad_s=(0.0, 0.0, 0.5)))
    for _ in range(10):
        arm.step(go(distance=0.0))
    turned = KINEMATICS.solve(START, ARM.home_rad, yaw_rad=ARM.tool_yaw_rad + 0.5)
    assert arm.q == pytest.approx(turned, abs=1e-3)


def test_seeding_forgets_everything_before(arm):
    for _ in range(7):
        arm.step(go(angle=1.0, height=0.1))
    arm.force = (0.0, 0.0, 2 * CONTACT)
    arm.step(go(distance=0.0, height=0.03))
    fresh = Perfect()
    arm.q, arm.force = Q_START, (0.0, 0.0, 0.0)
    arm.mover.seed(arm.state)
    for each in (arm, fresh):
        for k in range(6):
            each.step(go(angle=0.3 * k, height=0.12))
    assert arm.q == fresh.q
    assert arm.mover.target_m == fresh.mover.target_m
    assert arm.mover.is_in_contact == fresh.mover.is_in_contact


def test_however_long_the_tool_is_pushed_the_command_stays_inside_the_fence(arm):
    # Seen on the twin: a held object wedged on a box's wall near the edge of the workspace walked the tool outwards,
    # a millimetre a tick, because the command fell back to the measured joints each time.
    low, high = ARM.motion.workspace_m
    for _ in range(17):
        arm.step(go(angle=-math.pi / 2))
    mover = arm.mover
    pushed = KINEMATICS.tcp(arm.q)
    for k in range(200):
        if k % 5 == 0:
            mover.begin_step(go(angle=-math.pi / 2, height=0.025), arm.state, duration_s=5 * DT)
        commanded = KINEMATICS.tcp(mover.tick(arm_state(arm.q, tcp_m=pushed, force_n=(0.0, -20.0, 5.0))))
        assert all(a - 1e-6 <= x <= b + 1e-6 for a, x, b in zip(low, commanded, high, strict=True))
        pushed = (pushed[0], pushed[1] - 0.001, pushed[2])
        arm.q = KINEMATICS.solve(pushed, arm.q)
    assert pushed[1] < low[1] - 0.1


@pytest.mark.parametrize("beyond_m", [0.0, 0.0009, 0.003])
def test_a_command_held_down_at_a_fence_comes_up_to_the_tool(arm, beyond_m):
    # Seen on the twin: a hand that stood on a lid and was pushed out past a fence by a millimetre never rose again.
    low, high = ARM.motion.workspace_m
    commanded = (high[0] - 0.0006, 0.0, 0.0995)
    arm.q = KINEMATICS.solve(commanded, ARM.home_rad)
    arm.mover.seed(arm.state)
    measured = (high[0] + beyond_m, 0.0, 0.1035)
    state = arm_state(KINEMATICS.solve(measured, arm.q), tcp_m=measured, force_n=(0.0, 0.0, 2 * CONTACT))
    for _ in range(10):
        q = arm.mover.tick(state)
        assert all(a - 1e-6 <= x <= b + 1e-6 for a, x, b in zip(low, KINEMATICS.tcp(q), high, strict=True))
    assert KINEMATICS.tcp(q)[2] == pytest.approx(measured[2], abs=1e-4)


FAST_DT, LEASH_M = 0.002, ARM.motion.leash_m


class Following:
    """An arm whose tool trails its commands by a time, on a way that turns back at full speed."""

    def __init__(self, *, tick_s, late_s=0.0):
        self.mover = Mover(ARM, envelope=envelope(tick_s), table_m=0.0, tick_s=tick_s)
        self.mover.seed(arm_state(Q_START, tcp_m=START))
        servo = ARM.servo
        lag = lag_s(lookahead_s=servo.lookahead_s, gain=servo.gain, dead_time_s=servo.dead_time_s)
        self.n_ticks = round(0.05 / tick_s)
        self.commands = [Q_START] * (round((lag + late_s) / tick_s) + 1)
        self.limiters = set()

    @property
    def state(self):
        return arm_state(self.commands[0], tcp_m=KINEMATICS.tcp(self.commands[0]))

    def step(self, angle):
        self.mover.begin_step(go(angle=angle), self.state, duration_s=0.05)
        self.limiters.update(self.mover.limiters)
        for _ in range(self.n_ticks):
            self.commands = [*self.commands[1:], self.mover.tick(self.state)]
        return self.mover.target_m

    def turn_back(self):
        return [self.step(angle) for angle in [math.pi / 2] * 6 + [-math.pi / 2] * 6]


@pytest.mark.parametrize("late_s", [0.004, 0.01])
def test_the_leash_bends_no_way_by_how_late_a_measurement_is(late_s):
    expected, late = Following(tick_s=FAST_DT), Following(tick_s=FAST_DT, late_s=late_s)
    assert late.turn_back() == expected.turn_back()
    assert "leash" in expected.limiters


def test_the_leash_bends_no_way_by_how_long_a_tick_is():
    lock_step, wire = Following(tick_s=DT), Following(tick_s=FAST_DT)
    for one, other in zip(lock_step.turn_back(), wire.turn_back(), strict=True):
        assert math.dist(one, other) < 5e-4
    assert "leash" in lock_step.limiters


@pytest.mark.parametrize("tick_s", [DT, FAST_DT])
def test_a_tool_that_is_kept_far_from_where_its_commands_lead_is_leashed_where_it_is(tick_s):
    mover = Mover(ARM, envelope=envelope(tick_s), table_m=0.0, tick_s=tick_s)
    mover.seed(arm_state(Q_START, tcp_m=START))
    there = (START[0] + 0.01, START[1] - 0.08, START[2])
    state = arm_state(KINEMATICS.solve(there, Q_START), tcp_m=there)
    mover.begin_step(go(angle=math.pi / 2), state, duration_s=0.05)
    for _ in range(6):
        mover.tick(state)
    assert "leash" in mover.limiters
    assert math.dist(mover.target_m, there) == pytest.approx(LEASH_M, abs=1e-9)


def test_at_a_real_arms_ticks_a_way_is_found_piece_by_piece_and_is_the_same_always_as_many_ticks_later():
    made = [Mover(ARM, envelope=envelope(FAST_DT), table_m=0.0, tick_s=FAST_DT) for _ in range(2)]
    made[0]._least_s = math.inf
    paths, state = ([], []), arm_state(Q_START, tcp_m=START)
    for mover in made:
        mover.seed(state)
    for angle in (1.0, 1.5, 4.0, 2.0, 2.5):
        for mover, path in zip(made, paths, strict=True):
            mover.begin_step(go(angle=angle, distance=0.005), state, duration_s=0.05)
            path += [mover.tick(state) for _ in range(25)]
    assert paths[1] == paths[0][:1] * N_PIECES + paths[0][:-N_PIECES]
    assert math.dist(KINEMATICS.tcp(paths[0][-1]), START) > 1e-3


@pytest.mark.parametrize("n_ticks", [1, 3])
def test_intents_that_come_before_a_way_is_found_do_not_put_it_off_for_good(n_ticks):
    mover, state = Mover(ARM, envelope=envelope(FAST_DT), table_m=0.0, tick_s=FAST_DT), arm_state(Q_START, tcp_m=START)
    mover.seed(state)
    for _ in range(60 // n_ticks):
        mover.begin_step(go(angle=1.0, distance=0.002), state, duration_s=0.05)
        for _ in range(n_ticks):
            q = mover.tick(state)
    assert math.dist(KINEMATICS.tcp(q), START) > 2e-3


def test_a_hold_and_what_gives_way_to_a_push_forget_a_way_that_is_being_found():
    pushed = arm_state(Q_START, tcp_m=START, force_n=(0.0, 0.0, 2 * CONTACT))
    for stop in (lambda m: m.hold("no_intent"), lambda m: m.tick(pushed), lambda m: m.seed(arm_state(Q_START))):
        mover, state = (
            Mover(ARM, envelope=envelope(FAST_DT), table_m=0.0, tick_s=FAST_DT),
            arm_state(Q_START, tcp_m=START),
        )
        mover.seed(state)
        mover.begin_step(go(angle=1.0, distance=0.02), state, duration_s=0.05)
        mover.tick(state)
        stop(mover)
        target_m = mover.target_m
        for _ in range(10):
            mover.tick(state)
        assert mover.target_m == target_m
