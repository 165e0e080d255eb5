"""A lab's photographs: a folder with truth is benched as rendered pictures are, and a label that lacks is told."""

import numpy as np
import pytest

from config.yaml_text import dump_yaml
from perception.bench import bench_perception
from perception.calibration.camera_file import save
from perception.cameras.folder import write_picture
from perception.detection import learn_colours
from perception.detection.colour_file import save_colours
from perception.errors import PerceptionConfigError
from perception.labelled import LabelledFolder
from robot.frames import picture_of
from tests.support.painted_table import CAMERA, SCENARIO, guided_sample, nominal, painted

BUTTONS = tuple(b.name for b in SCENARIO.buttons)
BOXES = tuple(b.name for b in SCENARIO.boxes)
HEIGHTS = {b.name: b.height_m - b.cap_m / 2 for b in SCENARIO.buttons} | {
    c.name: c.height_m / 2 for c in SCENARIO.cylinders
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    at = tmp_path_factory.mktemp("lab")
    frames, regions = guided_sample()
    save(at / "camera.yaml", CAMERA)
    save_colours(at / "colours.yaml", learn_colours(frames, regions, camera=CAMERA, scenario=SCENARIO))
    labels = []
    for seed, level in ((1, "window"), (2, "lamps")):
        place = nominal(np.random.default_rng(seed))
        write_picture(at / f"{seed}.png", picture_of(painted(place, lamps_on=BUTTONS, lids_open=BOXES, seed=seed)))
        positions = {n: [float(p[0]), float(p[1]), HEIGHTS.get(n, 0.0)] for n, p in place.items()}
        labels.append(
            {
                "image": f"{seed}.png", "level": level, "positions_m": positions, "lamps_on": list(BUTTONS),
                "lids_open": list(BOXES),
            }
        )  # fmt: skip
    (at / "labels.yaml").write_text(dump_yaml({"photographs": labels}), encoding="utf-8")
    return at


def test_measured_photographs_are_benched_by_what_they_were_taken_under(folder):
    rows = {row.name: row for row in bench_perception(full=False, frames=folder).results}
    assert rows["position_mean_mm_window"].value < 1.5
    assert rows["position_mean_mm_lamps"].value < 1.5
    assert rows["placed_share_lamps"].value == 1.0
    assert rows["false_known_share"].value == 0.0
    assert rows["lamp_f1_perturbed"].value == 1.0
    assert not rows["lamp_errors_clean"].ok, "none of these is said to be clean"


def test_a_photograph_with_a_thing_that_nobody_measured_is_told(folder, tmp_path):
    for name in ("camera.yaml", "colours.yaml"):
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    label = {"image": "1.png", "positions_m": {"green_button": [0.3, 0.0, 0.04], "ghost": [0.0, 0.0, 0.0]}}
    (tmp_path / "labels.yaml").write_text(dump_yaml({"photographs": [label]}), encoding="utf-8")
    with pytest.raises(PerceptionConfigError, match=r"1\.png.*wrong are blue_box.*ghost"):
        LabelledFolder(tmp_path, SCENARIO)
