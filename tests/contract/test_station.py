"""One suite over a station on every plant: what a learner, a teleoperator and an operator may rely on."""

import math

import msgspec
import numpy as np
import pytest

from robot.as_came import as_came
from robot.errors import NotEngagedError, RobotConfigError, SafetyError
from robot.messages import (
    Grip,
    Heading,
    Hold,
    JointTarget,
    Outcome,
    PlantIdentity,
    PlantKind,
    StationMode,
    Twist,
)
from robot.safety import TooManyLatchesError
from sim_twin.operator import SimulatedOperator

LATCHES_ANEW = pytest.mark.slow_on_a_wire("another word of the same gate, and each takes two seconds to arm again")
EPISODES = pytest.mark.slow_on_a_wire("episodes take their time on a wire, and the plant's own resets say much of it")
ONE_OF_MANY = pytest.mark.slow_on_a_wire("shaped by the same motion, whatever the plant")
COUNTS = pytest.mark.slow_on_a_wire("the station counts, whatever its plant, and each latch takes two seconds")


@pytest.fixture
def disarmed(world):
    """A station of a test's own, an arm that is only read, and who may arm it."""
    made = world.station()
    yield made
    made[0].close()


@pytest.fixture
def engaged(world):
    """A station after a reset, an arm that is only read, and an operator."""
    made = world.engaged()
    yield made
    world.leave(made[0])


@pytest.fixture
def standing(world):
    """The same, wherever its arm stands."""
    made = world.standing()
    yield made
    world.leave(made[0])


def go(angle=0.0, distance=0.022, height=0.2, **more):
    return Heading(heading_rad=angle, distance_m=distance, height_m=height, **more)


def episode(station, *, seed, epoch, n):
    """Run random intents from a reset and return every percept, and what the gate said."""
    rng = np.random.default_rng([seed, epoch, 7])
    percepts, verdicts = [station.reset(seed=seed, epoch=epoch)], []
    for k in range(n):
        if k % 8 == 0:
            angle, height = rng.uniform(-3.0, 3.0), rng.uniform(0.1, 0.22)
        result = station.step(go(angle=angle, height=height))
        percepts.append(result.percept)
        verdicts.append((result.verdicts, result.is_void, result.executed.limiters))
    return percepts, verdicts


def is_same(world, one, other):
    """Tell whether two episodes are one: in lock-step bit for bit but for the stamps, time runs on over resets.

    In wall time the table is the same within 1 mm and so is the tool at the start; from there the steps are as long as
    the clock makes them, and the tool stays within 15 mm of the other's.
    """
    (percepts, verdicts), (its_percepts, its_verdicts) = one, other
    if world.is_lock_step:
        unstamped = [[msgspec.structs.replace(p, stamp_ns=0) for p in each] for each in (percepts, its_percepts)]
        return unstamped[0] == unstamped[1] and verdicts == its_verdicts
    places = [np.array([o.position_m for o in each[0].objects]) for each in (percepts, its_percepts)]
    away_m = [math.dist(p.tcp_position_m, q.tcp_position_m) for p, q in zip(percepts, its_percepts, strict=True)]
    return bool(np.abs(places[0] - places[1]).max() < 1e-3 and away_m[0] < 1e-3 and max(away_m) < 0.015)


# -------------------------------------------------------------------------------------------------------- engaging


def test_nothing_moves_before_the_station_is_engaged_nor_after_it_is_closed(disarmed, world):
    disarmed, arm, _ = disarmed
    assert disarmed.state.mode is StationMode.DISARMED
    with pytest.raises(NotEngagedError):
        disarmed.reset(seed=1, epoch=0)
    with pytest.raises(NotEngagedError):
        disarmed.step(Hold())
    disarmed.arm(by="tester")
    assert disarmed.state.mode is StationMode.ARMED
    with pytest.raises(NotEngagedError):
        disarmed.step(Hold())
    disarmed.engage()
    assert disarmed.state.mode is StationMode.ENGAGED
    assert not disarmed.step(Hold()).is_void
    assert not world.is_released(arm)
    disarmed.close()
    disarmed.close()
    assert disarmed.state.mode is StationMode.DISARMED
    assert world.is_released(arm)
    with pytest.raises(NotEngagedError):
        disarmed.step(Hold())


