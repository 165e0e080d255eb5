"""Command that is refused on the way leaves no program of ours on the arm, or says that nobody confirms it."""

import threading
import time

import pytest

from config.loader import load_arm, resolve
from robot.errors import ArmRefusedError, RobotError, StaleStateError
from tests.support.small_lab import controller_of, make_lab

pytestmark = pytest.mark.realtime

pytest.importorskip("rtde_control", reason="the genuine client comes with `pip install autotelic[lab]`")

HOST = "127.0.0.67"


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    folder = tmp_path_factory.mktemp("lab")
    make_lab(folder, HOST)
    with controller_of(folder, HOST) as controller:
        yield folder, controller


@pytest.fixture
def arm(lab):
    from robot.hal.rtde import RtdeArm

    made = RtdeArm(arm=load_arm("ur5e"), address=HOST)
    made.connect()
    yield made
    made.close()


def refused(*_, **__):
    raise ArmRefusedError("setPayload: the controller did not take it")


def runtime(controller):
    return controller.fault("truth")["runtime"]


def test_an_engagement_that_is_refused_after_its_upload_ends_the_program_and_may_be_tried_again(lab, arm, monkeypatch):
    with monkeypatch.context() as broken:
        broken.setattr("robot.hal.rtde_command.set_tool", refused)
        with pytest.raises(ArmRefusedError, match="setPayload"):
            arm.engage()
        assert runtime(lab[1]) == "STOPPED"
    arm.read()  # a disarmed arm's state is no word of the next program's
    with monkeypatch.context() as broken:
        broken.setattr("robot.hal.rtde_command.set_tool", refused)
        with pytest.raises(ArmRefusedError, match="setPayload"):
            arm.engage()
    assert runtime(lab[1]) == "STOPPED"
    assert arm.stop()


def test_where_nobody_confirms_that_the_program_has_ended_the_process_must_end(lab, arm, monkeypatch):
    monkeypatch.setattr("robot.hal.rtde_command.set_tool", refused)
    monkeypatch.setattr("robot.hal.rtde_command.end_program", lambda *_: False)
    with pytest.raises(StaleStateError, match=r"setPayload.*nobody confirms that the program has ended"):
        arm.engage()
    assert not arm.stop()
    with pytest.raises(StaleStateError, match="end this one and start another"):
        arm.engage()
    monkeypatch.undo()
    until(lambda: ended(lab[1]))


def test_a_stop_that_is_said_while_command_is_taken_or_a_hand_activated_is_heeded(lab, arm, monkeypatch):
    monkeypatch.setattr("robot.hal.rtde_command.set_tool", lambda *_: pytest.fail("it went on"))
    monkeypatch.setattr(arm, "_wake_hand", lambda: None)
    arm.is_stopped = lambda: True
    with pytest.raises(ArmRefusedError, match="somebody said stop"):
        arm.engage()
    assert runtime(lab[1]) == "STOPPED"
    with pytest.raises(ArmRefusedError, match="somebody said stop"):
        arm._see_running()  # what is called between two words to a hand that is being activated
    monkeypatch.undo()
    arm.is_stopped = lambda: False
    arm.engage()


@pytest.mark.slow
def test_a_stop_said_past_the_pipe_while_command_is_taken_leaves_no_program_and_the_same_process(lab):
    from robot.servo_client import ServoClient

    folder, controller = lab
    client = ServoClient(resolve(rig=folder / "rig.yaml", scenario=folder / "small.yaml"))
    client.connect()
    client.engage()
    client.stop()
    pid, says = client.pid, threading.Thread(target=lambda: await_programs(controller, 2) or client.halt())
    says.start()
    try:
        with pytest.raises(ArmRefusedError, match="somebody said stop while command was taken"):
            client.engage()
        says.join()
        assert (runtime(controller), client.pid, client.why_lost) == ("STOPPED", pid, None)
        client.end_halt()
        client.engage()
    finally:
        client.close()
    assert runtime(controller) == "STOPPED"


def await_programs(controller, n_programs):
    """Wait until so many programs have begun, one after another."""
    n, was = 0, False
    while n < n_programs:
        is_playing = runtime(controller) == "PLAYING"
        n, was = n + (is_playing and not was), is_playing


def ended(controller):
    controller.fault("program_stop")
    return runtime(controller) == "STOPPED"


def until(is_true, timeout_s=20.0):
    end_s = time.monotonic() + timeout_s
    while not is_true():
        assert time.monotonic() < end_s
        time.sleep(0.02)


@pytest.mark.slow
@pytest.mark.parametrize("is_stop_said", [False, True])
def test_a_program_that_nobody_could_end_while_command_was_taken_ends_the_process_and_a_person_is_told(
    lab, is_stop_said
):
    from robot.servo_client import ServoClient

    folder, controller = lab
    client = ServoClient(resolve(rig=folder / "rig.yaml", scenario=folder / "small.yaml"))
    client.connect()
    client.engage()
    client.stop()  # the hand is active from here on
    assert client.why_lost is None

    def break_the_second_program():
        await_programs(controller, 2)
        controller.fault("remote", on=False)  # now nobody but a person at the pendant ends what is paused
        controller.fault("safeguard_open")
        if is_stop_said:
            client.halt()

    breaks = threading.Thread(target=break_the_second_program)
    breaks.start()
    try:
        with pytest.raises(RobotError):
            client.engage()
        breaks.join()
        assert runtime(controller) == "PAUSED"
        client.await_rest()
        assert client.pid is None or client._is_gone
        assert "nobody confirms that the program has ended" in client.why_lost
    finally:
        client.end_halt()
        client.close()
        controller.fault("program_stop")
        controller.fault("safeguard_close")
        controller.fault("safeguard_reset")
        controller.fault("remote", on=True)
