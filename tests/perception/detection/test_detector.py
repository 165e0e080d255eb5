"""Detection on painted tables: places, stances, lamps, lids, and what cannot be told."""

import functools

import msgspec
import numpy as np
import pytest

from perception.detection import Detector, learn_colours, load_colours
from perception.detection.colour_file import save_colours
from perception.detection.regions import Region
from perception.detection.seen import LampState, LidState, Stance
from perception.errors import CalibrationRefusedError, PerceptionConfigError
from robot.frames import frame_of, picture_of
from tests.support.painted_table import CAMERA, SCENARIO, guided_sample, nominal, painted, seen_at

BUTTONS = tuple(b.name for b in SCENARIO.buttons)
BOXES = tuple(b.name for b in SCENARIO.boxes)


@functools.cache
def colours():
    frames, regions = guided_sample()
    return learn_colours(frames, regions, camera=CAMERA, scenario=SCENARIO)


@functools.cache
def detector():
    return Detector(camera=CAMERA, scenario=SCENARIO, colours=colours())


def things(detections):
    return {thing.name: thing for thing in detections.things}


def off_mm(thing, place):
    return 1e3 * float(np.linalg.norm(np.subtract(thing.position_m[:2], place[:2])))


@pytest.mark.parametrize(("seed", "light"), [(1, (1.0, 1.0, 1.0)), (2, (0.7, 0.68, 0.62)), (3, (1.05, 1.0, 0.85))])
def test_everything_is_found_within_two_millimetres_in_light_of_other_strength_and_tint(seed, light):
    place = nominal(np.random.default_rng(seed))
    found = detector().look(painted(place, lamps_on=BUTTONS[:1], lids_open=BOXES, light=light, seed=seed))
    seen = things(found)
    assert [t.name for t in found.things] == [*BUTTONS, *BOXES, *(c.name for c in SCENARIO.cylinders)]
    assert all(off_mm(seen[name], place[name]) < 2.0 for name in place)
    assert [lamp.state for lamp in found.lamps] == [LampState.ON, LampState.OFF, LampState.OFF]
    assert {lid.state for lid in found.lids} == {LidState.OPEN}
    assert found.stamp_ns == 7


def test_a_cylinder_in_a_shut_box_is_unknown_and_the_lid_is_told_shut():
    place = nominal(np.random.default_rng(4))
    found = detector().look(painted(place, lamps_on=BUTTONS))
    seen = things(found)
    assert all(seen[c.name].position_m is None and seen[c.name].confidence == 0.0 for c in SCENARIO.cylinders)
    assert all(off_mm(seen[name], place[name]) < 2.0 for name in (*BUTTONS, *BOXES))
    assert {lid.state for lid in found.lids} == {LidState.SHUT}
    assert {lamp.state for lamp in found.lamps} == {LampState.ON}


@pytest.mark.parametrize("axis_rad", [0.3, 1.4, 2.6])
def test_a_lying_cylinder_is_told_from_a_standing_one_with_its_axis(axis_rad):
    place = nominal() | {"red_cylinder": np.array([0.375, 0.1, 0.0]), "blue_cylinder": np.array([0.375, -0.1, 0.0])}
    seen = things(detector().look(painted(place, lying={"red_cylinder": axis_rad}, seed=5)))
    lies, stands = seen["red_cylinder"], seen["blue_cylinder"]
    assert (lies.stance, stands.stance) == (Stance.LYING, Stance.STANDING)
    assert abs((lies.axis_rad - axis_rad + np.pi / 2) % np.pi - np.pi / 2) < 0.15
    assert off_mm(lies, place["red_cylinder"]) < 2.0
    assert off_mm(stands, place["blue_cylinder"]) < 2.0
    assert (lies.position_m[2], stands.position_m[2]) == pytest.approx((0.022, 0.03))


def test_what_an_unknown_body_covers_half_is_unknown_and_what_the_arm_is_known_to_cover_half_is_found():
    place = nominal()
    frame = painted(place, seed=6)
    picture = picture_of(frame).copy()
    u, v = (int(n) for n in detector()._eye.pixels(place["green_button"][None, :])[0])
    picture[: v + 60, u : u + 80] = (200, 202, 207)
    covered = frame_of(picture, camera="side", sequence=0, stamp_ns=0, arrival_ns=0)
    assert things(detector().look(covered))["green_button"].position_m is None
    arm = np.array([[u, 0.0], [u + 79.0, 0.0], [u + 79.0, v + 59.0], [u, v + 59.0]])
    told = things(detector().look(covered, [arm]))["green_button"]
    assert 0.4 < told.visible < 0.65
    assert off_mm(told, place["green_button"]) < 3.0


