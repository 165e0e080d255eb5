"""What a person at the arm is asked for over the bus: minutes pass, and the node is there for everybody meanwhile."""

import os
import pty
import socket
import threading
import time
from types import SimpleNamespace

import pytest

from robot.bus import Bus, Role
from robot.errors import RobotError, SafetyError
from robot.messages import StationMode
from robot.node import NodeAsker, RemoteStation, StopCaller
from robot.operated import AskingOperator, OperatedStation
from robot.person import TerminalPerson, draw_digits
from robot.safety import Answer
from tests.support.robot_node import SERIAL, Node

pytestmark = pytest.mark.realtime

HOST = "127.0.0.103"


def until(is_true, timeout_s=10.0):
    end = time.monotonic() + timeout_s
    while not is_true():
        assert time.monotonic() < end
        time.sleep(0.005)


class AtTheArm:
    """Reads for as long as it is told to, and then says yes."""

    def __init__(self):
        self.agrees, self.asked, self.tend = threading.Event(), [], lambda: None

    def arm(self, station):
        self._read("arm")
        station.arm(by="a person")

    def look(self, station):
        self._read(station.state.reason)

    def clear(self, station):
        self._read("clear")
        station.clear_latch(by="a person")

    def _read(self, what):
        self.asked.append(what)
        while not self.agrees.is_set():
            self.tend()
            time.sleep(0.01)


@pytest.fixture
def lab():
    with socket.create_server((HOST, 0)) as free:
        endpoint = f"tcp/{HOST}:{free.getsockname()[1]}"
    person = AtTheArm()
    node = Node(endpoint, person=person)
    person.tend = node.node.tend
    told, made = [], []

    def join(source="learning"):
        bus = Bus(endpoint, serial=SERIAL, role=Role.LEARNING, source=source)
        bus.open()
        made.append(RemoteStation(bus, asker=NodeAsker(bus, wait_s=5.0, tell=told.append)))
        return made[-1]

    with Bus(endpoint, serial=SERIAL, role=Role.VIEWER) as viewer:
        yield SimpleNamespace(person=person, node=node, join=join, told=told, viewer=viewer)
    person.agrees.set()
    for station in made:
        station.close()
    node.close()


def arming(station):
    """Have it armed by a thread of its own, and return that and what came of it."""
    came = []

    def run():
        try:
            AskingOperator().arm_once(station)
        except RobotError as error:
            came.append(str(error))

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    return thread, came


def test_an_arm_is_armed_when_the_person_agrees_however_long_that_takes_and_he_is_asked_once(lab):
    station = lab.join()
    thread, came = arming(station)
    until(lambda: lab.told)
    time.sleep(2.5)  # longer than a lease lives without a word, and many times asked whether it is done
    assert lab.node.local.state.mode is StationMode.DISARMED
    lab.person.agrees.set()
    thread.join()
    assert came == []
    assert (lab.person.asked, station.state.mode) == (["arm"], StationMode.ENGAGED)
    assert "to arm it" in lab.told[0]


def test_meanwhile_others_are_told_what_it_waits_for(lab):
    thread, _ = arming(lab.join())
    until(lambda: lab.person.asked)
    with pytest.raises(SafetyError, match=r"waits for a person at the arm \(Arm\)"):
        AskingOperator().arm_once(lab.join("other"))
    lab.person.agrees.set()
    thread.join()


def test_a_stop_voids_it_whatever_the_person_says_afterwards(lab):
    thread, came = arming(lab.join())
    until(lambda: lab.person.asked)
    caller = StopCaller(lab.viewer, by="the test")
    assert caller.stop(within_s=5.0) is not None
    caller.close()
    thread.join()
    assert "somebody said stop" in came[0]
    assert any("void" in line for line in lab.node.said), "he who is asked must read it too"
    lab.person.agrees.set()
    assert lab.node.local.state.mode is StationMode.DISARMED


def test_who_asked_and_has_gone_is_waited_for_no_longer(lab):
    station = lab.join()
    thread, came = arming(station)
    until(lambda: lab.person.asked)
    station._is_over.set()  # its heart stops, as that of a process that was killed does
    thread.join()
    assert "has gone" in came[0]
    assert lab.node.local.state.mode is StationMode.DISARMED


@pytest.mark.slow
def test_a_robot_node_that_ends_voids_it(lab):
    arming(lab.join())
    until(lambda: lab.person.asked)
    lab.node.is_over.set()
    until(lambda: any("this robot node ends" in line for line in lab.node.said))


def test_a_latch_is_looked_into_and_cleared_by_the_person_alone(lab):
    lab.person.agrees.set()
    station = lab.join()
    AskingOperator().arm_once(station)
    lab.node.local.stop(by="the test")
    until(lambda: station.state.mode is StationMode.LATCHED)
    AskingOperator().rearm(station, seed=1, epoch=0)
    assert lab.person.asked == ["arm", "stopped by the test", "clear"]
    assert station.state.mode is StationMode.ENGAGED


def test_no_answer_of_the_cell_crosses_the_bus(lab):
    station = lab.join()
    with pytest.raises(SafetyError, match="no bus carries it"):
        station.arm(by="somebody", answer=Answer("1234", by="console"))
    assert lab.person.asked == []


