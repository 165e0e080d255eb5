"""The percept of painted pictures: what ground truth would say, with ages; a camera that fails is told."""

import functools
import math

import msgspec
import numpy as np
import pytest

from config.errors import ConfigError
from config.loader import load_rig, resolve
from config.rig import RigCamera
from perception.calibration.camera_file import save
from perception.detection import learn_colours
from perception.detection.colour_file import save_colours
from perception.errors import CameraSilentError, PerceptionConfigError
from perception.from_camera import CameraPerception
from perception.tracking.frames import FrameWatch
from robot.frames import CameraSpec, frame_of
from robot.messages import ObjectPose, SceneState
from tests.support.painted_table import CAMERA, SCENARIO, guided_sample, nominal, painted
from tests.support.stations import arm_state

ARM = resolve().arm
MS = 1_000_000
PARKED = (ARM.home_rad[0] - math.pi, *ARM.home_rad[1:])
"""Turned away: before nothing on the table."""
TCP = (0.42, 0.05, 0.2)
BUTTONS = tuple(b.name for b in SCENARIO.buttons)
BOXES = tuple(b.name for b in SCENARIO.boxes)


class GivenCamera:
    """Gives frames that a test laid ready, each once, when its time has come."""

    def __init__(self, *, name=CAMERA.name, serial=CAMERA.serial, width=1280, height=720):
        self.spec = CameraSpec(name=name, serial=serial, width_px=width, height_px=height, rate_hz=20.0)
        self.frames, self.n_connected, self.n_closed = [], 0, 0

    def connect(self):
        self.n_connected += 1

    def show(self, picture, stamp_ms, *, late_ms=30):
        times = {"stamp_ns": stamp_ms * MS, "arrival_ns": (stamp_ms + late_ms) * MS}
        self.frames.append(msgspec.structs.replace(picture, sequence=len(self.frames), **times))

    def read(self, now_ns):
        due = [f for f in self.frames if f.arrival_ns <= now_ns]
        self.frames = [f for f in self.frames if f.arrival_ns > now_ns]
        return due[-1] if due else None

    def close(self):
        self.n_closed += 1


@functools.cache
def colours():
    frames, regions = guided_sample()
    return learn_colours(frames, regions, camera=CAMERA, scenario=SCENARIO)


@functools.cache
def table():
    return painted(nominal(np.random.default_rng(1)), lamps_on=BUTTONS[:1], lids_open=BOXES, seed=1)


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    folder = tmp_path_factory.mktemp("camera")
    save(folder / "side.yaml", CAMERA)
    save_colours(folder / "colours.yaml", colours())
    given = RigCamera(
        name=CAMERA.name, calibration=str(folder / "side.yaml"), colours=str(folder / "colours.yaml")
    )  # fmt: skip
    return msgspec.structs.replace(load_rig("twin_camera"), camera=given)


@pytest.fixture
def looking(rig):
    camera = GivenCamera()
    perception = CameraPerception(scenario=SCENARIO, arm=ARM, rig=rig)
    perception.watch({camera.spec.name: camera})
    return perception, camera


def at(stamp_ms, tcp=TCP):
    return arm_state(PARKED, stamp_ns=stamp_ms * MS, tcp_m=tcp)


def test_a_percept_says_what_ground_truth_would_with_the_age_of_the_picture(looking):
    perception, camera = looking
    camera.show(table(), 20)
    seen = perception.perceive(at(60), None)
    place = nominal(np.random.default_rng(1))
    for name, d, is_valid in zip(SCENARIO.distances, seen.distances_m, seen.valid, strict=False):
        if name == "table":
            assert d == pytest.approx(TCP[2])
        else:
            thing = next(o for o in seen.objects if o.name == name)
            assert math.dist(thing.position_m[:2], place[name][:2]) < 2e-3
            assert d == pytest.approx(math.dist(thing.position_m, TCP))
            assert 0.8 < thing.confidence <= 1.0 or name in BOXES
        assert is_valid
    assert seen.button_states == (1.0, 0.0, 0.0)
    table_entry = SCENARIO.distances.index("table")
    assert all(a == pytest.approx(0.0 if i == table_entry else 0.04) for i, a in enumerate(seen.ages_s))
    assert len(seen.confidences) == len(seen.valid) == len(seen.ages_s)


def test_what_a_world_gives_away_is_not_looked_at(looking, rig):
    perception, camera = looking
    other, same = CameraPerception(scenario=SCENARIO, arm=ARM, rig=rig), GivenCamera()
    other.watch({same.spec.name: same})
    camera.show(table(), 20)
    same.show(table(), 20)
    nowhere = SceneState(
        stamp_ns=0, objects=tuple(ObjectPose(name=n, position_m=(9, 9, 9), quat=(1, 0, 0, 0)) for n in BUTTONS)
    )
    assert perception.perceive(at(60), nowhere) == other.perceive(at(60), None)


