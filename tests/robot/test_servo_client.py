"""The servo process: it holds the arm between intents, tells what a time step came to, and is never asked when gone."""

import os
import signal
import time

import msgspec
import pytest

from perception.ground_truth import GroundTruthPerception
from robot.bus import Bus, Role
from robot.errors import NotEngagedError, RobotConfigError, SafetyError, WireError
from robot.hal.sole_holder import SoleHolder
from robot.local_station import LocalStation
from robot.messages import GripCommand, Heading, JointTarget, Outcome, PlantKind, StationMode, Verdict
from robot.node.lab_node import open_robot_node
from robot.rigs import build_plant
from robot.servo_client import COAST_S, ServoClient
from robot.servo_messages import StrideReply
from robot.servo_process import EXIT_TERMINATED
from robot.tick_loop import Stride
from robot.tick_ring import decode_tick
from tests.support import unstoppable
from tests.support.loopback import own_address
from tests.support.stations import fake_rig

pytestmark = pytest.mark.realtime

OPEN = GripCommand(opening_m=0.085, force_n=20.0, speed_m_s=0.15)
N_TICKS = 5


def go(**changes):
    return Heading(**({"heading_rad": 0.0, "distance_m": 0.01, "height_m": 0.2} | changes))


def stride(client, intent):
    return client.stride(intent, OPEN, n_ticks=N_TICKS)


@pytest.fixture(scope="module")
def lasting():
    made = ServoClient(fake_rig())
    yield made
    made.close()


@pytest.fixture
def client(lasting):
    """One client for all: its process lives on, out of command, or a new one starts where a test ended it."""
    lasting.begin_epoch(0)
    yield lasting
    lasting.stop()


def test_one_life_of_a_process(client):
    assert client.identity.kind is PlantKind.FAKE
    with pytest.raises(SafetyError, match="engage"):
        stride(client, go())
    client.engage()
    assert client.begin_epoch(0) == 0b10000  # the paper's square box is open at first
    start = client.seed()
    for _ in range(10):
        came = stride(client, go())
    assert came.verdict is None
    assert came.is_begun
    moved = came.after.tcp_position_m[0] - start.tcp_position_m[0]
    assert 0.05 < moved < 0.11
    refused = stride(client, go(height_m=float("inf")))
    assert refused.verdict.is_latched
    assert not refused.is_begun
    with pytest.raises(SafetyError, match="engage"):
        stride(client, go())
    client.engage()
    rested = client.seed()
    assert stride(client, go()).before.tcp_position_m == pytest.approx(rested.tcp_position_m, abs=1e-3)
    client.stop()
    stopped_s = time.monotonic()
    client.await_rest()
    assert time.monotonic() - stopped_s < COAST_S / 2, "it was seen to rest"
    assert client.why_lost is None
    with pytest.raises(SafetyError, match="engage"):
        stride(client, go())


def test_a_process_that_was_killed_is_said_and_a_new_one_starts_without_command(client):
    client.engage()
    client.seed()
    assert stride(client, go()).verdict is None
    os.kill(client.pid, signal.SIGKILL)
    came = stride(client, go())
    assert came.verdict.is_latched
    assert "ended" in came.verdict.detail
    assert not came.is_begun
    assert "ended" in client.why_lost
    kept = [decode_tick(raw) for raw in client.ticks.take()]
    assert kept[-1].command is not None, "what it did last is there"
    with pytest.raises(NotEngagedError, match="connect"):
        client.seed()
    with pytest.raises(NotEngagedError, match="connect"):
        stride(client, go())
    client.connect()
    with pytest.raises(SafetyError, match="engage"):
        stride(client, go())


def test_a_process_that_takes_over_has_the_rules_of_the_epoch(client):
    assert client.begin_epoch(0) != (changed := client.begin_epoch(1000))  # the paper's rules change there
    client.engage()
    client.seed()
    os.kill(client.pid, signal.SIGKILL)
    assert stride(client, go()).verdict.is_latched
    client.engage()
    client.seed()
    assert stride(client, go()).after.digital_out == changed


def test_no_output_changes_between_an_epochs_beginning_and_the_seed_that_follows(client):
    """The arm stands where the last epoch ended, in a lid's way perhaps, and ticks go on that hold it there."""
    before = client.begin_epoch(0)
    client.engage()
    client.seed()
    assert stride(client, go()).after.digital_out == before
    assert (changed := client.begin_epoch(1000)) != before
    assert stride(client, go()).after.digital_out == before
    client.seed()
    assert stride(client, go()).after.digital_out == changed


