"""Tracks: what stays, what is believed only after several pictures, what goes with the hand, what grows old."""

import math

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from config.loader import resolve
from perception.detection.seen import Detections, LampSeen, LampState, LidSeen, LidState, Stance, ThingSeen
from perception.tracking import ArmCourse, TableTracks
from perception.tracking.lamp import LampTrack
from perception.tracking.place import PlaceTrack, Steadiness
from perception.tracking.tracks import N_GONE
from robot.messages import ArmMode, ArmState, GripState

SCENARIO = resolve().scenario
STEADY = Steadiness(gate_m=0.005, least_weight=0.1, n_agree=3)
MS = 1_000_000
FULL, EMPTY = (GripState(opening_m=w, is_moving=False, has_object=o) for w, o in ((0.044, True), (0.085, False)))


def at(x, y=0.0, z=0.03, *, stance=Stance.STANDING, name="red_cylinder", confidence=0.9, visible=1.0):
    position = None if x is None else (x, y, z)
    return ThingSeen(
        name=name, position_m=position, stance=stance, axis_rad=None, confidence=confidence, visible=visible
    )  # fmt: skip


def arm(stamp_ms, tool=(0.45, 0.0, 0.3), *, grip=EMPTY, q=(0.0,) * 6):
    return ArmState(
        stamp_ns=stamp_ms * MS, q_rad=q, qd_rad_s=(0.0,) * 6, tcp_position_m=tool, tcp_quat=(0.0, 1.0, 0.0, 0.0),
        tcp_speed_m_s=(0.0,) * 3, tcp_force_n=(0.0,) * 3, grip=grip, digital_in=0, digital_out=0, mode=ArmMode.RUNNING,
    )  # fmt: skip


def picture(stamp_ms, *things, lamps=()):
    return Detections(
        stamp_ns=stamp_ms * MS, things=things,
        lamps=tuple(LampSeen(name=name, state=state, score=None) for name, state in lamps),
        lids=(LidSeen(name="red_box", state=LidState.OPEN, confidence=1.0),),
    )  # fmt: skip


def test_a_place_is_the_mean_of_its_pictures_and_one_that_is_far_off_changes_nothing():
    track = PlaceTrack(STEADY)
    for k, x in enumerate((0.300, 0.302, 0.301)):
        track.note(at(x), k)
    assert track.place.position_m[0] == pytest.approx(0.301)
    track.note(at(0.4), 3)
    assert track.place.position_m[0] == pytest.approx(0.301)
    assert track.place.stamp_ns == 2, "a picture that disagrees bears nothing out"


def test_another_place_is_believed_when_as_many_pictures_running_as_asked_agree_on_it():
    track = PlaceTrack(STEADY)
    track.note(at(0.3), 0)
    for k, x in enumerate((0.4, 0.5, 0.401, 0.4, 0.3, 0.4, 0.4)):
        track.note(at(x), 1 + k)
        assert track.place.position_m[0] == pytest.approx(0.3, abs=1e-3)
    track.note(at(0.4), 9)
    assert track.place.position_m[0] == 0.4


def test_a_freer_sight_stands_for_itself_and_a_worse_one_only_says_that_it_is_still_there():
    track = PlaceTrack(STEADY)
    for k in range(3):
        track.note(at(0.304, visible=0.6), k)
    track.note(at(0.300, visible=0.9), 3)
    assert track.place.position_m[0] == 0.300
    track.note(at(0.304, visible=0.6), 4)
    assert track.place.position_m[0] == 0.300
    assert track.place.stamp_ns == 4


def test_what_is_not_seen_or_stands_otherwise_does_not_move_what_is_known():
    track = PlaceTrack(STEADY)
    track.note(at(0.3), 0)
    track.note(at(None), 1)
    track.note(at(0.3, stance=Stance.LYING), 2)
    assert (track.place.stamp_ns, track.place.stance) == (0, Stance.STANDING)


