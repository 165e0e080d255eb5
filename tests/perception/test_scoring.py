"""Scores by hand, and the bench's rows."""

import math

import numpy as np
import pytest

from config.loader import resolve
from perception.bench import level_results, overall_results
from perception.calibrated import printed
from perception.calibration.board import Board
from perception.detection.seen import Detections, LampSeen, LampState, LidSeen, LidState, Stance, ThingSeen
from perception.scoring import Score, f1_of, score, total, upper_bound
from robot.frames import frame_of
from robot.messages import ObjectPose
from robot.photographs import Photograph

SCENARIO = resolve().scenario
NAMES = [t.name for t in (*SCENARIO.buttons, *SCENARIO.boxes, *SCENARIO.cylinders)]
FRAME = frame_of(np.zeros((2, 2, 3), np.uint8), camera="c", sequence=0, stamp_ns=0, arrival_ns=0)


def thing(name, place):
    return ThingSeen(
        name=name, position_m=place, stance=Stance.FIXED, axis_rad=None, confidence=1.0, visible=1.0
    )  # fmt: skip


def photograph():
    objects = [ObjectPose(name=n, position_m=(0.1 * i, 0.0, 0.0), quat=(1.0, 0, 0, 0)) for i, n in enumerate(NAMES)]
    place = {b.name: objects[3 + i].position_m for i, b in enumerate(SCENARIO.boxes)}
    objects[6] = ObjectPose(name=NAMES[6], position_m=place["red_box"], quat=(1.0, 0, 0, 0))
    return Photograph(
        frame=FRAME, level="clean", objects=tuple(objects), lamps_on=("orange_button",),
        lids_open=("blue_box",), q_rad=None, opening_m=0.085,
    )  # fmt: skip


def test_a_picture_is_scored_by_what_was_placed_told_and_could_be_seen():
    shot = photograph()
    places = [o.position_m for o in shot.objects]
    seen = [thing(n, p) for n, p in zip(NAMES, places, strict=True)]
    seen[0] = thing(NAMES[0], (0.003, 0.004, 9.0))
    seen[1] = thing(NAMES[1], (0.1, 0.011, 0.0))
    seen[6] = thing(NAMES[6], None)
    states = (LampState.ON, LampState.ON, LampState.UNKNOWN)
    lids = (LidState.SHUT, LidState.OPEN, LidState.UNKNOWN)
    found = Detections(
        stamp_ns=0, things=tuple(seen),
        lamps=tuple(LampSeen(name=b.name, state=s, score=0.5) for b, s in zip(SCENARIO.buttons, states, strict=True)),
        lids=tuple(LidSeen(name=b.name, state=s, confidence=1) for b, s in zip(SCENARIO.boxes, lids, strict=True)),
    )  # fmt: skip
    came = score(shot, found, SCENARIO, None)
    assert came.errors_m == pytest.approx([0.005, 0.011, 0, 0, 0, 0, 0])
    assert (came.n_false, came.n_things, came.n_seeable) == (1, 8, 7)
    assert came.lamps == (1, 0, 1, 0, 1)
    assert came.lids == (1, 1, 1)
    assert total([came, came]).lamps == (2, 0, 2, 0, 2)
    with pytest.raises(ValueError, match="in its order"):
        score(shot, Detections(stamp_ns=0, things=(), lamps=(), lids=()), SCENARIO, None)


def test_f1_and_bounds_are_as_worked_by_hand():
    assert f1_of((8, 1, 1, 5, 0)) == pytest.approx(16 / 18)
    assert math.isnan(f1_of((0, 0, 0, 5, 0)))
    assert upper_bound(0, 100) == pytest.approx(0.02951, abs=1e-5)
    assert upper_bound(0, 0) == 1.0
    assert 0.05 < upper_bound(5, 100) < 0.12


def test_rows_miss_their_goals_where_nothing_was_seen_and_meet_them_at_the_limit():
    blind = dict.fromkeys(("clean", "mild"), Score())
    assert [r.name for r in overall_results(blind) if r.ok] == ["false_known_share"]
    limit = Score(errors_m=(0.002, 0.002), distance_errors_m=(0.003,), n_seeable=2, n_things=2, lamps=(1, 0, 0, 1, 0))
    assert all(r.ok for r in overall_results({"clean": limit, "mild": limit}))
    beyond = Score(errors_m=(math.nextafter(0.002, 1.0),), distance_errors_m=(0.0031,), n_things=1, n_false=1)
    assert not any(r.ok for r in overall_results({"clean": beyond, "mild": beyond}) if r.name != "position_p95_mm")
    assert {r.name for r in level_results("mild", limit)} >= {"position_mean_mm_mild", "lamp_errors_mild"}


def test_a_printed_boards_end_corners_are_where_its_sheet_has_them():
    sheet = printed(Board())
    assert [n for n, _, _ in sheet.corners] == [0, 5, 18, 23]
    assert sheet.corners[3][1:] == pytest.approx((0.02 + 6 * 0.036, 0.02 + 4 * 0.036))
    assert len(sheet.pixels) == sheet.width_px * sheet.height_px
