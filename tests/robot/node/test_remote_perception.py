"""A percept that came over the bus is at the measurement's stamp, or under its own; one that is too old is none."""

import math

import msgspec
import pytest

from robot.bus.camera_rows import Forgotten
from robot.bus.envelope import Envelope, Origin
from robot.bus.errors import BusError
from robot.bus.inlet import Received
from robot.bus.topics import FORGET, PERCEPT
from robot.errors import StaleStateError
from robot.node.remote_perception import PAUSE_S, RemotePerception
from robot.station_doors import Perceives, Sighted
from tests.support.stations import arm_state, fake_rig, percept

SCENARIO = fake_rig().scenario
PLACES = {name: (0.4, 0.1 * k, 0.02) for k, name in enumerate(SCENARIO.distances) if name != "table"}
ORIGIN = Origin(schema=b"", clock=7, begun_ns=0, source="perception")
DEADLINE_NS = round(PERCEPT.deadline_s * 1e9)
Q = (0.0, -1.5, 1.5, -1.5, -1.5, 0.0)


class Air:
    """What stands for a bus: percepts come when a measurement is told, or when they are put."""

    error = None
    n_forgotten, is_alone = 0, False

    def __init__(self, answer=None):
        self.now_ns, self.told, self._answer = 10_000_000_000, [], answer
        self.remote = RemotePerception(
            self, SCENARIO, tell=self._tell, measure=self._measure, now_ns=lambda: self.now_ns
        )

    def _measure(self):
        self.now_ns += 1_000
        return arm_state(Q, stamp_ns=self.now_ns)

    def asker(self, query):
        assert query is FORGET
        return self

    def ask(self, request):
        self.n_forgotten += 1
        if self.is_alone:
            raise BusError("percept/forget: expected an answer within 1 s, none came")
        return Forgotten()

    def subscriber(self, topic, on_message):
        assert topic is PERCEPT
        self._take = on_message
        return self

    def close(self):
        pass

    def put(self, message, *, seen_ns, is_same_clock=True):
        envelope = Envelope(origin=ORIGIN, sequence=0, stamp_ns=seen_ns)
        age_ns = self.now_ns - seen_ns if is_same_clock else None
        self._take(Received(message=message, envelope=envelope, arrived_ns=self.now_ns, age_ns=age_ns))

    def _tell(self, state):
        self.told.append(state)
        if self._answer is not None:
            self._answer(self, state)
        else:
            self.now_ns += 200_000_000


def answer_at_once(air, state):
    air.put(percept(PLACES, tcp_m=state.tcp_position_m, stamp_ns=state.stamp_ns), seen_ns=air.now_ns - 1_000_000)


def settled(air):
    """Have percepts of the new table come, so that the next look needs none of them."""
    air.remote._is_new_table = False
    return air


def arm(air, **changes):
    return arm_state(Q, stamp_ns=air.now_ns, **changes)


def test_it_fits_the_doors_of_a_station():
    air = Air()
    fits: tuple[Perceives, Sighted] = (air.remote, air.remote)
    assert isinstance(fits[1], Sighted)


def test_the_percept_at_the_measurement_s_stamp_is_returned_as_it_came():
    air = settled(Air(answer_at_once))
    state = arm(air)
    found = air.remote.perceive(state, None)
    assert found == percept(PLACES, tcp_m=state.tcp_position_m, stamp_ns=state.stamp_ns)
    assert air.told == [state]


def test_without_an_answer_the_newest_is_completed_by_what_the_arm_knows_and_keeps_its_own_stamp():
    air = settled(Air(lambda *_: None))
    seen_ns = air.now_ns - 40_000_000
    air.put(percept(PLACES, tcp_m=(0.0, 0.0, 0.5), stamp_ns=air.now_ns - 50_000_000), seen_ns=seen_ns)
    state = arm(air, tcp_m=(0.4, 0.0, 0.32))
    found = air.remote.perceive(state, None)
    assert (found.stamp_ns, found.tcp_position_m, found.grip) == (seen_ns, state.tcp_position_m, state.grip)
    for name, distance_m in zip(SCENARIO.distances, found.distances_m, strict=True):
        expected = 0.32 - SCENARIO.table.height_m if name == "table" else math.dist(state.tcp_position_m, PLACES[name])
        assert distance_m == pytest.approx(expected)


@pytest.mark.parametrize(("age_ns", "is_taken"), [(DEADLINE_NS, True), (DEADLINE_NS + 1, False)])
def test_a_percept_is_too_old_beyond_its_deadline(age_ns, is_taken):
    air = settled(Air(lambda *_: None))
    air.put(percept(PLACES, tcp_m=(0.4, 0.0, 0.2)), seen_ns=air.now_ns - age_ns)
    if is_taken:
        assert air.remote.perceive(arm(air), None).stamp_ns == air.now_ns - age_ns
    else:
        with pytest.raises(StaleStateError, match=r"not older than 150 ms, the newest is 150 ms old"):
            air.remote.perceive(arm(air), None)


