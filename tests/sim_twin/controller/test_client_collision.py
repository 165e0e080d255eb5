"""The genuine client servoes the arm into the table, with nothing of ours between: what the controller makes of it."""

import re

import numpy as np
import pytest

from tests.support.genuine_client import make_station, moved, until
from tests.support.loopback import own_address

pytestmark = pytest.mark.realtime

pytest.importorskip("rtde_control", reason="the genuine client comes with `pip install autotelic[lab]`")

OVER_M, DOWN_M, SPEED_M_S, TICK_S = 0.03, 0.07, 0.06, 0.002
FORCE_LIMIT_N, VIOLATION_N = 250.0, 275.0
PAUSED, PROTECTIVE_STOP = 4, 3


def servo(control, q_from, q_to, n_ticks):
    """Stream targets along a straight line in joint space until one is not taken; return how many were."""
    for k in range(n_ticks):
        period = control.initPeriod()
        target = q_from + (q_to - q_from) * (k + 1) / n_ticks
        if not control.servoJ(list(target), 0.0, 0.0, TICK_S, 0.03, 1200.0):
            return k
        control.waitPeriod(period)
    return n_ticks


def test_an_arm_that_is_servoed_into_the_table_is_stopped_by_the_contact_force_and_the_client_sees_it():
    from dashboard_client import DashboardClient

    host = own_address()
    with make_station(host) as station:
        control, receive = station.control, station.receive
        station.over_the_table(OVER_M)
        above = station.pose
        q_above, q_below = (
            np.array(control.getInverseKinematics(list(pose))) for pose in (above, moved(above, 0, 0, -DOWN_M))
        )
        n_ticks = round(DOWN_M / SPEED_M_S / TICK_S)
        assert servo(control, q_above, q_below, n_ticks) < n_ticks
        assert until(receive.isProtectiveStopped)
        q_rest = station.rest()
        assert (receive.getSafetyMode(), receive.getRuntimeState()) == (PROTECTIVE_STOP, PAUSED)
        assert station.pose[2] > 0.0, "far above where it was sent"
        assert not control.servoJ(list(q_below), 0.0, 0.0, TICK_S, 0.03, 1200.0)
        assert not control.moveJ(list(q_above))
        assert np.abs(station.rest() - q_rest).max() < 1e-3
        dashboard = DashboardClient(host)
        dashboard.connect()
        assert "PROTECTIVE_STOP" in dashboard.safetystatus()
        dashboard.disconnect()
        told = [line for line in station.process.fault("log")["lines"] if re.match(r"C\d", line)]
        assert len(told) == 1, told
        felt = re.fullmatch(r"C158A0: collision detected at the tool: (\d+) N", told[0])
        assert felt is not None, told
        assert FORCE_LIMIT_N <= float(felt[1]) <= VIOLATION_N


@pytest.mark.slow
def test_a_safety_plane_stops_an_arm_that_the_client_drives_through_it():
    with make_station(own_address(), planes=((0.0, 0.0, 1.0, 0.1),)) as station:
        control, receive = station.control, station.receive
        above = station.pose
        below = [*above[:2], 0.02, *above[3:]]
        assert above[2] > 0.15
        assert not control.moveL(below, 0.25, 1.2)
        assert until(receive.isProtectiveStopped)
        station.rest()
        assert 0.06 < station.pose[2] < 0.101
        told = [line for line in station.process.fault("log")["lines"] if re.match(r"C\d", line)]
        assert told == ["C152A0: target moves too fast towards a safety plane to stop before it"]
