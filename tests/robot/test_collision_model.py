"""The model that distances are taken on, against the arm's file and kinematics written down here once more."""

import math

import mujoco
import numpy as np
import pytest
from msgspec.structs import replace

from config.loader import resolve
from robot.kinematics import Kinematics
from robot.safety.blocks import Block
from robot.safety.clearance import Clearance
from robot.safety.collision_model import Hard, Near, Pair, collision_model, put
from robot.safety.obstacles import blocks_of

RESOLVED = resolve()
ARM, SCENARIO = RESOLVED.arm, RESOLVED.scenario
HARD = Hard(own_m=0.011, table_m=0.012, thing_m=0.013)
REACH_M = 0.08
TABLE_M = -0.25
BLOCKS = (
    Block(name="one", centre_m=(0.4, 0.1, 0.05), half_m=(0.05, 0.06, 0.07)),
    Block(name="two", centre_m=(0.1, 0.5, 0.02), half_m=(0.01, 0.02, 0.03)),
)
LINKS = [f"link_{k}_{k}" for k in range(7)]
OWN = {
    "link_0_0": {"link_3_3", "link_4_4", "link_5_5", "link_6_6", "palm", "fingers"},
    "link_1_1": {"link_3_3", "link_4_4", "link_5_5", "link_6_6", "palm", "fingers"},
    "link_2_2": {"link_4_4", "link_5_5", "link_6_6", "palm", "fingers"},
    "link_3_3": {"link_6_6", "palm", "fingers"},
}
"""What of the arm may touch what: neighbours always do; wrist 1 and the last link, base and upper arm never."""
MOVING = [*LINKS[2:], "palm"]
"""What comes down to the table: the shoulder, which only turns, does not."""


@pytest.fixture
def built():
    return collision_model(ARM, table_m=TABLE_M, blocks=BLOCKS, hard=HARD, reach_m=REACH_M)


def frames(q):
    """T_bi of every joint's frame, base first, by the rows of the file."""
    T, made = np.eye(4), [np.eye(4)]
    for row, angle in zip(ARM.joints, q, strict=True):
        c, s, ca, sa = math.cos(angle), math.sin(angle), math.cos(row.alpha_rad), math.sin(row.alpha_rad)
        T = T @ [
            [c, -s * ca, s * sa, row.a_m * c],
            [s, c * ca, -c * sa, row.a_m * s],
            [0.0, sa, ca, row.d_m],
            [0.0, 0.0, 0.0, 1.0],
        ]
        made.append(T)
    return made


def placed(model, q):
    data = mujoco.MjData(model)
    data.qpos[:] = q
    mujoco.mj_kinematics(model, data)
    return data


POSTURES = [ARM.home_rad, (0.3, -1.1, 1.7, 0.4, -0.9, 2.1), (0.0,) * 6]


@pytest.mark.parametrize("q", POSTURES)
def test_every_link_is_the_file_s_capsule_where_the_file_s_rows_bring_it(built, q):
    model, _ = built
    data, T_b = placed(model, q), frames(q)
    for capsule, name in zip(ARM.capsules, LINKS, strict=True):
        geom = model.geom(name)
        ends = [T_b[capsule.link][:3, :3] @ p + T_b[capsule.link][:3, 3] for p in (capsule.from_m, capsule.to_m)]
        assert geom.type == mujoco.mjtGeom.mjGEOM_CAPSULE
        assert geom.size[0] == capsule.radius_m
        assert geom.size[1] == pytest.approx(math.dist(*ends) / 2.0)
        assert data.geom_xpos[geom.id] == pytest.approx((ends[0] + ends[1]) / 2.0, abs=1e-6)
        along = data.geom_xmat[geom.id].reshape(3, 3)[:, 2]
        assert abs(along @ (ends[1] - ends[0])) == pytest.approx(math.dist(*ends), abs=1e-6)


