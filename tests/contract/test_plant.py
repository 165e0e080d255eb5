"""One suite over every plant: what any of them must do, whatever stands behind it.

Commands are functions of the arm's own time, so that they mean the same where ticks are missed.
"""

import math
from statistics import median

import numpy as np
import pytest

from config.loader import resolve
from robot.chain import ToolChain
from robot.errors import RobotError, StaleStateError
from robot.messages import ArmCommand, GripCommand
from robot.rigs import build_plant
from robot.servo import lag_s
from tests.contract.fits import PLANTS
from tests.support.contract_rigs import WORLDS

LIDS = 0b111000
MORE_SEEDS = pytest.mark.slow_on_a_wire("drawn from the same region, and each is an engagement of two seconds")
RATES_RAD_S = np.array([0.3, 0.1, 0.0, 0.0, 0.0, -0.2])


@pytest.fixture
def fresh(world):
    """A plant that nobody has connected to."""
    made = world.fresh()
    yield made
    made.arm.close()


@pytest.fixture
def plant(world):
    """A connected plant after a reset."""
    return world.plant()


class Driver:
    """Sends commands tick by tick, as the gate would, from the first one on."""

    def __init__(self, plant, resolved):
        self.plant, self.tool = plant, resolved.arm.tool
        self.tick_ns = round(resolved.rig.tick_s * 1e9)
        plant.arm.engage()
        self.q = np.array(plant.arm.read().q_rad)
        self.opening, self.outputs, self.n = self.tool.stroke_m, 0, 0

    def run(self, duration_s, path=None):
        """Follow a path, a function of seconds since now; return what was measured after each tick."""
        arm, start_ns, states = self.plant.arm, self.plant.arm.clock.now_ns(), []
        while (now_ns := arm.clock.now_ns()) + self.tick_ns // 2 < start_ns + duration_s * 1e9:
            if path is not None:
                self.q = path((now_ns - start_ns) * 1e-9)
            self.n += 1
            grip = GripCommand(opening_m=self.opening, force_n=self.tool.grip_force_n, speed_m_s=0.15)
            arm.write(
                ArmCommand(stamp_ns=now_ns, sequence=self.n, q_rad=tuple(self.q), grip=grip, digital_out=self.outputs)
            )
            arm.clock.wait_tick()
            states.append(arm.read())
        return states

    def ramp(self, rates_rad_s, duration_s):
        """Move every joint at its rate."""
        start = self.q.copy()
        return self.run(duration_s, lambda t_s: start + np.asarray(rates_rad_s) * t_s)


@pytest.fixture
def driver(plant, resolved):
    return Driver(plant, resolved)


class Recording:
    """What was measured in one engagement, phase by phase."""

    def __init__(self, world):
        driver = Driver(world.plant(), world.resolved)
        self.start = driver.plant.arm.read()
        self.held = driver.run(0.3)
        self.by_joint = [self._turn(driver, joint) for joint in range(6)]
        self.by_outputs = {}
        for driver.outputs in (0b1, LIDS, 0b101010, 0):
            self.by_outputs[driver.outputs] = driver.run(0.1)[-1]
        driver.opening = 0.0
        self.shutting = driver.run(0.9)
        driver.opening = driver.tool.stroke_m
        self.opening = driver.run(0.9)
        self.ramp_from, self.ramp_ns = driver.q.copy(), driver.plant.arm.clock.now_ns()
        self.ramp = driver.ramp(RATES_RAD_S, 0.8)

    @staticmethod
    def _turn(driver, joint):
        """Turn one joint by 0.08 rad and return the joints before and after."""
        one, before, goal = np.eye(6)[joint], driver.plant.arm.read().q_rad, driver.q + 0.08 * np.eye(6)[joint]
        driver.ramp(0.4 * one, 0.2)
        return np.array(before), np.array(driver.run(0.25, lambda _: goal)[-1].q_rad)

    def steady(self):
        """Return what was measured on the ramp when every start has died away."""
        return [s for s in self.ramp if s.stamp_ns - self.ramp_ns > 0.4e9]


@pytest.fixture
def recording(world):
    if world.recording is None:
        world.recording = Recording(world)
    return world.recording


