"""Frames between processes: whole, torn, late, lost, another camera's, of a camera that fails and comes again."""

import mmap
import os
import subprocess
import sys
from pathlib import Path

import msgspec
import numpy as np
import pytest

from perception.camera_node import FIRST_PAUSE_NS, SILENT_NS, CameraNode
from perception.cameras.over_bus import BusCamera
from perception.cameras.ring import N_SLOTS, SHARED, FrameReader, FrameWriter
from perception.errors import CameraSilentError, PerceptionConfigError
from robot.bus.envelope import Envelope, Origin
from robot.bus.inlet import Received
from robot.bus.topics import CAMERA_FRAME, CAMERA_IMAGE
from robot.errors import WireError
from robot.frames import CameraSpec, frame_of
from robot.hal.protocols import Camera

MS = 1_000_000
SPEC = CameraSpec(name="table", serial="17", width_px=8, height_px=6, rate_hz=20.0)
N_BYTES = 8 * 6 * 3
DEADLINE_NS = round(CAMERA_FRAME.deadline_s * 1e9)
OWNER = f"tests.{os.getpid()}"


def frame(sequence, stamp_ns=0, *, late_ns=30 * MS, width=8):
    picture = np.full((6, width, 3), sequence % 251, np.uint8)
    return frame_of(picture, camera="table", sequence=sequence, stamp_ns=stamp_ns, arrival_ns=stamp_ns + late_ns)


@pytest.fixture
def ring():
    writer = FrameWriter(OWNER, n_bytes=N_BYTES)
    reader = FrameReader(writer.name)
    yield writer, reader
    reader.close()
    writer.close()


# ------------------------------------------------------------------------------------------------------------ memory


def test_a_frame_comes_out_as_it_was_put_in(ring):
    writer, reader = ring
    for k in range(3 * N_SLOTS):
        put = frame(k, 1_000 * k)
        assert reader.take(writer.put(put), camera="table") == put


def test_a_frame_is_there_until_its_slot_is_begun_again(ring):
    writer, reader = ring
    number = writer.put(frame(0))
    for k in range(1, N_SLOTS):
        writer.put(frame(k))
        assert reader.take(number, camera="table") == frame(0)
    writer.begin()
    assert reader.take(number, camera="table") is None


def test_a_frame_whose_writer_ended_in_the_middle_is_none(ring):
    writer, reader = ring
    number = writer.put(frame(0))
    writer.begin()
    assert reader.take(number + 1, camera="table") is None
    assert reader.take(number, camera="table") == frame(0)


class Interrupted(mmap.mmap):
    """A reader's memory; something happens as soon as pixels are copied out of it."""

    meanwhile = None

    def __getitem__(self, part):
        copied = super().__getitem__(part)
        if self.meanwhile is not None:
            self.meanwhile()
        return copied


@pytest.mark.parametrize(("n_written", "is_whole"), [(N_SLOTS - 1, True), (N_SLOTS, False)])
def test_a_frame_that_is_overwritten_while_it_is_copied_is_none(ring, n_written, is_whole):
    writer, reader = ring
    number = writer.put(frame(0))
    with (SHARED / writer.name).open("r+b") as file:
        reader._map = memory = Interrupted(file.fileno(), 0)
    memory.meanwhile = lambda: [writer.put(frame(k)) for k in range(n_written)]
    assert (reader.take(number, camera="table") is not None) is is_whole


def test_frames_of_another_size_are_refused(ring):
    with pytest.raises(PerceptionConfigError, match="expected 144 bytes a frame, came 162"):
        ring[0].put(frame(0, width=9))


@pytest.mark.parametrize("name", ["", "../etc/passwd", "autotelic-", "autotelic-a/b", "autotelic-nowhere", "other"])
def test_memory_that_is_not_ours_or_not_there_is_refused(name):
    with pytest.raises(PerceptionConfigError, match="memory"):
        FrameReader(name)


def test_memory_with_something_else_in_it_is_refused():
    path = SHARED / f"autotelic-{OWNER}-wrong"
    path.write_bytes(b"x" * 4096)
    try:
        with pytest.raises(PerceptionConfigError, match="came something else"):
            FrameReader(path.name)
    finally:
        path.unlink()