@pytest.mark.parametrize("q", POSTURES)
def test_palm_fingers_and_tool_centre_are_where_the_hand_is(built, q):
    model, _ = built
    data, T_bf = placed(model, q), frames(q)[6]
    shapes = {
        "palm": (mujoco.mjtGeom.mjGEOM_BOX, (0.032, 0.06, 0.0414), 0.0414),
        "palm_ball": (mujoco.mjtGeom.mjGEOM_SPHERE, (math.hypot(0.032, 0.06, 0.0414), 0.0, 0.0), 0.0414),
        "fingers": (mujoco.mjtGeom.mjGEOM_BOX, (0.011, 0.0545, 0.0475), 0.1303),
        "fingers_ball": (mujoco.mjtGeom.mjGEOM_SPHERE, (math.hypot(0.011, 0.0545, 0.0475), 0.0, 0.0), 0.1303),
    }
    for name, (kind, size, out_m) in shapes.items():
        geom = model.geom(name)
        assert geom.type == kind
        assert geom.size == pytest.approx(size)
        assert data.geom_xpos[geom.id] == pytest.approx(T_bf[:3, :3] @ (0.0, 0.0, out_m) + T_bf[:3, 3], abs=1e-6)
        assert data.geom_xmat[geom.id].reshape(3, 3) == pytest.approx(T_bf[:3, :3], abs=1e-6)
    tcp = T_bf[:3, :3] @ ARM.tool.tcp_m + T_bf[:3, 3]
    assert data.site("tcp").xpos == pytest.approx(tcp, abs=1e-6)


def test_the_table_is_all_below_its_top_and_blocks_are_as_they_were_given(built):
    model, _ = built
    data = placed(model, ARM.home_rad)
    table = model.geom("table")
    assert table.type == mujoco.mjtGeom.mjGEOM_PLANE
    assert table.size == pytest.approx((2.0, 2.0, 0.1))
    assert data.geom_xpos[table.id] == pytest.approx((0.0, 0.0, TABLE_M))
    assert data.geom_xmat[table.id].reshape(3, 3) == pytest.approx(np.eye(3))
    for block in BLOCKS:
        geom = model.geom(f"thing/{block.name}")
        assert geom.type == mujoco.mjtGeom.mjGEOM_BOX
        assert geom.size == pytest.approx(block.half_m)
        assert data.geom_xpos[geom.id] == pytest.approx(block.centre_m)
    assert model.ngeom == 7 + 4 + 1 + 2


def test_nothing_touches_but_the_pairs_that_are_named(built):
    model, _ = built
    assert not model.geom_contype.any()
    assert not model.geom_conaffinity.any()
    assert [model.joint(i).name for i in range(6)] == [row.name for row in ARM.joints]
    assert (model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE).all()
    assert model.body_mass[1:7] == pytest.approx(np.ones(6))
    assert model.body_inertia[1:7] == pytest.approx(np.ones((6, 3)))
    assert [model.body(i).name for i in range(1, 8)] == [*(f"link_{i}" for i in range(1, 7)), "tool"]


def test_the_pairs_are_those_that_may_touch_and_no_other(built):
    _, pairs = built
    own = {Pair(a, b, Near.OWN) for a, others in OWN.items() for b in others}
    table = {Pair(part, "table", Near.TABLE) for part in MOVING}
    things = {Pair(part, f"thing/{b.name}", Near.THING) for part in (LINKS[1], *MOVING) for b in BLOCKS}
    assert set(pairs) == own | table | things
    assert len(pairs) == len(set(pairs))


def test_every_pair_is_kept_at_its_own_distance_and_looked_at_up_to_the_reach(built):
    model, pairs = built
    assert len(pairs) == model.npair
    for i, pair in enumerate(pairs):
        names = {model.geom(int(g[i])).name for g in (model.pair_geom1, model.pair_geom2)}
        part = "palm_ball" if pair.part == "palm" and pair.near is Near.THING else pair.part
        assert names == {part, pair.other}
        kept = {Near.OWN: 0.011, Near.TABLE: 0.012, Near.THING: 0.013}[pair.near]
        assert model.pair_margin[i] == pytest.approx(kept)
        assert model.pair_gap[i] == pytest.approx(REACH_M - kept)
        assert model.pair_dim[i] == 1


