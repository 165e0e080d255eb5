"""What is kept clear of by now: things where they were seen last, lids as they must be, and nothing that is held."""

import math

import pytest
from msgspec.structs import replace

from config.loader import resolve
from robot.messages import GripState
from robot.safety.blocks import AWAY, LidState
from robot.safety.lids import HAND_M, SETTLING_S, LidWatch
from robot.safety.obstacles import MOVED_M, Obstacles, blocks_of
from robot.surroundings import HELD_M, Lookout, Place, Surroundings
from tests.support.stations import percept

SCENARIO = resolve().scenario
BOX, CYLINDER, BUTTON = SCENARIO.boxes[1], SCENARIO.cylinders[0], SCENARIO.buttons[0]
BIT = 1 << BOX.lid.output
TRAVEL_NS = round((BOX.lid.open_angle_rad / BOX.lid.speed_rad_s + SETTLING_S) * 1e9)
FAR, TOOL = (0.3, 0.3, 0.3), (0.42, 0.0, 0.2)
FULL = GripState(opening_m=0.044, is_moving=False, has_object=True)
LYING = (math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0)
PLACES = {thing.name: (*thing.position_m, 0.03) for thing in (*SCENARIO.buttons, *SCENARIO.boxes, *SCENARIO.cylinders)}
LOOKOUT = Lookout(SCENARIO, max_age_s=0.15)


def see(changes=None, **more):
    return LOOKOUT.see(percept({**PLACES, **(changes or {})}, tcp_m=TOOL, **more))


def see_less(which, **changes):
    """All things, but one as it is changed."""
    whole = percept(PLACES, tcp_m=TOOL)
    things = tuple(replace(t, **changes) if t.name == which else t for t in whole.objects)
    return LOOKOUT.see(replace(whole, objects=things))


def block(obstacles, name):
    (found,) = [b for b in obstacles.blocks if b.name == name]
    return found


@pytest.fixture
def table():
    made = Obstacles(SCENARIO)
    made.seed(0, 0)
    return made


def test_before_anything_is_perceived_things_are_as_wide_as_their_regions_and_said_to_be_unseen(table):
    assert table.unseen == tuple(PLACES)
    for thing in (BOX, BUTTON):
        half = block(table, thing.name).half_m
        size = (BOX.inner_m[0] + 2 * BOX.wall_m) / 2 if thing is BOX else BUTTON.diameter_m / 2
        assert half[0] == pytest.approx(size + thing.spread_m[0])
    inside = next(b for b in SCENARIO.boxes if b.name == CYLINDER.inside)
    wide = CYLINDER.diameter_m / 2 + CYLINDER.spread_m[0] + inside.spread_m[0]
    assert block(table, CYLINDER.name).half_m[0] == pytest.approx(wide)
    assert table.blocks == blocks_of(SCENARIO)


def test_what_is_perceived_is_where_it_is_perceived_and_no_wider(table):
    assert table.perceive(see({CYLINDER.name: (0.4, 0.1, 0.05), BOX.name: (0.5, 0.02, 0.3)}))
    assert table.unseen == ()
    cylinder, box = block(table, CYLINDER.name), block(table, BOX.name)
    assert cylinder.centre_m == (0.4, 0.1, 0.05)
    assert cylinder.half_m == pytest.approx(
        (CYLINDER.diameter_m / 2 + MOVED_M, CYLINDER.diameter_m / 2 + MOVED_M, CYLINDER.height_m / 2 + MOVED_M)
    )
    assert box.centre_m == pytest.approx((0.5, 0.02, BOX.height_m / 2))  # it stands on the table, whatever is said


def test_a_cylinder_that_fell_over_lies(table):
    table.perceive(see_less(CYLINDER.name, quat=LYING))
    assert block(table, CYLINDER.name).half_m[2] == pytest.approx(CYLINDER.diameter_m / 2 + MOVED_M)


@pytest.mark.parametrize(("by", "is_moved"), [(MOVED_M, False), (MOVED_M * (1.0 + 1e-6), True)])
def test_what_moved_by_less_than_its_block_is_wider_has_not_moved(table, by, is_moved):
    at = (0.0, 0.0, 0.0)
    table.perceive(see({CYLINDER.name: at}))
    assert table.perceive(see({CYLINDER.name: (by, 0.0, 0.0)})) is is_moved
    assert block(table, CYLINDER.name).centre_m[0] == (by if is_moved else 0.0)