def test_every_plant_is_in_the_suite():
    rigs = [resolve(rig=name, scenario="paper", learning="default") for name in WORLDS]
    assert {type(build_plant(rig=r.rig, arm=r.arm, scenario=r.scenario)) for r in rigs} == set(PLANTS)


def test_spec_kind_and_model_are_readable_before_connecting_and_the_serial_after(fresh, resolved):
    spec, arm = fresh.arm.spec, resolved.arm
    assert spec.model == arm.name
    assert spec.rate_hz * resolved.rig.tick_s == pytest.approx(1.0)
    assert spec.q_min_rad == tuple(j.range_rad[0] for j in arm.joints)
    assert spec.q_max_rad == tuple(j.range_rad[1] for j in arm.joints)
    assert spec.qd_max_rad_s == tuple(j.speed_rad_s for j in arm.joints)
    assert spec.grip_stroke_m == arm.tool.stroke_m
    expected = resolved.rig.expected
    assert (fresh.identity.kind.value, fresh.identity.model) == (expected.kind, expected.model)
    fresh.arm.connect()
    assert fresh.identity.serial == expected.serial


def test_nothing_is_read_or_written_before_connecting(fresh, resolved):
    with pytest.raises(StaleStateError, match="connect"):
        fresh.arm.read()
    grip = GripCommand(opening_m=0.085, force_n=20.0, speed_m_s=0.1)
    with pytest.raises(RobotError, match="connect"):
        fresh.arm.write(
            ArmCommand(stamp_ns=0, sequence=1, q_rad=tuple(resolved.arm.home_rad), grip=grip, digital_out=0)
        )


def test_connecting_moves_nothing(fresh):
    fresh.arm.connect()
    before = fresh.arm.read()
    for _ in range(30):
        fresh.arm.clock.wait_tick()
    after = fresh.arm.read()
    assert after.q_rad == pytest.approx(before.q_rad, abs=1e-3)
    assert after.grip.opening_m == pytest.approx(before.grip.opening_m, abs=1e-3)
    assert after.digital_out == before.digital_out


def test_the_clock_ticks_on_its_grid_and_what_is_read_is_of_now(world, plant, resolved):
    clock, tick_ns = plant.arm.clock, round(resolved.rig.tick_s * 1e9)
    clock.wait_tick()
    start = before = clock.now_ns()
    n_missed = 0
    for k in range(1, 50):
        n_missed += clock.wait_tick()
        state, truth = plant.arm.read(), plant.truth.read()
        if world.is_lock_step:
            assert n_missed == 0
            assert clock.now_ns() == start + k * tick_ns
            assert plant.arm.read() == state
            assert state.stamp_ns == clock.now_ns() == truth.stamp_ns
        else:
            now = clock.now_ns()
            assert 0 <= now - state.stamp_ns < 50_000_000
            assert 0 <= now - truth.stamp_ns < 100_000_000
            assert now - before > tick_ns // 2, "waiting lets time pass"
            before = now
    assert (49 + n_missed - 1) * tick_ns <= clock.now_ns() - start <= 2 * (49 + n_missed) * tick_ns


def test_held_at_its_joints_the_arm_stays(recording):
    start, end = recording.start, recording.held[-1]
    assert end.q_rad == pytest.approx(start.q_rad, abs=1e-3)
    assert end.tcp_position_m == pytest.approx(start.tcp_position_m, abs=5e-4)


@pytest.mark.parametrize("joint", range(6))
def test_every_joint_goes_where_it_is_told_and_only_that_joint(recording, joint):
    start, end = recording.by_joint[joint]
    assert end[joint] - start[joint] == pytest.approx(0.08, abs=2e-3)
    assert np.delete(end, joint) == pytest.approx(np.delete(start, joint), abs=3e-3)


def test_on_a_ramp_the_arm_trails_by_the_servos_lag(world, recording, resolved):
    start, start_ns, servo = recording.ramp_from, recording.ramp_ns, resolved.arm.servo
    lag = median((s.stamp_ns - start_ns) * 1e-9 - (s.q_rad[0] - start[0]) / RATES_RAD_S[0] for s in recording.steady())
    assert lag == pytest.approx(
        lag_s(lookahead_s=servo.lookahead_s, gain=servo.gain, dead_time_s=servo.dead_time_s),
        abs=0.003 if world.is_lock_step else 0.006,
    )