def test_what_holds_no_arm_any_more_is_stopped_without_complaint(client):
    client.engage()
    client.seed()
    os.kill(client.pid, signal.SIGKILL)
    client.stop()
    assert client.pid is None
    client.stop()
    client.engage()
    client.seed()
    assert stride(client, go()).verdict is None


def test_a_process_that_hangs_is_killed_and_that_is_said(client):
    client.engage()
    client.seed()
    assert stride(client, go()).verdict is None
    pid = client.pid
    os.kill(pid, signal.SIGSTOP)
    begun = time.monotonic()
    came = stride(client, go())
    assert time.monotonic() - begun < 1.0  # 60 ms on a machine of its own
    assert came.verdict.is_latched
    assert "tick" in came.verdict.detail
    assert "tick" in client.why_lost
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)
    client.engage()
    client.seed()
    assert stride(client, go()).verdict is None


def test_a_process_that_is_busy_out_of_command_is_not_hung(client):
    client.engage()
    client.seed()
    client.stop()
    os.kill(client.pid, signal.SIGSTOP)
    time.sleep(0.3)
    os.kill(client.pid, signal.SIGCONT)
    client.engage()
    client.seed()
    assert stride(client, go()).verdict is None


def test_a_question_that_a_person_broke_in_on_leaves_no_process_behind(client, monkeypatch):
    client.engage()
    client.seed()
    pid = client.pid

    look = client._connection.poll

    def break_in(timeout_s):
        if timeout_s:  # a question that is waited on
            raise KeyboardInterrupt
        return look(timeout_s)

    monkeypatch.setattr(client._connection, "poll", break_in, raising=False)
    with pytest.raises(KeyboardInterrupt):
        stride(client, go())
    client.close()
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


def test_a_station_whose_servo_process_is_gone_latches_and_a_reset_does_not_take_the_arm_again():
    resolved = fake_rig()
    plant = build_plant(rig=resolved.rig, arm=resolved.arm, scenario=resolved.scenario)
    client = ServoClient(resolved)
    perception = GroundTruthPerception(scenario=resolved.scenario, arm=resolved.arm)
    station = LocalStation(
        world=plant, loop=client, perception=perception, arm=resolved.arm, scenario=resolved.scenario, rig=resolved.rig
    )
    with station:
        station.arm(by="the test")
        station.engage()
        os.kill(client.pid, signal.SIGKILL)
        assert station.step(go()).is_void
        assert station.state.mode is StationMode.LATCHED
        with pytest.raises(NotEngagedError):
            station.reset(seed=0, epoch=0)
        station.reset_plant(seed=0, epoch=0)
        station.clear_latch(by="the test")
        station.engage()
        os.kill(client.pid, signal.SIGKILL)
        os.waitid(os.P_PID, client.pid, os.WEXITED | os.WNOWAIT)
        with pytest.raises(NotEngagedError):
            station.reset(seed=0, epoch=1)
        assert station.state.mode is StationMode.LATCHED


def test_a_loss_is_told_after_a_stop_too_until_somebody_engages_again(client):
    client.engage()
    client.seed()
    assert client.why_lost is None
    os.kill(client.pid, signal.SIGKILL)
    client.stop()
    client.begin_epoch(0)  # starts a process, without command
    assert "ended" in client.why_lost
    client.engage()
    assert client.why_lost is None


TOLD_S = 0.1
"""How soon a loss must be told."""


def with_plant(plant):
    resolved = fake_rig()
    return ServoClient(msgspec.structs.replace(resolved, rig=msgspec.structs.replace(resolved.rig, plant=plant)))


@pytest.fixture
def stubborn():
    made = with_plant(unstoppable.PLANT)
    made.connect()
    made.engage()
    made.seed()
    yield made
    made.close()


def kill(client):
    os.kill(client.pid, signal.SIGKILL)
    os.waitid(os.P_PID, client.pid, os.WEXITED | os.WNOWAIT)


def test_a_stop_that_nobody_confirms_is_told_before_the_arm_can_rest_and_its_rest_is_waited_for(stubborn):
    begun_s = time.monotonic()
    stubborn.stop()
    told_s = time.monotonic() - begun_s
    assert "nobody confirms it" in stubborn.why_lost
    assert told_s < TOLD_S < COAST_S
    stubborn.await_rest()
    assert time.monotonic() - begun_s >= COAST_S
    rested_s = time.monotonic()
    stubborn.stop()
    stubborn.await_rest()
    assert time.monotonic() - rested_s < COAST_S, "it was waited for already"


