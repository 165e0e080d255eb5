"""A program whose process was lost before its watchdog was armed is ended; somebody's later one is not."""

import socket
from time import monotonic, sleep

import msgspec
import pytest

from config.loader import resolve
from robot.errors import RobotError
from robot.hal.leftover import Leftover
from robot.servo_client import ServoClient
from sim_twin.controller.process import ControllerProcess, ask_fault
from sim_twin.controller.server import Setup
from tests.support.loopback import own_address

pytestmark = pytest.mark.realtime

SCRIPT = b"def %s():\n  while True:\n    sync()\n  end\nend\n"
SECONDARY = 30002


@pytest.fixture(scope="module")
def host():
    with ControllerProcess(Setup(host=own_address())) as controller:
        yield controller.host


def runtime(host):
    return ask_fault(host, "truth")["runtime"]


def play(host, name=b"rtde_control"):
    with socket.create_connection((host, SECONDARY)) as link:
        link.sendall(SCRIPT % name)
        end_s = monotonic() + 5.0
        while runtime(host) != "PLAYING" and monotonic() < end_s:
            sleep(0.01)
    assert runtime(host) == "PLAYING"


def test_what_runs_when_the_process_was_lost_is_ended(host):
    play(host)
    leftover = Leftover(host)
    leftover.begin()
    assert leftover.wait()
    assert runtime(host) == "STOPPED"


def test_what_begins_a_moment_after_the_loss_is_ended_too(host):
    leftover = Leftover(host)
    leftover.begin()
    play(host)
    assert leftover.wait()
    assert runtime(host) == "STOPPED"


def test_what_begins_once_it_is_over_is_somebodys_and_runs_on(host):
    leftover = Leftover(host)
    leftover.begin()
    assert leftover.wait()
    play(host)
    sleep(0.3)
    assert runtime(host) == "PLAYING"


def test_what_runs_under_another_name_is_somebodys_and_runs_on(host):
    ask_fault(host, "program_stop")
    leftover = Leftover(host)
    leftover.listen()
    play(host, b"palletise")
    assert leftover.foreign() == "palletise"
    leftover.begin()
    assert leftover.wait()
    assert runtime(host) == "PLAYING"
    ask_fault(host, "program_stop")


def test_where_nobody_answers_it_gives_up_in_time():
    leftover = Leftover(own_address(), patience_s=0.3)
    begun_s = monotonic()
    leftover.begin()
    assert not leftover.wait()
    assert monotonic() - begun_s < 5.0


@pytest.mark.parametrize("port", [30004, 29999])
def test_who_loses_the_arm_before_uploading_leaves_somebody_elses_program_alone(host, port):
    resolved = resolve(rig="virtual_lab")
    rig = msgspec.structs.replace(resolved.rig, address=host, bus=None)
    client = ServoClient(msgspec.structs.replace(resolved, rig=rig))
    try:
        client.connect()
        ask_fault(host, "drop", port=port)
        play(host)
        with pytest.raises(RobotError):
            client.engage()
        sleep(1.0)
        assert runtime(host) == "PLAYING"
    finally:
        client.close()
    assert runtime(host) == "PLAYING"


@pytest.mark.slow
def test_who_finds_nobody_to_upload_to_leaves_a_program_alone_that_is_sent_next(host):
    resolved = resolve(rig="virtual_lab")
    rig = msgspec.structs.replace(resolved.rig, address=host, bus=None)
    client = ServoClient(msgspec.structs.replace(resolved, rig=rig))
    try:
        client.connect()
        ask_fault(host, "program_stop")  # of a test before
        ask_fault(host, "refuse", port=30003)
        with pytest.raises(RobotError, match=r"program upload: expected an answer at .*30003") as told:
            client.engage()
        assert "a program that it left" not in str(told.value)
        play(host)
        sleep(1.0)
        assert runtime(host) == "PLAYING"
    finally:
        ask_fault(host, "refuse", port=30003, on=False)
        client.close()
    assert runtime(host) == "PLAYING"
