"""Pictures of the table from where they are asked for."""

import math
import subprocess
import sys

import mujoco
import numpy as np
import pytest
from matplotlib.image import imread
from typer.testing import CliRunner

from robot.cli import app
from sim_twin.cli import _make_plant
from sim_twin.render import LOOKED_AT_M, Viewpoint


def camera_of(viewpoint):
    """Where MuJoCo puts the camera, and where that looks: no GL is needed for it."""
    world = _make_plant("paper", "twin").world
    scene = mujoco.MjvScene(world.model, 2000)
    mujoco.mjv_updateScene(
        world.model, world.data, mujoco.MjvOption(), None, viewpoint.camera(), mujoco.mjtCatBit.mjCAT_ALL, scene
    )
    return scene.camera[0].pos, scene.camera[0].forward


@pytest.mark.parametrize(
    ("bearing_deg", "elevation_deg", "towards"),
    [
        (0.0, 0.0, (1.0, 0.0, 0.0)),
        (90.0, 0.0, (0.0, 1.0, 0.0)),
        (-90.0, 0.0, (0.0, -1.0, 0.0)),
        (180.0, 0.0, (-1.0, 0.0, 0.0)),
        (0.0, 45.0, (math.sqrt(0.5), 0.0, math.sqrt(0.5))),
    ],
)
def test_the_camera_is_where_it_was_asked_to_be_and_looks_back(bearing_deg, elevation_deg, towards):
    place, forward = camera_of(Viewpoint(bearing_deg=bearing_deg, elevation_deg=elevation_deg, distance_m=1.5))
    # A scene has two eyes, a few centimetres apart; the left one is compared.
    assert (place - LOOKED_AT_M) / 1.5 == pytest.approx(np.array(towards), abs=0.03)
    assert forward == pytest.approx(-np.array(towards), abs=0.03)


@pytest.mark.parametrize("asked", ["1,2", "a,b,c", "0,-1,1", "0,91,1", "0,45,0.1", "0,45,nan", "inf,45,1", "0,45,1,1"])
def test_a_place_that_is_none_is_refused_in_words(asked, tmp_path):
    done = CliRunner().invoke(app, ["twin", "picture", str(tmp_path / "x.png"), "--from", asked])
    assert done.exit_code == 2
    assert "expected a bearing" in done.output
    assert not (tmp_path / "x.png").exists()


def test_pictures_from_two_places_show_two_views(tmp_path):
    for name, options in (("overview", []), ("side", ["--from", "-82,42,1.55"])):
        command = [
            sys.executable,
            "-c",
            "from robot.cli import main; main()",
            "twin",
            "picture",
            f"{name}.png",
            *options,
        ]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False)
        if "expected an off-screen GL" in done.stderr:
            pytest.skip(done.stderr)
        assert done.returncode == 0, done.stderr
    overview, side = (imread(tmp_path / f"{name}.png") for name in ("overview", "side"))
    assert overview.shape[:2] == side.shape[:2] == (960, 1280)
    assert np.abs(overview - side)[..., :3].mean() > 0.05
