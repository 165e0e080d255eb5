"""`autotelic calibrate` from pictures to a camera that is checked, and what it refuses on the way."""

import cv2
import msgspec
import numpy as np
import pytest
from typer.testing import CliRunner

from config.yaml_text import dump_yaml
from perception.calibration.board import corner_points
from perception.calibration.camera_file import load_camera, save
from perception.calibration.poses import carried, inverse
from robot.cli import app
from tests.perception.calibration.test_extrinsics import CORNERS, looking, lying
from tests.support.boards import BOARD, LESSER_LENS, known_camera, photograph

T_BC = looking((0.44, -0.3, 0.52), (0.44, 0.0, 0.0))


def call(*words):
    return CliRunner().invoke(app, ["calibrate", *map(str, words)])


def write_lying(folder, boards, rng, T_bc=T_BC):
    folder.mkdir()
    placements = []
    for i, T_bo in enumerate(boards):
        picture = photograph(LESSER_LENS, inverse(T_bc) @ T_bo, blur_px=0.5, noise=2.0, rng=rng)
        cv2.imwrite(str(folder / f"{i}.png"), picture[..., ::-1])
        places = carried(T_bo, corner_points(BOARD)[list(CORNERS)]) + rng.normal(0, 0.0003, (4, 3))
        touches = [{"corner": c, "position_m": p} for c, p in zip(CORNERS, places.tolist(), strict=True)]
        placements.append({"images": [f"{i}.png"], "touches": touches})
    (folder / "touches.yaml").write_text(dump_yaml({"placements": placements}))


@pytest.fixture
def shop(tmp_path):
    save(tmp_path / "board.yaml", BOARD)
    save(tmp_path / "side.yaml", known_camera(LESSER_LENS))
    return tmp_path


@pytest.mark.slow
def test_a_camera_is_placed_from_pictures_and_checked_where_no_board_lay(shop):
    rng = np.random.default_rng(4)
    write_lying(shop / "place", [lying(0.33, 0.1, 0.1), lying(0.26, 0.02, -0.2)], rng)
    write_lying(shop / "check", [lying(0.42, 0.05, 0.5)], rng)
    write_lying(shop / "bumped", [lying(0.42, 0.05, 0.5)], rng, looking((0.46, -0.3, 0.52), (0.46, 0.0, 0.0)))
    camera = shop / "side.yaml"
    placed = call("extrinsics", shop / "place", "--camera", camera)
    assert placed.exit_code == 0, placed.output
    assert load_camera(camera).extrinsics.pose.position_m == pytest.approx(T_BC[:3, 3], abs=0.005)
    checked = call("verify", shop / "check", "--camera", camera, "--json")
    assert checked.exit_code == 0, checked.output
    assert msgspec.json.decode(checked.stdout)["mean_mm"] < 1.0
    assert load_camera(camera).verified.n_points == 4
    bumped = call("verify", shop / "bumped", "--camera", camera)
    assert bumped.exit_code == 1
    assert "the camera is off" in bumped.output
    assert load_camera(camera).verified is None
    again = call("verify", shop / "place", "--camera", camera)
    assert again.exit_code == 1
    assert "in the fit" in again.output


def test_what_is_missing_is_told_and_the_cameras_file_stays_as_it_was(shop):
    camera, before = shop / "side.yaml", (shop / "side.yaml").read_text()
    (shop / "place").mkdir()
    for words, code, told in (
        (("extrinsics", shop / "place", "--camera", camera), 2, "neither is there"),
        (("verify", shop / "place", "--camera", camera), 2, "touches.yaml"),
        (("extrinsics", shop / "place", "--camera", shop / "none.yaml"), 2, "none.yaml"),
    ):
        done = call(*words)
        assert (done.exit_code, told in done.output) == (code, True), done.output
    lens = ("--board", shop / "board.yaml", "--camera", camera, "--name", "side", "--serial", "1")
    done = call("intrinsics", shop / "place", "--bar-mm", "96", *lens)
    assert (done.exit_code, "square size" in done.output) == (1, True), done.output
    assert camera.read_text() == before
