"""What the backend says and leaves behind when a controller in front of it is broken; no servo process beside it."""

import signal
import socket
from contextlib import contextmanager

import pytest

from config.loader import load_arm
from robot.errors import ArmRefusedError, StaleStateError, WireError
from robot.hal.robotiq import GRIPPER_PORT
from robot.messages import ArmCommand, GripCommand
from sim_twin.controller.process import ControllerProcess
from sim_twin.controller.server import Setup
from tests.support.loopback import own_address

pytestmark = pytest.mark.realtime

pytest.importorskip("rtde_control", reason="the genuine client comes with `pip install autotelic[lab]`")
rtde = pytest.importorskip("robot.hal.rtde")

STALE_NS = rtde.STALE_NS
CONFIG = load_arm("ur5e")
DASHBOARD, RTDE, SECONDARY = 29999, 30004, 30002


@pytest.fixture(scope="module")
def controller():
    with ControllerProcess(Setup(host=own_address())) as opened:
        yield opened


@pytest.fixture
def arm(controller):
    from robot.hal.rtde import RtdeArm

    made = RtdeArm(arm=CONFIG, address=controller.host)
    made.connect()
    yield made
    made.close()


class BrokenOffError(Exception):
    """A person broke in."""


def say(controller, line):
    """Send a line to the gripper as somebody else."""
    with socket.create_connection((controller.host, GRIPPER_PORT), timeout=5.0) as connection:
        connection.sendall(line.encode() + b"\n")
        return connection.recv(64).decode()


def opening(controller):
    return float(str(controller.fault("truth")["opening_m"]))


def drive(arm, opening_m, n_ticks):
    q_rad = arm.read().q_rad
    grip = GripCommand(opening_m=opening_m, force_n=20.0, speed_m_s=0.02)
    for k in range(n_ticks):
        arm.write(ArmCommand(stamp_ns=arm.clock.now_ns(), sequence=k, q_rad=q_rad, grip=grip, digital_out=0))
        arm.clock.wait_tick()
        arm.read()


@contextmanager
def undisturbed():
    """Skip where this machine kept the arm from its ticks: that says nothing of the hand."""
    try:
        yield
    except (StaleStateError, ArmRefusedError) as error:
        pytest.skip(f"this machine is too busy to hold an arm: {error}")


def wait(arm, n_ticks):
    for _ in range(n_ticks):
        arm.clock.wait_tick()


def test_an_activation_that_is_broken_off_leaves_the_hand_reset_and_still(controller, arm):
    def break_in(*_):
        raise BrokenOffError

    assert say(controller, "SET ACT 0") == "ack"
    before = signal.signal(signal.SIGALRM, break_in)
    signal.setitimer(signal.ITIMER_REAL, 0.3)
    try:
        with undisturbed(), pytest.raises(BrokenOffError):
            arm.engage()
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
    wait(arm, 50)
    standing_m = opening(controller)
    wait(arm, 200)
    assert opening(controller) == pytest.approx(standing_m, abs=1e-3)
    assert say(controller, "GET STA") == "STA 0\n"
    with undisturbed():
        arm.engage()
    assert say(controller, "GET STA") == "STA 3\n"
    assert arm.stop()


def test_a_hand_that_loses_its_activation_is_an_error_and_is_activated_anew_at_the_next_engagement(controller, arm):
    said = ""
    with undisturbed():
        arm.engage()
        drive(arm, 0.02, 20)
        assert say(controller, "SET ACT 0") == "ack"
        try:
            drive(arm, 0.02, 200)
        except (StaleStateError, ArmRefusedError):
            raise
        except WireError as error:
            said = str(error)
    assert said.startswith("gripper: expected it active")
    assert arm.stop()
    with undisturbed():
        arm.engage()
    assert say(controller, "GET STA") == "STA 3\n"
    assert arm.stop()


