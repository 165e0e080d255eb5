"""Arming ends with what it was for: its source, its profile, its lease. On a whole station."""

import pytest

from config.rig import PlantExpected
from robot.errors import NotEngagedError, SafetyError
from robot.hal.fake import FakePlant
from robot.local_station import LocalStation
from robot.messages import Hold, PlantIdentity, PlantKind, StationMode, Twist
from robot.rigs import build_station
from robot.safety import Arming, Grant
from sim_twin.operator import SimulatedOperator
from tests.support.stations import fake_rig
from tests.support.words import HostTime

LIFE_NS = 500_000_000
GRANT = Grant(source="teleop", profile="attended", lease=1)
IDENTITY = PlantIdentity(kind=PlantKind.FAKE, model="ur5e", serial="fake")


@pytest.fixture
def world():
    """A station of a teleoperator's, engaged, with its plant and its host's clock."""
    resolved, host = fake_rig(), HostTime(now_ns=0)
    plant = FakePlant(arm=resolved.arm, scenario=resolved.scenario, rig=resolved.rig)
    station = build_station(resolved, plant=plant, host_ns=host)
    station.take_lease("teleop", life_ns=LIFE_NS)
    SimulatedOperator().arm_once(station)
    yield station, plant, host
    station.close()


def test_the_state_names_who_it_is_armed_for_and_with_which_limits(world):
    station, _, _ = world
    state = station.state
    assert (state.mode, state.source, state.profile) == (StationMode.ENGAGED, "teleop", fake_rig().rig.profile)


def test_every_step_renews_the_lease(world):
    station, _, host = world
    for _ in range(5):
        host.now_ns += LIFE_NS
        assert not station.step(Hold()).is_void
    assert station.state.mode is StationMode.ENGAGED


def test_a_source_that_says_that_it_is_there_in_time_keeps_its_lease_and_one_that_is_late_does_not(world):
    station, _, host = world
    for _ in range(5):
        host.now_ns += LIFE_NS
        station.renew_lease()
    assert station.state.mode is StationMode.ENGAGED
    host.now_ns += LIFE_NS + 1
    station.renew_lease()
    assert station.state.mode is StationMode.DISARMED


def test_where_nobody_has_a_lease_there_is_none_to_renew():
    station = build_station(fake_rig())
    station.renew_lease()
    assert (station.lease_number, station.state.mode) == (0, StationMode.DISARMED)


def test_a_source_that_was_gone_for_longer_than_its_lease_finds_the_arm_stopped_and_disarmed(world):
    station, plant, host = world
    station.step(Twist(linear_m_s=(0.1, 0.0, 0.0)))
    host.now_ns += LIFE_NS + 1
    n_stops = plant.arm.n_stops
    with pytest.raises(NotEngagedError, match="no lease is in force"):
        station.step(Twist(linear_m_s=(0.1, 0.0, 0.0)))
    assert station.state.mode is StationMode.DISARMED
    assert "teleop" in station.state.reason
    assert plant.arm.n_stops > n_stops


def test_looking_at_the_state_is_enough_to_see_it(world):
    station, _, host = world
    host.now_ns += LIFE_NS + 1
    assert station.state.mode is StationMode.DISARMED


def test_after_an_expiry_it_must_be_armed_anew(world):
    station, _, host = world
    host.now_ns += LIFE_NS + 1
    with pytest.raises(NotEngagedError):
        station.step(Hold())
    with pytest.raises(SafetyError):
        station.engage()
    SimulatedOperator().arm_once(station)
    assert not station.step(Hold()).is_void


def test_a_hand_over_stops_the_arm_and_disarms(world):
    station, plant, _ = world
    n_stops = plant.arm.n_stops
    station.hand_over("learner")
    assert plant.arm.n_stops > n_stops
    with pytest.raises(NotEngagedError, match="now there is learner"):
        station.step(Hold())
    SimulatedOperator().arm_once(station)
    assert station.state.source == "learner"


