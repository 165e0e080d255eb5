"""A lens found from projected boards with noise; and each bad set refused for what is wrong with it."""

import msgspec
import numpy as np
import pytest

from perception.calibration.board_pdf import BAR_MM
from perception.calibration.faults import Reason, refuse
from perception.calibration.gates import (
    BAR_TOLERANCE,
    LEAST_VIEWS,
    MOST_BLUR_PX,
    MOST_RMS_PX,
    MOST_SD_SHARE,
    check_bar,
    check_fit,
    check_views,
)
from perception.calibration.intrinsics import fit_lens
from perception.calibration.lens import project
from perception.calibration.sighting import Finder
from perception.errors import CalibrationRefusedError
from tests.support.boards import BOARD, LENS, LESSER_LENS, good_views, photograph, projected, shown_at

DATE = "2026-05-31"


def seen_from(poses, *, noise_px=0.2, seed=0, lens=LENS, **more):
    rng = np.random.default_rng(seed)
    return [projected(lens, T, noise_px=noise_px, rng=rng, image=f"{i:02}", **more) for i, T in enumerate(poses)]


def reasons_of(sightings):
    with pytest.raises(CalibrationRefusedError) as error:
        fit_lens(BOARD, sightings, date=DATE)
    text = str(error.value)
    assert "nothing was written" in text
    return {reason for reason in Reason if f"\n  {reason}:" in text}


@pytest.mark.parametrize("seed", [3, 4, 5])
def test_a_lens_is_found_again_within_a_third_of_a_percent(seed):
    lens, record = fit_lens(BOARD, seen_from(good_views(LENS, 16, seed), seed=seed), date=DATE)
    assert (lens.fx_px, lens.fy_px) == pytest.approx((LENS.fx_px, LENS.fy_px), rel=0.003)
    assert (lens.cx_px, lens.cy_px) == pytest.approx((LENS.cx_px, LENS.cy_px), abs=4.0)
    assert record.rms_px == pytest.approx(0.2 * np.sqrt(2), rel=0.2)
    assert abs(lens.fx_px - LENS.fx_px) < 4 * record.focal_sd_px
    across = np.array([[x, y, 1.0] for x in np.linspace(-0.6, 0.6, 9) for y in np.linspace(-0.33, 0.33, 7)])
    apart = np.linalg.norm(project(lens, across) - project(LENS, across), axis=1)
    # A shift of the centre looks like a turn of the camera, which its pose takes up: all but the mean counts.
    assert np.abs(apart - apart.mean()).max() < 2.0


def test_more_noise_is_told_as_a_greater_residual():
    _, record = fit_lens(BOARD, seen_from(good_views(LENS, 16, 3), noise_px=0.35), date=DATE)
    assert record.rms_px == pytest.approx(0.35 * np.sqrt(2), rel=0.2)


def test_too_few_views_are_refused_and_one_more_is_not():
    views = seen_from(good_views(LENS, LEAST_VIEWS, 3))
    assert check_views(BOARD, views) == []
    assert reasons_of(views[:-1]) == {Reason.TOO_FEW}


def test_views_that_are_all_alike_are_refused():
    pose = good_views(LENS, 16, 3)[5]
    assert reasons_of(seen_from([pose] * 16)) == {Reason.ALIKE}


def test_parallel_boards_are_refused():
    flat = [
        shown_at(BOARD, LENS, (x, y), depth, (0.3, 0.2), spin)
        for x in (250, 640, 1030) for y in (180, 360, 540) for depth, spin in ((0.35, 0.0), (0.5, 0.4))
    ]  # fmt: skip
    assert Reason.PLANAR in reasons_of(seen_from(flat))


def test_a_picture_with_bare_corners_is_refused_by_the_names_of_what_is_bare():
    middle = [
        shown_at(BOARD, LENS, (640 + 20 * i, 360), 0.55, (0.5 * np.cos(i), 0.5 * np.sin(i)), 0.3 * i) for i in range(14)
    ]
    views = seen_from(middle)
    assert reasons_of(views) == {Reason.COVERAGE}
    with pytest.raises(CalibrationRefusedError, match="fewer upper left, upper right"):
        fit_lens(BOARD, views, date=DATE)


def test_pictures_of_two_sizes_are_refused():
    views = seen_from(good_views(LENS, 12, 3))
    views[4] = msgspec.structs.replace(views[4], width_px=1920)
    assert reasons_of(views) == {Reason.SIZES}


