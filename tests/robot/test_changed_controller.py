"""What somebody else changes on a controller while its arm is ours: told by name, and nothing more is sent."""

import socket
import time
from time import monotonic

import pytest

from config.loader import load_arm
from robot.errors import ArmRefusedError, StaleStateError
from robot.hal.obedience import N_SAMPLES, TOLERANCE_RAD, Obedience
from robot.hal.ur_state import Runtime
from robot.messages import ArmCommand, GripCommand
from sim_twin.controller.process import ControllerProcess
from sim_twin.controller.server import Setup
from tests.support.loopback import own_address

pytestmark = pytest.mark.realtime

pytest.importorskip("rtde_control", reason="the genuine client comes with `pip install autotelic[lab]`")

CONFIG = load_arm("ur5e")
SCRIPT_PORT = 30002
N_TICKS = 500
N_TOLD = 50
"""Within so many ticks of ours, 0.1 s, what was changed is told."""
OTHER = "def other():\n while True:\n  sync()\n end\nend\n"
TOOL = "sec tool():\n set_tcp(p[0, 0, 0.4, 0, 0, 0])\nend\n"
PAYLOAD = "sec load():\n set_payload(3.0, [0, 0, 0.05])\nend\n"


@pytest.fixture(scope="module")
def controller():
    with ControllerProcess(Setup(host=own_address())) as opened:
        yield opened


@pytest.fixture
def arm(controller):
    from robot.hal.rtde import RtdeArm

    made = RtdeArm(arm=CONFIG, address=controller.host)
    made.connect()
    try:
        made.engage()
    except StaleStateError as error:  # an arm that is refused is a failure: this controller is nobody else's
        made.close()
        pytest.skip(f"this machine is too busy to hold an arm: {error}")
    yield made
    made.close()


def send(controller, script):
    with socket.create_connection((controller.host, SCRIPT_PORT), timeout=5.0) as link:
        link.sendall(script.encode())
        link.recv(64)


def until(is_true, timeout_s=10.0):
    end_s = monotonic() + timeout_s
    while not is_true():
        assert monotonic() < end_s
        time.sleep(0.005)


def drive(arm, n_ticks, *, by_rad=0.0, n_written=None):
    """Write for some ticks, joint 0 moving on at a steady pace; note in `n_written` which one is at hand."""
    q_rad, grip = arm.read().q_rad, GripCommand(opening_m=0.04, force_n=20.0, speed_m_s=0.02)
    n_written = [0] if n_written is None else n_written
    for k in range(n_ticks):
        asked = (q_rad[0] + by_rad * k / n_ticks, *q_rad[1:])
        n_written[0] = k
        arm.write(ArmCommand(stamp_ns=arm.clock.now_ns(), sequence=k, q_rad=asked, grip=grip, digital_out=0))
        arm.clock.wait_tick()
        arm.read()


def told(arm, *, by_rad=0.0, n_written=None):
    """Drive until the arm is refused, and return why; skip where this machine kept it from its ticks."""
    try:
        drive(arm, N_TICKS, by_rad=by_rad, n_written=n_written)
    except StaleStateError as error:
        pytest.skip(f"this machine is too busy to hold an arm: {error}")
    except ArmRefusedError as error:
        return str(error)
    return ""


def runtime(controller):
    """Return what the dashboard says of the program."""
    with socket.create_connection((controller.host, 29999), timeout=5.0) as link:
        link.recv(128)
        link.sendall(b"programState\n")
        return link.recv(128).decode()


@pytest.mark.parametrize("n", [0, *(pytest.param(n, marks=pytest.mark.slow) for n in range(1, 5))])
def test_a_program_that_replaces_ours_is_told_within_the_second_and_goes_on(controller, arm, n):
    begun_s = monotonic()
    send(controller, OTHER)
    said = told(arm)
    # The state in between is seen now and then; what started is always told.
    assert "somebody started the program 'other'" in said or "has ended" in said
    assert not arm.stop(), "the process that held the arm must end"
    assert monotonic() - begun_s < 5.0, "the client waits 300 s for what another program never answers"
    assert "PLAYING" in runtime(controller)
    send(controller, "def nothing():\n stopj(2.0)\nend\n")


def test_what_runs_after_our_program_was_seen_to_have_ended_is_neither_asked_nor_ended(controller, arm):
    """Also where the start was not heard: nothing is known then but that a program runs again."""
    with socket.create_connection((controller.host, 29999), timeout=5.0) as link:
        link.recv(128)
        link.sendall(b"stop\n")
        link.recv(128)
    assert "has ended" in told(arm)
    arm._command._primary.close()
    send(controller, OTHER)
    until(lambda: "PLAYING" in runtime(controller) and arm.status().runtime == Runtime.PLAYING)
    begun_s = monotonic()
    assert not arm.stop()
    assert monotonic() - begun_s < 5.0
    assert "PLAYING" in runtime(controller)
    send(controller, "def nothing():\n stopj(2.0)\nend\n")


@pytest.mark.parametrize(
    ("script", "word"), [(TOOL, "tool centre point"), pytest.param(PAYLOAD, "payload", marks=pytest.mark.slow)]
)
def test_another_tool_or_payload_set_meanwhile_is_told_and_the_arm_comes_to_rest(controller, arm, script, word):
    n_written = [0]
    send(controller, script)
    said = told(arm, n_written=n_written)
    assert f"somebody set another {word}" in said or "watchdog" in said
    assert n_written[0] <= N_TOLD
    assert arm.stop()


@pytest.mark.slow
def test_an_arm_that_steers_for_what_it_is_sent_is_left_alone(controller, arm):
    said = told(arm, by_rad=0.5) + told(arm, by_rad=-0.5)
    assert not said or "watchdog" in said
    assert arm.stop()


def test_a_program_that_takes_commands_and_obeys_none_is_told(controller, arm, monkeypatch):
    servo = arm._command.servo
    still = arm.read().q_rad
    monkeypatch.setattr(arm._command, "servo", lambda q_rad, law: servo(still, law))
    said = told(arm, by_rad=0.2)
    assert "does its program still obey" in said or "watchdog" in said
    assert arm.stop()


@pytest.mark.parametrize(("off_rad", "is_told"), [(TOLERANCE_RAD - 1e-9, False), (TOLERANCE_RAD + 1e-9, True)])
@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("joint", range(6))
def test_a_target_is_held_to_all_that_was_sent_of_late_with_a_tolerance(off_rad, is_told, side, joint):
    watched = Obedience()
    sent = [tuple(0.01 * k if j == joint else 1.0 for j in range(6)) for k in range(N_SAMPLES)]
    for q_rad in sent[:-1]:
        assert watched.check(q_rad, (9.0,) * 6) is None, "not before there is enough"
    end = sent[-1][joint] if side > 0 else sent[0][joint]
    target = [end + side * off_rad if j == joint else 1.0 for j in range(6)]
    words = watched.check(sent[-1], target)
    assert (words is not None) is is_told
    assert not is_told or f"joint {joint}" in words


def test_a_target_that_is_no_number_is_told():
    watched = Obedience()
    told = [watched.check((0.0,) * 6, (float("nan"),) * 6) for _ in range(N_SAMPLES)]
    assert told[-1] is not None