def test_who_keeps_the_lease_is_never_stopped(world):
    station, plant, _ = world
    n_stops = plant.arm.n_stops
    for _ in range(3):
        station.step(Hold())
        assert station.state.mode is StationMode.ENGAGED
    assert plant.arm.n_stops == n_stops


def test_who_lets_go_of_the_lease_leaves_a_disarmed_arm_that_another_may_have(world):
    station, _, _ = world
    station.let_go()
    assert (station.lease_number, station.state.mode) == (0, StationMode.DISARMED)
    with pytest.raises(SafetyError, match="nobody has it"):
        station.hand_over("learner")
    station.take_lease("learner")
    assert station.lease_number > 0
    station.let_go()
    station.let_go()


def test_nobody_else_gets_the_lease_but_anybody_may_stop(world):
    station, plant, _ = world
    with pytest.raises(SafetyError, match="teleop has it"):
        station.take_lease("learner")
    assert station.state.mode is StationMode.ENGAGED
    n_stops = plant.arm.n_stops
    station.stop(by="somebody who saw a hand")
    assert plant.arm.n_stops > n_stops
    assert station.state.mode is StationMode.LATCHED
    assert station.state.reason == "stopped by somebody who saw a hand"
    assert station.n_latches == 1


def test_a_stop_of_what_is_only_armed_disarms_it(world):
    station, _, _ = world
    station.hand_over("learner")
    station.arm(by="tester")
    station.stop(by="tester")
    assert station.state.mode is StationMode.DISARMED


def test_a_hand_over_of_nothing_is_refused():
    station = build_station(fake_rig())
    with pytest.raises(SafetyError, match=r"^a hand-over: expected a source that has the lease, nobody has it$"):
        station.hand_over("learner")


def test_who_took_over_keeps_the_lease_for_its_own_life_and_no_longer(world):
    station, _, host = world
    given = station.hand_over("learner", life_ns=LIFE_NS // 2)
    host.now_ns += LIFE_NS // 2
    assert station.lease_number == given.number
    host.now_ns += 1
    assert station.lease_number == 0


@pytest.mark.parametrize(
    "now",
    [
        None,
        Grant(source="learner", profile="attended", lease=1),
        Grant(source="teleop", profile="unattended", lease=1),
        Grant(source="teleop", profile="attended", lease=2),
    ],
)
@pytest.mark.parametrize("is_engaged", [False, True])
def test_arming_ends_with_its_source_its_profile_and_its_lease_each_alone(now, is_engaged):
    arming = Arming(expected=PlantExpected(kind="fake", model="ur5e", serial="fake"), max_latches=9, latch_window=9)
    arming.arm(identity=IDENTITY, by="tester", grant=GRANT)
    if is_engaged:
        arming.engage()
    arming.hold_to(GRANT)
    assert arming.state.mode is (StationMode.ENGAGED if is_engaged else StationMode.ARMED)
    arming.hold_to(now)
    assert arming.state.mode is StationMode.DISARMED


def test_a_latch_is_not_lost_when_what_it_was_armed_for_ends(world):
    station, _, host = world
    station.stop(by="tester")
    host.now_ns += LIFE_NS + 1
    assert station.state.mode is StationMode.LATCHED


def test_a_wait_for_a_reset_does_not_cost_the_lease(world):
    station, plant, host = world
    lay_out = plant.resetter.reset

    def slow(**layout):
        host.now_ns += 100 * LIFE_NS
        lay_out(**layout)

    plant.resetter.reset = slow
    station.reset(seed=1, epoch=0)
    assert station.state.mode is StationMode.ENGAGED
    assert isinstance(station, LocalStation)


def test_a_source_that_was_there_all_the_while_keeps_a_lease_that_has_run_out_and_who_was_not_loses_it(world):
    station, _, host = world
    station.stop(by="tester")
    host.now_ns += 3 * LIFE_NS
    station.keep_lease()
    with pytest.raises(SafetyError):
        station.take_lease("another")
    host.now_ns += 3 * LIFE_NS
    station.take_lease("another")


def test_where_nobody_has_a_lease_there_is_none_to_keep():
    station = build_station(fake_rig())
    station.keep_lease()
    assert station.state.mode is StationMode.DISARMED
