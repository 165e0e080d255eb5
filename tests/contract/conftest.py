"""What the contract suites share: rigs, which cases are worth their wall time, a repeat on a stalled machine."""

import multiprocessing
import os
from pathlib import Path

import pytest
from _pytest.runner import runtestprotocol

from tests.support.contract_rigs import WORLDS, open_world

OPENED = pytest.StashKey[object]()


@pytest.fixture(scope="module", params=WORLDS)
def world(request):
    opened = request.config.stash[OPENED] = open_world(request.param)
    yield opened
    opened.close()


@pytest.fixture
def resolved(world):
    return world.resolved


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Mark slow what `wall_sample` leaves out, on the rigs whose time is the wall's."""
    n_by_test = {}
    for item in items:
        marker = item.get_closest_marker("wall_sample")
        if marker is None or WORLDS[item.callspec.params["world"]].is_lock_step:
            continue
        test = item.originalname, item.path
        n_by_test[test] = n_by_test.get(test, 0) + 1
        if n_by_test[test] > marker.args[0]:
            item.add_marker(pytest.mark.slow)


STALL_S, N_ATTEMPTS = 0.03, 3
REPEATED = pytest.StashKey[list[str]]()


def pytest_runtest_protocol(item, nextitem):
    """Repeat what failed in wall time while its processes had to wait for a processor; elsewhere a failure is one.

    An arm counts as lost after 50 ms without a state, and a program as silent after 100 ms without a command: where the
    machine's load alone makes such gaps, a failure says nothing of the plant. How long the processes waited is the
    kernel's own count.
    """
    name = getattr(getattr(item, "callspec", None), "params", {}).get("world")
    if name is None or WORLDS[name].is_lock_step:
        return None
    item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
    for attempt in range(1, N_ATTEMPTS + 1):
        before_s = _waited_s()
        reports = runtestprotocol(item, nextitem=nextitem, log=False)
        waited_s = _waited_s() - before_s
        if attempt == N_ATTEMPTS or waited_s < STALL_S or not any(report.failed for report in reports):
            break
        item.config.stash.setdefault(REPEATED, []).append(f"{item.nodeid} (its processes waited {waited_s:.3f} s)")
        item.config.stash[OPENED].renew()
        item._initrequest()
    for report in reports:
        if attempt > 1:
            report.sections.append(("stalls", f"attempt {attempt}; its processes waited {waited_s:.3f} s to run"))
        item.ihook.pytest_runtest_logreport(report=report)
    item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
    return True


def pytest_terminal_summary(terminalreporter, config):
    for told in config.stash.get(REPEATED, []):
        terminalreporter.write_line(f"repeated on a stalled machine: {told}")


def _waited_s():
    """Return how long this process and those it started have been ready to run and did not, by the kernel's count."""
    waited_ns = 0
    for pid in (os.getpid(), *(child.pid for child in multiprocessing.active_children())):
        for task in Path(f"/proc/{pid}/task").glob("*/schedstat"):
            try:
                waited_ns += int(task.read_text().split()[1])
            except OSError:
                continue  # it has just ended
    return waited_ns * 1e-9
