"""The twin's camera: its own lens, frames that come late and in order, and boards that calibrate it by pixels alone."""

import os
import subprocess
import sys

import cv2
import mujoco
import numpy as np
import pytest

from config.loader import resolve
from perception.calibration.board import board_picture
from perception.calibration.intrinsics import fit_lens
from perception.calibration.sighting import Finder
from robot.errors import WireError
from robot.frames import CameraSpec, picture_of
from sim_twin.board_stage import Sheet, board_stage
from sim_twin.lens import TrueLens, directions, half_angles, source_map
from sim_twin.plant import TwinPlant
from sim_twin.render import NoGLError
from sim_twin.rendered_camera import Optics, RenderedCamera, develop
from tests.support.boards import BOARD, LESSER_LENS, MARGIN_M, good_views, matrices, projected

TRUE = TrueLens(
    width_px=640, height_px=480, focal_px=(560.0, 562.0), centre_px=(322.1, 236.7),
    radial=(-0.09, 0.03), tangential=(0.0006, 0.0009),
)  # fmt: skip
SPEC = CameraSpec(name="side", serial="7", width_px=640, height_px=480, rate_hz=30.0)
MS = 1_000_000
GL = os.environ.get("MUJOCO_GL")
"""As it was when MuJoCo was imported: a test of a command that draws may set it later, which changes nothing then."""


def sheet_at(T_co, T_bc):
    picture = board_picture(BOARD, px_per_m=4000.0, margin_m=MARGIN_M)
    size = (BOARD.n_columns * BOARD.square_m + 2 * MARGIN_M, BOARD.n_rows * BOARD.square_m + 2 * MARGIN_M)
    corner = np.eye(4)
    corner[:3, 3] = (-MARGIN_M, -MARGIN_M, 0)
    return Sheet(picture=picture, size_m=size, T_bs=T_bc @ T_co @ corner)


def camera_on(sheets, T_bc, **optics):
    if GL not in ("egl", "osmesa"):
        pytest.skip(
            "needs MUJOCO_GL=egl or osmesa before MuJoCo is imported; the test below sets it for a process of its own"
        )
    model = board_stage(sheets)
    made = RenderedCamera(
        model=model, data=mujoco.MjData(model), spec=SPEC, lens=TRUE, T_bc=T_bc, optics=Optics(**optics),
        rng=np.random.default_rng(5),
    )  # fmt: skip
    try:
        made.connect()
    except NoGLError as error:
        pytest.skip(str(error))
    return made


