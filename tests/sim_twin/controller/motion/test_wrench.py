"""What a wrongly told payload adds to the force that is read, against the vector formula."""

import numpy as np
import pytest

from sim_twin.controller.motion.poses import matrix_from_pose
from sim_twin.controller.motion.wrench import GRAVITY_M_S2, is_same_payload, payload_bias


@pytest.mark.parametrize("seed", range(5))
def test_the_bias_is_the_difference_of_two_weights_and_their_moments(seed):
    rng = np.random.default_rng(seed)
    T_bf = matrix_from_pose(rng.uniform(-1.0, 1.0, 6))
    point_m, cogs_m, masses_kg = rng.uniform(-1.0, 1.0, 3), rng.uniform(-0.1, 0.1, (2, 3)), rng.uniform(0.1, 5.0, 2)
    weights_n = np.outer(masses_kg, [0.0, 0.0, -GRAVITY_M_S2])
    arms_m = cogs_m @ T_bf[:3, :3].T + T_bf[:3, 3] - point_m
    wrenches = np.hstack([weights_n, np.cross(arms_m, weights_n)])
    real, known = zip(masses_kg.tolist(), cogs_m, strict=True)
    assert payload_bias(T_bf, point_m, real, known) == pytest.approx(wrenches[0] - wrenches[1], abs=1e-12)


def test_a_payload_that_is_told_rightly_adds_nothing():
    told = (0.925, np.array([0.0, 0.0, 0.058]))
    bias = payload_bias(matrix_from_pose([0.4, 0.1, 0.3, 3.1, 0.0, 0.2]), np.zeros(3), told, told)
    assert bias == pytest.approx(np.zeros(6), abs=1e-12)
    assert is_same_payload(told, (0.925, np.array([0.0, 0.0, 0.058])))
    assert not is_same_payload(told, (0.925, np.array([0.0, 1e-9, 0.058])))
    assert not is_same_payload(told, (0.926, told[1]))
