"""A hand that presses on a shut lid, anywhere and for long, does not go through it and comes up again."""

import math
from collections.abc import Iterator

import numpy as np
import pytest

from config.loader import resolve
from robot.local_station import LocalStation
from robot.messages import Heading, StepResult
from sim_twin.bench import open_twin

RESOLVED = resolve()
BOX = RESOLVED.scenario.boxes[0]
LEAF_TOP_M = RESOLVED.scenario.table.height_m + BOX.height_m + BOX.lid.thickness_m
PRESSING_STEPS, RISING_STEPS = 70, 20
PUSH_M = 0.005


@pytest.fixture(scope="module")
def station() -> Iterator[LocalStation]:
    made, _ = open_twin(RESOLVED)
    yield made
    made.close()


def go(station: LocalStation, towards: np.ndarray, at: StepResult | None, height_m: float) -> StepResult:
    """Move the target straight towards a place in the plane, at a height over the table."""
    dx, dy = (0.0, 0.0) if at is None else towards - np.array(at.executed.target_m[:2])
    distance_m = min(math.hypot(dx, dy), station.spec.max_step_m)
    return station.step(Heading(heading_rad=math.atan2(dy, dx), distance_m=distance_m, height_m=height_m))


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("place", [(0.0, 0.0), (0.08, -0.07), (0.08, 0.0), (-0.07, 0.07), (0.02, -0.07)])
def test_pressing_on_a_shut_lid_stays_above_it_and_ends_when_the_hand_rises(station, place, seed):
    low_m, travel_m = station.spec.heights_m
    percept = station.reset(seed=seed, epoch=0)
    middle = next(thing.position_m for thing in percept.objects if thing.name == BOX.name)
    spot, result = np.add(middle[:2], place), None
    for _ in range(40):
        result = go(station, spot, result, travel_m)
    rng, tips_m, has_touched = np.random.default_rng(seed), [], False
    for _ in range(PRESSING_STEPS):
        result = go(station, spot + rng.uniform(-PUSH_M, PUSH_M, 2), result, low_m)
        has_touched |= result.percept.is_in_contact
        tips_m.append(result.percept.tcp_position_m[2] - RESOLVED.arm.tool.tip_below_tcp_m)
    assert has_touched
    assert min(tips_m) > LEAF_TOP_M
    for _ in range(RISING_STEPS):
        result = go(station, np.array(result.executed.target_m[:2]), result, travel_m)
    assert not result.is_void
    assert not result.percept.is_in_contact
    assert result.percept.tcp_position_m[2] == pytest.approx(travel_m, abs=0.005)
