"""Where a camera stands, found again from touched boards and from a carried one; checked by points outside the fit."""

import msgspec
import numpy as np
import pytest

from perception.calibration.board import Board, corner_points
from perception.calibration.evidence import Placement, Poses, ToolPose, Touch, Touches
from perception.calibration.extrinsics import fit_carried, fit_table
from perception.calibration.faults import Reason
from perception.calibration.hand_eye import solve_hand_eye
from perception.calibration.lens import intersect_height, project, rays
from perception.calibration.plane_error import grid_on_table
from perception.calibration.poses import carried, inverse, matrix_of, rotation_vector
from perception.calibration.verify import verify
from perception.errors import CalibrationRefusedError, PerceptionConfigError
from tests.support.boards import BOARD, LENS, known_camera, projected, turned

DATE = "2026-05-31"
AREA = grid_on_table((0.24, -0.36), (0.64, 0.36), 0.0)
CORNERS = (0, 5, 18, 23)
CAMERA = known_camera()


def looking(eye, target):
    """T_bc of a camera at a place, its rows level."""
    ahead = np.subtract(target, eye) / np.linalg.norm(np.subtract(target, eye))
    right = np.cross(ahead, (0, 0, 1))
    right /= np.linalg.norm(right)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = np.column_stack([right, np.cross(ahead, right), ahead]), eye
    return T


T_BC = looking(
    (0.44, -0.86, 0.5), (0.44, 0.0, 0.0)
)  # 30 degrees above the table, 1 m from its middle: 60 from overhead


def lying(x, y, turn):
    """T_bo of a board on the table, its z down into it."""
    return turned((0, 0, turn), (x, y, 0.0)) @ turned((np.pi, 0, 0), (0, 0, 0))


BOARDS = (lying(0.3, 0.15, 0.1), lying(0.4, -0.02, -0.4), lying(0.28, -0.1, 0.3))
CHECKED = (lying(0.33, 0.3, -0.2), lying(0.5, 0.08, 0.6))


def touched(boards, *, touch_mm=0.0, rng=None, stretch=1.0, corners=CORNERS, board=BOARD):
    placements = []
    for i, T_bo in enumerate(boards):
        places = carried(T_bo, corner_points(board)[list(corners)] * stretch)
        if touch_mm:
            places = places + rng.normal(0, touch_mm / 1e3, places.shape)
        touches = tuple(Touch(corner=c, position_m=tuple(p)) for c, p in zip(corners, places.tolist(), strict=True))
        placements.append(Placement(images=(f"{i}.png",), touches=touches))
    return Touches(placements=tuple(placements))


def seen(boards, *, noise_px=0.3, rng=None, T_bc=T_BC, stretch=1.0, board=BOARD):
    return [
        projected(
            LENS,
            inverse(T_bc) @ T,
            noise_px=noise_px,
            rng=rng or np.random.default_rng(0),
            image=f"{i}.png",
            stretch=stretch,
            board=board,
        )
        for i, T in enumerate(boards)
    ]


def plane_errors_mm(record, *, T_bc=T_BC, area=AREA):
    """What points of the table are off by, seen through the true camera and placed by the found one."""
    pixels = project(LENS, carried(inverse(T_bc), area))
    inside = (pixels >= 0).all(axis=1) & (pixels <= (1279, 719)).all(axis=1)
    found = intersect_height(matrix_of(record.pose), rays(LENS, pixels[inside]), 0.0)
    return 1e3 * np.linalg.norm(found - area[inside], axis=1)


def reasons_of(call):
    with pytest.raises(CalibrationRefusedError) as error:
        call()
    return {reason for reason in Reason if f"\n  {reason}:" in str(error.value)}


def test_without_noise_a_pose_is_found_exactly():
    record = fit_table(CAMERA, touched(BOARDS), seen(BOARDS, noise_px=0), AREA, date=DATE)
    assert matrix_of(record.pose) == pytest.approx(T_BC, abs=1e-8)
    assert record.touch_rms_mm == pytest.approx(0.0, abs=1e-6)


