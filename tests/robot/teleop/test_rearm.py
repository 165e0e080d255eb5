"""After a latch: a look, a code, a key. Never by itself."""

import re
import sys
from types import SimpleNamespace

import pytest
from rich.console import Console

from robot import person
from robot.errors import SafetyError
from robot.messages import Hold, StationMode
from robot.rigs import build_station
from robot.teleop.drive import Rearm
from robot.teleop.readout import ReadOut
from sim_twin.operator import SimulatedOperator
from tests.support.stations import fake_rig


@pytest.fixture
def latched(monkeypatch):
    """A driven station that was stopped, what its terminal said, and who sits there."""
    station, said, typed = build_station(fake_rig(), is_driven=True), [], []
    SimulatedOperator().arm_once(station)
    station.stop(by="a tester")
    monkeypatch.setattr(person.typer, "echo", lambda text, err: said.append(text))

    def readline():
        typed.append(len(said))
        code = re.search(r"the code is (\d{4})|type (\d\d),", said[-1])
        return f"{code[1] or code[2]}\n" if code else "\n"

    monkeypatch.setattr(sys, "stdin", SimpleNamespace(readline=readline, isatty=lambda: False))
    yield station, said, typed
    station.close()


def rearm(station, *, is_person=True):
    readout = ReadOut(keys=(), console=Console(quiet=True), now_ns=lambda: 0)
    return Rearm(station, readout, is_person=is_person, seed=1)(station.state)


def test_a_person_looks_types_the_code_and_then_two_digits(latched):
    station, said, typed = latched
    assert rearm(station)
    assert len(typed) == 3
    assert "stopped by a tester" in said[0]
    assert "within 10 s" in said[1]
    assert "stand clear" in said[2]
    assert station.state.mode is StationMode.ENGAGED
    assert not station.step(Hold()).is_void


def test_a_wrong_word_leaves_it_latched(latched, monkeypatch):
    station, _, _ = latched
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(readline=lambda: "yes\n", isatty=lambda: False))
    with pytest.raises(SafetyError, match="the code that the cell shows"):
        rearm(station)
    assert station.state.mode is StationMode.LATCHED


def test_where_the_input_has_ended_it_stays_latched(latched, monkeypatch):
    station, _, _ = latched
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(readline=lambda: "", isatty=lambda: False))
    with pytest.raises(SafetyError, match="the input has ended"):
        rearm(station)
    assert station.state.mode is StationMode.LATCHED


def test_a_script_is_nobody(latched):
    station, said, _ = latched
    assert not rearm(station, is_person=False)
    assert said == []
    assert station.state.mode is StationMode.LATCHED
