"""A program that somebody starts while command is taken is named, left alone if that can be, never taken for ours."""

import socket
import time

import pytest

from config.loader import load_arm
from robot.errors import ArmRefusedError, StaleStateError
from sim_twin.controller.process import ControllerProcess, ask_fault
from sim_twin.controller.server import Setup
from tests.support.loopback import own_address

pytestmark = pytest.mark.realtime

taking = pytest.importorskip("robot.hal.rtde_command", reason="ur_rtde comes with `pip install autotelic[lab]`")

OTHER = b"def other():\n while True:\n  sync()\n end\nend\n"


@pytest.fixture(scope="module")
def host():
    with ControllerProcess(Setup(host=own_address())) as opened:
        yield opened.host


@pytest.fixture
def arm(host):
    from robot.hal.rtde import RtdeArm

    made = RtdeArm(arm=load_arm("ur5e"), address=host)
    made.connect()
    try:
        made._wake_hand()
    except StaleStateError as error:
        made.close()
        pytest.skip(f"this machine is too busy to hold an arm: {error}")
    yield made
    made.close()
    ask_fault(host, "program_stop")


def says(host):
    with socket.create_connection((host, 29999), timeout=5.0) as link:
        link.recv(128)
        link.sendall(b"programState\n")
        return link.recv(128).decode().strip()


def play_other(host):
    with socket.create_connection((host, 30002), timeout=5.0) as link:
        link.sendall(OTHER)
        end_s = time.monotonic() + 5.0
        while says(host) != "PLAYING other":
            assert time.monotonic() < end_s
            time.sleep(0.01)


def test_one_that_begins_between_the_two_uploads_is_named_and_goes_on(host, arm, monkeypatch):
    prove = taking.prove_watchdog

    def proven_then_other(*arguments):
        prove(*arguments)
        play_other(host)

    monkeypatch.setattr(taking, "prove_watchdog", proven_then_other)
    with pytest.raises(ArmRefusedError, match="'other'"):
        arm.engage()
    assert says(host) == "PLAYING other"
    assert not arm.links.is_lost, "nothing of ours runs: this process may go on"


def test_one_that_replaces_ours_before_its_watchdog_is_armed_is_named_and_not_ended(host, arm, monkeypatch):
    def replaced(*_):
        play_other(host)
        refuse("setWatchdog")

    monkeypatch.setattr(taking, "prove_watchdog", replaced)
    with pytest.raises(StaleStateError, match="nobody confirms"):
        arm.engage()
    assert says(host) == "PLAYING other"


def test_an_upload_that_was_not_told_to_have_begun_is_not_confirmed_to_have_ended(host, arm, monkeypatch):
    def refused(*_):
        arm._command._primary.told.expect()  # an upload that is on its way still
        refuse("setPayload")

    monkeypatch.setattr(taking, "set_tool", refused)
    with pytest.raises(StaleStateError, match=r"setPayload.*nobody confirms"):
        arm.engage()
    assert arm.links.is_lost


def refuse(what):
    raise ArmRefusedError(f"{what}: the controller did not take it")