def test_one_board_with_03_px_of_noise_stays_within_the_error_budget():
    """The budget's own table: 7 × 5 squares of 40 mm, 1 m away, 60 degrees oblique, 0.6 × 0.4 m: 0.66 and 1.4 mm."""
    board = Board(square_m=0.04, marker_m=0.03)
    camera = msgspec.structs.replace(CAMERA, board=board)
    T_bc = looking((0.44, -np.cos(np.pi / 3), np.sin(np.pi / 3)), (0.44, 0.0, 0.0))
    T_bo = lying(0.30, 0.10, 0.0)
    area = grid_on_table((0.14, -0.2), (0.74, 0.2), 0.0)
    touches, errors, expected = touched([T_bo], board=board), [], []
    for seed in range(8):
        views = seen([T_bo], rng=np.random.default_rng(seed), T_bc=T_bc, board=board)
        record = fit_table(camera, touches, views, area, date=DATE)
        errors.append(plane_errors_mm(record, T_bc=T_bc, area=area))
        expected.append(record.expected_mm)
    errors = np.concatenate(errors)
    assert errors.mean() < 0.66
    assert np.percentile(errors, 95) < 1.4
    assert np.mean(expected) == pytest.approx(np.sqrt((errors**2).mean()), rel=0.3)


def test_three_boards_touched_with_half_a_millimetre_of_error_are_good_to_a_millimetre():
    errors = []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        record = fit_table(CAMERA, touched(BOARDS, touch_mm=0.5, rng=rng), seen(BOARDS, rng=rng), AREA, date=DATE)
        errors.append(plane_errors_mm(record))
    assert np.mean(errors) < 1.0


def test_a_wrong_square_size_is_told_by_the_touches():
    for stretch in (0.97, 1.02):
        views = seen(BOARDS, rng=np.random.default_rng(0), stretch=stretch)
        call = lambda s=stretch, v=views: fit_table(CAMERA, touched(BOARDS, stretch=s), v, AREA, date=DATE)  # noqa: E731
        assert reasons_of(call) == {Reason.SQUARE_SIZE}


@pytest.mark.parametrize(
    ("corners", "reason"),
    [((0, 5, 18), Reason.TOUCHES), ((0, 1, 2, 3, 4, 5), Reason.TOUCHES), ((0, 5, 18, 24), Reason.TOUCHES)],
)
def test_touches_that_leave_a_board_loose_are_refused(corners, reason):
    touches = touched(BOARDS[:1], corners=[c for c in corners if c < 24])
    if 24 in corners:
        place = touches.placements[0]
        strange = msgspec.structs.replace(place, touches=(*place.touches, Touch(corner=24, position_m=(0.3, 0, 0))))
        touches = Touches(placements=(strange,))
    assert reasons_of(lambda: fit_table(CAMERA, touches, seen(BOARDS[:1], noise_px=0), AREA, date=DATE)) == {reason}


def test_a_corner_numbered_wrongly_is_refused():
    place = touched(BOARDS[:1], corners=(0, 5, 18, 23, 9)).placements[0]
    swapped = [msgspec.structs.replace(t, corner=10) if t.corner == 9 else t for t in place.touches]
    touches = Touches(placements=(msgspec.structs.replace(place, touches=tuple(swapped)),))
    found = reasons_of(lambda: fit_table(CAMERA, touches, seen(BOARDS[:1], noise_px=0), AREA, date=DATE))
    assert found & {Reason.TOUCHES, Reason.SQUARE_SIZE}


def test_a_board_moved_after_it_was_touched_is_refused():
    moved = (lying(0.31, 0.15, 0.1), *BOARDS[1:])
    views = seen(moved, rng=np.random.default_rng(0))
    assert Reason.RESIDUAL in reasons_of(lambda: fit_table(CAMERA, touched(BOARDS), views, AREA, date=DATE))


def test_pictures_of_another_size_or_without_a_sharp_board_are_refused():
    views = seen(BOARDS, noise_px=0)
    other = [msgspec.structs.replace(v, width_px=640) for v in views]
    soft = [msgspec.structs.replace(v, blur_px=2.0) for v in views]
    assert reasons_of(lambda: fit_table(CAMERA, touched(BOARDS), other, AREA, date=DATE)) == {Reason.SIZES}
    assert reasons_of(lambda: fit_table(CAMERA, touched(BOARDS), soft, AREA, date=DATE)) == {Reason.TOO_FEW}


# ------------------------------------------------------------------------------------------------- carried by the tool

T_TO = turned((0.05, -0.03, 1.1), (-0.12, -0.09, 0.03))


