"""The tick thread pinned to a CPU, in a process of its own: who runs where, and that nothing of it stays behind."""

import subprocess
import sys
from pathlib import Path

import pytest

PINNED = """
import os, threading
from robot.realtime import CpuPin
from threading import get_native_id
before = os.sched_getaffinity(0)
pin = CpuPin({priority})
print(pin.why_not)
def threads():
    return {{int(t): os.sched_getaffinity(int(t)) for t in os.listdir("/proc/self/task")}}
other = threading.Event()
thread = threading.Thread(target=other.wait)
thread.start()
pin.pin()
found = threads()
is_pinned = found.pop(get_native_id()) == pin.cpus
print(len(pin.cpus), is_pinned, all(not places & pin.cpus for places in found.values()), len(found) > 0)
pin.unpin()
late = threading.Thread(target=other.wait)
late.start()
print(threads()[late.native_id] == before, os.sched_getscheduler(0) == os.SCHED_FIFO)
pin.release()
print(os.sched_getaffinity(0) == before, os.sched_getscheduler(0) == os.SCHED_OTHER)
other.set()
"""


def pinned(priority, *, limit=""):
    done = subprocess.run(
        [sys.executable, "-c", limit + PINNED.format(priority=priority)],
        cwd=Path(__file__).parents[2], capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def test_the_tick_thread_has_a_processor_to_itself_until_it_leaves():
    why_not, cpu, late, after = pinned(5)
    if why_not != "None":
        pytest.skip(f"no real-time priority here: {why_not}")
    assert cpu == "1 True True True"
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
    why_not, cpu, _, after = pinned(priority, limit=limit)
    assert said in why_not
    assert cpu == "0 False True True"
    assert after == "True True"