@pytest.mark.parametrize(
    "changes",
    [
        {"is_valid": False}, {"age_s": 0.16}, {"age_s": math.nan}, {"quat": (0.0,) * 4},
        {"position_m": (math.nan, 0.0, 0.0)}, {"quat": (math.inf, 0.0, 0.0, 0.0)}, {"name": "another"},
    ],
    ids=["invalid", "old", "ageless", "no turn", "nowhere", "endless", "absent"],
)  # fmt: skip
def test_what_is_not_perceived_now_stays_where_it_was_last_and_is_said_to_be_unseen(table, changes):
    table.perceive(see({CYLINDER.name: (0.4, 0.1, 0.05)}))
    before = block(table, CYLINDER.name)
    table.perceive(see_less(CYLINDER.name, **changes))
    assert block(table, CYLINDER.name) is before
    assert table.unseen == (CYLINDER.name,)


def test_a_thing_as_old_as_it_may_be_is_still_perceived(table):
    table.perceive(see_less(CYLINDER.name, age_s=0.15))
    assert table.unseen == ()


def test_what_is_held_is_no_obstacle_and_is_one_again_where_it_was_left(table):
    for by, is_held in ((HELD_M - 1e-6, True), (HELD_M, False)):
        here = (TOOL[0], TOOL[1], TOOL[2] - by)
        table.perceive(see({CYLINDER.name: here}, grip=FULL))
        assert block(table, CYLINDER.name).centre_m == (AWAY if is_held else here)
    table.perceive(see({CYLINDER.name: TOOL}))
    assert block(table, CYLINDER.name).centre_m == TOOL


def test_a_held_thing_that_the_hand_hides_is_still_held_until_the_hand_is_empty(table):
    table.perceive(see({CYLINDER.name: TOOL}, grip=FULL))
    hidden = replace(see_less(CYLINDER.name, is_valid=False), is_hand_full=True)
    table.perceive(hidden)
    assert block(table, CYLINDER.name).centre_m == AWAY
    assert table.unseen == (CYLINDER.name,)
    table.perceive(replace(hidden, is_hand_full=False))
    assert block(table, CYLINDER.name).centre_m == TOOL


def test_of_two_things_in_reach_the_nearer_one_is_held(table):
    other = SCENARIO.cylinders[1].name
    table.perceive(see({CYLINDER.name: (TOOL[0] + 0.02, *TOOL[1:]), other: (TOOL[0] + 0.01, *TOOL[1:])}, grip=FULL))
    assert block(table, other).centre_m == AWAY
    assert block(table, CYLINDER.name).centre_m != AWAY


def test_seeding_forgets_where_things_were(table):
    table.perceive(see())
    table.seed(0, 0)
    assert table.blocks == blocks_of(SCENARIO)
    assert table.unseen == tuple(PLACES)


def test_a_lid_that_was_asked_to_move_is_anywhere_until_it_must_have_arrived(table):
    table.perceive(see({BOX.name: (0.5, 0.0, 0.0)}))
    shut = block(table, f"{BOX.name}/leaf_near")
    assert not table.watch(0, FAR, 10**9)
    assert table.watch(BIT, FAR, 10**9)
    moving = block(table, f"{BOX.name}/leaf_near")
    assert moving.half_m[2] > 0.045
    assert not table.watch(BIT, FAR, 10**9 + TRAVEL_NS - 1)
    assert table.watch(BIT, FAR, 10**9 + TRAVEL_NS)
    assert block(table, f"{BOX.name}/leaf_near").quat != (1.0, 0.0, 0.0, 0.0)
    assert not table.watch(BIT, FAR, 10**9 + 2 * TRAVEL_NS)
    assert table.watch(0, FAR, 9 * 10**9)
    assert table.watch(0, FAR, 9 * 10**9 + TRAVEL_NS)
    assert block(table, f"{BOX.name}/leaf_near") == shut