def test_what_a_killed_process_left_is_given_back_by_the_next_of_its_name_and_that_of_one_that_lives_is_not():
    code = f"""
import os, signal
from perception.cameras.ring import FrameWriter
print(FrameWriter({OWNER!r} + ".killed", n_bytes=10).name, flush=True)
os.kill(os.getpid(), signal.SIGKILL)
"""
    left = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False).stdout.strip()
    assert (SHARED / left).exists()
    lives = FrameWriter(OWNER + ".killed", n_bytes=10)
    after = FrameWriter(OWNER + ".killed", n_bytes=10)
    assert not (SHARED / left).exists()
    assert (SHARED / lives.name).exists()
    for writer in (lives, after):
        writer.close()
        writer.close()
    assert not list(Path(SHARED).glob(f"autotelic-{OWNER}.killed*"))


# ----------------------------------------------------------------------------------------------- who takes, who reads


class Air:
    """What stands for a bus between a camera node and who perceives, and for their clock."""

    serial, source = OWNER, "camera"

    def __init__(self):
        self.now_ns, self.notes, self.take = 10_000 * MS, [], None
        self.camera = BusCamera(self, SPEC, now_ns=lambda: self.now_ns)
        self.camera.connect()
        self.is_cut, self.is_same_clock = False, True

    def publisher(self, topic):
        assert topic in (CAMERA_FRAME, CAMERA_IMAGE)
        return self

    def subscriber(self, topic, on_message):
        assert topic is CAMERA_FRAME
        self.take = on_message
        return self

    def close(self):
        pass

    def put(self, note, *, stamp_ns):
        origin = Origin(schema=b"", clock=7, begun_ns=0, source="camera")
        envelope = Envelope(origin=origin, sequence=len(self.notes), stamp_ns=stamp_ns)
        self.notes.append(note)
        age_ns = self.now_ns - stamp_ns if self.is_same_clock else None
        if not self.is_cut:
            self.take(Received(message=note, envelope=envelope, arrived_ns=self.now_ns, age_ns=age_ns))


class GivenCamera:
    """Gives what a test lays ready; an error in place of a frame is raised."""

    def __init__(self, spec=SPEC):
        self.spec, self.frames, self.n_connected, self.n_closed = spec, [], 0, 0
        self.fails = False

    def connect(self):
        self.n_connected += 1
        if self.fails:
            raise WireError("camera table: there is none")

    def read(self, now_ns):
        found = self.frames.pop(0) if self.frames else None
        if isinstance(found, Exception):
            raise found
        return found

    def close(self):
        self.n_closed += 1


@pytest.fixture
def shown():
    air, given = Air(), GivenCamera()
    node = CameraNode(air, given, now_ns=lambda: air.now_ns)
    yield air, given, node
    node.close()
    air.camera.close()


def show(shown, sequence, *, ago_ns=40 * MS, arrived_ns=10 * MS):
    """Have the camera take a frame that was exposed some time ago, and the node show it."""
    air, given, node = shown
    put = frame(sequence, air.now_ns - ago_ns, late_ns=ago_ns - arrived_ns)
    given.frames.append(put)
    node.turn()
    return put


def test_the_doors_fit():
    cameras: tuple[type[Camera], ...] = (BusCamera, GivenCamera)
    assert cameras


def test_who_perceives_gets_the_newest_frame_once_with_the_stamps_of_its_capture(shown):
    air, _, node = shown
    show(shown, 0)
    newest = show(shown, 1)
    assert air.camera.read(air.now_ns) == newest
    assert air.camera.read(air.now_ns) is None
    assert (air.camera.counts.read, air.camera.counts.lost, air.camera.counts.torn) == (1, 0, 0)
    assert node.pulse.doing == "shows"


def test_a_frame_that_arrived_after_a_measurement_is_for_the_next_one(shown):
    air, _, _ = shown
    earlier = show(shown, 0, arrived_ns=10 * MS)
    later = show(shown, 1, arrived_ns=1 * MS)
    assert air.camera.read(air.now_ns - 5 * MS) == earlier
    assert air.camera.read(air.now_ns) == later


