"""A station over a real bus: the same door, one source at a time, nothing old or foreign let in; anybody stops it."""

import math
import socket
import time

import msgspec
import pytest

from robot.bus import Bus, Role
from robot.bus.outlet import Outlet
from robot.bus.station_rows import Command, LayOut, StationAsk
from robot.bus.topic import key_of
from robot.bus.topics import ASK, INTENT, LAY_OUT
from robot.errors import NotEngagedError, RobotConfigError, SafetyError
from robot.messages import Heading, Hold, StationMode
from robot.node import NodeAsker, RemoteStation, StopCaller
from robot.node.remote_station import BEAT_S
from robot.operated import OperatedStation
from robot.rigs import build_station
from robot.safety import Answer, AnsweredBy
from sim_twin.operator import SimulatedOperator
from tests.support.robot_node import SERIAL, Node
from tests.support.stations import fake_rig

pytestmark = pytest.mark.realtime

HOST = "127.0.0.101"
GO = Heading(heading_rad=0.5, distance_m=0.02, height_m=0.2)


def until(is_true, timeout_s=10.0):
    end = time.monotonic() + timeout_s
    while not is_true():
        assert time.monotonic() < end
        time.sleep(0.005)


@pytest.fixture
def endpoint():
    with socket.create_server((HOST, 0)) as free:
        return f"tcp/{HOST}:{free.getsockname()[1]}"


@pytest.fixture
def node(endpoint):
    opened = Node(endpoint)
    yield opened
    opened.close()


@pytest.fixture
def join(node, endpoint):
    made = []

    def make(role=Role.LEARNING, source="", **more):
        bus = Bus(endpoint, serial=SERIAL, role=role, source=source)
        bus.open()
        made.append(RemoteStation(bus, asker=NodeAsker(bus, wait_s=5.0), **more))
        return made[-1]

    yield make
    for station in made:
        station.close()


@pytest.fixture
def engaged(join):
    station = join()
    SimulatedOperator().arm_once(station)
    station.reset(seed=1, epoch=0)
    return station


@pytest.fixture
def viewer(node, endpoint):
    with Bus(endpoint, serial=SERIAL, role=Role.VIEWER) as bus:
        yield bus


def test_it_is_the_station_that_the_robot_node_holds(join, node):
    station = join()
    assert (station.spec, station.identity) == (node.local.spec, node.local.identity)
    with pytest.raises(NotEngagedError):
        station.step(Hold())
    with pytest.raises(NotEngagedError):
        station.reset(seed=1, epoch=0)


def test_a_step_over_the_bus_is_the_step_at_home_to_the_last_bit(engaged):
    home = build_station(fake_rig())
    SimulatedOperator().arm_once(home)
    assert engaged.reset(seed=3, epoch=1).distances_m == home.reset(seed=3, epoch=1).distances_m
    for k in range(30):
        intent = Heading(heading_rad=0.1 * k, distance_m=0.02, height_m=0.15)
        there, here = engaged.step(intent), home.step(intent)
        assert (there.executed, there.verdicts, there.is_void) == (
            msgspec.structs.replace(here.executed, sent=there.executed.sent), here.verdicts, here.is_void
        )  # fmt: skip
        assert there.executed.sent.q_rad == here.executed.sent.q_rad
        assert there.percept.distances_m == here.percept.distances_m
    home.close()


def test_what_is_no_intent_is_refused_by_the_gate_there(engaged):
    result = engaged.step(Heading(heading_rad=math.nan, distance_m=0.0, height_m=0.2))
    assert (result.is_void, result.verdicts[0].reason) == (True, "not_finite")
    until(lambda: engaged.state.mode is StationMode.LATCHED)
    assert engaged.n_latches == 1
    assert engaged.latch_reasons[0].startswith("not_finite")
    with pytest.raises(NotEngagedError, match="not_finite"):
        engaged.step(Hold())


def test_what_has_no_encoding_is_refused_there_too(engaged):
    assert engaged.step(object()).verdicts[0].reason == "malformed"


def test_a_duration_that_is_not_whole_ticks_is_an_error_and_no_latch(engaged):
    with pytest.raises(RobotConfigError, match="duration"):
        engaged.step(Hold(), duration_s=0.0131)
    assert not engaged.step(Hold()).is_void


def test_one_source_has_the_lease_and_another_is_refused_by_name(engaged, join):
    other = join(Role.TELEOP)
    with pytest.raises(SafetyError, match=r"learning:.* has it"):
        other.arm(by="tester")
    assert other.state.mode is StationMode.DISARMED
    assert "has the lease" in other.state.reason
    assert not engaged.step(GO).is_void


def test_whoever_comes_after_one_that_left_must_arm_anew(engaged, join, node):
    engaged.close()
    assert node.local.state.mode is StationMode.DISARMED
    other = join(Role.TELEOP)
    with pytest.raises(NotEngagedError):
        other.step(GO)
    SimulatedOperator().arm_once(other)
    assert not other.step(GO).is_void


@pytest.mark.slow
def test_a_source_that_is_silent_for_its_lease_s_life_is_disarmed(node, join):
    station = join()
    station.take_lease("tester", life_ns=round(2.5 * BEAT_S * 1e9))
    SimulatedOperator().arm_once(station)
    time.sleep(5 * BEAT_S)
    assert station.state.mode is StationMode.ENGAGED, "its beats renew the lease"
    station._is_over.set()
    until(lambda: station.state.mode is StationMode.DISARMED)
    result = station.step(GO)
    assert result.is_void
    with pytest.raises(NotEngagedError):
        station.step(GO)


