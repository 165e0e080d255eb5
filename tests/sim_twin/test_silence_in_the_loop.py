"""A loop that is asked nothing more brings the arm to rest by itself, whoever ticks it; judged by the physics."""

import numpy as np
import pytest

from config.loader import resolve
from robot.messages import GripCommand, Heading, StationMode, Twist
from sim_twin.bench import open_twin

RESOLVED = resolve()
TICK_S = RESOLVED.rig.tick_s
AGE_S = RESOLVED.arm.motion.intent_max_age_s
STOP_S = RESOLVED.profile.stopping.time_s
ASIDE = Heading(heading_rad=np.pi / 2, distance_m=0.03, height_m=0.25)
DOWN = Twist(linear_m_s=(0.3, -0.3, -0.3))


@pytest.fixture
def twin():
    station, plant = open_twin(RESOLVED)
    station.reset(seed=113, epoch=0)
    yield station, plant.world
    station.close()


def silent(station, world):
    """Tick for a second longer than an arm may move. Returns the limiters, and the tool's speed in each tick."""
    tool = RESOLVED.arm.tool
    grip = GripCommand(opening_m=world.opening_goal_m, force_n=tool.grip_force_n, speed_m_s=world.grip_speed_m_s)
    speeds, before_m = [], station.loop.state.tcp_position_m
    for _ in range(round((AGE_S + STOP_S + 1.0) / TICK_S)):
        assert station.loop.tick(grip) is None, "a loop that rests in time is not latched for its silence"
        now_m = station.loop.state.tcp_position_m
        speeds.append(np.linalg.norm(np.subtract(now_m, before_m)) / TICK_S)
        before_m = now_m
    return station.loop.report(None, is_begun=True).limiters, np.array(speeds)


@pytest.mark.parametrize(("intent", "n"), [(ASIDE, 6), (DOWN, 60)], ids=["amid a way", "pressing"])
def test_an_arm_that_is_asked_nothing_more_rests_in_time(twin, intent, n):
    station, world = twin
    for _ in range(n):
        station.step(intent)
    limiters, speeds = silent(station, world)
    assert "no_intent" in limiters
    rest = round((AGE_S + STOP_S) / TICK_S)
    assert speeds[rest:].max() < 0.005
    assert abs(world.data.qvel[:6]).max() < 0.01
    assert station.state.mode is StationMode.ENGAGED


def test_an_intent_of_a_long_time_step_is_carried_out_to_its_end(twin):
    station, _ = twin
    n = round(3 * AGE_S / TICK_S)
    station.step(ASIDE, duration_s=n * TICK_S)
    assert "no_intent" not in station.loop.report(None, is_begun=True).limiters
