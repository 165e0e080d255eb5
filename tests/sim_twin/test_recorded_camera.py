"""A drive on the rig twin_camera: every frame that perception read is in its session, and films itself."""

import os
from itertools import pairwise
from statistics import median

import pytest
import yaml
from typer.testing import CliRunner

from robot.bus.topics import CAMERA_IMAGE, PERCEPT
from robot.cli import app
from robot.recording.checking import check
from robot.recording.film import save_film
from robot.recording.images import decode_image
from robot.recording.session_file import SessionFile

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif("MUJOCO_GL" not in os.environ, reason="nothing says how to draw off-screen: MUJOCO_GL=egl"),
]


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    folder = tmp_path_factory.mktemp("seen")
    steps = [{"for_s": 1.5, "linear": [0, 1, 0]}, {"for_s": 0.5, "linear": [0, 0, -0.5]}]
    (folder / "script.yaml").write_text(yaml.safe_dump({"steps": steps}))
    asked = ["teleop", "--rig", "twin_camera", "--device", f"script:{folder / 'script.yaml'}", "--no-view", "--fast"]
    done = CliRunner().invoke(app, [*asked, "--record-to", str(folder / "drive.mcap")])
    if "GL" in done.output:
        pytest.skip(done.output)
    assert done.exit_code == 0, done.output
    return folder / "drive.mcap"


def test_frames_are_in_it_at_the_camera_s_rate_each_another(session):
    with SessionFile(session) as opened:
        images = [(raw.publish_ns, image) for _, raw, image in opened.messages(CAMERA_IMAGE)]
        n_percepts = sum(1 for _ in opened.raw([PERCEPT.name]))
        wrong = [f for f in check(opened).findings if f.severity == "error"]
    assert len(images) > 20
    assert n_percepts > len(images)
    assert median(b - a for (a, _), (b, _) in pairwise(images)) == pytest.approx(5e7, rel=0.25)
    assert len({image.data for _, image in images}) == len(images)
    assert decode_image(images[-1][1]).shape == (480, 640, 3)
    assert decode_image(images[-1][1]).std() > 20
    assert wrong == []


def test_its_film_is_made_of_its_frames(session, tmp_path):
    with SessionFile(session) as opened:
        assert save_film(opened, tmp_path / "film.mp4") == "its camera's frames"
