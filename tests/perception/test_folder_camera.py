"""A folder of pictures as a camera."""

import sys

import cv2
import numpy as np
import pytest

from perception.cameras import FolderCamera
from perception.errors import OpenCvMissingError, PerceptionConfigError
from perception.opencv import opencv
from robot.errors import RobotConfigError, WireError
from robot.frames import Frame, frame_of, picture_of

MS = 1_000_000


@pytest.fixture
def folder(tmp_path):
    for i in range(4):
        picture = np.zeros((24, 32, 3), np.uint8)
        picture[..., 0] = 10 * i  # OpenCV writes blue first
        cv2.imwrite(str(tmp_path / f"{i}.png"), picture)
    (tmp_path / "notes.txt").write_text("no picture")
    return tmp_path


def test_pictures_come_once_each_at_their_rate_and_what_was_missed_leaves_a_gap(folder):
    with_rate = FolderCamera(folder, name="side", rate_hz=10.0)
    with_rate.connect()
    got = [(t, f.sequence, f.stamp_ns // MS) for t in (7, 50, 110, 120, 330, 400, 900) if (f := with_rate.read(t * MS))]
    assert got == [(7, 0, 7), (110, 1, 107), (330, 3, 307)]


def test_colours_are_red_green_blue_and_bytes_survive_the_frame(folder):
    camera = FolderCamera(folder, name="side", rate_hz=10.0)
    camera.connect()
    camera.read(0)
    frame = camera.read(100 * MS)
    assert picture_of(frame)[3, 4].tolist() == [0, 0, 10]
    assert (frame.width_px, frame.height_px, camera.spec.width_px) == (32, 24, 32)


def test_nothing_is_read_before_connecting_and_after_closing(folder):
    camera = FolderCamera(folder, name="side")
    for _ in range(2):
        with pytest.raises(WireError, match="not connected"):
            camera.read(0)
        camera.connect()
        assert camera.read(5).sequence == 0
        camera.close()
        camera.close()


def test_a_folder_that_is_none_is_empty_or_holds_other_things_is_told(folder, tmp_path):
    (tmp_path / "empty").mkdir()
    for wrong, words in ((tmp_path / "absent", "a folder"), (tmp_path / "empty", "there are none")):
        with pytest.raises(PerceptionConfigError, match=words):
            FolderCamera(wrong, name="side")
    with pytest.raises(PerceptionConfigError, match="above 0 Hz"):
        FolderCamera(folder, name="side", rate_hz=0.0)
    (folder / "1.png").write_bytes(b"not a picture")
    cv2.imwrite(str(folder / "2.png"), np.zeros((48, 32, 3), np.uint8))
    camera = FolderCamera(folder, name="side", rate_hz=10.0)
    camera.connect()
    camera.read(0)
    with pytest.raises(PerceptionConfigError, match="cannot read"):
        camera.read(100 * MS)
    with pytest.raises(PerceptionConfigError, match="32 × 48"):
        camera.read(200 * MS)


def test_a_frame_holds_its_bytes_to_its_size():
    picture = np.zeros((2, 3, 3), np.uint8)
    frame = frame_of(picture, camera="side", sequence=0, stamp_ns=1, arrival_ns=2)
    assert (picture_of(frame) == picture).all()
    short = Frame(camera="side", sequence=0, stamp_ns=1, arrival_ns=2, width_px=3, height_px=2, pixels=b"abc")
    with pytest.raises(RobotConfigError, match="expected 18 bytes"):
        picture_of(short)
    for wrong in (np.zeros((2, 3), np.uint8), np.zeros((2, 3, 4), np.uint8), np.zeros((2, 3, 3))):
        with pytest.raises(RobotConfigError, match="height, width, 3"):
            frame_of(wrong, camera="side", sequence=0, stamp_ns=1, arrival_ns=2)


def test_without_opencv_one_error_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "cv2", None)
    with pytest.raises(OpenCvMissingError, match=r"autotelic\[lab\]"):
        opencv()