@given(st.lists(st.one_of(st.none(), st.floats(0.25, 0.6)), max_size=30))
def test_a_believed_place_is_always_within_the_gate_of_some_picture(xs):
    track = PlaceTrack(STEADY)
    for k, x in enumerate(xs):
        track.note(at(x), k)
    seen = [x for x in xs if x is not None]
    assert (track.place is None) == (not seen)
    if seen:
        assert min(abs(x - track.place.position_m[0]) for x in seen) <= STEADY.gate_m


def test_a_lamp_changes_after_two_pictures_and_its_age_counts_from_the_last_that_bears_it_out():
    lamp, on, off = LampTrack(), LampSeen(name="b", state=LampState.ON, score=1.0), None
    off = msgspec.structs.replace(on, state=LampState.OFF)
    lamp.note(msgspec.structs.replace(on, state=LampState.UNKNOWN), 1)
    assert lamp.stamp_ns is None
    lamp.note(off, 2)
    assert (lamp.is_lit, lamp.stamp_ns) == (False, 2)
    lamp.note(on, 3)
    assert (lamp.is_lit, lamp.stamp_ns) == (False, 2)
    lamp.note(on, 4)
    assert (lamp.is_lit, lamp.stamp_ns) == (True, 4)


def test_between_two_measurements_the_arm_was_between_them():
    course = ArmCourse()
    assert course.at(0) is None
    course.note(arm(100, q=(0.0,) * 6))
    course.note(arm(150, q=(0.1,) * 6, grip=FULL))
    q, opening = course.at(125 * MS)
    assert q == pytest.approx((0.05,) * 6)
    assert opening == pytest.approx((0.044 + 0.085) / 2)
    assert course.at(0)[0] == (0.0,) * 6
    assert course.at(900 * MS)[0] == pytest.approx((0.1,) * 6)


def seen_once(x=0.45, y=0.0):
    tracks = TableTracks(SCENARIO)
    tracks.forget(0)
    tracks.note_arm(arm(40, (0.3, 0.3, 0.3)))
    tracks.note_picture(picture(20, at(x, y)))
    return tracks


def test_what_was_never_seen_is_not_valid_and_said_to_be_where_the_file_lays_it_out():
    tracks = TableTracks(SCENARIO)
    tracks.forget(0)
    box = SCENARIO.boxes[0]
    tracks.note_picture(
        picture(10, at(box.position_m[0] + 0.01, box.position_m[1], 0.0, name=box.name, stance=Stance.FIXED))
    )
    red = tracks.thing("red_cylinder", arm(50))
    assert not red.is_valid
    assert red.confidence == 0.0
    assert red.position_m == pytest.approx((box.position_m[0] + 0.01, box.position_m[1], 0.03))


def test_a_hidden_thing_is_where_it_was_seen_as_long_as_the_tool_kept_away():
    tracks = seen_once()
    tracks.note_arm(arm(20_000, (0.3, 0.3, 0.3)))
    red = tracks.thing("red_cylinder", arm(20_000))
    assert red.is_valid
    assert red.age_s == pytest.approx(19.98)


@pytest.mark.parametrize(("after_ms", "is_valid"), [(2019, True), (2020, True), (2021, False)])
def test_what_the_tool_was_near_is_believed_for_two_seconds_and_not_longer(after_ms, is_valid):
    tracks = seen_once()
    tracks.note_arm(arm(after_ms, (0.45, 0.1, 0.1)))
    assert tracks.thing("red_cylinder", arm(after_ms)).is_valid is is_valid