def test_a_plant_that_is_not_the_one_the_rig_names_is_not_armed(world, resolved):
    expected = msgspec.structs.replace(resolved.rig.expected, serial="another")
    other = msgspec.structs.replace(resolved, rig=msgspec.structs.replace(resolved.rig, expected=expected))
    station, _, operator = world.station(other)
    with pytest.raises((SafetyError, RobotConfigError), match="another"):  # on a wire connecting refuses already
        operator.arm_once(station)
    assert station.state.mode is StationMode.DISARMED
    station.close()


class LooksReal:
    """A station that says its arm is a real one."""

    identity = PlantIdentity(kind=PlantKind.REAL, model="ur5e", serial="20225500001")

    def __init__(self, station):
        self._station = station

    def __getattr__(self, name):
        return getattr(self._station, name)


def test_the_simulated_operator_refuses_a_real_arm(disarmed):
    station, _, operator = disarmed
    assert isinstance(operator, SimulatedOperator)
    with pytest.raises(SafetyError, match="real arm"):
        operator.arm_once(LooksReal(station))
    assert station.state.mode is StationMode.DISARMED


# ----------------------------------------------------------------------------------------------------------- steps


def test_a_step_takes_its_time_and_says_what_it_did(world, engaged, resolved):
    station, arm, _ = engaged
    step_ns = round(resolved.arm.motion.step_s * 1e9)
    before = arm.read()
    for k in range(1, 6):
        result = station.step(go(angle=0.5))
        late_ns = result.percept.stamp_ns - before.stamp_ns - k * step_ns
        assert late_ns == 0 if world.is_lock_step else -step_ns < late_ns < 0.5e9
        assert result.executed.duration_s == resolved.arm.motion.step_s
        assert result.verdicts == ()
        assert not result.is_void
    moved = np.subtract(result.percept.tcp_position_m, before.tcp_position_m)
    assert moved @ (math.cos(0.5), math.sin(0.5), 0.0) > 0.03


def test_what_was_asked_for_and_what_was_sent_last_are_both_kept(engaged):
    station, _, _ = engaged
    asked = go(angle=0.5)
    for _ in range(4):
        done = station.step(asked).executed
        assert done.requested == asked
    assert done.sent.sequence > 0
    assert max(abs(a - b) for a, b in zip(done.sent.q_rad, station.measured.q_rad, strict=True)) < 0.1
    assert station.step(Hold()).executed.sent.sequence > done.sent.sequence


def test_the_parts_of_a_path_add_up_and_it_rests_on_the_target(engaged):
    station, _, _ = engaged
    start = np.array(station.step(go(distance=0.0)).percept.tcp_position_m)
    results = [station.step(go(angle=1.0)) for _ in range(5)] + [station.step(go(distance=0.0)) for _ in range(15)]
    total = start + np.sum([r.executed.moved_m for r in results], axis=0)
    last = results[-1]
    assert total == pytest.approx(last.percept.tcp_position_m, abs=1e-9)
    assert last.percept.tcp_position_m == pytest.approx(last.executed.target_m, abs=1e-3)


def test_the_tool_trails_the_target_by_one_to_three_steps(engaged):
    station, _, _ = engaged
    lags = []
    for k in range(12):
        result = station.step(go(angle=0.2 if k < 6 else math.pi))
        lags.append(math.dist(result.percept.tcp_position_m, result.executed.target_m) / 0.022)
    assert max(lags) < 4.2  # the leash
    assert 1.0 < lags[5] < 3.5


@pytest.mark.parametrize("duration", [0.0, -0.05, 0.0131, math.nan, math.inf, 1e9])
def test_a_duration_that_is_not_whole_ticks_is_an_error_and_no_latch(standing, duration):
    station, _, _ = standing
    with pytest.raises(RobotConfigError, match="duration"):
        station.step(Hold(), duration_s=duration)
    assert station.state.mode is StationMode.ENGAGED


