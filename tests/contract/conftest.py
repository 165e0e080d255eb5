"""What the contract suites share: rigs, which of them keep to a wall's clock, and a repeat on a stalled machine."""

from pathlib import Path

import pytest
from _pytest.runner import runtestprotocol

from tests.support.contract_rigs import WORLDS, open_world
from tests.support.overbooked import waited_s

OPENED = pytest.StashKey[object]()
"""The world that was opened last; None where the last did not open."""


@pytest.fixture(scope="module", params=WORLDS)
def world(request):
    stash = request.config.stash
    stash[OPENED] = None
    stash[OPENED] = opened = open_world(request.param)
    yield opened
    opened.close()


@pytest.fixture
def resolved(world):
    return world.resolved


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Mark what runs on a wire as keeping to a wall's clock, and there as slow what is marked `slow_on_a_wire`."""
    for item in items:
        name = getattr(getattr(item, "callspec", None), "params", {}).get("world")
        if Path(item.path).parent != Path(__file__).parent or name is None or WORLDS[name].is_lock_step:
            continue
        item.add_marker(pytest.mark.realtime)
        if item.get_closest_marker("slow_on_a_wire"):
            item.add_marker(pytest.mark.slow)


STALL_S, N_ATTEMPTS, TWICE = 0.03, 3, 2
REPEATED = pytest.StashKey[list[str]]()


def pytest_runtest_protocol(item, nextitem):
    """Repeat what failed in wall time while the machine had too few processors; elsewhere a failure is one.

    An arm counts as lost after 40 ms without a state, and a program as silent after 100 ms without a command: where the
    machine's load alone makes such gaps, a failure says nothing of the plant. How long it was is the kernel's count.
    What failed must then pass twice running: a failure of the plant's own, now and then, is not to slip through.
    """
    name = getattr(getattr(item, "callspec", None), "params", {}).get("world")
    if name is None or WORLDS[name].is_lock_step:
        return None
    item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
    n_failed = n_passed = 0
    while n_passed < (1 if n_failed == 0 else TWICE):
        before_s = waited_s()
        reports = runtestprotocol(item, nextitem=nextitem, log=False)
        stalled_s = waited_s() - before_s
        opened = item.config.stash.get(OPENED, None)
        if any(report.failed for report in reports):
            n_failed, n_passed = n_failed + 1, 0
            if opened is not None:
                opened.renew()  # repeated or not: a link that was lost here must not fail the next test too
            if opened is None or stalled_s < STALL_S or n_failed == N_ATTEMPTS:
                break
            item.config.stash.setdefault(REPEATED, []).append(
                f"{item.nodeid} (the machine was overbooked for {stalled_s:.3f} s)"
            )
        else:
            n_passed += 1
        item._initrequest()
    attempt = n_failed + n_passed
    for report in reports:
        if attempt > 1:
            report.sections.append(("stalls", f"attempt {attempt}; the machine was overbooked for {stalled_s:.3f} s"))
        item.ihook.pytest_runtest_logreport(report=report)
    item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
    return True


def pytest_terminal_summary(terminalreporter, config):
    for told in config.stash.get(REPEATED, []):
        terminalreporter.write_line(f"repeated on a stalled machine: {told}")