def hand_poses(n=12, seed=0, *, axes=(1.0, 1.0, 1.0)):
    """Tool poses that hold the board towards the camera, turned about the axes asked for."""
    rng = np.random.default_rng(seed)
    poses = []
    for _ in range(n):
        turn = turned(rng.uniform(-0.5, 0.5, 3) * axes, (0, 0, 0))
        middle = np.eye(4)
        middle[:3, 3] = np.array([3.5, 2.5, 0]) * BOARD.square_m
        T_co = turned((0, 0, 0), rng.uniform((-0.15, -0.08, 0.55), (0.15, 0.08, 0.85))) @ turn @ inverse(middle)
        poses.append(T_BC @ T_co @ inverse(T_TO))
    return poses


def views_of(T_bt, *, noise_px=0.3, arm_mm=0.0, stretch=1.0, seed=0):
    rng = np.random.default_rng(seed)
    sightings = [
        projected(
            LENS,
            inverse(T_BC) @ T @ T_TO,
            noise_px=noise_px,
            rng=rng or np.random.default_rng(0),
            image=f"{i}.png",
            stretch=stretch,
        )
        for i, T in enumerate(T_bt)
    ]
    views = tuple(
        ToolPose(
            image=f"{i}.png",
            position_m=tuple((T[:3, 3] + rng.normal(0, arm_mm / 1e3, 3)).tolist()),
            rotation_vector_rad=tuple(rotation_vector(T[:3, :3]).tolist()),
        )
        for i, T in enumerate(T_bt)
    )
    return Poses(views=views), sightings


def test_the_closed_form_finds_camera_board_and_scale_exactly():
    T_bt = hand_poses(5)
    found = solve_hand_eye(T_bt, [inverse(T_BC) @ T @ T_TO for T in T_bt])
    assert found.T_bc == pytest.approx(T_BC, abs=1e-9)
    assert found.T_to == pytest.approx(T_TO, abs=1e-9)
    assert found.scale == pytest.approx(1.0, abs=1e-9)


def test_a_carried_board_brings_the_table_to_a_millimetre_and_a_half():
    errors = []
    for seed in range(2):
        poses, sightings = views_of(hand_poses(16, seed), arm_mm=0.3, seed=seed)
        errors.append(plane_errors_mm(fit_carried(CAMERA, poses, sightings, AREA, date=DATE)))
    assert np.mean(errors) < 1.5


def test_a_carried_board_of_another_size_is_told_by_the_arms_own_lengths():
    poses, sightings = views_of(hand_poses(14), stretch=0.97)
    assert reasons_of(lambda: fit_carried(CAMERA, poses, sightings, AREA, date=DATE)) == {Reason.SQUARE_SIZE}


def test_too_few_views_in_the_hand_and_turns_about_one_axis_are_refused():
    few = views_of(hand_poses(7))
    single = views_of(hand_poses(14, axes=(1.0, 0.0, 0.0)))
    assert reasons_of(lambda: fit_carried(CAMERA, *few, AREA, date=DATE)) == {Reason.TOO_FEW}
    assert reasons_of(lambda: fit_carried(CAMERA, *single, AREA, date=DATE)) == {Reason.MOTION}


# ------------------------------------------------------------------------------------------------------ the touch test


def placed(T_bc=T_BC):
    record = fit_table(CAMERA, touched(BOARDS), seen(BOARDS, noise_px=0), AREA, date=DATE)
    return msgspec.structs.replace(CAMERA, extrinsics=record)


def test_a_camera_that_stayed_is_verified_to_its_noise_and_one_that_was_bumped_by_two_centimetres_is_not():
    camera, touches = placed(), touched(CHECKED)
    stayed = verify(camera, touches, seen(CHECKED, noise_px=0), date=DATE)
    assert (stayed.n_points, stayed.max_mm) == (8, pytest.approx(0.0, abs=1e-4))
    bumped = T_BC.copy()
    bumped[0, 3] += 0.02
    found = verify(camera, touches, seen(CHECKED, noise_px=0, T_bc=bumped), date=DATE)
    assert found.mean_mm == pytest.approx(20.0, abs=3.0)


def test_points_of_the_fit_prove_nothing_and_are_refused():
    camera = placed()
    assert reasons_of(lambda: verify(camera, touched(BOARDS), seen(BOARDS), date=DATE)) == {Reason.IN_THE_FIT}


def test_a_touch_test_needs_points_and_a_pose():
    camera = placed()
    few = touched(CHECKED[:1], corners=(0, 5, 18))
    assert reasons_of(lambda: verify(camera, few, seen(CHECKED, noise_px=0), date=DATE)) == {Reason.TOO_FEW}
    with pytest.raises(PerceptionConfigError, match="run `calibrate extrinsics`"):
        verify(CAMERA, touched(CHECKED), seen(CHECKED, noise_px=0), date=DATE)