@pytest.mark.parametrize(("now_ms", "is_valid"), [(169, True), (170, True), (171, False)])
def test_nothing_is_known_any_more_when_the_newest_picture_is_too_old(looking, now_ms, is_valid):
    perception, camera = looking
    camera.show(table(), 20)
    perception.perceive(at(60), None)
    late = perception.perceive(at(now_ms), None)
    of_table = SCENARIO.distances.index("table")
    assert {v for i, v in enumerate(late.valid) if i != of_table} == {is_valid}
    assert late.valid[of_table], "the arm itself knows how high it is"
    assert {o.is_valid for o in late.objects} == {is_valid}


def test_a_camera_that_has_fallen_silent_is_told_so_that_the_arm_is_held(looking):
    perception, camera = looking
    camera.show(table(), 20)
    perception.perceive(at(60), None)
    perception.perceive(at(620), None)
    with pytest.raises(CameraSilentError, match=r"side.* 601 ms old.*plugged in"):
        perception.perceive(at(621), None)
    camera.show(table(), 640)
    assert all(perception.perceive(at(680), None).valid), "it goes on when pictures come again"


@pytest.mark.parametrize("level", [0, 255])
def test_a_black_or_overexposed_camera_is_as_good_as_silent(looking, level):
    perception, camera = looking
    dead = frame_of(np.full((720, 1280, 3), level, np.uint8), camera="side", sequence=0, stamp_ns=0, arrival_ns=0)
    camera.show(table(), 20)
    perception.perceive(at(60), None)
    camera.show(dead, 200)
    assert not any(o.is_valid for o in perception.perceive(at(240), None).objects)
    camera.show(dead, 620)
    with pytest.raises(CameraSilentError, match="covered, dark or over-exposed"):
        perception.perceive(at(650), None)


def test_a_frozen_camera_is_noticed_at_its_third_picture_and_told_from_an_unplugged_one(looking):
    perception, camera = looking
    for k in range(12):
        camera.show(table(), 20 + 50 * k)
        seen = perception.perceive(at(60 + 50 * k), None)
        assert seen.objects[0].is_valid is (60 + 50 * k - 70 <= 150), "the second picture is the last to go by"
    camera.show(table(), 650)
    with pytest.raises(CameraSilentError, match="all are the same"):
        perception.perceive(at(690), None)
    perception.forget()
    camera.show(table(), 700)
    assert perception.perceive(at(740), None).objects[0].is_valid


def test_frames_that_were_lost_are_counted():
    watch = FrameWatch()
    for sequence in (4, 5, 8, 9, 9):
        watch.note(msgspec.structs.replace(table(), sequence=sequence))
    assert watch.n_lost == 2


def test_after_a_reset_nothing_of_the_table_before_is_known(looking):
    perception, camera = looking
    camera.show(table(), 20)
    perception.perceive(at(60), None)
    perception.forget()
    fresh = perception.perceive(at(100), None)
    assert not any(o.is_valid for o in fresh.objects)
    assert fresh.button_states == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("camera", "why"),
    [
        (GivenCamera(name="top"), "expected camera side"),
        (GivenCamera(width=640), "calibrated at 1280 × 720"),
        (GivenCamera(serial="other"), "expected serial"),
    ],
)
def test_a_camera_that_is_not_the_calibrated_one_is_refused(rig, camera, why):
    perception = CameraPerception(scenario=SCENARIO, arm=ARM, rig=rig)
    with pytest.raises(PerceptionConfigError, match=why):
        perception.watch({camera.spec.name: camera})


def test_a_rig_without_a_camera_or_with_anothers_file_is_refused(rig):
    with pytest.raises(PerceptionConfigError, match="names none"):
        CameraPerception(scenario=SCENARIO, arm=ARM, rig=msgspec.structs.replace(rig, camera=None))
    swapped = msgspec.structs.replace(rig.camera, name="top")
    with pytest.raises(PerceptionConfigError, match="expected the calibration of camera top, came that of side"):
        CameraPerception(scenario=SCENARIO, arm=ARM, rig=msgspec.structs.replace(rig, camera=swapped))
    lost = msgspec.structs.replace(rig.camera, colours="nowhere.yaml")
    with pytest.raises(ConfigError, match="nowhere"):
        CameraPerception(scenario=SCENARIO, arm=ARM, rig=msgspec.structs.replace(rig, camera=lost))


def test_the_cameras_door_is_opened_and_shut_with_the_station(looking):
    perception, camera = looking
    perception.connect()
    perception.close()
    assert (camera.n_connected, camera.n_closed) == (1, 1)