def test_only_what_is_typed_after_a_question_answers_it(monkeypatch, capsys):
    reader, writer = os.pipe()
    with os.fdopen(reader) as keyboard:
        monkeypatch.setattr("sys.stdin", keyboard)
        os.write(writer, b"\nyes\n")
        said = []

        def meanwhile():
            said.append(capsys.readouterr().err)
            if "the code, then Enter" in said[-1]:
                os.write(writer, b"4711\n")

        assert TerminalPerson(meanwhile).ask("the code") == "4711"
        os.close(writer)
        with pytest.raises(SafetyError, match="nobody is at the arm"):
            TerminalPerson(lambda: None).await_key("again")


class HeldKey:
    """A terminal where something lies on Enter, 30 times a second, until it is taken away."""

    def __init__(self):
        self.master, slave = pty.openpty()
        self.keyboard, self._away = os.fdopen(slave, "r"), threading.Event()
        self.types = threading.Thread(target=self._type, daemon=True)
        self.types.start()

    def _type(self):
        while not self._away.wait(1 / 30):
            os.write(self.master, b"\n")
            os.read(self.master, 4096)

    def take_away(self):
        self._away.set()
        self.types.join()

    def type(self, text):
        os.write(self.master, text.encode())

    def close(self):
        self.take_away()
        self.keyboard.close()
        os.close(self.master)


@pytest.fixture
def held(monkeypatch):
    terminal = HeldKey()
    monkeypatch.setattr("sys.stdin", terminal.keyboard)
    yield terminal
    terminal.close()


def test_nothing_is_asked_while_a_key_is_held_and_a_stop_ends_the_waiting(held, capsys):
    rounds, said = iter(range(100)), []

    def meanwhile():
        said.append(capsys.readouterr().err)
        if next(rounds, None) is None:
            raise SafetyError("it is void")

    with pytest.raises(SafetyError, match="it is void"):
        TerminalPerson(meanwhile).await_key("hands off")
    assert "hands off" not in "".join(said)
    assert "".join(said).count("lying on the keyboard") == 1


def test_enter_alone_does_not_confirm_nor_do_digits_that_were_shown_before(monkeypatch, capsys):
    reader, writer = os.pipe()
    answers, shown = iter([b"\n", b"41\n", b" 56 \n"]), iter(["41", "23", "56"])
    said = []

    def meanwhile():
        said.append(capsys.readouterr().err)
        if "hands off: type" in said[-1]:
            os.write(writer, next(answers))

    with os.fdopen(reader) as keyboard, os.fdopen(writer, "w"):
        monkeypatch.setattr("sys.stdin", keyboard)
        TerminalPerson(meanwhile, draw=lambda: next(shown)).confirm("hands off")
    assert "".join(said).count("the arm waits") == 2
    assert next(answers, None) is None


def test_a_key_that_is_held_from_the_question_on_confirms_nothing(held, capsys):
    """Auto-repeat begins after a pause: the quiet before a question may have been that."""
    held.take_away()
    said = []

    def meanwhile():
        said.append(capsys.readouterr().err)
        if "hands off: type" in said[-1]:
            held.type("\n" * 5)
            if "".join(said).count("hands off: type") == 3:
                raise SafetyError("it is void")

    with pytest.raises(SafetyError, match="it is void"):
        TerminalPerson(meanwhile).confirm("hands off")


def test_digits_to_be_typed_back_differ_so_that_no_one_key_types_them():
    drawn = {draw_digits() for _ in range(2000)}
    assert len(drawn) > 80
    assert all(len(digits) == len(set(digits)) == 2 and digits.isdigit() for digits in drawn)


def test_waiting_for_a_person_ends_where_what_he_is_asked_for_is_void(monkeypatch):
    reader, writer = os.pipe()

    def void():
        raise SafetyError("it is void")

    with os.fdopen(reader) as keyboard, os.fdopen(writer, "w"):
        monkeypatch.setattr("sys.stdin", keyboard)
        with pytest.raises(SafetyError, match="it is void"):
            TerminalPerson(void).await_key("again")


@pytest.mark.slow
@pytest.mark.parametrize("away_s", [0.5, 4.0])
def test_a_hub_that_is_away_while_a_person_is_asked_ends_no_run(away_s):
    """Shorter than a lease lives, or longer: the question goes on, or is void and asked once more."""
    with socket.create_server((HOST, 0)) as free:
        endpoint = f"tcp/{HOST}:{free.getsockname()[1]}"

    def hub():
        opened = Bus(endpoint, serial=SERIAL, role=Role.VIEWER, source="hub", is_hub=True)
        opened.open()
        return opened

    first, person = hub(), AtTheArm()
    node = Node(endpoint, is_hub=False, person=person)
    person.tend = node.node.tend
    bus = Bus(endpoint, serial=SERIAL, role=Role.LEARNING, source="learning")
    bus.open()
    station = RemoteStation(bus, asker=NodeAsker(bus, wait_s=20.0))
    came = []

    def run():
        with OperatedStation(station, AskingOperator()) as operated:
            came.append(operated.reset(seed=1, epoch=0))

    thread = threading.Thread(target=run)
    thread.start()
    until(lambda: person.asked)
    first.close()
    time.sleep(away_s)
    second = hub()
    time.sleep(2.0)
    assert node.local.state.mode is not StationMode.ENGAGED
    person.agrees.set()
    thread.join()
    node.close()
    second.close()
    assert len(came) == 1
