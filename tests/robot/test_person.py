"""A person at the terminal arms: what is asked, what is answered, and what a real arm's pendant shows."""

import socket
import threading

import msgspec
import pytest

from robot.errors import SafetyError, WireError
from robot.hal.fake import FakePlant
from robot.hal.pendant import Pendant
from robot.messages import PlantIdentity, PlantKind, StationMode
from robot.person import PersonOperator
from robot.rigs import build_station
from sim_twin.operator import SimulatedOperator
from tests.support.stations import fake_rig
from tests.support.words import HostTime

REAL = PlantIdentity(kind=PlantKind.REAL, model="ur5e", serial="20225500001")


class Somebody:
    """Reads what is shown, on the pendant or on the console, and types it after a while."""

    def __init__(self, pendant, host, *, after_s=1.0):
        self.pendant, self.host, self.after_s = pendant, host, after_s
        self.keys, self.asked, self.confirmed = [], [], []

    def tell(self, text):
        raise AssertionError(text)

    def await_key(self, text):
        self.keys.append(text)

    def confirm(self, text):
        self.confirmed.append(text)

    def ask(self, text):
        self.asked.append(text)
        self.host.now_ns += round(self.after_s * 1e9)
        return self.pendant[-1].split()[-1] if "pendant" in text else text.split("code is ")[1].split(":")[0]


@pytest.fixture
def cell():
    """A real arm as far as anybody can tell, its pendant, and its host's clock."""
    resolved, host, pendant = fake_rig(), HostTime(now_ns=0), []
    expected = msgspec.structs.replace(resolved.rig.expected, kind="real", serial=REAL.serial)
    resolved = msgspec.structs.replace(resolved, rig=msgspec.structs.replace(resolved.rig, expected=expected))
    plant = FakePlant(arm=resolved.arm, scenario=resolved.scenario, rig=resolved.rig)
    plant.identity = REAL
    station = build_station(resolved, plant=plant, host_ns=host, cell_shows=pendant.append)
    yield station, pendant, host
    station.close()


def test_a_person_who_reads_the_pendant_arms_a_real_arm(cell):
    station, pendant, host = cell
    person = Somebody(pendant, host)
    PersonOperator(person).arm_once(station)
    assert station.state.mode is StationMode.ENGAGED
    assert "emergency stop" in person.keys[0]
    assert len(pendant) == 1
    assert pendant[0].split()[-1] not in person.asked[0]


def test_the_console_never_shows_what_the_pendant_shows(cell):
    station, pendant, _ = cell
    assert station.challenge() is None
    assert len(pendant) == 1


def test_an_answer_after_ten_seconds_does_not_arm(cell):
    station, pendant, host = cell
    with pytest.raises(SafetyError, match="within 10 s"):
        PersonOperator(Somebody(pendant, host, after_s=10.001)).arm_once(station)
    assert station.state.mode is StationMode.DISARMED


def test_neither_the_simulated_operator_nor_a_name_arms_it(cell):
    station, pendant, _ = cell
    with pytest.raises(SafetyError, match="real arm"):
        SimulatedOperator().arm_once(station)
    with pytest.raises(SafetyError, match="nothing was asked"):
        station.arm(by="a name on a bus")
    assert station.state.mode is StationMode.DISARMED
    assert pendant == []


def test_a_latch_takes_a_look_a_code_and_a_word(cell):
    station, pendant, host = cell
    person = Somebody(pendant, host)
    operator = PersonOperator(person)
    operator.arm_once(station)
    station.stop(by="tester")
    operator.rearm(station, seed=1, epoch=1)
    assert station.state.mode is StationMode.ENGAGED
    assert pendant[0] != pendant[1]
    assert ["stopped by tester" in key for key in person.keys] == [False, True]
    assert ["stand clear" in line for line in person.confirmed] == [True]


def test_where_nothing_else_can_show_it_the_console_does():
    resolved, host = fake_rig(), HostTime(now_ns=0)
    station = build_station(resolved, host_ns=host)
    PersonOperator(Somebody([], host)).arm_once(station)
    assert station.state.mode is StationMode.ENGAGED
    station.close()


# ------------------------------------------------------------------------------------------------------- the pendant


def dashboard(answer):
    """A dashboard port on loopback that greets, takes one line and answers it."""
    server = socket.create_server(("127.0.0.1", 0))
    heard = []

    def serve():
        link, _ = server.accept()
        with link, link.makefile("rwb") as lines:
            lines.write(b"Connected: Universal Robots Dashboard Server\n")
            lines.flush()
            heard.append(lines.readline().decode())
            lines.write(answer + b"\n")
            lines.flush()

    thread = threading.Thread(target=serve)
    thread.start()
    return server, thread, heard


def test_the_pendant_shows_one_line_whatever_the_text_holds():
    server, thread, heard = dashboard(b"showing popup")
    Pendant("127.0.0.1", port=server.getsockname()[1])("type\n0417\r\nquit")
    thread.join()
    server.close()
    assert heard == ["popup type 0417 quit\n"]


def test_a_pendant_that_shows_nothing_is_an_error():
    server, thread, _ = dashboard(b"Could not understand: 'popup'")
    with pytest.raises(WireError, match="nothing is shown"):
        Pendant("127.0.0.1", port=server.getsockname()[1])("0417")
    thread.join()
    port = server.getsockname()[1]
    server.close()
    with pytest.raises(WireError, match="expected it to show"):
        Pendant("127.0.0.1", port=port)("0417")
