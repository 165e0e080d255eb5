"""One process of a machine holds an arm; its name goes with it, however it ends."""

import os
import signal
import subprocess
import sys

import pytest

from robot.errors import WireError
from robot.hal.sole_holder import SoleHolder

HOLDS = """
from robot.hal.sole_holder import SoleHolder
holder = SoleHolder("192.0.2.7")
holder.take()
print("held", flush=True)
input()
"""


def test_another_process_is_refused_by_its_number_until_the_first_ends_even_where_it_stands_still():
    with subprocess.Popen(
        [sys.executable, "-c", HOLDS], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as other:
        assert other.stdout.readline() == "held\n"
        ours = SoleHolder("192.0.2.7")
        other.send_signal(signal.SIGSTOP)
        with pytest.raises(WireError, match=rf"another process of this machine holds it \(process {other.pid}\)"):
            ours.take()
        elsewhere = SoleHolder("192.0.2.8")
        elsewhere.take()
        elsewhere.release()
        os.kill(other.pid, signal.SIGKILL)
    ours.take()
    ours.take()
    ours.release()
    ours.release()


def test_what_was_given_back_may_be_taken_by_another():
    first, second = SoleHolder("192.0.2.9"), SoleHolder("192.0.2.9")
    first.take()
    with pytest.raises(WireError):
        second.take()
    first.release()
    second.take()
    second.release()


def test_an_arm_has_one_name_however_it_is_called():
    by_number, by_name = SoleHolder("127.0.0.1"), SoleHolder("localhost")
    by_number.take()
    with pytest.raises(WireError, match="localhost: another process"):
        by_name.take()
    by_number.release()


def test_a_name_that_stands_for_nothing_is_held_as_it_is_written():
    first, second = SoleHolder("nothing.invalid"), SoleHolder("nothing.invalid")
    first.take()
    with pytest.raises(WireError):
        second.take()
    first.release()
