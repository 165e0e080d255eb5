"""A whole drive by keyboard, on a pseudo-terminal: what a person at an SSH session meets."""

import signal
import termios

import pytest

from tests.support.terminal import Session


@pytest.fixture
def session():
    opened = Session("--rig", "twin", "--no-view")
    yield opened
    opened.close()


def test_a_drive_by_keyboard_moves_while_a_key_repeats_and_ctrl_c_gives_the_terminal_back(session):
    session.until(r"rests: released")
    session.until(r"moves\b", meanwhile=b"a")
    session.until(r"rests: released")
    session.process.send_signal(signal.SIGINT)
    assert session.end() == 0, session.text[-2000:]
    assert "at rest" in session.text
    assert termios.tcgetattr(session.terminal) == session.before


@pytest.mark.slow
def test_it_ends_by_its_key_and_when_the_connection_goes(session):
    session.until(r"rests: released")
    session.type(b"x")
    assert session.end() == 0
    other = Session("--rig", "twin", "--no-view")
    other.until(r"rests: released")
    other.process.send_signal(signal.SIGHUP)
    assert other.end() == 0
    other.close()