def test_a_dashboard_that_hung_up_is_connected_anew_with_command_and_one_that_is_not_there_is_said_by_name(
    controller, arm
):
    controller.fault("refuse", port=DASHBOARD)
    try:
        with pytest.raises(WireError, match="dashboard"):
            arm.engage()
    finally:
        controller.fault("refuse", port=DASHBOARD, on=False)
    controller.fault("drop", port=DASHBOARD)
    arm.engage()
    assert arm.stop()


@contextmanager
def frozen(controller, *ports):
    for port in ports:
        controller.fault("freeze", on=True, port=port)
    try:
        yield
    finally:
        for port in ports:
            controller.fault("freeze", on=False, port=port)


def test_a_hand_that_is_mute_while_the_arm_is_connected_is_named_and_no_reason_to_end_the_process(
    controller, monkeypatch
):
    from robot.hal import rtde

    monkeypatch.setattr(rtde, "START_S", 0.2)
    mute = rtde.RtdeArm(arm=CONFIG, address=controller.host)
    try:
        with frozen(controller, GRIPPER_PORT), pytest.raises(WireError, match=r"gripper: .*power.*plugged") as told:
            mute.connect()
        assert not isinstance(told.value, StaleStateError)
    finally:
        mute.close()


def test_a_controller_whose_time_stands_still_is_stale_whatever_its_hand_says(controller, arm, monkeypatch):
    from robot.hal import rtde

    monkeypatch.setattr(rtde, "START_S", 0.2)
    with frozen(controller, GRIPPER_PORT, RTDE):
        arm._gripper.close()
        arm._gripper.connect(controller.host)
        with pytest.raises(StaleStateError, match="newest is"):
            arm._wait_first_state()


@pytest.mark.parametrize("is_remote_at_first", [True, False])
def test_a_program_that_a_protective_stop_has_paused_is_seen_to_end(is_remote_at_first):
    """The dashboard answers before the state that shows it has come: a stop that looks at once sees it paused.

    And a dashboard that was connected in local control obeys nobody in remote control either.
    """
    from robot.hal.rtde import RtdeArm

    with ControllerProcess(Setup(host=own_address())) as controller:
        controller.fault("remote", on=is_remote_at_first)
        arm = RtdeArm(arm=CONFIG, address=controller.host)
        arm.connect()
        controller.fault("remote", on=True)
        with undisturbed():
            arm.engage()
        controller.fault("protective_stop")
        wait(arm, 100)
        is_confirmed = arm.stop()
        arm.close()
        assert is_confirmed


def test_an_arm_whose_drives_are_cut_is_refused_for_its_stop_and_not_for_the_hand_that_has_no_power():
    from robot.hal.rtde import RtdeArm

    with ControllerProcess(Setup(host=own_address())) as controller:
        controller.fault("violation")
        arm = RtdeArm(arm=CONFIG, address=controller.host)
        with pytest.raises(ArmRefusedError, match="came: safety violation"):
            arm.connect()
        arm.close()


def test_a_program_that_only_a_person_can_end_is_no_confirmed_stop(controller, arm):
    with undisturbed():
        arm.engage()
    controller.fault("remote", on=False)
    controller.fault("safeguard_open")
    assert not arm.stop()
    controller.fault("safeguard_close")
    controller.fault("remote", on=True)


@pytest.mark.parametrize(
    ("fault", "on", "off", "word"),
    [
        ("slider", {"share": 0.5}, {"share": 1.0}, "speed slider at 100 %, it is at 50 %"),
        ("reduced", {"on": True}, {"on": False}, "reduced mode"),
    ],
    ids=["slider", "reduced"],
)
def test_an_arm_that_somebody_slows_down_in_command_is_refused(controller, arm, fault, on, off, word):
    with undisturbed():
        arm.engage()
        drive(arm, 0.08, 20)
    controller.fault(fault, **on)
    try:
        with pytest.raises(ArmRefusedError, match=word):
            drive(arm, 0.08, 50)
        assert arm.stop()
        with pytest.raises(ArmRefusedError, match=word):
            arm.engage()
    finally:
        controller.fault(fault, **off)