@pytest.mark.parametrize("level", [0, 255])
def test_a_black_and_an_overexposed_picture_show_nothing_and_say_so(level):
    picture = np.full((720, 1280, 3), level, np.uint8)
    found = detector().look(frame_of(picture, camera="side", sequence=0, stamp_ns=1, arrival_ns=1))
    assert all(t.position_m is None and t.stance is Stance.UNKNOWN for t in found.things)
    assert {lamp.state for lamp in found.lamps} == {LampState.UNKNOWN}
    assert {lid.state for lid in found.lids} == {LidState.UNKNOWN}


def test_a_table_with_nothing_on_it_has_nothing_known_on_it():
    found = detector().look(painted_empty())
    assert all(t.position_m is None for t in found.things)
    assert {lid.state for lid in found.lids} == {LidState.UNKNOWN}


def painted_empty():
    from tests.support.painted_table import Painting

    return Painting(seed=8).frame()


def test_a_picture_of_another_size_and_a_camera_without_a_place_are_refused():
    small = frame_of(np.zeros((480, 640, 3), np.uint8), camera="side", sequence=0, stamp_ns=0, arrival_ns=0)
    with pytest.raises(PerceptionConfigError, match="expected 1280 × 720"):
        detector().look(small)
    with pytest.raises(PerceptionConfigError, match="calibrate extrinsics"):
        Detector(camera=msgspec.structs.replace(CAMERA, extrinsics=None), scenario=SCENARIO, colours=colours())


def test_a_thing_that_nobody_named_is_told_and_not_guessed():
    fewer = msgspec.structs.replace(colours(), models=tuple(m for m in colours().models if m.name != "red_cylinder"))
    with pytest.raises(PerceptionConfigError, match="red_cylinder"):
        Detector(camera=CAMERA, scenario=SCENARIO, colours=fewer)


def test_colours_read_back_equal(tmp_path):
    save_colours(tmp_path / "colours.yaml", colours())
    assert load_colours(tmp_path / "colours.yaml") == colours()


def test_a_sample_without_light_or_with_a_region_too_small_is_refused():
    frames, regions = guided_sample()
    dark = frame_of(np.zeros((720, 1280, 3), np.uint8), camera="side", sequence=0, stamp_ns=0, arrival_ns=0)
    with pytest.raises(CalibrationRefusedError, match="lit table in off"):
        learn_colours(frames | {"off": dark}, regions, camera=CAMERA, scenario=SCENARIO)
    speck = Region(image="off", name="speck", polygon_px=((700.0, 600.0), (703.0, 600.0), (703.0, 603.0)))
    with pytest.raises(CalibrationRefusedError, match="60 pixels or more of speck"):
        learn_colours(frames, [*regions, speck], camera=CAMERA, scenario=SCENARIO)


AWAY = (0.4, 3.0, 0.0)
"""Off the picture."""
AT = (0.66, 0.0, 0.03)
FAR_PX = np.array([[2.0, 2.0], [6.0, 2.0], [6.0, 6.0]])


@functools.cache
def cleared(lids_open=BOXES):
    """The table without its red cylinder; shut boxes hide nothing of where it stood."""
    return painted(nominal() | {"red_cylinder": np.array(AWAY)}, lids_open=lids_open, seed=21)


@pytest.mark.parametrize(
    ("picture", "before", "is_gone"),
    [
        ("cleared", [FAR_PX], True),
        ("cleared", [], False),
        ("cleared", ["arm"], False),
        ("there", [FAR_PX], False),
    ],
    ids=["seen past", "the arm not known", "the arm before it", "still there"],
)
def test_a_cylinder_is_gone_where_one_sees_past_its_place_and_only_there(picture, before, is_gone):
    there = nominal() | {"red_cylinder": np.array([*AT[:2], 0.0])}
    frame = cleared() if picture == "cleared" else painted(there, lids_open=BOXES, seed=22)
    u, v = seen_at(np.array([AT]))[0]
    arm = np.array([[u - 9, v - 40], [u + 40, v - 40], [u + 40, v + 40], [u - 9, v + 40]])
    found = detector().look(frame, [arm if b is not FAR_PX else b for b in before], {"red_cylinder": AT})
    assert things(found)["red_cylinder"].is_gone is is_gone


def test_nothing_is_gone_that_was_never_seen():
    assert not any(thing.is_gone for thing in detector().look(cleared(), [FAR_PX]).things)