@pytest.mark.parametrize(("gap_m", "is_looked_at"), [(-0.01, True), (0.0015, True), (0.0025, False)])
def test_parts_two_links_apart_are_looked_at_if_they_come_within_two_millimetres(gap_m, is_looked_at):
    # The upper arm passes the base's axis 0.138 m aside, 0.058 m thick, whatever the joints do.
    thick = replace(ARM.capsules[0], radius_m=0.138 - 0.058 - gap_m)
    _, pairs = collision_model(
        replace(ARM, capsules=(thick, *ARM.capsules[1:])), table_m=TABLE_M, blocks=(), hard=HARD, reach_m=REACH_M
    )
    assert (Pair("link_0_0", "link_2_2", Near.OWN) in pairs) is is_looked_at
    assert Pair("link_0_0", "link_1_1", Near.OWN) not in pairs


def test_a_table_that_the_shoulder_reaches_down_to_is_held_off_it_too():
    _, pairs = collision_model(ARM, table_m=0.12, blocks=(), hard=HARD, reach_m=REACH_M)
    assert Pair("link_1_1", "table", Near.TABLE) in pairs
    assert Pair("link_0_0", "table", Near.TABLE) not in pairs


@pytest.mark.parametrize(("gap_m", "is_looked_at"), [(0.0015, True), (0.0025, False)])
def test_what_never_comes_within_two_millimetres_is_not_looked_at(gap_m, is_looked_at):
    # The shoulder reaches 0.06 m down from 0.1625 m, 0.065 m thick: a table so far under it stays there.
    table_m = 0.1625 - 0.06 - 0.065 - gap_m
    _, pairs = collision_model(ARM, table_m=table_m, blocks=(), hard=HARD, reach_m=REACH_M)
    assert (Pair("link_1_1", "table", Near.TABLE) in pairs) is is_looked_at


def test_things_are_looked_at_wherever_they_stand_for_they_may_come_nearer():
    post = Block(name="post", centre_m=(9.0, 9.0, 9.0), half_m=(0.02, 0.02, 0.001))
    leaf = Block(name="leaf", centre_m=(9.0, 9.0, 9.0), half_m=(0.02, 0.02, 0.001), is_for_fingers=True)
    _, pairs = collision_model(ARM, table_m=TABLE_M, blocks=(post, leaf), hard=HARD, reach_m=REACH_M)
    assert {p.part for p in pairs if p.other == "thing/post"} == {LINKS[1], *MOVING}
    assert [p for p in pairs if p.other == "thing/leaf"] == [Pair("fingers", "thing/leaf", Near.LEAF)]


def test_a_block_is_put_elsewhere_turned_and_resized_as_if_it_had_been_built_so(built):
    model, _ = built
    turn = (math.cos(0.3), 0.0, math.sin(0.3), 0.0)
    elsewhere = Block(name="one", centre_m=(0.3, -0.2, 0.4), half_m=(0.01, 0.2, 0.03), quat=turn)
    fresh, _ = collision_model(ARM, table_m=TABLE_M, blocks=(elsewhere, BLOCKS[1]), hard=HARD, reach_m=REACH_M)
    geom = model.geom("thing/one").id
    put(model, geom, elsewhere)
    for name in ("geom_size", "geom_rbound", "geom_aabb"):
        assert getattr(model, name)[geom] == pytest.approx(getattr(fresh, name)[fresh.geom("thing/one").id])
    moved, made = placed(model, ARM.home_rad), placed(fresh, ARM.home_rad)
    assert moved.geom_xpos[geom] == pytest.approx(made.geom_xpos[geom])
    assert moved.geom_xmat[geom] == pytest.approx(made.geom_xmat[geom])
    assert abs(moved.geom_xmat[geom][2]) == pytest.approx(math.sin(0.6))