def test_an_output_that_somebody_else_switches_is_refused_by_its_terminal(controller, arm):
    arm.engage()
    with undisturbed():
        drive(arm, 0.05, 30)
    with socket.create_connection((controller.host, SECONDARY)) as port:
        port.sendall(b"sec other():\n  set_standard_digital_out(3, True)\nend\n")
        with pytest.raises((ArmRefusedError, StaleStateError)) as raised:
            drive(arm, 0.05, 200)
        port.sendall(b"sec back():\n  set_standard_digital_out(3, False)\nend\n")
    arm.stop()
    with undisturbed():
        if "who else" not in str(raised.value):
            raise raised.value
    assert "digital output 3: " in str(raised.value)


TICK_NS = 2_000_000


class Still:
    """A client that serves the last state for ever, as ur_rtde's does after a drop."""

    def getTimestamp(self):  # noqa: N802 - ur_rtde's name
        return 12.5


@pytest.mark.parametrize(("age_ns", "is_stale"), [(0, False), (STALE_NS, False), (STALE_NS + 1, True)])
def test_a_state_that_stands_still_is_borne_up_to_the_limit_and_not_beyond(monkeypatch, age_ns, is_stale):
    made, now_ns = rtde.RtdeArm(arm=CONFIG, address="127.0.0.1"), 7_000_000
    monkeypatch.setattr(rtde, "monotonic_ns", lambda: now_ns)
    made._note_freshness(Still())
    now_ns += age_ns
    if not is_stale:
        made._note_freshness(Still())
        return
    with pytest.raises(StaleStateError, match="is 40 ms old"):
        made._note_freshness(Still())


def test_a_state_that_stands_still_is_found_within_50_ms_tick_and_package_counted_and_one_20_ms_late_is_borne():
    assert STALE_NS + 2 * TICK_NS < 50_000_000
    assert STALE_NS > 20_000_000 + 2 * TICK_NS


class Lost:
    """A client that lost its link and cannot reconnect: it throws, whatever is asked of it."""

    def __getattr__(self, name):
        def throw(*_):
            raise RuntimeError("Timeout connecting to UR dashboard server.")

        return throw


def test_a_client_that_throws_where_it_cannot_reconnect_is_a_lost_link_by_name():
    made = rtde.RtdeArm(arm=CONFIG, address="127.0.0.1")
    command = made._command
    command.control = command.outputs = Lost()
    with pytest.raises(StaleStateError, match=r"servoJ: .*Timeout connecting"):
        command.servo((0.0,) * 6, CONFIG.servo)
    assert made.links.is_lost
    made.links.is_lost = False
    command.outputs.bits = 0
    with pytest.raises(StaleStateError, match=r"digital outputs: .*Timeout connecting"):
        command.put(1)
    assert made.links.is_lost


def test_a_command_that_took_as_long_as_a_reconnection_is_a_lost_link(monkeypatch):
    import robot.hal.rtde_command as sending

    class Sent:
        def servoJ(self, *_):  # noqa: N802 - ur_rtde's name
            return True

    for spent_ns, is_lost in ((sending.WRITE_NS, False), (sending.WRITE_NS + 1, True)):
        made, times = rtde.RtdeArm(arm=CONFIG, address="127.0.0.1"), iter((7, 7 + spent_ns))
        monkeypatch.setattr(sending, "monotonic_ns", lambda times=times: next(times))
        made._command.control = Sent()
        if is_lost:
            with pytest.raises(StaleStateError, match="may have reconnected"):
                made._command.servo((0.0,) * 6, CONFIG.servo)
        else:
            assert made._command.servo((0.0,) * 6, CONFIG.servo)
        assert made.links.is_lost is is_lost
        made._command.control = None
