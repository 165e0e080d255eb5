"""Malformed messages by the thousand on one port, while the genuine client servoes beside: nobody else is disturbed."""

import math
import time
from pathlib import Path

import numpy as np
import pytest

from tests.support.genuine_client import HOME, make_station
from tests.support.port_fuzz import PORTS, FuzzBeside

HOST = "127.0.0.34"
PERIOD_S, SWING_RAD = 0.004, 0.02
GROWTH_MB = 40.0
N_BRIEF, N_FULL = 2_000, 100_000


@pytest.fixture(scope="module")
def station():
    with make_station(HOST) as made:
        yield made


class Servoing:
    """A client that swings one joint, and what it saw meanwhile: controller times, joints off their targets."""

    def __init__(self, station):
        self.control, self.receive = station.control, station.receive
        self.phase, self.seen_s, self.off_rad, self.taken = 0.0, [], [], []

    def run(self, is_over, at_least_s=1.0):
        begun = time.monotonic()
        while not is_over() or time.monotonic() - begun < at_least_s:
            self.phase += PERIOD_S
            q = HOME.copy()
            q[0] += SWING_RAD * math.sin(math.pi * self.phase)
            self.taken.append(self.control.servoJ(list(q), 0, 0, PERIOD_S, 0.1, 300))
            self.seen_s.append(self.receive.getTimestamp())
            self.off_rad.append(float(np.abs(np.array(self.receive.getActualQ()) - q).max()))
            time.sleep(PERIOD_S)
        wall_s = time.monotonic() - begun
        return (self.seen_s[-1] - self.seen_s[0]) / wall_s


def resident_mb(pid):
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * 4096 / 1e6


def check(station, kind, n):
    station.recover()
    before_mb = resident_mb(station.process.pid)
    alone = Servoing(station)
    pace_alone = alone.run(lambda: True)
    beside = Servoing(station)
    beside.phase = alone.phase
    with FuzzBeside(HOST, kind, n) as fuzzing:
        pace = beside.run(fuzzing.done)
    assert fuzzing.n_sent == n
    assert all(beside.taken)
    assert station.control.isProgramRunning()
    assert np.all(np.diff(beside.seen_s) >= 0.0)
    assert max(beside.off_rad) < 2 * SWING_RAD
    assert pace > 0.5 * pace_alone
    station.control.servoStop()
    assert resident_mb(station.process.pid) - before_mb < GROWTH_MB
    answers(station)


def answers(station):
    """New clients of every port are served."""
    from dashboard_client import DashboardClient

    from robot.hal.ur_primary import read_facts

    dashboard = DashboardClient(HOST)
    dashboard.connect()
    assert dashboard.running()
    dashboard.disconnect()
    assert np.abs(np.array(read_facts(HOST).q_rad) - HOME).max() < 2 * SWING_RAD
    assert station.process.is_alive


@pytest.mark.parametrize("kind", PORTS)
def test_a_port_bears_malformed_messages(station, kind):
    check(station, kind, N_BRIEF)


@pytest.mark.slow
@pytest.mark.parametrize("kind", PORTS)
def test_a_port_bears_a_hundred_thousand_malformed_messages(station, kind):
    check(station, kind, N_FULL)