def test_parts_beside_one_another_in_the_file_are_looked_at_if_a_link_lies_between_them():
    thick = replace(ARM.capsules[0], radius_m=0.1)
    _, pairs = collision_model(
        replace(ARM, capsules=(thick, *ARM.capsules[2:])), table_m=TABLE_M, blocks=(), hard=HARD, reach_m=REACH_M
    )
    assert Pair("link_0_0", "link_2_1", Near.OWN) in pairs


def test_distances_kept_have_defaults_and_are_told_by_kind():
    assert Hard() == Hard(own_m=0.01, table_m=0.005, thing_m=0.005)
    assert [HARD.of(near) for near in (Near.OWN, Near.TABLE, Near.THING, Near.LEAF)] == [0.011, 0.012, 0.013, 0.0]
    farther = HARD.farther(0.002)
    assert [farther.of(near) for near in Near] == pytest.approx([0.013, 0.014, 0.015, 0.002])


def test_a_block_is_as_wide_as_the_region_its_thing_may_be_drawn_from():
    button = replace(SCENARIO.buttons[0], name="b", position_m=(0.3, -0.2), spread_m=(0.03, 0.01))
    box = replace(
        SCENARIO.boxes[0], name="x", position_m=(0.5, -0.3), spread_m=(0.02, 0.04), inner_m=(0.18, 0.12), lid=None
    )  # fmt: skip
    inside = replace(SCENARIO.cylinders[0], name="c", inside="x", position_m=(0.01, 0.02), spread_m=(0.005, 0.006))
    alone = replace(SCENARIO.cylinders[0], name="d", inside=None, position_m=(0.1, 0.2), spread_m=(0.05, 0.06))
    scenario = replace(
        SCENARIO, table=replace(SCENARIO.table, height_m=0.125), buttons=(button,), boxes=(box,),
        cylinders=(inside, alone),
    )  # fmt: skip
    made = blocks_of(scenario)
    expected = (
        ("b", (0.3, -0.2, 0.125 + 0.025), (0.05 + 0.03, 0.05 + 0.01, 0.025)),
        ("x", (0.5, -0.3, 0.125 + 0.0375), (0.095 + 0.02, 0.065 + 0.04, 0.0375)),
        ("c", (0.51, -0.28, 0.125 + 0.03), (0.022 + 0.025, 0.022 + 0.046, 0.03)),
        ("d", (0.1, 0.2, 0.125 + 0.03), (0.022 + 0.05, 0.022 + 0.06, 0.03)),
    )
    assert [block.name for block in made] == [name for name, _, _ in expected]
    for block, (_, centre, half) in zip(made, expected, strict=True):
        assert block.centre_m == pytest.approx(centre)
        assert block.half_m == pytest.approx(half)


def bare(*buttons, table_m=0.0):
    return replace(
        SCENARIO, table=replace(SCENARIO.table, height_m=table_m), buttons=buttons, boxes=(), cylinders=()
    )  # fmt: skip


def test_no_gap_is_told_beyond_the_reach_less_the_greatest_distance_kept():
    for hard in (Hard(own_m=0.03), Hard(table_m=0.03), Hard(thing_m=0.03)):
        assert Clearance(ARM, bare(), hard=hard).most_m == pytest.approx(0.05)
        assert Clearance(ARM, bare(), hard=hard, reach_m=0.1).most_m == pytest.approx(0.07)
    far = Clearance(ARM, bare(table_m=-3.0), hard=HARD)
    assert far.gap(ARM.home_rad) == far.most_m == pytest.approx(REACH_M - 0.013)
    assert far.closest(ARM.home_rad, within_m=1.0) == []


LOW = Kinematics(ARM).solve((0.42, 0.0, -0.15), ARM.home_rad)
"""The hand lower than anything else of the arm."""


def over_the_table(height_m):
    """The arm, over a table so far under its palm."""
    palm = placed(Clearance(ARM, bare(), hard=HARD)._model, LOW).geom("palm")
    corners = palm.xmat.reshape(3, 3)[2] * (0.032, 0.06, 0.0414)
    table_m = float(palm.xpos[2] - np.abs(corners).sum()) - height_m
    return Clearance(ARM, bare(table_m=table_m), hard=HARD)