def test_what_the_hand_closed_on_goes_with_the_tool_at_once_and_is_unknown_when_let_go_until_it_is_seen():
    tracks = seen_once()
    tracks.note_arm(arm(100, (0.448, 0.003, 0.035), grip=FULL))
    tracks.note_picture(picture(90, at(0.2, 0.2), at(0.2, 0.2)))  # what pictures say of it counts for nothing
    lifted = arm(600, (0.54, 0.1, 0.2), grip=FULL)
    tracks.note_arm(lifted)
    held = tracks.thing("red_cylinder", lifted)
    assert (held.is_valid, held.age_s) == (True, 0.0)
    assert held.position_m == pytest.approx((0.542, 0.1, 0.195), abs=1e-9), "jaws centre it along their way"
    after = arm(650, (0.54, 0.1, 0.2))
    tracks.note_arm(after)
    let_go = tracks.thing("red_cylinder", after)
    assert not let_go.is_valid
    assert math.dist(let_go.position_m, held.position_m) < 1e-9
    tracks.note_picture(picture(640, at(0.1)))
    assert not tracks.thing("red_cylinder", arm(700)).is_valid, "that picture was taken before it was let go"
    tracks.note_picture(picture(700, at(0.54, 0.1)))
    assert tracks.thing("red_cylinder", arm(750)).is_valid


def test_a_hand_that_is_full_of_something_unknown_holds_nothing_known():
    tracks = seen_once()
    tracks.note_arm(arm(100, (0.45, 0.2, 0.035), grip=FULL))
    assert tracks.thing("red_cylinder", arm(100, (0.5, 0.3, 0.2), grip=FULL)).position_m == (0.45, 0.0, 0.03)


@pytest.mark.parametrize(("age_ms", "is_valid"), [(249, True), (250, True), (251, False)])
def test_a_lamp_that_was_not_seen_for_longer_than_its_memory_is_unknown(age_ms, is_valid):
    tracks = TableTracks(SCENARIO)
    name = SCENARIO.buttons[0].name
    tracks.note_picture(picture(0, lamps=[(name, LampState.ON)]))
    lamp = tracks.lamp(name, age_ms * MS)
    assert (lamp.is_lit, lamp.is_valid) == (True, is_valid)
    assert lamp.age_s == pytest.approx(age_ms / 1e3)


def test_a_loose_thing_that_newer_pictures_do_not_show_is_looked_for_all_over_now_and_then():
    tracks = seen_once()
    assert tracks.near(0)["red_cylinder"] == (0.45, 0.0, 0.03)
    tracks.note_picture(picture(400, at(None)))
    assert ["red_cylinder" in tracks.near(n) for n in range(5)] == [False, True, True, True, False]


def gone(name="red_cylinder"):
    return msgspec.structs.replace(at(None, name=name, stance=Stance.UNKNOWN, confidence=0.0), is_gone=True)


@pytest.mark.parametrize(("n", "is_known"), [(N_GONE - 1, True), (N_GONE, False)])
def test_a_thing_is_not_known_any_more_once_so_many_pictures_running_show_past_it(n, is_known):
    tracks = TableTracks(SCENARIO)
    tracks.note_picture(picture(0, at(0.5)))
    for k in range(n):
        tracks.note_picture(picture(50 * (k + 1), gone()))
    now = tracks.thing("red_cylinder", arm(400))
    assert now.is_valid is is_known
    assert now.position_m == pytest.approx((0.5, 0.0, 0.03)), "where it was last"
    assert ("red_cylinder" in tracks.near(1)) is is_known, "it is looked for everywhere"


@pytest.mark.parametrize("between", [at(0.5), at(None, stance=Stance.UNKNOWN)], ids=["seen", "hidden"])
def test_one_picture_that_does_not_show_past_a_thing_begins_the_count_anew(between):
    tracks = TableTracks(SCENARIO)
    tracks.note_picture(picture(0, at(0.5)))
    for k in range(3 * N_GONE):
        tracks.note_picture(picture(50 * (k + 1), between if k % N_GONE == 0 else gone()))
    assert tracks.thing("red_cylinder", arm(400)).is_valid


def test_a_thing_that_was_taken_away_is_known_where_it_is_put_back():
    tracks = TableTracks(SCENARIO)
    tracks.note_picture(picture(0, at(0.5)))
    for k in range(N_GONE):
        tracks.note_picture(picture(50 * (k + 1), gone()))
    tracks.note_picture(picture(400, at(0.35, 0.1)))
    back = tracks.thing("red_cylinder", arm(420))
    assert (back.is_valid, back.position_m) == (True, (0.35, 0.1, 0.03))
