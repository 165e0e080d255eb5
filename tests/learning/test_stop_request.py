"""A first signal asks for a stop, a second one is a KeyboardInterrupt, and afterwards signals are what they were."""

import os
import signal

import pytest

from learning.stop_request import StopRequest

SIGNALS = [signal.SIGINT, signal.SIGTERM]


@pytest.mark.parametrize("number", SIGNALS)
def test_the_first_signal_asks_for_a_stop_and_says_so(number):
    said = []
    with StopRequest(said.append) as stop:
        assert not stop()
        os.kill(os.getpid(), number)
        assert stop()
    assert len(said) == 1
    assert said[0].startswith("stopping after this epoch and the evaluations that are due or under way")


@pytest.mark.parametrize("first", SIGNALS)
@pytest.mark.parametrize("second", SIGNALS)
def test_the_second_signal_stops_at_once(first, second):
    with StopRequest(lambda _: None):
        os.kill(os.getpid(), first)
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), second)


def test_afterwards_signals_do_what_they_did_before():
    before = [signal.getsignal(number) for number in SIGNALS]
    with StopRequest(lambda _: None), pytest.raises(ZeroDivisionError):
        raise ZeroDivisionError
    assert [signal.getsignal(number) for number in SIGNALS] == before
