"""A perturbed plant is another plant under the same name."""

import msgspec
import numpy as np
import pytest

from config.loader import resolve
from sim_twin.perturb import NOMINAL, PERTURBATIONS, perturbed_plant

replace = msgspec.structs.replace
N_TICKS = 150


@pytest.fixture(scope="module")
def resolved():
    return resolve(rig="twin")


@pytest.mark.parametrize("by", PERTURBATIONS[1:], ids=lambda p: p.name)
def test_a_perturbed_plant_differs_in_what_it_says_and_nobody_is_told(resolved, by):
    nominal, other = perturbed_plant(resolved, NOMINAL), perturbed_plant(resolved, by)
    assert other.arm.spec == nominal.arm.spec
    assert other.identity == nominal.identity
    ends = []
    for plant in (nominal, other):
        plant.arm.connect()
        world = plant.world
        world.data.qpos[:6] = world.data.ctrl[world.joint_controls] = world.arm.home_rad
        world.data.qvel[:6] = 0.0
        for k in range(60):
            world.data.ctrl[world.joint_controls[0]] += 0.005 * (k < 30)
            if k == 25 and by.braking_factor != 1.0:
                plant.arm.stop()
            world.advance()
            if k == 27 and by.lag_factor != 1.0:
                break
        ends.append(np.array(plant.arm.read().tcp_position_m))
    apart = float(np.linalg.norm(ends[1] - ends[0]))
    assert 2e-4 < apart < 0.05


def test_a_payload_that_is_not_compensated_makes_the_tool_droop_and_one_that_is_absent_makes_it_rise(resolved):
    heights = {}
    for by in PERTURBATIONS:
        if by.payload_kg or by is NOMINAL:
            plant = perturbed_plant(resolved, by)
            plant.arm.connect()
            for _ in range(60):
                plant.world.advance()
            heights[by.payload_kg] = plant.arm.read().tcp_position_m[2]
    assert heights[1.0] < heights[0.0] - 2e-4 < heights[0.0] + 2e-4 < heights[-1.0]
    assert heights[-1.0] - heights[1.0] < 0.01
