"""Cameras on a wire and video files behind one door. No device is needed: what OpenCV opens is given in its place."""

from queue import Queue

import msgspec
import numpy as np
import pytest

from config.loader import load_rig
from perception.cameras import DeviceCamera, FolderCamera, VideoCamera
from perception.cameras.device import OLDEST_NS, TICK_NS, Capture, exposed_ns, open_device
from perception.errors import PerceptionConfigError
from perception.opencv import opencv
from robot.errors import WireError
from robot.frames import picture_of
from robot.hal.protocols import Camera

MS = 1_000_000
PERIOD_NS = 50 * MS
RIG = load_rig("twin_camera")
SIZE = (640, 480)


def rig_with(device, **camera):
    return msgspec.structs.replace(RIG, camera=msgspec.structs.replace(RIG.camera, device=str(device), **camera))


def test_every_source_fits_the_cameras_door():
    sources: tuple[type[Camera], ...] = (DeviceCamera, FolderCamera, VideoCamera)
    devices: tuple[type[Capture], ...] = (GivenDevice,)
    assert (len(sources), len(devices)) == (3, 1)


@pytest.mark.parametrize("source", [DeviceCamera, VideoCamera])
def test_a_rig_that_names_no_device_is_refused(source):
    for rig in (RIG, load_rig("twin")):
        with pytest.raises(PerceptionConfigError, match="expected `camera:` with a `device`"):
            source(rig=rig)


# -------------------------------------------------------------------------------------------------------------- video


@pytest.fixture(scope="module")
def film(tmp_path_factory):
    """Write a film of five grey pictures, 10 a second."""
    cv2, path = opencv(), tmp_path_factory.mktemp("film") / "film.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 10.0, SIZE)
    for k in range(5):
        writer.write(np.full((SIZE[1], SIZE[0], 3), 40 * k, np.uint8))
    writer.release()
    return path


def grey(frame):
    return round(float(picture_of(frame).mean()) / 40)


def test_a_film_comes_at_its_own_rate_and_what_nobody_read_in_time_is_lost_by_its_number(film):
    camera = VideoCamera(rig=rig_with(film))
    camera.connect()
    assert camera.spec.rate_hz == pytest.approx(10.0)
    begun_ns = 7_000 * MS
    first = camera.read(begun_ns)
    assert (grey(first), first.sequence, first.stamp_ns) == (0, 0, begun_ns)
    assert camera.read(begun_ns + 99 * MS) is None
    fourth = camera.read(begun_ns + 310 * MS)
    assert (grey(fourth), fourth.sequence) == (3, 3)
    assert (fourth.stamp_ns, fourth.arrival_ns) == (begun_ns + 300 * MS, begun_ns + 310 * MS)
    assert camera.read(begun_ns + 500 * MS) is None, "there are five pictures"
    camera.connect()
    assert grey(camera.read(begun_ns + 900 * MS)) == 0
    camera.close()
    camera.close()
    with pytest.raises(WireError, match="not connected"):
        camera.read(0)


def test_what_is_no_film_of_the_calibrated_size_is_refused(film, tmp_path):
    with pytest.raises(PerceptionConfigError, match="there is none at"):
        VideoCamera(rig=rig_with(tmp_path / "nowhere.avi")).connect()
    other = VideoCamera(rig=rig_with(film))
    other.spec = msgspec.structs.replace(other.spec, width_px=320)
    with pytest.raises(PerceptionConfigError, match="expected a video of 320 × 480 pixels as calibrated"):
        other.connect()


# ------------------------------------------------------------------------------------------------------------- device


class GivenDevice:
    """What OpenCV would open: hands on what a test puts in, None as the end."""

    def __init__(self):
        self.frames, self.taken, self.is_closed = Queue(), Queue(), False
        self.opened = []

    def open(self, device, spec, exposure):
        self.opened.append((device, exposure))
        return self

    def grab(self):
        return self.frames.get(timeout=10.0)

    def close(self):
        self.is_closed = True
        self.taken.put(None)


class Clock:
    now_ns = 5_000 * MS

    def __call__(self):
        return self.now_ns


def picture(level):
    return np.full((SIZE[1], SIZE[0], 3), level, np.uint8)


def read_soon(camera):
    """Return the next frame, or raise what is raised: a thread brings it."""
    for _ in range(10_000):
        frame = camera.read(0)
        if frame is not None:
            return frame
        camera._end.wait(0.001)
    raise AssertionError("no frame came")


def device_camera(exposure=None):
    device, clock = GivenDevice(), Clock()
    camera = DeviceCamera(rig=rig_with("/dev/video7", exposure=exposure), opens=device.open, now_ns=clock)
    return camera, device, clock


def test_a_device_s_frame_is_stamped_in_the_middle_of_its_exposure_and_when_it_came():
    camera, device, clock = device_camera(exposure=100.0)
    camera.connect()
    assert device.opened == [("/dev/video7", 100.0)]
    device.frames.put((picture(9), clock.now_ns - 30 * MS))
    frame = read_soon(camera)
    assert (frame.stamp_ns, frame.arrival_ns) == (clock.now_ns - 30 * MS - 100 * TICK_NS // 2, clock.now_ns)
    assert (picture_of(frame) == 9).all()
    assert camera.read(0) is None
    device.frames.put(None)
    camera.close()


def test_a_gap_between_stamps_is_told_as_frames_that_were_lost():
    camera, device, clock = device_camera()
    camera.connect()
    sequences = []
    for gap in (0, 1, 1.2, 3.1, 0.1):
        clock.now_ns += round(gap * PERIOD_NS)
        device.frames.put((picture(0), clock.now_ns))
        sequences.append(read_soon(camera).sequence)
    assert sequences == [0, 1, 2, 5, 6]
    device.frames.put(None)
    camera.close()


def test_a_device_that_gives_no_more_is_told_and_can_be_taken_anew():
    camera, device, clock = device_camera()
    camera.connect()
    device.frames.put(None)
    with pytest.raises(WireError, match=r"/dev/video7 gives no frame; is it plugged in"):
        read_soon(camera)
    assert device.taken.get(timeout=10.0) is None
    assert device.is_closed
    camera.connect()
    device.frames.put((picture(3), clock.now_ns))
    assert read_soon(camera).sequence == 0
    device.frames.put(None)
    camera.close()
    with pytest.raises(WireError, match="not connected"):
        camera.read(0)


def test_a_device_that_is_not_there_is_told():
    with pytest.raises(WireError, match="is it plugged in"):
        open_device("/dev/video63", DeviceCamera(rig=rig_with("/dev/video63")).spec, None)


@pytest.mark.parametrize(("age_ns", "is_ours"), [(0, True), (OLDEST_NS, True), (OLDEST_NS + 1, False), (-1, False)])
def test_a_driver_s_stamp_of_another_clock_is_not_believed(age_ns, is_ours):
    now_ns = 9_000 * MS
    stamp_ns = exposed_ns(now_ns - age_ns, now_ns, period_ns=PERIOD_NS, exposure_ns=10 * MS)
    assert stamp_ns == (now_ns - age_ns if is_ours else now_ns - PERIOD_NS // 2) - 5 * MS
