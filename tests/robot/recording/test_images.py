"""A camera's frames are in the session, as viewers know them, and the doctor sees a camera that hangs."""

import base64
import json

import msgspec
import numpy as np
import pytest
from mcap.reader import make_reader

from config.loader import resolve
from robot.bus.topics import CAMERA_IMAGE
from robot.errors import RobotConfigError
from robot.frame_tap import tapped
from robot.frames import CameraSpec, frame_of
from robot.recording.checking import N_SAME_FRAMES, check
from robot.recording.images import ImageCoder, decode_image, image_coder
from robot.recording.recorder import Recorder
from robot.recording.session_file import SessionFile
from robot.recording.sink import Sink
from robot.recording.taps import RecordedTicks
from robot.recording.topics import LANES

pytest.importorskip("cv2")

S = 1_000_000_000
PERIOD_NS = S // 20


def picture(seed=0):
    """Return a smooth picture with some noise."""
    x, y = np.meshgrid(np.linspace(0, 255, 64), np.linspace(0, 255, 48))
    smooth = np.stack([x, y, np.full_like(x, 40.0)], axis=2)
    return (smooth + np.random.default_rng(seed).normal(0, 2, smooth.shape)).clip(0, 255).astype(np.uint8)


def frame(n, *, seed=None):
    return frame_of(
        picture(n if seed is None else seed), camera="table", sequence=n, stamp_ns=n * PERIOD_NS,
        arrival_ns=n * PERIOD_NS + 30_000_000,
    )  # fmt: skip


def recorded(path, frames):
    recorder = Recorder(Sink(path, may_wait=True), lanes=LANES)
    ticks = RecordedTicks(recorder, images=ImageCoder("jpeg", quality=85))
    for one in frames:
        ticks.seen(one)
    recorder.close()
    return path


@pytest.mark.parametrize(("form", "most_off"), [("png", 0), ("jpeg", 12)])
def test_a_picture_comes_back_as_it_was_or_nearly_and_its_colours_are_in_order(form, most_off):
    image = ImageCoder(form, quality=95).encode(frame(3))
    back = decode_image(image).astype(int)
    assert np.abs(back - picture(3)).max() <= most_off if form == "png" else np.abs(back - picture(3)).mean() < most_off
    assert back[0, -1, 0] > 200 > back[0, -1, 1], "red grows to the right, green downwards"
    assert (image.frame_id, image.format, image.timestamp.nsec) == ("table", form, 3 * PERIOD_NS)


def test_a_viewers_library_finds_a_compressed_image_of_foxgloves_with_its_bytes_in_base_64(tmp_path):
    path = recorded(tmp_path / "frames.mcap", [frame(n) for n in range(4)])
    with path.open("rb") as opened:
        found = list(make_reader(opened).iter_messages(topics=[CAMERA_IMAGE.name]))
    schema, _, message = found[2]
    told = json.loads(message.data)
    assert (len(found), schema.name, schema.encoding) == (4, "foxglove.CompressedImage", "jsonschema")
    assert message.publish_time == 2 * PERIOD_NS
    assert json.loads(schema.data)["properties"]["data"]["contentEncoding"] == "base64"
    assert base64.b64decode(told["data"])[:2] == b"\xff\xd8", "a JPEG"
    assert told["format"] == "jpeg"


def test_what_is_read_back_is_what_was_seen(tmp_path):
    with SessionFile(recorded(tmp_path / "frames.mcap", [frame(n) for n in range(3)])) as session:
        images = [image for _, _, image in session.messages(CAMERA_IMAGE)]
    for n, image in enumerate(images):
        assert np.abs(decode_image(image).astype(int) - picture(n)).mean() < 12


def kinds(path):
    with SessionFile(path) as session:
        return {f.kind for f in check(session).findings if f.topic == CAMERA_IMAGE.name}


@pytest.mark.parametrize(("n_same", "is_frozen"), [(N_SAME_FRAMES, False), (N_SAME_FRAMES + 1, True)])
def test_the_doctor_finds_a_camera_that_shows_its_last_picture_over_and_over(tmp_path, n_same, is_frozen):
    frames = [*map(frame, range(10)), *[frame(10 + n, seed=77) for n in range(n_same)], *map(frame, range(30, 33))]
    assert ("frozen" in kinds(recorded(tmp_path / "frames.mcap", frames))) is is_frozen


def test_the_doctor_finds_frames_that_are_missing(tmp_path):
    whole = [frame(n) for n in range(20)]
    assert kinds(recorded(tmp_path / "whole.mcap", whole)) == set()
    assert kinds(recorded(tmp_path / "torn.mcap", whole[:10] + whole[14:])) == {"gap"}


def test_what_is_recorded_is_chosen_in_the_rigs_file():
    camera = resolve(rig="twin_camera", scenario="paper", learning="default").rig.camera
    assert image_coder(camera) is not None
    assert image_coder(msgspec.structs.replace(camera, recorded="none")) is None
    assert image_coder(None) is None
    with pytest.raises(RobotConfigError, match="jpeg"):
        ImageCoder("gif", quality=1)


class OneFrame:
    """A camera that has one frame."""

    spec = CameraSpec(name="table", serial="", width_px=64, height_px=48, rate_hz=20.0)

    def __init__(self):
        self.frames = [frame(1)]

    def connect(self):
        pass

    def read(self, now_ns):
        return self.frames.pop() if self.frames else None

    def close(self):
        pass


def test_who_reads_a_tapped_camera_is_given_each_frame_and_the_tap_is_told_it_once():
    seen = []

    class Tap:
        def seen(self, frame):
            seen.append(frame)

    camera = tapped({"table": OneFrame()}, Tap())["table"]
    assert camera.spec is OneFrame.spec
    assert camera.read(0).sequence == 1
    assert camera.read(0) is None
    assert [one.sequence for one in seen] == [1]


def test_a_tap_that_wants_no_frames_leaves_cameras_as_they_are():
    cameras = {"table": OneFrame()}
    assert tapped(cameras, None) is cameras