def test_an_intent_grown_old_within_a_long_step_comes_to_rest_unlatched(standing):
    station, arm, _ = standing
    for _ in range(5):
        station.step(go())
    result = station.step(go(), duration_s=1.5)
    assert not result.is_void
    assert max(abs(v) for v in arm.read().qd_rad_s) < 5e-3
    assert result.percept.tcp_position_m == pytest.approx(result.executed.target_m, abs=1e-3)


def test_the_percept_counts_what_the_spec_says(standing):
    station, _, _ = standing
    percept, spec = station.step(Hold()).percept, station.spec
    assert len(percept.distances_m) == spec.n_distances == len(spec.distance_names)
    assert len(percept.button_states) == spec.n_buttons
    assert len(percept.ages_s) == len(percept.valid) == spec.n_distances + spec.n_buttons
    places = {o.name: o.position_m for o in percept.objects}
    for name, d in zip(spec.distance_names, percept.distances_m, strict=True):
        if name == "table":
            assert d == pytest.approx(percept.tcp_position_m[2] - spec.table_height_m)
        else:
            assert d == pytest.approx(math.dist(percept.tcp_position_m, places[name]))


def test_the_hand_does_what_an_intent_asks(standing, resolved):
    station, _, _ = standing
    for _ in range(16):
        shut = station.step(Hold(grip=Grip.CLOSE))
    assert shut.percept.grip.opening_m < 0.01
    for _ in range(16):
        wide = station.step(Hold(grip=Grip.OPEN))
    assert wide.percept.grip.opening_m == pytest.approx(resolved.arm.tool.stroke_m, abs=2e-3)


# ------------------------------------------------------------------------------------------------------ repeating


@pytest.fixture
def two(world):
    """Two stations that have done nothing yet; one and the same, after what it has done, where one is all there is."""
    made = [world.standing() for _ in range(2)]
    yield [(station, operator) for station, _, operator in made]
    for station, _, _ in made:
        world.leave(station)


@EPISODES
def test_the_same_seed_is_the_same_episode_and_another_seed_another(world, two):
    (one, _), (other, _) = two
    first = episode(one, seed=3, epoch=0, n=8)
    assert not is_same(world, episode(one, seed=4, epoch=0, n=8), first)
    assert is_same(world, episode(other, seed=3, epoch=0, n=8), first)


@EPISODES
def test_an_epoch_depends_on_nothing_before_its_reset(world, two):
    (through, _), (straight, _) = two
    for epoch in (0, 1):
        episode(through, seed=3, epoch=epoch, n=world.n_steps)
    first = episode(through, seed=3, epoch=2, n=world.n_steps)
    assert is_same(world, episode(straight, seed=3, epoch=2, n=world.n_steps), first)


@EPISODES
def test_an_epoch_after_a_latch_is_the_epoch_that_would_have_been(world, two):
    station, operator = two[0]
    expected = episode(station, seed=3, epoch=2, n=world.n_steps)
    station.step(go(angle=math.nan))
    operator.rearm(station, seed=9, epoch=0)
    assert is_same(world, episode(station, seed=3, epoch=2, n=world.n_steps), expected)


# -------------------------------------------------------------------------------------------------------- refusing


HOSTILE = [
    (go(angle=math.nan), "not_finite"),
    (JointTarget(q_rad=(1e8,) * 6), "out_of_reason"),
    ("up", "malformed"),
]
MORE_HOSTILE = [
    (go(distance=1e12), "out_of_reason"),
    (go(distance="far"), "malformed"),
    (None, "malformed"),
    (go(distance=math.inf), "not_finite"),
    (go(height=-math.inf), "not_finite"),
    (go(distance=-0.02), "out_of_reason"),
    (Twist(linear_m_s=(0.0, math.nan, 0.0)), "not_finite"),
    (Twist(linear_m_s=(1e5, 0.0, 0.0)), "out_of_reason"),
    (JointTarget(q_rad=(math.nan,) * 6), "not_finite"),
    (JointTarget(q_rad=(0.0,) * 5), "malformed"),
    (object(), "malformed"),
]


