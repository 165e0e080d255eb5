"""The keyboard on a pseudo-terminal: what is typed arrives, and the terminal is given back as it was."""

import contextlib
import os
import select
import termios

import pytest

from robot.errors import RobotConfigError
from robot.teleop.keyboard import Keyboard
from robot.teleop.keys import HELD_NS


class Time:
    now_ns = 10_000_000_000

    def __call__(self):
        return self.now_ns


@pytest.fixture
def typed():
    """A keyboard, who types on it, and its time."""
    typist, terminal = os.openpty()
    time = Time()
    board = Keyboard(detail="", now_ns=time, step_s=0.02, terminal=terminal)
    board.connect()
    yield board, typist, terminal, time
    board.close()
    for fd in (typist, terminal):
        with contextlib.suppress(OSError):
            os.close(fd)


def test_what_is_typed_arrives_without_enter_and_is_not_printed(typed):
    board, typist, _, time = typed
    os.read(typist, 1024)
    os.write(typist, b"w")
    assert board.read().linear == (1.0, 0.0, 0.0)
    time.now_ns += HELD_NS + 1
    assert not board.read().is_held
    os.write(typist, b"x")
    assert board.read().is_over
    os.set_blocking(typist, False)
    with pytest.raises(BlockingIOError):
        os.read(typist, 1024)


def test_it_asks_for_releases_and_takes_the_answer(typed):
    board, typist, _, time = typed
    assert b"\x1b[?u" in os.read(typist, 1024)
    os.write(typist, b"\x1b[?11u\x1b[119;1:1u")
    assert board.read().is_held
    time.now_ns += 2 * HELD_NS
    assert board.read().is_held
    os.write(typist, b"\x1b[119;1:3u")
    assert not board.read().is_held


def test_a_lone_escape_ends_after_a_moment_and_not_at_once(typed):
    board, typist, _, time = typed
    os.write(typist, b"\x1b")
    assert not board.read().is_over
    time.now_ns += 60_000_000
    assert board.read().is_over


def test_a_sequence_in_two_parts_is_one_key(typed):
    board, typist, _, _ = typed
    os.write(typist, b"\x1b")
    board.read()
    os.write(typist, b"[A")
    asked = board.read()
    assert asked.linear == (1.0, 0.0, 0.0)
    assert not asked.is_over


def said_to(typist):
    """What the terminal was told so far: a pseudo-terminal hands it on in pieces, and a moment later."""
    told = b""
    while select.select([typist], [], [], 0.2)[0]:
        told += os.read(typist, 1024)
    return told


def test_the_terminal_is_given_back_as_it_was_and_what_was_not_read_is_dropped():
    typist, terminal = os.openpty()
    before = termios.tcgetattr(terminal)
    board = Keyboard(detail="", now_ns=Time(), step_s=0.02, terminal=terminal)
    board.connect()
    assert termios.tcgetattr(terminal) != before
    os.write(typist, b"wwwww")
    board.close()
    board.close()
    assert termios.tcgetattr(terminal) == before
    assert b"\x1b[<u" in said_to(typist)
    os.close(typist)
    os.close(terminal)


def test_a_terminal_that_goes_away_ends_the_drive(typed):
    board, typist, _, _ = typed
    os.write(typist, b"w")
    assert board.read().is_held
    os.close(typist)
    asked = board.read()
    assert asked.is_over
    assert not asked.is_held


def test_what_is_no_terminal_is_told():
    read, write = os.pipe()
    with pytest.raises(RobotConfigError, match="expected a terminal"):
        Keyboard(detail="", now_ns=Time(), step_s=0.02, terminal=read).connect()
    os.close(read)
    os.close(write)
    with pytest.raises(RobotConfigError, match="nothing after it"):
        Keyboard(detail="fast", now_ns=Time(), step_s=0.02)
