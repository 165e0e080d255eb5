"""How long a servo process may go without a tick: 20 ms where it waits for something, 60 ms where it cannot run."""

import os
import signal
import subprocess
import sys
from contextlib import suppress

import pytest

from robot.servo_watch import LOOK_S, Patience, ServoWatch

pytestmark = pytest.mark.realtime

ENDS_S = 10.0


def looks_until_over(is_asleep, pulses=None):
    """Return how many looks after the first at a pulse it takes."""
    patience = Patience()
    for k in range(100):
        if patience.is_over(pulses[k] if pulses else 7, is_asleep=lambda k=k: is_asleep(k)):
            return k
    return None


@pytest.mark.parametrize(
    ("is_asleep", "limit_s"), [(lambda _: True, 0.02), (lambda _: False, 0.06), (lambda k: k % 2 == 0, 0.04)]
)
def test_a_pulse_that_stands_still_is_over_in_time(is_asleep, limit_s):
    assert looks_until_over(is_asleep) == round(limit_s / LOOK_S)


def test_a_pulse_that_goes_on_or_is_out_of_command_is_never_over():
    assert looks_until_over(lambda _: True, list(range(1, 101))) is None
    assert looks_until_over(lambda _: True, [0] * 100) is None
    assert looks_until_over(lambda _: True, [k // 4 + 1 for k in range(100)]) is None


@pytest.fixture
def sleeper():
    child = subprocess.Popen([sys.executable, "-c", "import sys, time; print(flush=True); time.sleep(60)"], stdout=-1)
    child.stdout.readline()
    yield child
    with suppress(ProcessLookupError):
        os.kill(child.pid, signal.SIGKILL)
    child.wait()
    child.stdout.close()


def test_what_sleeps_where_it_should_tick_is_killed(sleeper):
    watch = ServoWatch(sleeper.pid, [7])
    sleeper.wait(ENDS_S)
    watch.close()
    assert watch.was_hung
    assert sleeper.returncode == -signal.SIGKILL


def test_what_sleeps_out_of_command_is_left_alone(sleeper):
    watch = ServoWatch(sleeper.pid, [0])
    with pytest.raises(subprocess.TimeoutExpired):
        sleeper.wait(0.1)
    watch.close()
    assert not watch.was_hung


def test_whoever_knows_more_may_have_it_killed_while_it_is_watched_and_not_afterwards(sleeper):
    watch = ServoWatch(sleeper.pid, [0])
    watch.close()
    watch.kill()
    with pytest.raises(subprocess.TimeoutExpired):
        sleeper.wait(0.1)
    watch = ServoWatch(sleeper.pid, [0])
    watch.kill()
    sleeper.wait(ENDS_S)
    watch.kill()
    watch.close()
    assert (watch.was_hung, sleeper.returncode) == (False, -signal.SIGKILL)
