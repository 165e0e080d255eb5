"""Outputs over RTDE: the client says that it sent, so that what is read tells whether a terminal follows."""

import pytest

pytest.importorskip("rtde_io", reason="the genuine client comes with `pip install autotelic[lab]`")
outputs = pytest.importorskip("robot.hal.rtde_outputs")

ALL, LIMIT = 0xFFFF, outputs.STRAY_NS


class Sent:
    """A client to whom sending is all."""

    def __init__(self, *_):
        pass

    def setStandardDigitalOut(self, *_):  # noqa: N802 - ur_rtde's name
        return True

    setConfigurableDigitalOut = setStandardDigitalOut  # noqa: N815


@pytest.fixture
def driven(monkeypatch):
    monkeypatch.setattr(outputs, "RTDEIOInterface", Sent)
    return outputs.DigitalOutputs("127.0.0.1", bits=0)


@pytest.mark.parametrize("terminal", range(16))
def test_a_terminal_that_does_not_follow_is_borne_up_to_the_limit_and_not_beyond(driven, terminal):
    assert driven.put(1 << terminal) is None
    for now_ns in (7, 8, 7 + LIMIT):
        assert driven.strayed(0, ALL, now_ns=now_ns) is None
    assert driven.strayed(0, ALL, now_ns=8 + LIMIT) == terminal


def test_one_that_follows_late_is_no_stray_and_its_time_begins_anew_when_it_is_switched_again(driven):
    driven.put(0b1)
    assert driven.strayed(0b0, ALL, now_ns=0) is None
    assert driven.strayed(0b1, ALL, now_ns=LIMIT) is None
    driven.put(0b0)
    assert driven.strayed(0b1, ALL, now_ns=LIMIT + 1) is None
    assert driven.strayed(0b1, ALL, now_ns=2 * LIMIT) is None
    driven.put(0b1)
    assert driven.strayed(0b0, ALL, now_ns=2 * LIMIT + 5) is None
    assert driven.strayed(0b0, ALL, now_ns=3 * LIMIT) is None


def test_another_terminal_that_is_switched_meanwhile_saves_no_stray(driven):
    driven.put(0b1)
    for k in range(21):
        driven.put(0b1 | (k % 2) << 1)
        found = driven.strayed(driven.bits & ~0b1, ALL, now_ns=k * LIMIT // 20)
        assert found is None
    driven.put(0b01)
    assert driven.strayed(0b00, ALL, now_ns=LIMIT + 1) == 0


def test_terminals_that_are_driven_by_others_are_theirs(driven):
    for now_ns in (0, 1, 2 * LIMIT):
        assert driven.strayed(0b100, ALL & ~0b100, now_ns=now_ns) is None
