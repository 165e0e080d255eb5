"""The twin with a camera, whole: percepts as truth has them, the same twice. The pictures need a GL."""

import os
import subprocess
import sys

import pytest

from config.loader import resolve
from robot.errors import WireError
from sim_twin.camera_plant import CameraTwinPlant, WatchingCamera
from sim_twin.plant import TwinPlant
from sim_twin.studio.viewing import RIG_VIEW

SCRIPT = """
import math
from config.loader import resolve
from perception.ground_truth import GroundTruthPerception
from robot.messages import Heading
from robot.operated import OperatedStation
from robot.rigs import build_operator, build_plant, build_station
r = resolve(rig="twin_camera")
plant = build_plant(rig=r.rig, arm=r.arm, scenario=r.scenario)
local = build_station(r, plant=plant)
station, truth = OperatedStation(local, build_operator(r.rig)), GroundTruthPerception(scenario=r.scenario, arm=r.arm)
station.connect()
told = []
for _ in range(2):
    percepts = [station.reset(seed=41, epoch=0)]
    for step in range(12):
        percepts.append(station.step(Heading(heading_rad=0.5 * step, distance_m=0.02, height_m=0.2)).percept)
        true = truth.perceive(local.measured, plant.truth.read())
        for seen, real in zip(percepts[-1].objects, true.objects):
            if seen.is_valid:
                assert math.dist(seen.position_m, real.position_m) < 0.004, (seen, real)
                assert seen.age_s >= 0.03
        for i, state in enumerate(true.button_states):
            assert not percepts[-1].valid[len(true.distances_m) + i] or percepts[-1].button_states[i] == state
    assert sum(o.is_valid for o in percepts[-1].objects) >= 6
    origin = percepts[0].stamp_ns
    told.append([(p.stamp_ns - origin, p.distances_m, p.ages_s, p.valid, p.confidences) for p in percepts])
assert told[0] == told[1], "a reset begins anew, noise and all"
station.close()
print("as truth")
"""


def test_a_camera_that_is_not_connected_gives_nothing_and_waits_for_nobody():
    resolved = resolve()
    world = TwinPlant(arm=resolved.arm, scenario=resolved.scenario, rig=resolved.rig).world
    camera = WatchingCamera(world, RIG_VIEW)
    camera.watch()
    assert camera.has_frame
    with pytest.raises(WireError, match="not connected"):
        camera.read(0)
    camera.close()


def test_without_anyone_at_the_camera_the_plant_is_the_plain_twin():
    resolved = resolve(rig="twin_camera")
    with_camera = CameraTwinPlant(arm=resolved.arm, scenario=resolved.scenario, rig=resolved.rig)
    plain = TwinPlant(arm=resolved.arm, scenario=resolved.scenario, rig=resolved.rig)
    assert with_camera.model_sha256 == plain.model_sha256
    for plant in (with_camera, plain):
        plant.resetter.reset(seed=3, epoch=1, digital_out=0)
    assert with_camera.truth.read().objects == plain.truth.read().objects
    assert set(with_camera.cameras) == {resolved.rig.camera.name}


@pytest.mark.slow
def test_the_rendered_cameras_percepts_are_as_truth_and_the_same_after_every_reset():
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT], env={**os.environ, "MUJOCO_GL": "egl"}, capture_output=True, text=True,
        timeout=600, check=False,
    )  # fmt: skip
    if "expected an off-screen GL" in done.stderr:
        pytest.skip("no off-screen GL here")
    assert "as truth" in done.stdout, done.stderr