def test_from_another_machine_a_percept_s_age_counts_from_its_arrival():
    air = settled(Air(lambda *_: None))
    air.put(percept(PLACES, tcp_m=(0.4, 0.0, 0.2)), seen_ns=5, is_same_clock=False)
    assert air.remote.perceive(arm(air), None).stamp_ns == air.now_ns
    air.now_ns += DEADLINE_NS + 1
    with pytest.raises(StaleStateError):
        air.remote.perceive(arm(air), None)


def test_after_a_reset_percepts_from_before_do_not_count():
    air = Air(lambda *_: None)
    air.put(percept(PLACES, tcp_m=(0.4, 0.0, 0.2)), seen_ns=air.now_ns)
    air._answer = None
    air.remote.forget()
    with pytest.raises(StaleStateError, match="none came"):
        air.remote.perceive(arm(air), None)
    air = Air(answer_at_once)
    air.remote.forget()
    state = arm(air)
    assert air.remote.perceive(state, None).stamp_ns == air.told[-1].stamp_ns > state.stamp_ns
    assert len(air.told) > 3


def test_a_percept_of_another_measurement_is_not_taken_for_this_one_s():
    air = settled(Air(answer_at_once))
    state = arm(air)
    air._answer = lambda air, told: answer_at_once(air, msgspec.structs.replace(told, stamp_ns=told.stamp_ns - 1))
    assert air.remote.perceive(state, None).stamp_ns == air.now_ns - 1_000_000


def test_a_new_table_is_waited_for_no_longer_where_somebody_says_stop():
    air = Air(lambda *_: None)
    air.remote._gives_up = lambda: len(air.told) >= 2
    with pytest.raises(StaleStateError, match="none came"):
        air.remote.perceive(arm(air), None)
    assert len(air.told) == 3


def test_a_new_table_is_forgotten_by_who_perceives_before_its_percepts_count():
    air = Air(answer_at_once)
    air.remote.perceive(arm(air), None)
    air.remote.perceive(arm(air), None)
    assert air.n_forgotten == 1
    air.remote.forget()
    air.remote.perceive(arm(air), None)
    assert air.n_forgotten == 2


def test_where_nobody_says_that_it_is_forgotten_nothing_is_perceived_and_it_is_asked_again():
    air = Air(answer_at_once)
    air.is_alone = True
    for n in (1, 2):
        with pytest.raises(StaleStateError, match="a new table: percept/forget"):
            air.remote.perceive(arm(air), None)
        assert air.n_forgotten == n
    air.is_alone = False
    assert air.remote.perceive(arm(air), None).stamp_ns == air.now_ns


def test_a_new_table_is_looked_at_with_new_measurements_for_no_picture_of_it_was_there_at_the_first():
    def answer(air, state):
        known = percept(PLACES, tcp_m=state.tcp_position_m, stamp_ns=state.stamp_ns)
        is_seen = state.stamp_ns > exposed_ns
        things = tuple(msgspec.structs.replace(thing, is_valid=is_seen) for thing in known.objects)
        air.now_ns += 20_000_000
        air.put(msgspec.structs.replace(known, objects=things), seen_ns=state.stamp_ns)

    air = Air(answer)
    exposed_ns = air.now_ns + 100_000_000
    found = air.remote.perceive(arm(air), None)
    assert all(thing.is_valid for thing in found.objects)
    assert exposed_ns < found.stamp_ns < exposed_ns + 200_000_000
    assert found.stamp_ns == air.told[-1].stamp_ns


def test_of_a_new_table_percepts_are_waited_for_until_one_knows_where_anything_is():
    told = []

    def answer(air, state):
        known = percept(PLACES, tcp_m=state.tcp_position_m, stamp_ns=state.stamp_ns)
        unknown = tuple(msgspec.structs.replace(thing, is_valid=False) for thing in known.objects)
        told.append(known if len(told) >= 6 else msgspec.structs.replace(known, objects=unknown))
        air.put(told[-1], seen_ns=air.now_ns)

    air = Air(answer)
    assert air.remote.perceive(arm(air), None).objects[0].is_valid
    assert len(told) == 8


def test_after_a_pause_a_percept_of_now_is_waited_for_and_in_motion_none_is():
    """Nobody is asked while an arm waits for a person: what was perceived last is of before."""

    def late(air, state):  # what comes is seen a while after it was asked for
        air.now_ns += 120_000_000
        if len(air.told) > 3:
            answer_at_once(air, state)

    air = settled(Air(late))
    air.put(percept(PLACES, tcp_m=(0.4, 0.0, 0.2)), seen_ns=air.now_ns - 10 * DEADLINE_NS)
    air.remote._looked_ns = air.now_ns - round(PAUSE_S * 1e9) - 1
    found = air.remote.perceive(arm(air), None)
    assert air.now_ns - found.stamp_ns < DEADLINE_NS
    assert len(air.told) > 3
    air.now_ns += DEADLINE_NS + 1
    air._answer = lambda air, _: None
    air.remote._looked_ns = air.now_ns - round(PAUSE_S * 1e9)
    n = len(air.told)
    with pytest.raises(StaleStateError):
        air.remote.perceive(arm(air), None)
    assert len(air.told) == n + 1