def test_a_frame_that_was_overwritten_before_it_was_read_is_torn_and_the_next_one_comes(shown):
    air, _, _ = shown
    show(shown, 0)
    air.is_cut = True
    for k in range(1, N_SLOTS + 1):
        show(shown, k)
    air.is_cut = False
    assert air.camera.read(air.now_ns) is None
    assert air.camera.counts.torn == 1
    assert air.camera.read(air.now_ns) is None
    newest = show(shown, N_SLOTS + 1)
    assert air.camera.read(air.now_ns) == newest


def test_frames_that_were_lost_on_the_way_are_counted(shown):
    air, _, _ = shown
    show(shown, 3)
    air.is_cut = True
    show(shown, 4)
    air.is_cut = False
    show(shown, 7)
    assert air.camera.counts.lost == 3


@pytest.mark.parametrize(("ago_ns", "n_late"), [(DEADLINE_NS, 0), (DEADLINE_NS + 1, 1)])
def test_a_late_frame_is_handed_on_with_its_own_stamp_and_counted(shown, ago_ns, n_late):
    air, _, _ = shown
    late = show(shown, 0, ago_ns=ago_ns)
    found = air.camera.read(air.now_ns)
    assert found == late
    assert air.now_ns - found.stamp_ns == ago_ns
    assert air.camera.counts.late == n_late


def test_after_a_reset_no_frame_from_before_it_is_looked_at(shown):
    air, _, _ = shown
    show(shown, 0)
    air.camera.forget()
    assert air.camera.read(air.now_ns) is None
    show(shown, 1, ago_ns=1, arrived_ns=0)
    assert air.camera.read(air.now_ns) is None, "exposed before, though it came after"
    at_reset = show(shown, 2, ago_ns=0, arrived_ns=0)
    assert air.camera.read(air.now_ns) == at_reset


@pytest.mark.parametrize(
    ("spec", "size", "why"),
    [
        ({"serial": "18"}, 8, "expected serial 17 as calibrated, came 18"),
        ({}, 4, "expected 8 × 6 pixels as calibrated, came 4 × 6"),
    ],
)
def test_another_camera_s_frames_are_refused_in_words(spec, size, why):
    air = Air()
    given = GivenCamera(msgspec.structs.replace(SPEC, width_px=size, **spec))
    node = CameraNode(air, given, now_ns=lambda: air.now_ns)
    given.frames.append(frame(0, air.now_ns, width=size))
    node.turn()
    with pytest.raises(CameraSilentError, match=why):
        air.camera.read(air.now_ns)
    node.close()


def test_pictures_in_another_machine_s_memory_are_refused_in_words(shown):
    air, _, _ = shown
    air.is_same_clock = False
    show(shown, 0)
    with pytest.raises(CameraSilentError, match="on another"):
        air.camera.read(air.now_ns)


def test_a_camera_process_that_was_started_anew_is_read_from_its_own_memory(shown):
    air, given, node = shown
    show(shown, 5)
    assert air.camera.read(air.now_ns) is not None
    node.close()
    again = CameraNode(air, given, now_ns=lambda: air.now_ns)
    first = show((air, given, again), 0)
    assert air.camera.read(air.now_ns) == first
    assert air.camera.counts.lost == 0
    again.close()


# ------------------------------------------------------------------------------------------------- a camera that fails


def test_a_camera_that_fails_is_let_go_of_and_taken_anew_after_growing_pauses(shown):
    air, given, node = shown
    show(shown, 0)
    given.frames.append(WireError("camera table: unplugged"))
    node.turn()
    assert given.n_closed == 1
    assert node.pulse.doing == "waits for its camera"
    given.fails = True
    pauses = []
    for _ in range(4):
        begun_ns, n = air.now_ns, given.n_connected
        while given.n_connected == n:
            air.now_ns += 50 * MS
            node.turn()
        pauses.append(air.now_ns - begun_ns)
    assert pauses == [FIRST_PAUSE_NS * 2**k for k in range(4)]
    given.fails = False
    air.now_ns += 2 * pauses[-1]
    node.turn()
    back = show(shown, 1)
    assert air.camera.read(air.now_ns) == back


@pytest.mark.parametrize(("silent_ns", "n_closed"), [(SILENT_NS, 0), (SILENT_NS + 1, 1)])
def test_a_camera_that_gives_nothing_for_long_is_taken_anew(shown, silent_ns, n_closed):
    air, given, node = shown
    show(shown, 0)
    air.now_ns += silent_ns
    node.turn()
    assert given.n_closed == n_closed