def test_anybody_may_stop_it_and_it_stays_stopped_until_somebody_arms_it(engaged, viewer, node):
    assert not engaged.step(GO).is_void
    assert StopCaller(viewer, by="a viewer").stop(within_s=5.0) < 1.0
    assert node.local.state.mode is StationMode.LATCHED
    assert node.local.state.reason == "stopped by a viewer"
    assert node.n_halts > 0
    assert engaged.step(GO).is_void
    with pytest.raises(SafetyError):
        engaged.engage()
    SimulatedOperator().rearm(engaged, seed=1, epoch=1)
    assert not engaged.step(GO).is_void


def test_whoever_stopped_it_knows_at_once_that_it_stands(engaged):
    engaged.stop(by="the learner")
    assert engaged.state.mode is StationMode.LATCHED
    assert engaged.state.reason == "stopped by the learner"


def test_after_a_final_stop_nothing_is_armed_by_this_robot_node(engaged, viewer):
    assert StopCaller(viewer, by="the supervisor").stop(within_s=5.0, is_final=True) is not None
    until(lambda: engaged.state.mode is StationMode.LATCHED)
    with pytest.raises(SafetyError, match="is ending it"):
        SimulatedOperator().rearm(engaged, seed=1, epoch=1)


def test_nobody_who_confirms_a_stop_is_told(viewer, node):
    node.close()
    assert StopCaller(viewer, by="a viewer").stop(within_s=0.2) is None


def wrapped(command, *, begun=0, stamp_ns=None, sequence=0):
    outlet = Outlet(Command, source="intruder", clock=begun, now_ns=time.monotonic_ns)
    for _ in range(sequence):
        outlet.wrap(command)
    return outlet.wrap(command, stamp_ns=stamp_ns)


def test_captured_commands_sent_again_move_nothing(engaged, viewer, node):
    """Old number, old stamp, another lease: sent by whoever can write to the topic, past every client of ours."""
    captured = []
    spy = viewer.raw().declare_subscriber(
        key_of(SERIAL, INTENT.name),
        lambda sample: captured.append((sample.payload.to_bytes(), sample.attachment.to_bytes())),
    )
    for _ in range(20):  # what was sent before anybody knew of the spy it never hears
        engaged.step(GO)
        if len(captured) >= 5:
            break
    assert len(captured) >= 5
    spy.undeclare()
    before, n_before = node.local.measured, node.node._admission.n_refused
    key = key_of(SERIAL, INTENT.name)
    for payload, attachment in captured:  # byte for byte: duplicates of the same source's stream
        viewer.raw().put(key, payload, attachment=attachment)
    lease = engaged._lease
    again = Command(lease=lease, number=3, intent=GO)
    late = Command(lease=lease, number=1000, intent=GO)
    foreign = Command(lease="0123456789abcdef", number=1001, intent=GO)
    for command, stamp_ns in ((again, None), (late, time.monotonic_ns() - 150_000_000), (foreign, None)):
        sent = wrapped(command, begun=viewer.clock, stamp_ns=stamp_ns)
        viewer.raw().put(key, sent.payload, attachment=sent.attachment)
    until(lambda: node.node._admission.n_refused == n_before + 3)
    assert node.local.measured == before
    assert not engaged.step(GO).is_void, "the rightful source goes on"


def test_a_captured_question_asked_again_does_nothing(engaged, endpoint):
    with Bus(endpoint, serial=SERIAL, role=Role.LEARNING, source="intruder") as bus:
        for work in (LayOut(seed=9, epoch=9),):
            told = bus.asker(LAY_OUT).ask(StationAsk(work=work, lease=engaged._lease, number=1))
            assert told.failed.message.startswith("sequence")
            told = bus.asker(ASK).ask(StationAsk(work=work, lease="0123456789abcdef", number=10**6))
            assert told.failed.message.startswith("lease")
    assert not engaged.step(GO).is_void


@pytest.mark.slow
def test_a_robot_node_that_is_gone_voids_the_step_and_one_that_comes_back_is_armed_anew(endpoint, monkeypatch):
    monkeypatch.setattr("robot.node.remote_station.ANSWER_S", 0.3)
    with Bus(endpoint, serial=SERIAL, role=Role.TWIN, is_hub=True):
        first = Node(endpoint, is_hub=False)
        bus = Bus(endpoint, serial=SERIAL, role=Role.LEARNING)
        bus.open()
        station = RemoteStation(bus, asker=NodeAsker(bus, wait_s=5.0))
        operated = OperatedStation(station, SimulatedOperator(), pause=lambda _: None)
        operated.connect()
        operated.reset(seed=1, epoch=0)
        assert not operated.step(GO).is_void
        first.close()
        assert operated.step(GO).is_void
        until(lambda: operated.state.mode is StationMode.DISARMED)
        second = Node(endpoint, is_hub=False)
        operated.reset(seed=1, epoch=1)
        assert not operated.step(GO).is_void
        operated.close()
        second.close()


def test_no_answer_for_a_real_arm_crosses_the_bus(engaged):
    answer = Answer("1234", by=AnsweredBy.CONSOLE)
    for attempt in (
        engaged.challenge,
        engaged.pressed,
        lambda: engaged.arm(by="tester", answer=answer),
        lambda: engaged.clear_latch(by="tester", answer=answer),
    ):
        with pytest.raises(SafetyError, match="no bus carries"):
            attempt()
