"""The tick thread's seat, in a process of its own: who runs where, and that nothing of it stays behind."""

import subprocess
import sys
from pathlib import Path

import pytest

SEATED = """
import os, threading
from robot.realtime import Seat
from threading import get_native_id
before = os.sched_getaffinity(0)
seat = Seat({priority})
print(seat.why_not)
def threads():
    return {{int(t): os.sched_getaffinity(int(t)) for t in os.listdir("/proc/self/task")}}
other = threading.Event()
thread = threading.Thread(target=other.wait)
thread.start()
seat.take()
found = threads()
is_seated = found.pop(get_native_id()) == seat.processors
print(len(seat.processors), is_seated, all(not places & seat.processors for places in found.values()), len(found) > 0)
seat.leave()
late = threading.Thread(target=other.wait)
late.start()
print(threads()[late.native_id] == before, os.sched_getscheduler(0) == os.SCHED_FIFO)
seat.give_up()
print(os.sched_getaffinity(0) == before, os.sched_getscheduler(0) == os.SCHED_OTHER)
other.set()
"""


def seated(priority, *, limit=""):
    done = subprocess.run(
        [sys.executable, "-c", limit + SEATED.format(priority=priority)],
        cwd=Path(__file__).parents[2], capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def test_the_tick_thread_has_a_processor_to_itself_until_it_leaves():
    why_not, seat, late, after = seated(5)
    if why_not != "None":
        pytest.skip(f"no real-time priority here: {why_not}")
    assert seat == "1 True True True"
    assert late == "True True"
    assert after == "True True"


@pytest.mark.parametrize(
    ("priority", "limit", "said"),
    [
        (0, "", "None"),
        (5, "import os; os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})\n", "one processor only"),
        (
            5,
            "import os\ndef refuse(*_): raise PermissionError(1, 'not permitted')\nos.sched_setscheduler = refuse\n",
            "not permitted",
        ),
    ],
)
def test_without_it_everything_runs_where_it_did_and_why_is_said(priority, limit, said):
    why_not, seat, _, after = seated(priority, limit=limit)
    assert said in why_not
    assert seat == "0 False True True"
    assert after == "True True"
