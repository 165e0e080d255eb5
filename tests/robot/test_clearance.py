"""Distances are MuJoCo's own, the slopes are those of the distances, and what cannot touch is not looked at."""

import mujoco
import numpy as np
import pytest
from msgspec.structs import replace

from config.loader import resolve
from robot.chain import ToolChain
from robot.safety.clearance import Clearance
from robot.safety.collision_model import Hard, Near, collision_model
from robot.safety.obstacles import blocks_of
from robot.safety.sweep import Sweep

RESOLVED = resolve()
ARM, SCENARIO = RESOLVED.arm, RESOLVED.scenario
HARD = Hard(own_m=0.01, table_m=0.005, thing_m=0.005)
REACH_M = 0.08


@pytest.fixture(scope="module")
def clearance():
    return Clearance(ARM, SCENARIO, hard=HARD, reach_m=REACH_M)


@pytest.fixture(scope="module")
def shapes():
    model, pairs = collision_model(
        ARM, table_m=SCENARIO.table.height_m, blocks=blocks_of(SCENARIO), hard=HARD, reach_m=REACH_M
    )
    return model, mujoco.MjData(model), pairs


def _postures(n, seed=0):
    rng = np.random.default_rng(seed)
    near_home = np.asarray(ARM.home_rad) + 0.3 * rng.normal(size=(n // 2, 6))
    return [tuple(q) for q in np.concatenate([near_home, rng.uniform(-np.pi, np.pi, (n - n // 2, 6))]).tolist()]


def _reference(shapes, q):
    """The least gap by mj_geomDistance, every pair by itself, in a model of its own."""
    model, data, pairs = shapes
    data.qpos[:] = q
    mujoco.mj_kinematics(model, data)
    least = REACH_M - max(HARD.own_m, HARD.table_m, HARD.thing_m)
    for pair in pairs:
        a, b = model.geom(pair.part).id, model.geom(pair.other).id
        least = min(least, mujoco.mj_geomDistance(model, data, a, b, REACH_M, None) - HARD.of(pair.near))
    return least


def test_the_least_gap_is_that_of_all_pairs_by_themselves(clearance, shapes):
    worst = max(abs(clearance.gap(q) - _reference(shapes, q)) for q in _postures(600))
    assert worst < 1e-4


def test_what_each_pair_keeps_is_what_its_contacts_say_whichever_shape_is_first(clearance):
    n_met = 0
    for q in _postures(60):
        clearance.gap(q)
        contact = clearance._data.contact
        for keep, (a, b) in zip(contact.includemargin.tolist(), contact.geom.tolist(), strict=True):
            assert clearance._kept_of[a, b] == clearance._kept_of[b, a] == keep
            n_met += 1
    assert n_met > 60


def test_joints_asked_about_are_the_models_own(clearance):
    """They are written past the library's own door."""
    for q in _postures(3):
        clearance.gap(q)
        assert clearance._data.qpos.tolist() == list(q)


def test_a_capsule_s_distance_is_that_of_its_points_along_the_axis(clearance, shapes):
    """Independent of MuJoCo's distances: both axes of two capsules are sampled."""
    model, data, pairs = shapes
    capsules = [p for p in pairs if p.near is Near.OWN and p.part.startswith("link") and p.other.startswith("link")]
    along = np.linspace(-1.0, 1.0, 201)
    for q in _postures(12, seed=3):
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        for pair in capsules:
            ids = [model.geom(name).id for name in (pair.part, pair.other)]
            points = [
                data.geom_xpos[g] + np.outer(along * model.geom_size[g, 1], data.geom_xmat[g].reshape(3, 3)[:, 2])
                for g in ids
            ]
            apart = np.linalg.norm(points[0][:, None] - points[1][None], axis=2).min()
            sampled = apart - sum(model.geom_size[g, 0] for g in ids)
            told = mujoco.mj_geomDistance(model, data, *ids, 2.0, None)
            assert told <= sampled + 1e-9
            assert told == pytest.approx(sampled, abs=1e-3)


def test_the_slope_of_a_gap_is_its_difference(clearance):
    h, errors = 1e-6, []
    for q in _postures(60, seed=1):
        for one in clearance.closest(q, within_m=0.05):
            for i in range(6):
                moved = tuple(x + h * (k == i) for k, x in enumerate(q))
                other = [c.gap_m for c in clearance.closest(moved, within_m=0.07) if c.pair == one.pair]
                if one.gap_m > 1e-3 and other:
                    errors.append(abs((other[0] - one.gap_m) / h - one.slope_m_rad[i]))
    assert len(errors) > 300
    assert np.quantile(errors, 0.99) < 1e-3  # the rest stand where the nearest point changes its edge


def test_the_tool_jacobian_is_the_difference_of_the_tool_s_place(clearance):
    from robot.chain import ToolChain

    chain, h, q = ToolChain(ARM), 1e-6, ARM.home_rad
    J = clearance.tool_jacobian(q)
    for i in range(6):
        moved = tuple(x + h * (k == i) for k, x in enumerate(q))
        change = (np.subtract(chain.tcp(moved), chain.tcp(q))) / h
        assert J[:3, i] == pytest.approx(change, abs=1e-4)


def test_fingers_are_held_off_the_arm_and_off_leaves_that_stand_and_nothing_else(clearance):
    of_fingers = [p for p in clearance.pairs if "fingers" in (p.part, p.other)]
    leaves = {p.other for p in of_fingers if p.near is not Near.OWN}
    sides = [(box.name, side) for box in SCENARIO.boxes if box.lid for side in ("near", "far")]
    assert leaves == {f"thing/{name}/leaf_{side}/standing" for name, side in sides}


def test_palm_and_links_are_held_off_the_table_and_every_thing_on_it(clearance):
    for part in ("palm", "link_3_3", "link_6_6"):
        others = {p.other for p in clearance.pairs if p.part == part and p.near is not Near.OWN}
        assert others == {"table", *(f"thing/{b.name}" for b in blocks_of(SCENARIO) if not b.is_for_fingers)}


def test_neighbours_and_what_can_never_touch_are_not_looked_at(clearance):
    own = {frozenset((p.part, p.other)) for p in clearance.pairs if p.near is Near.OWN}
    for a, b in (("link_1_1", "link_2_2"), ("link_0_0", "link_2_2"), ("link_4_4", "link_6_6")):
        assert frozenset((a, b)) not in own
    assert frozenset(("link_1_1", "link_3_3")) in own


def test_nothing_of_the_arm_moves_farther_than_the_sweep_s_bound(shapes):
    model, data, _ = shapes
    sweep, rng = Sweep(ARM), np.random.default_rng(0)
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)

    def points(q):
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        made = []
        for g in range(model.ngeom):
            if model.geom_bodyid[g] and model.geom(g).name != "palm_ball":
                radius, half, _ = model.geom_size[g]
                is_box = model.geom_type[g] == mujoco.mjtGeom.mjGEOM_BOX
                # Of a capsule its ends and its rim: the farthest of a rounded end lies between these.
                local = (
                    corners * model.geom_size[g]
                    if is_box
                    else corners * (radius / np.sqrt(2), radius / np.sqrt(2), half)
                )
                made.append(data.geom_xpos[g] + local @ data.geom_xmat[g].reshape(3, 3).T)
        return np.concatenate(made)

    for _ in range(400):
        q, turn = rng.uniform(-np.pi, np.pi, 6), 0.05 * rng.normal(size=6) * rng.choice([0.0, 1.0], 6)
        if rng.random() < 0.5:
            turn[3] = -turn[1] - turn[2]  # a tool that is kept pointing down
        moved = np.linalg.norm(points(q + turn) - points(q), axis=1).max()
        assert moved <= sweep.bound_m(tuple(turn.tolist())) + 1e-12


def test_an_arm_without_parallel_axes_has_a_bound_too():
    import msgspec

    rows = list(ARM.joints)
    rows[1] = msgspec.structs.replace(rows[1], alpha_rad=0.1)
    skew = Sweep(msgspec.structs.replace(ARM, joints=tuple(rows)))
    turn = (0.01, -0.02, 0.03, 0.0, 0.01, 0.02)
    assert skew.bound_m(turn) >= Sweep(ARM).bound_m(turn)


def test_things_that_are_put_elsewhere_are_kept_clear_of_there():
    blocks = blocks_of(SCENARIO)
    moved = Clearance(ARM, SCENARIO, hard=HARD, reach_m=REACH_M)
    wrist_m = ToolChain(ARM).points(ARM.home_rad)[0][1]
    near = (replace(blocks[0], centre_m=wrist_m), *blocks[1:])
    before = moved.gap(ARM.home_rad)
    moved.put(near)
    assert moved.gap(ARM.home_rad) < 0.0 < before
    moved.put(blocks)
    assert moved.gap(ARM.home_rad) == before
