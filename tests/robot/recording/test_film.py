"""A film of a session goes by in the session's own time and says what was decided and refused."""

import os
import shutil
from pathlib import Path

import pytest

from robot.bus.topics import ARM_STATE, PERCEPT, VERDICT
from robot.messages import Outcome, Verdict
from robot.recording.errors import UnfitError
from robot.recording.film import RATE_HZ, moments, save_film
from robot.recording.images import ImageCoder
from robot.recording.messages import GoalChosen
from robot.recording.recorder import Recorder
from robot.recording.session_file import SessionFile
from robot.recording.sink import Sink
from robot.recording.taps import RecordedTicks
from robot.recording.topics import GOAL, LANES
from tests.robot.recording.test_images import frame
from tests.support.stations import arm_state, percept

S = 1_000_000_000
Q = (0.0, -1.5, 1.5, -1.5, -1.5, 0.0)
SHIPPED = Path(__file__).parents[2] / "replay/learnt.mcap"


@pytest.fixture
def session(tmp_path):
    path = tmp_path / "session.mcap"
    recorder = Recorder(Sink(path, may_wait=True), lanes=LANES)
    refused = Verdict(stamp_ns=0, sequence=1, outcome=Outcome.REFUSED, reason="speed")
    for k in range(0, 400):
        at = 5 * S + k * S // 100
        recorder.write(ARM_STATE, arm_state((k / 100, *Q[1:]), stamp_ns=at), log_ns=at)
        if k % 5 == 0:
            recorder.write(PERCEPT, percept({}, tcp_m=(k / 100, 0.0, 0.0), stamp_ns=at), log_ns=at)
        if k == 100:
            recorder.write(GOAL, GoalChosen(epoch=0, goal=0, name="press"), log_ns=at)
        if k == 200:
            recorder.write(VERDICT, refused, log_ns=at)
    recorder.close()
    with SessionFile(path) as opened:
        yield opened


def test_moments_lie_on_an_even_grid_and_each_has_what_was_newest_then(session):
    found = list(moments(session, 5.0, 8.0, rate_hz=RATE_HZ))
    assert [m.at_s for m in found] == pytest.approx([5.0 + n / RATE_HZ for n in range(61)], abs=1e-6)
    for m in found[1:]:
        assert m.at_s - 5.0 - m.state.q_rad[0] == pytest.approx(0.0, abs=0.0101)
        assert m.at_s - 5.0 - m.percept.tcp_position_m[0] == pytest.approx(0.0, abs=0.0501)


@pytest.mark.parametrize(
    ("at_s", "says"),
    [(0.5, []), (1.5, ["goal press"]), (2.5, ["goal press", "refused: speed"]), (3.9, ["goal press"])],
)
def test_what_is_said_is_what_held_then(session, at_s, says):
    (first, *_) = moments(session, 5.0 + at_s, 9.0, rate_hz=RATE_HZ)
    assert list(first.lines[1:]) == says


def test_a_camera_s_frames_are_filmed_as_they_came_a_gap_shown_as_long_as_it_was(tmp_path):
    cv2 = pytest.importorskip("cv2")
    path, out = tmp_path / "frames.mcap", tmp_path / "out.mp4"
    recorder = Recorder(Sink(path, may_wait=True), lanes=LANES)
    ticks = RecordedTicks(recorder, images=ImageCoder("jpeg", quality=85))
    for n in (*range(10), *range(20, 30)):
        ticks.seen(frame(n))
    recorder.close()
    with SessionFile(path) as opened:
        assert save_film(opened, out) == "its camera's frames"
    film = cv2.VideoCapture(str(out))
    assert film.get(cv2.CAP_PROP_FRAME_COUNT) == pytest.approx(30, abs=1)
    assert film.read()[1].shape == (48, 64, 3)


def test_where_no_video_can_be_written_that_is_said(tmp_path):
    pytest.importorskip("cv2")
    path = tmp_path / "frames.mcap"
    recorder = Recorder(Sink(path, may_wait=True), lanes=LANES)
    RecordedTicks(recorder, images=ImageCoder("jpeg", quality=85)).seen(frame(0))
    recorder.close()
    with SessionFile(path) as opened, pytest.raises(UnfitError, match=r"\.mp4"):
        save_film(opened, tmp_path / "out.nothing")


@pytest.mark.slow
@pytest.mark.skipif(
    "MUJOCO_GL" not in os.environ, reason="nothing says how to draw off-screen: MUJOCO_GL=egl or osmesa"
)
def test_a_session_without_a_camera_is_drawn_anew(tmp_path):
    cv2 = pytest.importorskip("cv2")
    path, out = tmp_path / "learnt.mcap", tmp_path / "out.mp4"
    shutil.copy(SHIPPED, path)
    with SessionFile(path) as opened:
        try:
            save_film(opened, out)
        except UnfitError as error:
            pytest.skip(str(error))
    picture = cv2.VideoCapture(str(out)).read()[1]
    assert picture.shape == (720, 960, 3)
    assert picture.std() > 20, "there is something to see"