def test_a_board_that_is_bent_or_moved_is_refused_by_the_worst_picture():
    views = seen_from(good_views(LENS, 16, 3))
    rng = np.random.default_rng(8)
    moved = tuple((x + rng.normal(0, 4), y + rng.normal(0, 4)) for x, y in views[6].pixels)
    views[6] = msgspec.structs.replace(views[6], pixels=moved)
    with pytest.raises(CalibrationRefusedError, match=r"residual: .*06"):
        fit_lens(BOARD, views, date=DATE)


@pytest.mark.parametrize(
    ("blur", "is_kept"), [(MOST_BLUR_PX, True), (np.nextafter(MOST_BLUR_PX, 9), False), (np.inf, False)]
)
def test_the_limit_of_blur_passes_and_the_next_float_does_not(blur, is_kept):
    views = seen_from(good_views(LENS, 12, 3), blur_px=blur)
    assert (check_views(BOARD, views) == []) is is_kept


@pytest.mark.parametrize(
    ("rms", "sd", "is_kept"),
    [
        (MOST_RMS_PX, MOST_SD_SHARE, True),
        (np.nextafter(MOST_RMS_PX, 9), 0.001, False),
        (0.2, np.nextafter(MOST_SD_SHARE, 9), False),
        (np.nan, 0.001, False),
        (0.2, np.nan, False),
    ],
)
def test_the_limits_of_a_fit_pass_and_the_next_float_does_not(rms, sd, is_kept):
    assert (check_fit(["a"], [rms], rms, sd) == []) is is_kept


@pytest.mark.parametrize(
    ("bar_mm", "is_kept"),
    [(100.0, True), (100.39, True), (99.61, True), (100.41, False), (99.59, False), (94.0, False), (np.nan, False)],
)
def test_a_bar_of_another_length_is_refused_with_the_size_that_was_printed(bar_mm, is_kept):
    assert BAR_TOLERANCE == 0.004
    faults = check_bar(BOARD, bar_mm, BAR_MM)
    assert (faults == []) is is_kept
    if bar_mm == 94.0:
        with pytest.raises(CalibrationRefusedError, match=r"square size: .*square_m: 0\.03384"):
            refuse(faults)


def test_blur_is_told_from_pixels_and_refused_where_no_marker_can_be_read_any_more():
    finder, rng = Finder(BOARD), np.random.default_rng(2)
    T_co = shown_at(BOARD, LESSER_LENS, (300, 240), 0.4, (0.3, -0.2))
    sharp, soft, smeared, lost = (
        finder.find(photograph(LESSER_LENS, T_co, noise=2.0, rng=rng, **how), "x")
        for how in ({"blur_px": 0.4}, {"blur_px": 1.2}, {"smear_px": 11}, {"blur_px": 4.0})
    )
    assert sharp.blur_px < 0.9
    assert soft.blur_px == pytest.approx(1.3, abs=0.25)
    assert MOST_BLUR_PX < smeared.blur_px < np.inf
    assert lost.corners == ()
    assert MOST_BLUR_PX < lost.blur_px < np.inf
    assert reasons_of([msgspec.structs.replace(lost, image=f"{i}") for i in range(12)]) == {Reason.BLURRED}


def test_corners_of_a_photographed_board_are_found_to_a_tenth_of_a_pixel():
    rng = np.random.default_rng(3)
    for T_co in (
        shown_at(BOARD, LESSER_LENS, (300, 240), 0.4, (0.5, -0.3)),
        shown_at(BOARD, LESSER_LENS, (380, 200), 0.6, (-0.4, 0.4), 1.0),
    ):
        seen = Finder(BOARD).find(photograph(LESSER_LENS, T_co, blur_px=0.5, noise=2.0, rng=rng), "x")
        truth = projected(LESSER_LENS, T_co)
        place = dict(zip(truth.corners, truth.pixels, strict=True))
        apart = np.array([np.subtract(p, place[c]) for c, p in zip(seen.corners, seen.pixels, strict=True)])
        assert len(apart) >= 20
        assert np.sqrt((apart**2).sum(axis=1).mean()) < 0.1
        assert np.abs(apart.mean(axis=0)).max() < 0.03  # a half of a pixel is what conventions differ by
