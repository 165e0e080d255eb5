"""A station that falls silent, over the wire: the physics' arm is at rest soon after its last intent, and stays so."""

import math
import time

import msgspec
import numpy as np
import pytest

from robot.chain import ToolChain
from robot.errors import NotEngagedError
from robot.messages import Heading, StationMode
from robot.operated import OperatedStation
from robot.rigs import build_operator, build_station
from sim_twin.controller.process import ControllerProcess
from sim_twin.controller.server import Setup
from sim_twin.controller.trace import read_trace
from sim_twin.paired.ride import wired_rig
from tests.support.loopback import own_address

pytestmark = pytest.mark.realtime

AHEAD = Heading(heading_rad=math.pi / 2, distance_m=0.022, height_m=0.225)
SLOW_M_S = 0.05
SILENT_S, REST_S, STILL_RAD_S = 1.0, 0.4, 0.005
"""Rest by the 100 ms that an intent lives, the stop, the arm's lag, and 200 ms in which this machine may be busy."""


@pytest.fixture
def wire(tmp_path):
    """A slow station over the wire, whose target is far ahead of its tool, and the trace of its arm."""
    wired = wired_rig(own_address())
    arm = msgspec.structs.replace(wired.arm, motion=msgspec.structs.replace(wired.arm.motion, speed_m_s=SLOW_M_S))
    wired, trace = msgspec.structs.replace(wired, arm=arm), tmp_path / "trace"
    rig = wired.rig
    with ControllerProcess(Setup(host=rig.address, cell=rig.cell, bus=rig.bus, trace=str(trace))):
        station = OperatedStation(build_station(wired), build_operator(rig))
        try:
            station.connect()
            station.reset(seed=1, epoch=0)
            yield station, trace, arm
        finally:
            station.close()


@pytest.mark.slow
def test_a_station_that_falls_silent_leaves_its_arm_at_rest_far_short_of_the_target(wire):
    station, trace, arm = wire
    for _ in range(10):
        result = station.step(AHEAD)
        assert not result.is_void, result.verdicts
    since_s = time.monotonic()
    while time.monotonic() < since_s + SILENT_S:
        time.sleep(0.02)
    rows = read_trace(trace, since_s=since_s)
    chain = ToolChain(arm)
    tool_m = np.array([chain.tcp(tuple(q)) for q in rows[:, 3:9].tolist()])
    resting = rows[:, 0] > since_s + REST_S
    assert resting.sum() > 100
    assert np.abs(rows[resting, 9:15]).max() < STILL_RAD_S
    assert np.linalg.norm(tool_m[resting] - tool_m[-1], axis=1).max() < 1e-4
    assert math.dist(tool_m[0], tool_m[-1]) < SLOW_M_S * REST_S
    assert math.dist(result.executed.target_m, tool_m[-1]) > 0.05
    late = station.step(AHEAD)
    assert late.verdicts[0].reason == "stale_intent"
    assert station.state.mode is StationMode.LATCHED
    with pytest.raises(NotEngagedError):
        station.step(AHEAD)