def test_the_measured_speed_is_the_speed_of_the_joints(recording):
    speeds = np.median([s.qd_rad_s for s in recording.steady()], axis=0)
    assert speeds == pytest.approx(RATES_RAD_S, rel=0.05, abs=5e-3)


def test_the_tool_is_where_its_joints_bring_it(recording, resolved):
    chain = ToolChain(resolved.arm)
    for state in recording.ramp[::10]:
        assert state.tcp_position_m == pytest.approx(chain.tcp(state.q_rad), abs=2e-3)
        assert abs(np.dot(chain.quat(state.q_rad), state.tcp_quat)) == pytest.approx(1.0, abs=1e-4)


def test_outputs_are_read_back_and_inputs_are_bits_the_arm_has(recording, fresh):
    for bits, state in recording.by_outputs.items():
        assert state.digital_out == bits
        assert 0 <= state.digital_in < 1 << fresh.arm.spec.n_inputs


def test_the_hand_opens_and_shuts_at_its_speed_and_an_empty_one_holds_nothing(recording, resolved):
    shutting, opening = recording.shutting, recording.opening
    assert shutting[-1].grip.opening_m == pytest.approx(0.0, abs=2e-3)
    for early, late in pairs(shutting, apart_s=0.1):
        took_s = (late.stamp_ns - early.stamp_ns) * 1e-9
        assert early.grip.opening_m - late.grip.opening_m <= 0.15 * took_s * 1.2 + 2e-3
    assert not shutting[-1].grip.has_object
    assert not shutting[-1].grip.is_moving
    assert opening[len(opening) // 9].grip.is_moving
    assert opening[-1].grip.opening_m == pytest.approx(resolved.arm.tool.stroke_m, abs=2e-3)


def pairs(states, *, apart_s):
    """Return each state with the first one that is so much younger."""
    found, k = [], 0
    for early in states:
        while k < len(states) and states[k].stamp_ns - early.stamp_ns < apart_s * 1e9:
            k += 1
        if k == len(states):
            break
        found.append((early, states[k]))
    return found


def test_stopping_rests_arm_and_empty_fingers_soon_can_be_repeated_and_is_no_end(driver):
    driver.opening = 0.0
    driver.ramp([1.0, 0, 0, 0, 0, 0], 0.4)
    arm = driver.plant.arm
    before = arm.read()
    assert arm.stop()
    assert arm.stop()
    wait(arm, 0.4)
    rest = arm.read()
    wait(arm, 0.1)
    assert arm.read().q_rad == pytest.approx(rest.q_rad, abs=1e-3)
    assert abs(rest.q_rad[0] - before.q_rad[0]) < 0.25
    check_fingers(before, rest, arm.read())
    arm.engage()
    driver.q, driver.opening = np.array(arm.read().q_rad), driver.tool.stroke_m
    again = driver.ramp([0.2, 0, 0, 0, 0, 0], 0.25)
    assert median(s.qd_rad_s[0] for s in again[len(again) // 2 :]) == pytest.approx(0.2, abs=0.03)
    assert again[-1].grip.opening_m > before.grip.opening_m
    assert arm.stop()
    rest = arm.read()
    wait(arm, 0.2)
    check_fingers(again[-1], rest, arm.read())


def check_fingers(before, rest, after):
    """Fingers that were on their way stopped there, opening as well as closing."""
    assert 0.01 < before.grip.opening_m < 0.08
    assert rest.grip.opening_m == pytest.approx(before.grip.opening_m, abs=0.012)
    assert after.grip.opening_m == pytest.approx(rest.grip.opening_m, abs=1e-3)
    assert not after.grip.is_moving


def wait(arm, duration_s):
    end_ns = arm.clock.now_ns() + duration_s * 1e9
    while arm.clock.now_ns() < end_ns:
        arm.clock.wait_tick()


def test_commands_that_cease_move_nothing_any_further(driver):
    driver.ramp([0.4, 0, 0, 0, 0, 0], 0.3)
    arm = driver.plant.arm
    wait(arm, 0.4)
    rest = arm.read()
    assert rest.q_rad[0] - driver.q[0] == pytest.approx(0.0, abs=0.02)
    wait(arm, 0.1)
    assert arm.read().q_rad == pytest.approx(rest.q_rad, abs=1e-3)


def layout(plant):
    return [(o.name, o.position_m, o.quat) for o in plant.truth.read().objects]


def measured(plant):
    state = plant.arm.read()
    return (
        state.q_rad,
        state.qd_rad_s,
        state.tcp_position_m,
        state.grip.opening_m,
        state.digital_in,
        state.digital_out,
    )


def snapshot(plant):
    return layout(plant), measured(plant)


def is_same(world, one, other):
    """Tell whether two snapshots show one table and one arm: bit for bit in lock-step, else within 2 mm and 2 mrad."""
    if world.is_lock_step:
        return one == other
    (objects, arm), (its_objects, its_arm) = one, other
    assert [o[0] for o in objects] == [o[0] for o in its_objects]
    numbers = np.hstack([np.hstack(o[1:]) for o in objects] + [np.hstack(arm)])
    its_numbers = np.hstack([np.hstack(o[1:]) for o in its_objects] + [np.hstack(its_arm)])
    return bool(np.abs(numbers - its_numbers).max() <= 2e-3)


def test_a_reset_is_reproducible_by_its_seed_whatever_happened_before(world, plant):
    plant.resetter.reset(seed=5, epoch=3, digital_out=LIDS)
    first = snapshot(plant)
    driver = Driver(plant, world.resolved)
    driver.outputs, driver.opening = LIDS, 0.0
    driver.run(0.3)
    plant.resetter.reset(seed=6, epoch=3, digital_out=0)
    assert not is_same(world, snapshot(plant), first)
    plant.resetter.reset(seed=5, epoch=4, digital_out=LIDS)
    assert not is_same(world, snapshot(plant), first)
    plant.resetter.reset(seed=5, epoch=3, digital_out=LIDS)
    assert is_same(world, snapshot(plant), first)
    other = world.plant()
    other.resetter.reset(seed=5, epoch=3, digital_out=LIDS)
    assert is_same(world, snapshot(other), first)


@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(seed, marks=MORE_SEEDS) for seed in (2, 3, 4))])
def test_after_a_reset_the_arm_rests_in_the_start_region_with_an_open_hand(plant, driver, resolved, seed):
    driver.opening = 0.0
    driver.run(0.5)
    plant.resetter.reset(seed=seed, epoch=0, digital_out=LIDS)
    state, start = plant.arm.read(), resolved.scenario.start
    for x, centre, spread in zip(state.tcp_position_m, start.position_m, start.spread_m, strict=True):
        assert abs(x - centre) <= spread + 1e-3
    assert max(abs(v) for v in state.qd_rad_s) < 0.02
    assert state.grip.opening_m == pytest.approx(resolved.arm.tool.stroke_m, abs=2e-3)
    assert not state.grip.has_object
    assert state.digital_out == LIDS
    # The tool points straight down: its turn is half a turn about an axis in the plane.
    assert math.hypot(state.tcp_quat[0], state.tcp_quat[3]) < 0.01


def test_time_never_goes_back_over_a_reset(plant):
    before = plant.arm.clock.now_ns()
    for _ in range(5):
        plant.arm.clock.wait_tick()
    plant.resetter.reset(seed=1, epoch=1, digital_out=0)
    assert plant.arm.clock.now_ns() >= before + 5


def test_the_truth_names_everything_in_the_scenarios_order(plant, resolved):
    scenario = resolved.scenario
    names = [e.name for e in (*scenario.buttons, *scenario.boxes, *scenario.cylinders)]
    assert [o.name for o in plant.truth.read().objects] == names


def test_closing_can_be_repeated_and_ends_reading(plant):
    plant.arm.close()
    plant.arm.close()
    with pytest.raises(StaleStateError):
        plant.arm.read()
