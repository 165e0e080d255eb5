"""A recorder on the bus writes what the processes write to each other, byte for byte."""

import math
import time
from time import monotonic_ns

import msgspec
import pytest

from robot.bus import TRUTH, Bus, Role
from robot.bus.codec import Codec
from robot.messages import ObjectPose, SceneState
from robot.recording.listening import BusListener
from robot.recording.recorder import Recorder
from robot.recording.session_file import SessionFile
from robot.recording.sink import Sink
from robot.recording.topics import LANES

pytestmark = pytest.mark.realtime

ENDPOINT, SERIAL = "tcp/127.0.0.104:7447", "4711"
N = 40


def scene(n, x):
    thing = ObjectPose(name="cup", position_m=(x, 0.1 * n, 0.0), quat=(1.0, 0.0, 0.0, 0.0))
    return SceneState(stamp_ns=n, objects=(thing,))


def test_what_is_written_on_the_bus_is_recorded_byte_for_byte_with_its_sources_stamps(tmp_path):
    path = tmp_path / "bus.mcap"
    recorder = Recorder(Sink(path, may_wait=False), lanes=LANES)
    with (
        Bus(ENDPOINT, serial=SERIAL, role=Role.TWIN, is_hub=True) as twin,
        Bus(ENDPOINT, serial=SERIAL, role=Role.RECORDER) as bus,
    ):
        listener = BusListener(bus, recorder, [TRUTH])
        publisher = twin.publisher(TRUTH)
        end_s = time.monotonic() + 15.0

        def is_heard():  # a declaration takes its time to cross
            publisher.put(scene(-1, 0.0))
            return listener.n > 0 or time.monotonic() > end_s

        def write_one():
            if len(stamps) < N:
                stamps.append(monotonic_ns())
                publisher.put(sent[len(stamps) - 1], stamp_ns=stamps[-1])
                return False
            return time.monotonic() > stamps[-1] / 1e9 + 0.5

        sent = [scene(n, math.nan if n == 7 else 0.25) for n in range(N)]
        stamps = []
        is_begun = [False]

        def go_on():
            is_begun[0] = is_begun[0] or is_heard()
            return is_begun[0] and write_one()

        listener.run(go_on, poll_s=0.005)
    recorder.close()
    assert (listener.lost(), listener.refused()) == (0, 0)
    with SessionFile(path) as session:
        raws = list(session.raw())
    raws = raws[-N:]
    assert [raw.payload for raw in raws] == [Codec(SceneState).encode(message).payload for message in sent]
    assert [raw.publish_ns for raw in raws] == stamps
    assert all(raw.log_ns >= raw.publish_ns for raw in raws)
    assert msgspec.json.decode(raws[7].payload)["objects"][0]["position_m"][0] == "~NaN"
