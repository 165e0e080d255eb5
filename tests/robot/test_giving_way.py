"""What a push does to a command: up to the hard force it keeps to the joints' accelerations, and nothing sticks."""

import math

import numpy as np
import pytest
from msgspec.structs import replace

from robot.chain import ToolChain
from robot.hal.fake import FakeArm
from robot.kinematics import Kinematics
from robot.messages import Heading, Hold, Twist
from robot.motion import Mover
from robot.motion.holding import speed_step
from robot.safety import Gate, GateLimits
from tests.support.profiles import ARM, envelope
from tests.support.stations import arm_state, command

START = Kinematics(ARM).solve((0.42, 0.0, 0.2), ARM.home_rad)
HARD = ARM.motion.hard_force_n
LAG_S, STEP_S = 0.03, 0.05
PUSHED_RAD = 0.004
REACH_M = 0.002
UP = np.array([0.0, 0.0, 1.0])


class Pushed:
    """Motion and gate on an arm that trails what it is told and that a test pushes; a refusal fails."""

    def __init__(self, dt, profile):
        self.dt, self.chain = dt, ToolChain(ARM)
        limits = GateLimits.of(ARM, FakeArm(arm=ARM, tick_s=dt).spec, table_m=0.0, tick_s=dt)
        self.envelope = envelope(dt, profile)
        self.mover = Mover(ARM, envelope=self.envelope, table_m=0.0, tick_s=dt)
        self.gate = Gate(arm=self, limits=limits, envelope=self.envelope, chain=self.chain)
        self.path = [START] * (round(LAG_S / dt) + 1)
        self.force_n, self.bent_rad, self.n = (0.0, 0.0, 0.0), (0.0,) * 6, 0
        self.mover.seed(self.state())
        self.gate.seed(self.state())

    def write(self, sent):
        self.path.append(sent.q_rad)

    def stop(self):
        return True

    @property
    def tcp_m(self):
        return self.chain.tcp(self.path[-1])

    def state(self):
        q = tuple(a + b for a, b in zip(self.path[-1 - round(LAG_S / self.dt)], self.bent_rad, strict=True))
        at = arm_state(q, tcp_m=self.chain.tcp(q), force_n=self.force_n)
        return replace(at, stamp_ns=self.n * round(self.dt * 1e9))

    def step(self, intent, seconds=STEP_S):
        self.gate.admit(intent, now_ns=self.n * round(self.dt * 1e9))
        self.mover.begin_step(intent, self.state(), duration_s=seconds)
        for _ in range(round(seconds / self.dt)):
            self.tick()

    def tick(self):
        now_ns, state = self.n * round(self.dt * 1e9), self.state()
        sent = command(self.mover.tick(state), sequence=self.n + 1, stamp_ns=now_ns)
        verdict = self.gate.write(sent, state, now_ns=now_ns)
        assert verdict is None, verdict
        self.n += 1

    def push(self, rng, most_n):
        way = rng.normal(size=3) + UP
        self.force_n = tuple((way / np.linalg.norm(way) * rng.uniform(0.0, most_n)).tolist())
        self.bent_rad = tuple(rng.uniform(-PUSHED_RAD, PUSHED_RAD, size=6).tolist())

    def let_go(self):
        self.force_n, self.bent_rad = (0.0, 0.0, 0.0), (0.0,) * 6


def any_intent(rng):
    if rng.random() < 0.3:
        return Hold()
    if rng.random() < 0.5:
        return Twist(linear_m_s=tuple(rng.uniform((-1.0, -1.0, 0.0), 1.0).tolist()))
    return Heading(
        heading_rad=rng.uniform(-math.pi, math.pi), distance_m=rng.uniform(0.0, 0.03), height_m=rng.uniform(0.08, 0.25)
    )


def changes(path, dt):
    """Return by how much joints changed their speed from tick to tick, rad/s²."""
    return np.abs(np.diff(path, n=2, axis=0)) / dt**2


@pytest.mark.parametrize("profile", ["attended", "unattended"])
@pytest.mark.parametrize("dt", [0.01, 0.002])
def test_whatever_pushes_up_to_the_hard_force_joints_keep_to_a_stops_acceleration_and_nothing_is_refused(dt, profile):
    arm, rng = Pushed(dt, profile), np.random.default_rng(7)
    for _ in range(60):
        arm.push(rng, HARD) if rng.random() < 0.4 else arm.let_go()
        arm.step(any_intent(rng))
    stop = [end.stop_rad / dt**2 for end in arm.envelope.joints]
    assert (changes(arm.path, dt) <= np.multiply(stop, 1.0 + 1e-6)).all()


@pytest.mark.parametrize(("force_n", "is_bounded"), [(HARD, True), (math.nextafter(HARD, 1e3), False)])
def test_at_the_hard_force_a_command_brakes_and_at_the_next_float_it_falls_back_at_once(force_n, is_bounded):
    arm = Pushed(0.01, "unattended")
    for _ in range(6):
        arm.step(Heading(heading_rad=0.0, distance_m=0.0, height_m=0.03))
    arm.force_n = (0.0, 0.0, force_n)
    arm.tick()
    stop = [end.stop_rad / 0.01**2 for end in arm.envelope.joints]
    assert bool((changes(arm.path, 0.01)[-1] <= np.multiply(stop, 1.0 + 1e-6)).all()) == is_bounded


@pytest.mark.parametrize("profile", ["attended", "unattended"])
@pytest.mark.parametrize("dt", [0.01, 0.002])
def test_however_it_was_pushed_an_arm_that_is_let_go_of_reaches_a_free_target_in_time(dt, profile):
    arm, rng = Pushed(dt, profile), np.random.default_rng(11)
    for _ in range(4):
        for _ in range(8):
            arm.push(rng, 1.3 * HARD) if rng.random() < 0.5 else arm.let_go()
            arm.step(any_intent(rng))
        arm.let_go()
        goal = (rng.uniform(0.35, 0.5), rng.uniform(-0.15, 0.15), rng.uniform(0.12, 0.22))
        for _ in range(60):  # three seconds for a third of a metre
            x, y, _ = (b - a for a, b in zip(arm.mover.target_m, goal, strict=True))
            arm.step(Heading(heading_rad=math.atan2(y, x), distance_m=min(0.012, math.hypot(x, y)), height_m=goal[2]))
        assert math.dist(arm.tcp_m, goal) < REACH_M


@pytest.mark.parametrize("overshoot", [0.0, 0.3, 1.58, 10.0])
def test_a_part_that_gathers_speed_keeps_room_for_what_its_jerk_overshoots_and_never_less_than_none(overshoot):
    for last in np.linspace(0.0, 2e-3, 41).tolist():
        step = speed_step(1e-3, last, overshoot)
        assert 0.0 < step <= 1e-3
        assert step + overshoot * max(0.0, step - last) <= 1e-3 * (1.0 + 1e-12)
        more = step * (1.0 + 1e-9)
        assert more + overshoot * max(0.0, more - last) > 1e-3
