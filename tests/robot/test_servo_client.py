"""The servo process: it holds the arm between intents, tells what a time step came to, and is never asked when gone."""

import os
import signal

import msgspec
import pytest

from robot.errors import NotEngagedError, RobotConfigError, SafetyError, WireError
from robot.messages import GripCommand, Heading, JointTarget, PlantKind
from robot.servo_client import ServoClient
from tests.support.stations import fake_rig

OPEN = GripCommand(opening_m=0.085, force_n=20.0, speed_m_s=0.15)
N_TICKS = 5


def go(**changes):
    return Heading(**({"heading_rad": 0.0, "distance_m": 0.01, "height_m": 0.2} | changes))


def stride(client, intent):
    return client.stride(intent, OPEN, n_ticks=N_TICKS, is_hand_busy=False)


@pytest.fixture
def client():
    made = ServoClient(fake_rig())
    made.connect()
    yield made
    made.close()


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
    with pytest.raises(SafetyError, match="engage"):
        stride(client, go())


def test_a_process_that_was_killed_is_said_and_a_new_one_starts_without_command(client):
    client.engage()
    client.seed()
    os.kill(client.pid, signal.SIGKILL)
    with pytest.raises(WireError, match="ended"):
        stride(client, go())
    with pytest.raises(NotEngagedError, match="connect"):
        client.seed()
    client.connect()
    with pytest.raises(SafetyError, match="engage"):
        stride(client, go())


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