def downward():
    """T_bc of a camera 1.5 m over the table that looks straight down."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = np.column_stack([(0, -1, 0), (-1, 0, 0), (0, 0, -1)]), (0.4, 0.0, 1.5)
    return T


def test_the_twins_lens_bends_light_as_opencvs_model_does():
    matrix, bent = matrices(LESSER_LENS)
    tangents = directions(TRUE)
    sample = tangents[::40, ::40].reshape(-1, 2)
    back = cv2.projectPoints(np.column_stack([sample, np.ones(len(sample))]), np.zeros(3), np.zeros(3), matrix, bent)[
        0
    ].reshape(-1, 2)
    u, v = np.meshgrid(np.arange(0, 640, 40), np.arange(0, 480, 40))
    assert back == pytest.approx(np.column_stack([u.ravel(), v.ravel()]), abs=1e-5)


def test_every_pixel_takes_its_light_from_inside_the_straight_picture():
    tangents = directions(TRUE)
    places = source_map(tangents, half_angles(tangents), (1280, 960))
    assert places.min() >= 0.0
    assert places[..., 0].max() <= 1279
    assert places[..., 1].max() <= 959


def test_a_lens_that_folds_is_refused():
    with pytest.raises(ValueError, match="fold"):
        directions(TrueLens(width_px=640, height_px=480, focal_px=(200, 200), centre_px=(320, 240), radial=(-0.9, 0.0)))


def test_noise_exposure_and_blur_are_as_strong_as_asked_and_the_same_for_a_seed():
    light = np.full((200, 200, 3), 100.0)
    noisy = develop(light, Optics(exposure=1.2, read_noise=2.0, shot_noise=0.05), np.random.default_rng(1))
    again = develop(light, Optics(exposure=1.2, read_noise=2.0, shot_noise=0.05), np.random.default_rng(1))
    assert (noisy == again).all()
    assert noisy.mean() == pytest.approx(120.0, abs=0.2)
    assert noisy.std() == pytest.approx(np.sqrt(4.0 + 6.0), rel=0.05)
    assert develop(light, Optics(exposure=3.0), np.random.default_rng(1)).min() == 255
    point = np.zeros((41, 41, 3))
    point[20, 20] = 4.0e3
    spot = develop(point, Optics(defocus_px=2.0), np.random.default_rng(1))[..., 0].astype(float)
    assert np.sqrt((spot.sum(axis=0) * (np.arange(41) - 20) ** 2).sum() / spot.sum()) == pytest.approx(2.0, rel=0.05)


@pytest.mark.gl
def test_a_frame_is_drawn_at_its_exposure_and_given_when_it_has_arrived():
    camera = camera_on([], downward(), latency_s=0.05, sharpness=1.0)
    taken = [(t, camera.read(t * MS)) for t in range(0, 130, 10)]
    got = [(t, f.sequence, f.stamp_ns // MS, f.arrival_ns // MS) for t, f in taken if f is not None]
    assert got == [(50, 0, 0, 50), (90, 1, 40, 90), (120, 2, 70, 120)]
    camera.close()
    camera.close()
    with pytest.raises(WireError, match="not connected"):
        camera.read(0)


@pytest.mark.gl
def test_a_rendered_board_is_seen_where_the_lens_puts_it_and_no_half_pixel_aside():
    T_bc = downward()
    T_co = good_views(LESSER_LENS, 16, 1)[5]
    camera = camera_on([sheet_at(T_co, T_bc)], T_bc, read_noise=1.0)
    frame = camera.read(0)
    again = camera_on([sheet_at(T_co, T_bc)], T_bc, read_noise=1.0).read(0)
    assert frame == again
    seen = Finder(BOARD).find(picture_of(frame), "0")
    truth = projected(LESSER_LENS, T_co)
    place = dict(zip(truth.corners, truth.pixels, strict=True))
    apart = np.array([np.subtract(p, place[c]) for c, p in zip(seen.corners, seen.pixels, strict=True)])
    assert len(apart) == 24
    assert np.abs(apart.mean(axis=0)).max() < 0.05
    assert np.sqrt((apart**2).sum(axis=1).mean()) < 0.15


@pytest.mark.gl
def test_a_table_that_was_laid_out_anew_is_drawn_where_things_are_now():
    if GL not in ("egl", "osmesa"):
        pytest.skip("needs MUJOCO_GL=egl or osmesa before MuJoCo is imported")
    resolved = resolve()
    plant = TwinPlant(arm=resolved.arm, scenario=resolved.scenario, rig=resolved.rig)

    def camera():
        made = RenderedCamera(
            model=plant.world.model, data=plant.world.data, spec=SPEC, lens=TRUE, T_bc=downward(),
            optics=Optics(sharpness=1.0), rng=np.random.default_rng(5),
        )  # fmt: skip
        made.connect()
        return made

    plant.resetter.reset(seed=1, epoch=0, digital_out=0)
    early = camera()
    before = early.read(0).pixels
    plant.resetter.reset(seed=2, epoch=0, digital_out=0)
    assert early.read(40 * MS).pixels == camera().read(40 * MS).pixels != before


@pytest.mark.gl
@pytest.mark.slow
def test_a_lens_is_calibrated_from_rendered_boards_alone():
    T_bc = downward()
    seen = []
    for i, T_co in enumerate(good_views(LESSER_LENS, 20, 7)):
        camera = camera_on([sheet_at(T_co, T_bc)], T_bc, read_noise=1.5, defocus_px=0.4)
        seen.append(Finder(BOARD).find(picture_of(camera.read(0)), f"{i:02}"))
        camera.close()
    lens, record = fit_lens(BOARD, seen, date="2026-05-31")
    print(lens, record.rms_px, record.focal_sd_px)  # noqa: T201
    assert (lens.fx_px, lens.fy_px) == pytest.approx(TRUE.focal_px, rel=0.004)
    assert (lens.cx_px, lens.cy_px) == pytest.approx(TRUE.centre_px, abs=3.0)
    assert record.rms_px < 0.3


@pytest.mark.slow
def test_what_renders_passes_in_a_process_that_may_draw():
    if GL:
        pytest.skip("this is such a process")
    command = [sys.executable, "-m", "pytest", "-q", "-rs", "-p", "no:cacheprovider", "-m", "gl", __file__]
    done = subprocess.run(
        command, env={**os.environ, "MUJOCO_GL": "egl"}, capture_output=True, text=True, timeout=500, check=False
    )
    if "expected an off-screen GL" in done.stdout:
        pytest.skip("no off-screen GL here")
    assert done.returncode == 0, done.stdout
    assert "4 passed" in done.stdout