@pytest.mark.parametrize("height_m", [0.05, 0.02, 0.012, 0.005, -0.01])
def test_the_gap_to_a_table_is_the_height_over_it_less_what_is_kept(height_m):
    assert over_the_table(height_m).gap(LOW) == pytest.approx(height_m - 0.012, abs=1e-6)


@pytest.mark.parametrize("away_m", [0.03, 0.013, 0.004, -0.01])
def test_the_gap_of_the_palm_to_a_block_is_that_of_its_box_and_not_of_the_ball_around_it(away_m):
    near, button = beside_the_palm(away_m)
    gap_m = near.gap(ARM.home_rad)
    (one,) = [c for c in near.closest(ARM.home_rad, within_m=0.06) if c.pair.part == "palm"]
    assert one.gap_m == pytest.approx(gap_m, abs=1e-6)
    assert one.pair == Pair("palm", f"thing/{button.name}", Near.THING)
    assert gap_m == pytest.approx(away_m - 0.013, abs=2e-3)
    slope = [
        (near.gap(tuple(q + 1e-6 * (k == i) for k, q in enumerate(ARM.home_rad))) - gap_m) / 1e-6 for i in range(6)
    ]
    assert one.slope_m_rad == pytest.approx(slope, abs=2e-3)
    assert one in near.closest(ARM.home_rad, within_m=one.gap_m)
    assert [c for c in near.closest(ARM.home_rad, within_m=one.gap_m - 1e-6) if c.pair.part == "palm"] == []


def beside_the_palm(away_m):
    """A table so far down that nothing is near it, and a post so far beside the palm."""
    palm = placed(Clearance(ARM, bare(table_m=-3.0), hard=HARD)._model, ARM.home_rad).geom("palm")
    R = palm.xmat.reshape(3, 3)
    axis = int(np.argmax(np.abs(R[:2, 0])))
    at = [float(palm.xpos[0]), float(palm.xpos[1])]
    at[axis] += float(np.abs(R[axis, :2]) @ (0.032, 0.06)) + away_m + 0.02
    height_m = float(palm.xpos[2]) - 0.02 + 3.0
    post = replace(SCENARIO.buttons[0], position_m=tuple(at), spread_m=(0.0, 0.0), diameter_m=0.04, height_m=height_m)
    return Clearance(ARM, bare(post, table_m=-3.0), hard=HARD), post


def test_what_only_the_ball_around_the_palm_comes_near_to_is_out_of_reach():
    far, _ = beside_the_palm(0.083)
    assert [c for c in far.closest(ARM.home_rad, within_m=1.0) if c.pair.part == "palm"] == []


def test_what_just_touches_has_no_direction_to_yield_in_and_is_not_told():
    touching = over_the_table(0.0)
    assert touching.gap(LOW) == pytest.approx(-0.012, abs=1e-9)
    assert touching.closest(LOW, within_m=0.0) == []


def test_each_pair_is_told_once():
    near = over_the_table(0.01)
    for q in (LOW, (LOW[0], LOW[1] + 0.02, *LOW[2:])):
        pairs = [c.pair for c in near.closest(q, within_m=0.06)]
        assert len(pairs) == len(set(pairs)) > 0


@pytest.mark.parametrize("q", POSTURES)
def test_the_tool_jacobian_holds_speed_and_turning(q):
    J, T_b = Clearance(ARM, bare(), hard=HARD).tool_jacobian(q), frames(q)
    tcp = T_b[6][:3, :3] @ ARM.tool.tcp_m + T_b[6][:3, 3]
    for i in range(6):
        axis = T_b[i][:3, 2]
        assert J[3:, i] == pytest.approx(axis, abs=1e-6)
        assert J[:3, i] == pytest.approx(np.cross(axis, tcp - T_b[i][:3, 3]), abs=1e-6)
