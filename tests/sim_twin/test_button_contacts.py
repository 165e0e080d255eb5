"""What a finger meets of a button on the twin: its side pushes it back out, however deep it has sunk in."""

import math

import mujoco
import numpy as np
import pytest

from config.loader import resolve
from robot.description import FIXTURE_CONTACT
from sim_twin.scene import build_scene

FINGER_HALF_M = (0.011, 0.006, 0.01875)
LOW_M, HIGH_M = 0.008, 0.036
"""A finger's end beside a button's ring, and beside its cap."""


@pytest.fixture(scope="module")
def probed():
    """The scene with a finger in it that hangs in the air and touches fixtures alone."""
    resolved = resolve(rig="twin")
    spec = build_scene(resolved.arm, resolved.scenario, physics_s=0.002, tick_s=0.01)
    finger = spec.worldbody.add_body(name="probe", pos=[0.4, 0.0, 0.5])
    finger.add_freejoint()
    finger.add_geom(
        name="probe", type=mujoco.mjtGeom.mjGEOM_BOX, size=FINGER_HALF_M, mass=0.1, contype=FIXTURE_CONTACT[1]
    )
    model = spec.compile()
    return model, mujoco.MjData(model), resolved.scenario.buttons[0]


@pytest.mark.parametrize("end_m", [LOW_M, HIGH_M])
@pytest.mark.parametrize("deep_m", [0.001, 0.003, 0.006, 0.009])
@pytest.mark.parametrize("aside_m", [0.0, 0.004, 0.008, -0.012, 0.016])
def test_a_finger_that_has_sunk_into_a_buttons_side_is_pushed_back_the_way_it_came(probed, end_m, deep_m, aside_m):
    model, data, button = probed
    radius_m = button.diameter_m / 2.0 + (0.006 if end_m == LOW_M else 0.0)
    x, y = button.position_m
    nearest_m = max(0.0, abs(aside_m) - FINGER_HALF_M[0])
    edge_m = math.sqrt(radius_m**2 - nearest_m**2)
    address = model.joint(model.body("probe").jntadr[0]).qposadr[0]
    place = [x + aside_m, y - edge_m - FINGER_HALF_M[1] + deep_m, end_m + FINGER_HALF_M[2]]
    data.qpos[address : address + 7] = [*place, 1.0, 0.0, 0.0, 0.0]
    mujoco.mj_forward(model, data)
    probe = model.geom("probe").id
    met = [(c, -1.0 if c.geom[0] == probe else 1.0) for c in data.contact if probe in c.geom]
    sideways = [(-c.dist, sign * np.array(c.frame[:3])) for c, sign in met if abs(c.frame[2]) < 0.5]
    assert sideways, "it is felt"
    depth, out = max(sideways, key=lambda told: told[0])
    assert depth == pytest.approx(deep_m, abs=1.5e-3)
    assert out[1] < -0.9, "out of the button's side"


@pytest.mark.parametrize("part", ["", "/cap"])
def test_what_is_met_of_a_button_is_as_wide_and_as_high_as_what_is_seen(probed, part):
    model, _, button = probed
    geoms = [g for g in range(model.ngeom) if model.body(model.geom_bodyid[g]).name.endswith(button.name + part)]
    met = [g for g in geoms if model.geom_contype[g] | model.geom_conaffinity[g]]
    seen = [g for g in geoms if model.geom_type[g] == mujoco.mjtGeom.mjGEOM_CYLINDER]
    assert len(met) == len(seen) == 1
    radius_m, half_m, _ = model.geom_size[seen[0]]
    assert np.sort(model.geom_aabb[met[0], 3:]) == pytest.approx([half_m, radius_m, radius_m], abs=3e-4)
    assert model.geom_pos[met[0]] == pytest.approx(model.geom_pos[seen[0]], abs=1e-9)


def test_a_cap_weighs_what_it_weighed(probed):
    model, _, _ = probed
    caps = [b for b in range(model.nbody) if model.body(b).name.endswith("/cap")]
    assert [float(model.body(b).mass[0]) for b in caps] == pytest.approx([0.05] * 3)