def test_a_lid_turns_round_on_its_way_and_counts_anew():
    lid = LidWatch(BOX)
    lid.seed(0, 0)
    assert lid.note(BIT, 100)
    assert not lid.note(0, TRAVEL_NS)
    assert not lid.note(0, 2 * TRAVEL_NS - 1)
    assert lid.note(0, 2 * TRAVEL_NS)
    assert lid.state is LidState.SHUT


def test_a_lid_that_nobody_has_told_of_is_anywhere():
    assert LidWatch(BOX).state is LidState.UNKNOWN


def test_what_is_in_the_way_of_leaves_that_have_arrived_changes_nothing():
    lid = LidWatch(BOX)
    lid.seed(0, 0)
    lid.note(BIT, 0)
    lid.hold_up(10)
    assert not lid.note(BIT, TRAVEL_NS)
    assert lid.note(BIT, 10 + TRAVEL_NS)
    lid.hold_up(20 + TRAVEL_NS)
    assert lid.state is LidState.OPEN
    assert not lid.note(BIT, 20 + TRAVEL_NS)


def test_a_thing_that_nobody_has_seen_yet_holds_up_no_leaf(table):
    assert table.watch(BIT, FAR, 10**9)
    assert table.watch(BIT, FAR, 10**9 + TRAVEL_NS)


def test_seeding_takes_a_lid_to_be_as_told_but_for_one_that_is_on_its_way():
    lid = LidWatch(BOX)
    for bits, state in ((BIT, LidState.OPEN), (0, LidState.SHUT)):
        lid.seed(bits, 0)
        assert lid.state is state
    lid.note(BIT, 1000)
    lid.seed(BIT, 1000 + TRAVEL_NS - 1)
    assert lid.state is LidState.UNKNOWN
    lid.seed(BIT, 1000 + TRAVEL_NS)
    assert lid.state is LidState.OPEN
    lid.note(0, 5 * TRAVEL_NS)
    lid.seed(BIT, 5 * TRAVEL_NS + 1)
    assert lid.state is LidState.OPEN


def _settles(table, tool_m, changes=None):
    """Whether a lid that was asked to open is known to be open after its time."""
    table.perceive(see({BOX.name: (0.5, 0.0, 0.0), **(changes or {})}))
    table.watch(BIT, FAR, 10**9)
    return table.watch(BIT, tool_m, 10**9 + TRAVEL_NS)


@pytest.mark.parametrize(
    ("tool_m", "is_settled"),
    [((0.5, 0.0, 0.22), True), ((0.5, 0.0, 0.2), False), ((0.5, 0.0, 0.03), False), ((0.5, 0.3, 0.1), True)],
    ids=["above", "over", "down in it", "beside"],
)
def test_leaves_that_the_hand_may_hold_up_are_not_known_to_arrive(table, tool_m, is_settled):
    assert _settles(table, tool_m) is is_settled


@pytest.mark.parametrize(
    ("at_m", "is_settled"),
    [((0.5, 0.0, 0.03), True), ((0.5, 0.0, BOX.height_m + 0.01), False), ((0.5, 0.25, 0.1), True)],
    ids=["down in it", "across its rim", "beside"],
)
def test_leaves_that_a_loose_thing_may_hold_up_are_not_known_to_arrive(table, at_m, is_settled):
    assert _settles(table, FAR, {CYLINDER.name: at_m}) is is_settled


def test_a_box_that_is_turned_has_its_leaves_where_they_are(table):
    yaw = math.pi / 2
    turned = (math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2))
    table.seed(BIT, 0)
    table.perceive(see_less(BOX.name, quat=turned, position_m=(0.5, 0.0, 0.0)))
    x, y, _ = block(table, f"{BOX.name}/leaf_near").centre_m
    assert x == pytest.approx(0.5, abs=1e-6)
    assert y == pytest.approx(-0.11, abs=0.015)  # what looked to -x looks to -y


RAISED = replace(SCENARIO, table=replace(SCENARIO.table, height_m=0.1))
YAW = 0.5
LEAF_M = (BOX.inner_m[0] + BOX.wall_m) / 2
OUT_M = LEAF_M * max(0.0, -math.cos(BOX.lid.open_angle_rad)) + BOX.lid.thickness_m + BOX.lid.padding_m
HALF_M = (BOX.inner_m[0] / 2 + BOX.wall_m + OUT_M, BOX.inner_m[1] / 2 + BOX.wall_m)
HIGH_M = BOX.height_m + LEAF_M + BOX.lid.thickness_m + BOX.lid.padding_m