@pytest.mark.parametrize(
    ("intent", "reason"), [*HOSTILE, *(pytest.param(*each, marks=LATCHES_ANEW) for each in MORE_HOSTILE)]
)
def test_a_hostile_intent_is_refused_with_a_clear_verdict_and_moves_nothing(standing, intent, reason):
    station, arm, _ = standing
    for _ in range(3):
        station.step(Hold())
    before = arm.read()
    result = station.step(intent)
    assert [v.outcome for v in result.verdicts] == [Outcome.REFUSED]
    assert result.verdicts[0].reason == reason
    assert "expected" in result.verdicts[0].detail
    assert result.verdicts[0].is_latched
    assert result.is_void
    assert result.executed.requested == as_came(intent), "what was asked for is kept as it came"
    assert result.verdicts[0].refused is not None
    assert station.state.mode is StationMode.LATCHED
    assert reason in station.state.reason
    for _ in range(30):
        arm.clock.wait_tick()
    assert arm.read().q_rad == pytest.approx(before.q_rad, abs=2e-3)


@pytest.mark.parametrize(
    "intent",
    [
        go(distance=5.0),
        pytest.param(go(height=9.0), marks=ONE_OF_MANY),
        pytest.param(go(height=-9.0), marks=ONE_OF_MANY),
        pytest.param(go(angle=500.0), marks=ONE_OF_MANY),
        Twist(linear_m_s=(9.0, -9.0, -9.0)),
        JointTarget(q_rad=(6.0, 6.0, -6.0, 6.0, -6.0, 6.0)),
    ],
)
def test_a_large_intent_is_shaped_and_never_latches(standing, intent):
    station, _, _ = standing
    for _ in range(8):
        before = station.step(Hold()).executed.target_m
        result = station.step(intent)
        assert result.verdicts == ()
        assert math.dist(before, result.executed.target_m) <= station.spec.max_step_m * 1.01
    low, high = station.spec.workspace_m
    assert all(a - 5e-3 <= x <= b + 5e-3 for a, x, b in zip(low, result.percept.tcp_position_m, high, strict=True))


def test_a_latch_is_not_cleared_by_a_reset_but_by_an_operator_after_the_plants(standing):
    station, _, operator = standing
    station.step(go(angle=math.nan))
    for attempt in (lambda: station.step(Hold()), lambda: station.reset(seed=1, epoch=1)):
        with pytest.raises(NotEngagedError, match="not_finite"):
            attempt()
    for attempt in (lambda: station.arm(by="tester"), station.engage, lambda: station.clear_latch(by="tester")):
        with pytest.raises(SafetyError):
            attempt()
    assert station.state.mode is StationMode.LATCHED
    operator.rearm(station, seed=1, epoch=1)
    assert station.state.mode is StationMode.ENGAGED
    assert not station.step(go()).is_void


@LATCHES_ANEW
def test_after_a_latch_motion_starts_from_rest_at_the_measured_joints(engaged):
    station, arm, operator = engaged
    for _ in range(6):
        station.step(go(angle=0.4))
    station.step(go(angle=math.nan))
    operator.rearm(station, seed=1, epoch=1)
    start = arm.read().tcp_position_m
    result = station.step(Hold())
    assert result.executed.target_m == pytest.approx(start, abs=1e-3)
    assert math.dist(result.percept.tcp_position_m, start) < 1e-3


@COUNTS
def test_too_many_latches_fail_the_run(world, resolved):
    few = msgspec.structs.replace(resolved, rig=msgspec.structs.replace(resolved.rig, max_latches=2))
    station, _, operator = world.station(few)
    operator.arm_once(station)
    for _ in range(2):
        station.step(go(angle=math.nan))
        operator.rearm(station, seed=1, epoch=0)
    station.step(go(angle=math.nan))
    with pytest.raises(TooManyLatchesError):
        operator.rearm(station, seed=1, epoch=0)
    assert station.n_latches == 3
    station.close()
