"""What a terminal's bytes mean, and when a key counts as released."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot.messages import Grip
from robot.teleop.device import Frame
from robot.teleop.keys import HELD_NS, PAUSE_NS, KeyBoard, KeyEvent, Kind, decode
from tests.support.words import HostTime


@pytest.fixture
def time():
    return HostTime(now_ns=10_000_000_000)


@pytest.fixture
def board(time):
    return KeyBoard(now_ns=time)


def feed(board, raw):
    events, rest = decode(raw)
    assert rest == b""
    for event in events:
        board.feed(event)


@pytest.mark.parametrize(
    ("raw", "events"),
    [
        (b"w", [KeyEvent("w")]),
        (b" ", [KeyEvent("space")]),
        (b"\x03", [KeyEvent("ctrl+c")]),
        (b"\x1b[A", [KeyEvent("up")]),
        (b"\x1b[5~w", [KeyEvent("pgup"), KeyEvent("w")]),
        (b"\x1b[O", [KeyEvent("blur")]),
        (b"\x1b[?11u", [KeyEvent("kitty")]),
        (b"\x1b[119u", [KeyEvent("w")]),
        (b"\x1b[119;1:2u", [KeyEvent("w", Kind.REPEAT)]),
        (b"\x1b[119;1:3u", [KeyEvent("w", Kind.RELEASE)]),
        (b"\x1b[1;1:3A", [KeyEvent("up", Kind.RELEASE)]),
        (b"\x1b[99;5u", [KeyEvent("ctrl+c")]),
        (b"\x1b[119:87;2u", [KeyEvent("w")]),
        ("é".encode(), [KeyEvent("é")]),
        (b"\x1bw", [KeyEvent("esc"), KeyEvent("w")]),
    ],
)
def test_bytes_are_keys(raw, events):
    assert decode(raw) == (events, b"")


@pytest.mark.parametrize("raw", [b"\x1b", b"\x1b[", b"\x1b[119;1", b"\xc3"])
def test_half_a_sequence_waits_for_its_other_half(raw):
    assert decode(raw) == ([], raw)


@given(st.binary(max_size=60), st.integers(0, 60))
def test_any_bytes_decode_alike_however_they_are_cut(raw, at):
    whole, rest = decode(raw)
    first, left = decode(raw[:at])
    second, its_rest = decode(left + raw[at:])
    if b"\x1b" not in raw[at : at + 1] or left != b"\x1b":
        assert (first + second, its_rest) == (whole, rest)


@pytest.mark.parametrize(("after_ns", "is_held"), [(0, True), (HELD_NS, True), (HELD_NS + 1, False)])
def test_a_key_is_held_for_150_ms_after_it_was_seen_and_not_a_nanosecond_longer(board, time, after_ns, is_held):
    feed(board, b"w")
    time.now_ns += after_ns
    asked = board.asked()
    assert asked.is_held is is_held
    assert asked.linear == ((1.0, 0.0, 0.0) if is_held else (0.0, 0.0, 0.0))
    assert asked.stamp_ns == time.now_ns


def test_a_repeating_key_goes_on(board, time):
    for _ in range(40):
        feed(board, b"a")
        time.now_ns += 33_000_000
        assert board.asked().linear == (0.0, 1.0, 0.0)
    time.now_ns += HELD_NS
    assert not board.asked().is_held


@pytest.mark.parametrize("stop", [b" ", b"k", b"W", b"\x1b[O", b"\t", "é".encode()])
def test_any_other_key_and_a_window_that_is_left_stop(board, stop):
    feed(board, b"w")
    feed(board, stop)
    assert not board.asked().is_held


def test_with_a_terminal_that_tells_releases_a_key_is_held_over_the_first_pause(board, time):
    feed(board, b"\x1b[?11u\x1b[119;1:1u")
    time.now_ns += PAUSE_NS
    assert board.asked().is_held
    feed(board, b"\x1b[119;1:3u")
    assert not board.asked().is_held


def test_but_not_for_good_where_it_falls_silent(board, time):
    feed(board, b"\x1b[?11u\x1b[119;1:1u")
    time.now_ns += PAUSE_NS + 1
    assert not board.asked().is_held
    feed(board, b"\x1b[119;1:1u\x1b[119;1:2u")
    time.now_ns += HELD_NS
    assert board.asked().is_held
    time.now_ns += 1
    assert not board.asked().is_held


def test_two_keys_add_up_and_one_of_them_may_be_let_go(board):
    feed(board, b"\x1b[?11u\x1b[119;1:1u\x1b[97;1:1u")
    assert board.asked().linear == (1.0, 1.0, 0.0)
    feed(board, b"\x1b[97;1:3u")
    assert board.asked().linear == (1.0, 0.0, 0.0)


def test_hand_speed_frame_and_clutch_stay_as_switched(board, time):
    feed(board, b"c--tz")
    asked = board.asked()
    assert (asked.grip, asked.speed_share, asked.frame, asked.is_clutched) == (Grip.CLOSE, 0.8, Frame.TOOL, True)
    for _ in range(30):
        time.now_ns += 40_000_000
        feed(board, b"t")  # held: it must not go on switching
    time.now_ns += PAUSE_NS + 1
    assert board.asked().frame is Frame.TOOL
    feed(board, b"tzo" + b"+" * 9)
    asked = board.asked()
    assert (asked.grip, asked.speed_share, asked.frame, asked.is_clutched) == (Grip.OPEN, 1.0, Frame.BASE, False)


def test_the_speed_has_a_least(board):
    feed(board, b"-" * 30)
    assert board.asked().speed_share == 0.1


@pytest.mark.parametrize("key", [b"x", b"\x03", b"\x04", b"\x1b[99;5u", b"\x1b[27u"])
def test_these_end_the_drive(board, key):
    feed(board, b"w" + key)
    asked = board.asked()
    assert asked.is_over
    assert not asked.is_held
