"""The hand on the twin: what a reflex closes on in passing is held, by friction alone."""

import math

import pytest

from config.loader import resolve
from robot.operated import OperatedStation
from robot.rigs import build_operator, build_station
from sim_twin.pilot import Pilot


@pytest.fixture(scope="module")
def station():
    resolved = resolve(scenario="paper")
    station = OperatedStation(build_station(resolved), build_operator(resolved.rig))
    station.connect()
    yield station
    station.close()


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize(
    ("off_m", "period", "phase", "step_m"),
    [(0.010, 2, 1, 0.008), (0.010, 4, 0, 0.006), (0.010, 4, 1, 0.006), (0.010, 4, 2, 0.011), (0.011, 6, 0, 0.011)],
)
def test_an_object_that_slides_in_and_out_between_the_jaws_is_held_or_left_where_it_lies(
    station, side, off_m, period, phase, step_m
):
    """Over an open box the tool sinks beside the cylinder, off the pads' middle, and slides in and out of reach."""
    pilot = Pilot(station)
    pilot.reset(seed=5, epoch=1000)
    x, y, z = pilot.where("red_cylinder")
    assert pilot.go(x + side * off_m, y)
    assert pilot.down(lambda result: result.percept.tcp_position_m[2] < z)
    pilot.rest()
    inwards, outwards = (math.pi, 0.0) if side > 0.0 else (0.0, math.pi)
    for i in range(phase, 60):
        result = pilot.step(
            heading_rad=inwards if i % period < period / 2 else outwards, distance_m=step_m, height_m=pilot.low_m
        )
        if "hand" in result.executed.limiters:
            break
    while "hand" in result.executed.limiters:
        result = pilot.step(height_m=pilot.low_m)
    pilot.rest()
    moved_m = math.dist(pilot.where("red_cylinder"), (x, y, z))
    assert pilot.percept.grip.has_object or moved_m < 1e-3


def test_the_arm_waits_where_an_object_came_between_the_jaws_though_the_tool_was_on_its_way(station):
    pilot = Pilot(station)
    pilot.reset(seed=5, epoch=1000)
    x, y, z = pilot.where("red_cylinder")
    assert pilot.go(x + 0.02, y)
    assert pilot.down(lambda result: result.percept.tcp_position_m[2] < z)
    for _ in range(20):
        result = pilot.step(heading_rad=math.pi, distance_m=0.022, height_m=pilot.low_m)
        if "hand" in result.executed.limiters:
            break
    while "hand" in result.executed.limiters:
        result = pilot.step(height_m=pilot.low_m)
    assert result.percept.grip.has_object
    assert abs(result.percept.tcp_position_m[0] - pilot.where("red_cylinder")[0]) < 0.009
