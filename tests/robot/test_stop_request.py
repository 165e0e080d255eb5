"""A first signal asks for a stop, a second one is a KeyboardInterrupt, and afterwards signals are what they were."""

import os
import signal

import pytest

from robot.stop_request import StopRequest

SIGNALS = [signal.SIGINT, signal.SIGTERM]


@pytest.mark.parametrize("number", SIGNALS)
def test_the_first_signal_asks_for_a_stop_and_says_so(number):
    said = []
    with StopRequest(lambda: said.append("soon")) as stop:
        assert not stop()
        os.kill(os.getpid(), number)
        assert stop()
    assert said == ["soon"]


@pytest.mark.parametrize("first", SIGNALS)
@pytest.mark.parametrize("second", SIGNALS)
def test_the_second_signal_stops_at_once(first, second):
    with StopRequest():
        os.kill(os.getpid(), first)
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), second)


def test_a_signal_that_does_not_end_at_once_goes_on_asking():
    """A terminal that went away says so more than once; the arm is to come to rest all the same."""
    said = []
    with StopRequest(lambda: said.append("soon"), signals=(*SIGNALS, signal.SIGHUP), at_once=(signal.SIGINT,)) as stop:
        os.kill(os.getpid(), signal.SIGHUP)
        os.kill(os.getpid(), signal.SIGHUP)
        os.kill(os.getpid(), signal.SIGTERM)
        assert stop()
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)
    assert said == ["soon"]


def test_afterwards_signals_do_what_they_did_before():
    before = [signal.getsignal(number) for number in SIGNALS]
    with StopRequest(), pytest.raises(ZeroDivisionError):
        raise ZeroDivisionError
    assert [signal.getsignal(number) for number in SIGNALS] == before
