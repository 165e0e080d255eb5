"""Lids on the twin: leaves are where the blocks have them, and no palm comes onto one that stands open."""

import math

import mujoco
import numpy as np
import pytest
from msgspec.structs import replace

from config.loader import resolve
from robot.messages import Twist
from robot.safety.blocks import LidState, fixture_blocks, posed
from sim_twin.bench import open_twin
from sim_twin.names import on_table

RESOLVED = resolve(rig="twin")
BOXES = {box.name: box for box in RESOLVED.scenario.boxes}
ATTENDED = replace(RESOLVED, rig=replace(RESOLVED.rig, profile="attended"))
SPEED_M_S = 0.24
LEAST_M = 0.01
BOW_M = 0.002
"""What the twin's servo may swing past by (sim_twin.allowances)."""


@pytest.fixture(scope="module")
def twin():
    station, plant = open_twin(ATTENDED)
    yield station, plant
    station.close()


def settled(twin):
    """A table whose lids stand as their outputs say; the box that is open."""
    station, plant = twin
    percept = station.reset(seed=3, epoch=0)
    bits = plant.world.digital_out
    (name,) = [b.name for b in BOXES.values() if b.lid and bits >> b.lid.output & 1]
    middle = next(thing.position_m for thing in percept.objects if thing.name == name)
    return name, middle, bits


def test_leaves_on_the_twin_are_where_their_blocks_are(twin):
    _, plant = twin
    _, _, bits = settled(twin)
    model, data = plant.world.model, plant.world.data
    for box in BOXES.values():
        state = LidState.OPEN if bits >> box.lid.output & 1 else LidState.SHUT
        at = tuple(data.xpos[model.body(on_table(box.name)).id].tolist())
        leaves = [b for b in fixture_blocks(box, state) if "leaf" in b.name and not b.is_for_fingers]
        for side, block in zip(("near", "far"), leaves, strict=True):
            geom = model.geom(on_table(box.name, f"leaf_{side}")).id
            there = posed(block, at, (1.0, 0.0, 0.0, 0.0))
            assert data.geom_xpos[geom] == pytest.approx(np.array(there.centre_m), abs=1.5e-3)
            turn = np.zeros(9)
            mujoco.mju_quat2Mat(turn, np.array(there.quat))
            assert data.geom_xmat[geom] == pytest.approx(turn, abs=0.02)
            assert model.geom_size[geom] == pytest.approx(np.array(there.half_m), abs=1e-3)


def _nearest_m(plant, name):
    """The least distance of palm and links to the leaves of a box, by the twin's own shapes."""
    model, data = plant.world.model, plant.world.data
    own = [i for i in range(model.ngeom) if model.geom(i).name.startswith(("palm", "capsule"))]
    leaves = [model.geom(on_table(name, f"leaf_{side}")).id for side in ("near", "far")]
    return min(mujoco.mj_geomDistance(model, data, a, b, 0.2, None) for a in own for b in leaves)


def _go(station, goal, n, *, seen=lambda: None):
    names = set()
    for _ in range(n):
        at = station.percept.tcp_position_m
        apart = [b - a for a, b in zip(at, goal, strict=True)]
        away = math.hypot(*apart)
        pace = min(SPEED_M_S, 5.0 * away) / max(away, 1e-9)
        came = station.step(Twist(linear_m_s=tuple(pace * d for d in apart)))
        assert not came.verdicts, came.verdicts
        names |= set(came.executed.limiters)
        seen()
    return names


@pytest.mark.parametrize("height_m", [0.06, 0.1])
def test_a_palm_that_is_driven_at_an_open_lid_stops_before_its_leaf(twin, height_m):
    station, plant = twin
    name, (x, y, _), _ = settled(twin)
    _go(station, (x - 0.2, y, 0.2), 40)
    _go(station, (x - 0.2, y, height_m), 30)
    gaps_m = []
    names = _go(station, (x, y, height_m), 40, seen=lambda: gaps_m.append(_nearest_m(plant, name)))
    assert "clearance" in names
    assert LEAST_M - BOW_M < min(gaps_m) < 0.04


def test_fingers_do_not_push_a_leaf_that_stands(twin):
    station, plant = twin
    name, (x, y, _), _ = settled(twin)
    address = int(plant.world.model.joint(on_table(name, "leaf_near")).qposadr[0])
    open_rad = BOXES[name].lid.open_angle_rad
    _go(station, (x - 0.2, y, 0.2), 40)
    angles = []
    _go(station, (x, y, 0.14), 40, seen=lambda: angles.append(float(plant.world.data.qpos[address])))
    assert min(angles) > open_rad - 0.02


def test_between_the_leaves_of_an_open_lid_the_hand_goes_down_to_the_bottom(twin):
    station, _ = twin
    _, (x, y, _), _ = settled(twin)
    _go(station, (x, y, 0.22), 60)
    _go(station, (x, y, 0.028), 60)
    assert station.percept.tcp_position_m[2] == pytest.approx(0.028, abs=2e-3)
