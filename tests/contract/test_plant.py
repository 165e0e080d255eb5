"""One suite over every plant: what any of them must do, whatever stands behind it."""

import math

import numpy as np
import pytest

from config.loader import resolve
from robot.errors import RobotError, StaleStateError
from robot.kinematics import ToolChain
from robot.messages import ArmCommand, GripCommand
from robot.rigs import build_plant
from robot.servo import lag_s
from tests.contract.fits import PLANTS

RIGS = ("fake", "twin")
LIDS = 0b111000


def resolve_rig(name):
    return resolve(rig=name, scenario="paper", learning="default")


@pytest.fixture(scope="module", params=RIGS)
def resolved(request):
    return resolve_rig(request.param)


@pytest.fixture
def fresh(resolved):
    """A plant that nobody has connected to."""
    return build_plant(rig=resolved.rig, arm=resolved.arm, scenario=resolved.scenario)


@pytest.fixture
def plant(fresh):
    """A connected plant after a reset."""
    fresh.arm.connect()
    fresh.resetter.reset(seed=1, epoch=0, digital_out=0)
    return fresh


class Driver:
    """Sends commands tick by tick, as the gate would."""

    def __init__(self, plant, resolved):
        self.plant, self.tool = plant, resolved.arm.tool
        self.q = list(plant.arm.read().q_rad)
        self.opening, self.outputs, self.n = self.tool.stroke_m, 0, 0

    def tick(self, n=1):
        arm = self.plant.arm
        for _ in range(n):
            self.n += 1
            grip = GripCommand(opening_m=self.opening, force_n=self.tool.grip_force_n, speed_m_s=0.15)
            arm.write(
                ArmCommand(
                    stamp_ns=arm.clock.now_ns(),
                    sequence=self.n,
                    q_rad=tuple(self.q),
                    grip=grip,
                    digital_out=self.outputs,
                )
            )
            arm.clock.wait_tick()
        return arm.read()


@pytest.fixture
def driver(plant, resolved):
    return Driver(plant, resolved)


def test_every_plant_is_in_the_suite():
    built = {type(build_plant(rig=r.rig, arm=r.arm, scenario=r.scenario)) for r in map(resolve_rig, RIGS)}
    assert built == set(PLANTS)


def test_spec_and_identity_are_readable_before_connecting(fresh, resolved):
    spec, arm = fresh.arm.spec, resolved.arm
    assert spec.model == arm.name
    assert spec.rate_hz * resolved.rig.tick_s == pytest.approx(1.0)
    assert spec.q_min_rad == tuple(j.range_rad[0] for j in arm.joints)
    assert spec.q_max_rad == tuple(j.range_rad[1] for j in arm.joints)
    assert spec.qd_max_rad_s == tuple(j.speed_rad_s for j in arm.joints)
    assert spec.grip_stroke_m == arm.tool.stroke_m
    expected = resolved.rig.expected
    assert (fresh.identity.kind.value, fresh.identity.model, fresh.identity.serial) == (
        expected.kind,
        expected.model,
        expected.serial,
    )


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


def test_the_clock_ticks_on_its_grid_and_reading_passes_no_time(plant, resolved):
    clock, tick_ns = plant.arm.clock, round(resolved.rig.tick_s * 1e9)
    start = clock.now_ns()
    for k in range(1, 50):
        assert clock.wait_tick() == 0
        assert clock.now_ns() == start + k * tick_ns
        assert plant.arm.read() == plant.arm.read()
        assert plant.arm.read().stamp_ns == clock.now_ns() == plant.truth.read().stamp_ns


def test_held_at_its_joints_the_arm_stays(driver):
    start = driver.plant.arm.read()
    end = driver.tick(50)
    assert end.q_rad == pytest.approx(start.q_rad, abs=1e-3)
    assert end.tcp_position_m == pytest.approx(start.tcp_position_m, abs=5e-4)


@pytest.mark.parametrize("joint", range(6))
def test_every_joint_goes_where_it_is_told_and_only_that_joint(driver, joint):
    start = driver.plant.arm.read().q_rad
    for _ in range(40):
        driver.q[joint] += 0.002
        driver.tick()
    end = driver.tick(60).q_rad
    assert end[joint] - start[joint] == pytest.approx(0.08, abs=2e-3)
    assert np.delete(end, joint) == pytest.approx(np.delete(start, joint), abs=3e-3)


