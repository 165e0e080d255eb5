"""A perturbed plant is another plant under the same name."""

import math

import msgspec
import mujoco
import numpy as np
import pytest

from config.errors import ConfigError
from config.loader import load_rig, resolve
from config.perturbation import Perturbation
from config.yaml_text import dump_yaml
from robot.chain import ToolChain
from robot.rigs import build_station
from sim_twin.camera_plant import view_of
from sim_twin.names import on_table
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


def model_of(resolved, **by):
    return perturbed_plant(resolved, Perturbation(name="other", **by)).world.model


def test_masses_are_heavier_and_what_holds_the_arm_up_still_counts_on_those_of_the_files(resolved):
    nominal, heavy = model_of(resolved), model_of(resolved, mass_factor=1.2)
    assert np.allclose(heavy.body_mass, 1.2 * nominal.body_mass)
    assert np.allclose(heavy.body_inertia, 1.2 * nominal.body_inertia)
    held = nominal.body_mass * nominal.body_gravcomp
    assert held.sum() > 10.0
    assert np.allclose(heavy.body_mass * heavy.body_gravcomp, held)


def test_an_arm_that_is_heavier_than_its_compensation_droops(resolved):
    heights = []
    for factor in (0.8, 1.0, 1.2):
        plant = perturbed_plant(resolved, Perturbation(name="other", mass_factor=factor))
        plant.arm.connect()
        for _ in range(60):
            plant.world.advance()
        heights.append(plant.arm.read().tcp_position_m[2])
    assert heights[0] > heights[1] + 2e-4
    assert heights[1] > heights[2] + 2e-4


def test_a_slippery_cylinder_slides_farther_by_the_friction_that_it_has(resolved):
    slid = []
    for factor in (0.4, 0.5, 0.6):  # with more it tips over
        model = model_of(resolved, friction_factor=factor)
        data = mujoco.MjData(model)
        joint = model.joint(on_table("red_cylinder"))
        at, speed = int(joint.qposadr[0]), int(joint.dofadr[0])
        data.qpos[at : at + 3] = (0.2, 0.45, resolved.scenario.cylinders[0].height_m / 2)  # on the free table
        data.qvel[speed] = 0.5
        mujoco.mj_step(model, data, 300)
        slid.append(float(data.qpos[at] - 0.2))
        assert abs(data.qvel[speed]) < 0.02
    # v^2 / (2 mu g): as friction falls by a third, the way grows by a half
    assert slid[0] / slid[2] == pytest.approx(1.5, rel=0.15)
    assert slid[2] < slid[1] < slid[0]


def test_everything_is_perceived_where_it_is_not_and_stands_where_it_stood(resolved):
    by = Perturbation(name="other", percept_m=(0.01, -0.004, 0.0))
    nominal, other = perturbed_plant(resolved, NOMINAL), perturbed_plant(resolved, by)
    for there, told in zip(nominal.truth.read().objects, other.truth.read().objects, strict=True):
        assert np.subtract(told.position_m, there.position_m) == pytest.approx((0.01, -0.004, 0.0), abs=1e-12)
    assert np.array_equal(nominal.world.data.xpos, other.world.data.xpos)


def test_a_percept_is_made_of_what_is_told(resolved):
    rig = replace(resolved.rig, perturbation=Perturbation(name="other", percept_m=(0.01, 0.0, 0.0)))
    seen = []
    for each in (resolved, replace(resolved, rig=rig)):
        station = build_station(each)
        station.connect()
        station.arm(by="test")
        station.engage()
        seen.append(station.reset(seed=5, epoch=0))
        station.close()
    before, after = seen
    assert [thing.name for thing in after.objects] == [thing.name for thing in before.objects]
    for then, now in zip(before.objects, after.objects, strict=True):
        assert np.subtract(now.position_m, then.position_m) == pytest.approx((0.01, 0.0, 0.0), abs=1e-6)


def test_a_controller_that_believes_its_file_tells_the_tool_where_a_longer_arm_has_it_not(resolved):
    plants = [
        perturbed_plant(resolved, Perturbation(name="other", kinematics_m=0.002, tells_belief=is_so))
        for is_so in (False, True)
    ]
    told = []
    for plant in plants:
        plant.arm.connect()
        told.append(plant.arm.read().tcp_position_m)
    assert told[1] == ToolChain(resolved.arm).tcp(plants[1].arm.read().q_rad)
    assert 1e-3 < math.dist(told[0], told[1]) < 8e-3


def test_what_differs_is_in_the_digest_of_the_plant(resolved):
    digests = {
        perturbed_plant(resolved, Perturbation(name="other", **by)).model_sha256
        for by in ({}, {"mass_factor": 1.2}, {"friction_factor": 0.8}, {"lag_factor": 1.2})
    }
    assert len(digests) == 4
    assert perturbed_plant(resolved, NOMINAL).model_sha256 in digests


@pytest.mark.parametrize("rig", ["fake", "lab", "virtual_lab"])
def test_a_plant_that_is_no_twin_is_refused_a_perturbation(rig, tmp_path):
    file = tmp_path / "other.yaml"
    file.write_text(dump_yaml(msgspec.to_builtins(replace(load_rig(rig), perturbation=NOMINAL))))
    with pytest.raises(ConfigError, match="perturbation: expected none but for a twin"):
        load_rig(file)


def test_a_camera_that_was_moved_sees_everything_moved_the_other_way(resolved):
    rig = replace(load_rig("twin_camera"), perturbation=Perturbation(name="other", percept_m=(0.01, -0.02, 0.0)))
    moved, still = view_of(rig), view_of(load_rig("twin_camera"))
    assert np.allclose(moved.T_bc[:3, :3], still.T_bc[:3, :3])
    assert np.allclose(moved.T_bc[:3, 3] - still.T_bc[:3, 3], (-0.01, 0.02, 0.0))
    thing, off = np.array([[0.45, 0.1, 0.03]]), np.array([0.01, -0.02, 0.0])
    assert np.allclose(moved.seen_at(thing), still.seen_at(thing + off))