def raised(places, *, is_full=False, at=(0.48, 0.07), yaw=YAW):
    """A table 0.1 m up whose box was perceived at a place, turned, or nowhere, its lid asked to open."""
    made = Obstacles(RAISED)
    made.seed(0, 0)
    quat = (math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2))
    seen = dict(places)
    if at is not None:
        seen[BOX.name] = Place(position_m=(*at, 0.1), quat=quat)
    made.perceive(Surroundings(stamp_ns=0, places=tuple(seen.get(name) for name in PLACES), is_hand_full=is_full))
    made.watch(BIT, FAR, 10**9)
    return made


def from_box(x, y, z, at=(0.48, 0.07), yaw=YAW):
    """Where a place in the box's frame is."""
    c, s = math.cos(yaw), math.sin(yaw)
    return at[0] + c * x - s * y, at[1] + s * x + c * y, 0.1 + z


@pytest.mark.parametrize("corner", [(1, 1), (1, -1), (-1, 1), (-1, -1)])
@pytest.mark.parametrize(("at", "yaw"), [((0.48, 0.07), YAW), (None, 0.0)], ids=["perceived", "unseen"])
def test_a_hand_at_a_corner_of_what_leaves_sweep_is_in_their_way_and_a_millimetre_beyond_is_not(corner, at, yaw):
    place = at or BOX.position_m
    for axis, by, is_settled in ((0, -1e-3, False), (0, 1e-3, True), (1, 1e-3, True)):
        x, y = (sign * (half + HAND_M - 1e-3) for sign, half in zip(corner, HALF_M, strict=True))
        x, y = (x + corner[0] * (by + 1e-3), y) if axis == 0 else (x, y + corner[1] * (by + 1e-3))
        table = raised({}, at=at, yaw=yaw)
        assert table.watch(BIT, from_box(x, y, 0.1, place, yaw), 10**9 + TRAVEL_NS) is is_settled, (axis, by)


@pytest.mark.parametrize(
    ("is_full", "by", "is_settled"), [(False, 0.02, True), (True, 0.02, False), (True, 0.031, True)]
)
def test_a_full_hand_is_in_the_way_of_leaves_from_higher_up(is_full, by, is_settled):
    table = raised({}, is_full=is_full)
    assert table.watch(BIT, from_box(0.0, 0.0, HIGH_M + by), 10**9 + TRAVEL_NS) is is_settled


@pytest.mark.parametrize(("by", "is_settled"), [(-1e-4, False), (1e-4, True)])
def test_a_loose_thing_holds_up_leaves_as_far_off_as_its_longest_half(by, is_settled):
    radius_m = math.hypot(CYLINDER.diameter_m, CYLINDER.height_m) / 2
    place = Place(position_m=from_box(HALF_M[0] + radius_m + by, 0.0, 0.1), quat=(1.0, 0.0, 0.0, 0.0))
    assert raised({CYLINDER.name: place}).watch(BIT, FAR, 10**9 + TRAVEL_NS) is is_settled


@pytest.mark.parametrize(("by", "is_moved"), [(1e-3, False), (math.nextafter(1e-3, 1.0), True)])
def test_what_turned_by_a_thousandth_has_not_moved_and_the_next_float_has(table, by, is_moved):
    def seen(turn):
        quat = (1.0, turn, 0.0, 0.0)
        places = (Place(position_m=(0.4, 0.0, 0.1), quat=quat) if n == CYLINDER.name else None for n in PLACES)
        return Surroundings(stamp_ns=0, places=tuple(places), is_hand_full=False)

    assert table.perceive(seen(0.0))
    assert table.perceive(seen(by)) is is_moved


def test_blocks_of_what_is_perceived_are_turned_with_it_and_those_for_fingers_stay_theirs():
    table = raised({})
    near, standing = block(table, BOX.name), block(table, f"{BOX.name}/leaf_near/standing")
    assert near.quat == pytest.approx((math.cos(YAW / 2), 0.0, 0.0, math.sin(YAW / 2)))
    assert standing.is_for_fingers is True
    assert near.is_for_fingers is False