def test_on_a_ramp_the_arm_trails_by_the_servos_lag(driver, resolved):
    servo, rate, dt = resolved.arm.servo, 0.3, resolved.rig.tick_s
    for _ in range(60):
        driver.q[0] += rate * dt
        state = driver.tick()
    # The last command was sent one tick before the state was read.
    lag = (driver.q[0] + rate * dt - state.q_rad[0]) / rate
    assert lag == pytest.approx(
        lag_s(lookahead_s=servo.lookahead_s, gain=servo.gain, dead_time_s=servo.dead_time_s), abs=0.003
    )


def test_the_measured_speed_is_the_speed_of_the_joints(driver, resolved):
    for _ in range(60):
        driver.q[0] += 0.003
        state = driver.tick()
    assert state.qd_rad_s[0] == pytest.approx(0.003 / resolved.rig.tick_s, rel=0.05)


def test_the_tool_is_where_its_joints_bring_it(driver, resolved):
    chain = ToolChain(resolved.arm)
    for _ in range(20):
        driver.q[1] += 0.002
        state = driver.tick()
    assert state.tcp_position_m == pytest.approx(chain.tcp(state.q_rad), abs=2e-3)
    quat = chain.quat(state.q_rad)
    assert abs(np.dot(quat, state.tcp_quat)) == pytest.approx(1.0, abs=1e-4)


def test_stopping_rests_soon_holds_the_grip_and_can_be_repeated(driver):
    driver.opening = 0.03
    for _ in range(40):
        driver.q[0] += 0.01
        driver.tick()
    arm = driver.plant.arm
    moving, opening = arm.read().q_rad[0], arm.read().grip.opening_m
    assert arm.stop()
    assert arm.stop()
    for _ in range(80):
        arm.clock.wait_tick()
    rest = arm.read()
    for _ in range(20):
        arm.clock.wait_tick()
    assert arm.read().q_rad == pytest.approx(rest.q_rad, abs=1e-3)
    assert abs(rest.q_rad[0] - moving) < 0.25
    assert rest.grip.opening_m <= opening + 1e-3


def test_the_hand_opens_and_shuts_at_its_speed_and_an_empty_one_holds_nothing(driver, resolved):
    stroke = resolved.arm.tool.stroke_m
    driver.opening = 0.0
    openings = [driver.tick().grip.opening_m for _ in range(100)]
    assert openings[-1] == pytest.approx(0.0, abs=2e-3)
    assert (-np.diff(openings) <= 0.15 * resolved.rig.tick_s * 1.5).all()
    assert not driver.tick().grip.has_object
    assert not driver.tick().grip.is_moving
    driver.opening = stroke
    assert driver.tick(5).grip.is_moving
    assert driver.tick(100).grip.opening_m == pytest.approx(stroke, abs=2e-3)


def test_outputs_are_read_back_and_inputs_are_bits_the_arm_has(driver):
    for bits in (0b1, LIDS, 0b101010, 0):
        driver.outputs = bits
        state = driver.tick(2)
        assert state.digital_out == bits
        assert 0 <= state.digital_in < 1 << driver.plant.arm.spec.n_inputs


def layout(plant):
    return [(o.name, o.position_m, o.quat) for o in plant.truth.read().objects]


def measured(plant):
    state = plant.arm.read()
    return (state.q_rad, state.qd_rad_s, state.tcp_position_m, state.grip, state.digital_in, state.digital_out)


def test_a_reset_is_reproducible_by_its_seed_whatever_happened_before(plant, driver, resolved):
    plant.resetter.reset(seed=5, epoch=3, digital_out=LIDS)
    first = (layout(plant), measured(plant))
    driver.tick(7)
    driver.q = list(plant.arm.read().q_rad)
    driver.opening = 0.0
    driver.tick(30)
    plant.resetter.reset(seed=6, epoch=3, digital_out=0)
    assert layout(plant) != first[0]
    plant.resetter.reset(seed=5, epoch=4, digital_out=LIDS)
    assert layout(plant) != first[0]
    plant.resetter.reset(seed=5, epoch=3, digital_out=LIDS)
    assert (layout(plant), measured(plant)) == first
    other = build_plant(rig=resolved.rig, arm=resolved.arm, scenario=resolved.scenario)
    other.arm.connect()
    other.resetter.reset(seed=5, epoch=3, digital_out=LIDS)
    assert (layout(other), measured(other)) == first


@pytest.mark.parametrize("seed", range(5))
def test_after_a_reset_the_arm_rests_in_the_start_region_with_an_open_hand(plant, driver, resolved, seed):
    driver.opening = 0.0
    driver.tick(50)
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
