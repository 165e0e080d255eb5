"""A camera's process, for real: it plays a film; it is killed in the middle, and another takes its place."""

import os
import signal
import time

import msgspec
import numpy as np
import pytest
import yaml

from config.loader import load_rig
from perception.cameras.over_bus import BusCamera
from perception.cameras.ring import SHARED
from perception.opencv import opencv
from robot.bus import Bus, Role
from robot.bus.topics import CAMERA_IMAGE, HEALTH
from robot.frames import CameraSpec, picture_of
from robot.recording.images import decode_image
from tests.support.small_lab import SERIAL, start

pytestmark = [pytest.mark.realtime, pytest.mark.slow]

HOST = "127.0.0.83"
SIZE = (640, 480)
SPEC = CameraSpec(name="table", serial="", width_px=SIZE[0], height_px=SIZE[1], rate_hz=20.0)
WAIT_S = 120.0


def make_rig(folder):
    """Write a film of sixty grey pictures, 20 a second, and a rig whose camera plays it."""
    cv2 = opencv()
    writer = cv2.VideoWriter(str(folder / "film.avi"), cv2.VideoWriter.fourcc(*"MJPG"), 20.0, SIZE)
    for k in range(60):
        writer.write(np.full((SIZE[1], SIZE[0], 3), 4 * k, np.uint8))
    writer.release()
    tree = msgspec.to_builtins(load_rig("virtual_lab_camera"))
    tree |= {"address": HOST, "bus": f"tcp/{HOST}:7447"}
    tree["camera"] |= {"source": "perception.cameras.video:VideoCamera", "device": "./film.avi", "rate_hz": 20.0}
    (folder / "rig.yaml").write_text(yaml.safe_dump(tree))


def left_behind():
    return [path.name for path in SHARED.glob(f"autotelic-{SERIAL}.camera-*")]


class Watcher:
    """Who perceives, and the camera's process that a supervisor would start."""

    def __init__(self, folder, bus):
        self.folder, self.frames, self.told = folder, [], []
        self.camera = BusCamera(bus, SPEC)
        self.camera.connect()
        bus.subscriber(HEALTH, lambda received: self.told.append(received.message))
        self.images = {}
        bus.subscriber(CAMERA_IMAGE, lambda received: self.images.update({received.stamp_ns: received.message}))
        self.process = None

    def begin(self):
        self.process = start(self.folder, "node", "camera", "--rig", "rig.yaml")

    def look_until(self, is_so):
        end_s = time.monotonic() + WAIT_S
        while not is_so():
            assert time.monotonic() < end_s, (self.told[-1:], len(self.frames))
            assert self.process is None or self.process.poll() is None, self.process.stderr.read()
            frame = self.camera.read(time.monotonic_ns())
            if frame is not None:
                assert np.ptp(picture_of(frame).astype(int)) <= 2, "one picture, not parts of two"
                assert frame.arrival_ns >= frame.stamp_ns
                self.frames.append(frame)
            time.sleep(0.002)

    def look(self, n_more):
        wanted = len(self.frames) + n_more
        self.look_until(lambda: len(self.frames) >= wanted)


def test_a_killed_camera_s_place_is_taken_by_the_next_and_no_torn_picture_is_seen(tmp_path):
    make_rig(tmp_path)
    with Bus(f"tcp/{HOST}:7447", serial=SERIAL, role=Role.TWIN, is_hub=True) as bus:
        watcher = Watcher(tmp_path, bus)
        watcher.begin()
        watcher.look(10)
        stamps = [frame.stamp_ns for frame in watcher.frames]
        assert stamps == sorted(set(stamps))
        os.kill(watcher.process.pid, signal.SIGKILL)
        watcher.process.communicate()
        (torn_off,) = left_behind()
        n = len(watcher.frames)
        watcher.begin()
        watcher.look(10)
        assert watcher.frames[-1].stamp_ns > stamps[-1]
        assert torn_off not in left_behind(), "what the killed one left is given back"
        assert len(watcher.frames) >= n + 10
        both = [f for f in watcher.frames if f.stamp_ns in watcher.images]
        assert len(both) >= 10, "who records is told the same frames, compressed"
        for frame in both:
            picture = decode_image(watcher.images[frame.stamp_ns])
            assert abs(picture.astype(int) - picture_of(frame)).max() <= 4
        watcher.look_until(lambda: any(health.doing == "shows" for health in watcher.told))
        watcher.process.send_signal(signal.SIGINT)
        watcher.process.communicate(timeout=60)
        assert watcher.process.returncode == 0
        watcher.camera.close()
    assert left_behind() == []