def test_nothing_is_begun_anew_before_an_arm_that_was_lost_can_rest(client):
    client.engage()
    client.seed()
    begun_s = time.monotonic()
    kill(client)
    client.stop()
    assert "ended" in client.why_lost
    assert time.monotonic() - begun_s < COAST_S
    client.connect()
    assert time.monotonic() - begun_s >= COAST_S


def test_a_process_that_is_terminated_stops_its_arm_in_its_time(client):
    client.engage()
    client.seed()
    assert stride(client, go()).verdict is None
    process = client._process
    os.kill(client.pid, signal.SIGTERM)
    process.join(10.0)
    assert process.exitcode == EXIT_TERMINATED  # not killed by the watch while it stops the arm


def test_an_error_of_the_process_is_raised_here_by_its_kind():
    resolved = fake_rig()
    wrong = msgspec.structs.replace(resolved, rig=msgspec.structs.replace(resolved.rig, plant="os:getcwd"))
    with pytest.raises((RobotConfigError, WireError)):
        ServoClient(wrong).connect()


@pytest.mark.parametrize("intent", [None, "up", object(), go(distance_m="far"), JointTarget(q_rad=(0.0,) * 5)])
def test_what_is_no_intent_is_refused_by_the_gate_and_the_process_lives(client, intent):
    client.engage()
    client.seed()
    verdict = stride(client, intent).verdict
    assert (verdict.reason, verdict.is_latched) == ("malformed", True)
    client.engage()
    client.seed()
    assert stride(client, go()).verdict is None


def test_a_process_that_ends_says_nothing_over_what_a_person_reads(capfd):
    made = ServoClient(fake_rig())
    made.engage()
    made.seed()
    assert stride(made, go()).verdict is None
    made.close()
    assert capfd.readouterr() == ("", "")


def test_a_latch_that_comes_just_before_a_time_step_is_asked_for_is_its_end(client, monkeypatch):
    """It was told by the process's refusal, a SafetyError that ended the run: the word had been taken in unread."""
    client.engage()
    client.seed()
    assert stride(client, go(height_m=float("nan"))).verdict.reason == "not_finite"
    told = StrideReply(stride=stride_of(client), is_asked=False)
    looks = [lambda: client._take_in(told)]
    overhear = client._overhear
    monkeypatch.setattr(client, "_overhear", lambda: (looks.pop(0) if looks else overhear)())
    assert stride(client, go()).verdict.reason == "arm_mode"
    assert client.why_lost is None, "it was taken"
    client.engage()
    client.seed()
    assert stride(client, go()).verdict is None


def stride_of(client):
    """Return a time step that an arm's own stop cut short before it was begun."""
    verdict = Verdict(
        stamp_ns=0, sequence=-1, outcome=Outcome.REFUSED, reason="arm_mode", detail="a stop", is_latched=True
    )
    state = client._newest
    return Stride(
        before=state, after=state, is_begun=False, target_m=(0.0, 0.0, 0.0), limiters=(), is_in_contact=False,
        verdict=verdict,
    )  # fmt: skip


def at(address, **rig):
    """Return the rig of a fake arm that says it is at an address."""
    resolved = fake_rig()
    return msgspec.structs.replace(resolved, rig=msgspec.structs.replace(resolved.rig, address=address, **rig))


def test_a_second_client_of_an_address_is_refused_before_it_starts_a_process_until_the_first_is_closed():
    address = own_address()
    first, second = ServoClient(at(address)), ServoClient(at(address))
    first.hold()
    for take in (second.hold, second.connect, second.engage, second.measure):
        with pytest.raises(WireError, match=f"{address}: another process of this machine holds it"):
            take()
        assert second.pid is None
    first.hold()
    first.close()
    second.hold()
    second.close()


def test_a_client_that_connects_holds_its_address_though_nobody_told_it_to():
    address = own_address()
    client = ServoClient(at(address))
    try:
        client.connect()
        with pytest.raises(WireError, match="another process"):
            SoleHolder(address).take()
    finally:
        client.close()


def test_a_robot_node_is_refused_before_anybody_asks_for_its_arm_and_holds_it_while_it_is_open():
    address = own_address()
    endpoint = f"tcp/{address}:7447"
    resolved = at(address, bus=endpoint)
    holder = SoleHolder(address)
    with Bus(endpoint, serial=resolved.rig.expected.serial, role=Role.VIEWER, source="hub", is_hub=True):
        holder.take()
        with pytest.raises(WireError, match="another process of this machine holds it"), open_robot_node(resolved):
            pass
        holder.release()
        with open_robot_node(resolved), pytest.raises(WireError, match="another process"):
            holder.take()
        holder.take()
        holder.release()
