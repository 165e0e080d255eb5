"""The parts of detection by themselves: colours, light, bodies that hide, silhouettes, lamps, the arm's outline."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from config.loader import resolve
from perception.detection.arm_outline import arm_outlines, arm_parts
from perception.detection.colour_file import LampModel
from perception.detection.colours import features, lab
from perception.detection.eye import Eye
from perception.detection.lamps import OFF_BELOW, ON_ABOVE, Debounce, lamp_score, lamp_state
from perception.detection.light import table_light
from perception.detection.matching import best_place
from perception.detection.seen import LampState
from perception.detection.shapes import cap_points, hull, stamp
from perception.detection.silhouette import Hidden, fit_silhouette
from perception.detection.solids import box_edges, box_solids, hides
from robot.description import forward_kinematics
from tests.support.painted_table import CAMERA, SCENARIO, seen_at

EYE = Eye(CAMERA)
BOX, BUTTON = SCENARIO.boxes[0], SCENARIO.buttons[0]
LAMP = LampModel(name="lamp", off=(60.0, 5.0, -66.0), on=(90.0, -2.0, -11.0))
channel = st.floats(0.15, 1.0)


def test_lab_of_white_and_of_the_three_primaries_is_as_the_standard_has_it():
    found = lab(np.array([[1.0, 1, 1], [1, 0, 0], [0, 1, 0], [0, 0, 1]]))
    standard = [[100, 0, 0], [53.24, 80.09, 67.20], [87.74, -86.18, 83.18], [32.30, 79.19, -107.86]]
    assert found == pytest.approx(np.array(standard), abs=0.05)


@given(channel, channel, channel, st.floats(0.3, 1.0))
def test_a_shadow_changes_lightness_and_leaves_the_two_chromas(r, g, b, share):
    bright, dim = features(np.array([[r, g, b], [share * r, share * g, share * b]]))
    assert dim[1:] == pytest.approx(bright[1:], abs=1e-6)
    assert dim[0] <= bright[0]


def test_the_tables_light_is_the_lit_parts_and_not_the_shadows_or_the_things():
    picture = np.full((60, 60, 3), (200, 180, 160), np.uint8)
    picture[:20] = (100, 90, 80)
    picture[40:] = (20, 40, 200)
    big = np.repeat(np.repeat(picture, 6, axis=0), 6, axis=1)
    assert table_light(big, np.ones((60, 60), bool)) == pytest.approx([200, 180, 160])
    assert table_light(np.zeros_like(big), np.ones((60, 60), bool)) is None
    assert table_light(np.full_like(big, 255), np.ones((60, 60), bool)) is None


def test_an_eye_sees_where_opencv_projects_and_back_on_the_plane():
    points = np.array([[0.3, -0.2, 0.05], [0.6, 0.3, 0.05]])
    assert EYE.pixels(points) == pytest.approx(seen_at(points), abs=1e-6)
    assert EYE.on_plane(seen_at(points), 0.05) == pytest.approx(points, abs=1e-8)


def test_a_wall_hides_what_is_behind_it_and_not_what_is_before_it_or_on_it():
    wall = box_solids(BOX, lid_rad=None)[0]  # the one that looks away from the robot, towards this eye
    eye = np.array([1.0, 0.0, 0.05])
    x = wall.centre_m[0]
    points = np.array([[x - 0.1, 0, 0.03], [x + 0.1, 0, 0.03], [x + wall.half_m[0], 0, 0.03], [x - 0.1, 0, 0.3]])
    assert hides(wall, eye, points).tolist() == [True, False, False, False]


def test_a_shut_box_shows_no_edge_inside_it_and_an_open_one_does():
    eye = EYE.position_m - np.array([*BOX.position_m, 0.0])
    shut, opened = (box_edges(BOX, lid_rad=a, eye_m=eye).points_m for a in (0.0, BOX.lid.open_angle_rad))
    half = np.array(BOX.inner_m) / 2 - 0.002
    assert not ((np.abs(shut[:, :2]) < half).all(axis=1) & (shut[:, 2] < BOX.height_m - 0.001)).any()
    assert (opened[:, 2] > BOX.height_m + 0.05).any()


@given(st.floats(-0.02, 0.02), st.floats(-0.02, 0.02), st.floats(0.0, 0.5))
def test_a_caps_place_is_found_from_its_silhouette_even_with_a_known_part_of_it_hidden(dx, dy, covered):
    body, start = cap_points(BUTTON), np.array([*BUTTON.position_m, 0.0])
    truth = start + np.array([dx, dy, 0.0])
    outline = hull(EYE.pixels(truth + body))
    low, high = np.floor(outline.min(axis=0)) - 60, np.ceil(outline.max(axis=0)) + 60
    width, height = (high - low).astype(int)
    fine = np.zeros((8 * height, 8 * width), np.uint8)
    stamp(fine, (outline - low + 0.5) * 8 - 0.5, np.zeros(2), 1)
    seen = (cv2.resize(255 * fine, (width, height), interpolation=cv2.INTER_AREA) > 127).astype(np.uint8)
    (left, top), (right, bottom) = outline.min(axis=0) - 5, outline.max(axis=0) + 5
    edge = left + covered * (right - left)
    cover = np.array([[left, top], [edge, top], [edge, bottom], [left, bottom]])
    stamp(seen, cover, low, 0)
    fit = fit_silhouette(EYE, body, start, seen, low, Hidden([cover]))
    assert fit is not None
    assert np.subtract(fit.position_m, truth[:2]) == pytest.approx([0, 0], abs=1.2e-3)  # a pixel
    assert fit.overlap > 0.9
    assert fit.visible == pytest.approx(1.0 - covered, abs=0.15)


def test_where_nothing_of_a_body_is_left_there_is_no_fit():
    seen, start = np.zeros((200, 200), np.uint8), np.array([*BUTTON.position_m, 0.0])
    assert fit_silhouette(EYE, cap_points(BUTTON), start, seen, np.array([400.0, 200.0]), Hidden([])) is None


def test_the_best_place_is_the_one_whose_edges_lie_on_the_slopes():
    grey = np.zeros((60, 60), np.float32)
    grey[:, 33], grey[:, 34:] = 0.5, 1.0
    edges = np.array([[30.0, v, 1.0, 0.0, 1000.0, 0.0, 0.0, 1000.0] for v in range(20, 40)])
    i, _, peak, before, after, _, _ = best_place(grey, edges, 0.001, 6)
    assert i == 3.0
    assert before == after == pytest.approx(0.25 / 0.28)
    assert peak == pytest.approx(0.5 / 0.53)


@pytest.mark.parametrize(
    ("score", "state"),
    [
        (None, LampState.UNKNOWN),
        (OFF_BELOW, LampState.OFF),
        (np.nextafter(OFF_BELOW, 1.0), LampState.UNKNOWN),
        (np.nextafter(ON_ABOVE, 0.0), LampState.UNKNOWN),
        (ON_ABOVE, LampState.ON),
    ],
)
def test_between_the_two_thresholds_a_lamp_is_neither(score, state):
    assert lamp_state(score) is state


def test_a_reading_scores_0_as_with_the_lamp_off_1_as_with_it_on_and_nothing_where_it_is_like_neither():
    off, on = np.array(LAMP.off), np.array(LAMP.on)
    assert [lamp_score(LAMP, r) for r in (off, on, (off + on) / 2)] == pytest.approx([0.0, 1.0, 0.5])
    assert lamp_score(LAMP, np.array([60.0, 60.0, 30.0])) is None
    assert lamp_score(LAMP, np.array([np.nan, 0.0, 0.0])) is None
    assert lamp_score(LampModel(name="dead", off=LAMP.off, on=LAMP.off), off) is None


def test_a_lamp_changes_after_three_alike_and_a_single_picture_changes_nothing():
    on, off, unknown = LampState.ON, LampState.OFF, LampState.UNKNOWN
    lamp = Debounce()
    assert [lamp.note(s) for s in (on, on, on)] == [unknown, unknown, on]
    assert [lamp.note(s) for s in (off, off, on, off, off)] == [on] * 5
    assert [lamp.note(s) for s in (unknown, off)] == [on, off]


def test_the_arms_outline_holds_its_hand_and_follows_its_joints():
    arm = resolve().arm
    for q_rad in (arm.home_rad, (2.4, -1.6, 1.9, -1.8, -1.57, -1.9)):
        parts = arm_parts(arm, q_rad, 0.085)
        T = forward_kinematics(arm, q_rad, frame="flange")
        assert len(parts) == len(arm.capsules) + 3
        tip = T @ [0.0, 0.0425, arm.tool.tcp_m[2] + arm.tool.tip_below_tcp_m, 1.0]
        assert min(np.abs(parts[-1] - tip[:3]).max(axis=1).min(), np.abs(parts[-2] - tip[:3]).max(axis=1).min()) < 0.02
        pixel = EYE.pixels((T @ [0.0, 0.0, 0.03, 1.0])[None, :3])[0]
        mask = np.zeros((720, 1280), np.uint8)
        for outline in arm_outlines(arm, q_rad, 0.085, EYE):
            stamp(mask, outline, np.zeros(2), 1)
        assert mask[int(pixel[1]), int(pixel[0])] == 1
        assert mask.mean() < 0.4
