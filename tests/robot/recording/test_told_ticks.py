"""Ticks that come over a wire are recorded like those of this process, and nothing of them twice."""

import pytest

from robot.bus.envelope import Envelope, Origin
from robot.bus.errors import MalformedError, SchemaError
from robot.bus.inlet import Received
from robot.bus.tick_rows import TickBatch, pack_ticks, unpack_ticks
from robot.bus.topics import ARM_STATE, PERCEPT, REQUESTED, SENT, VERDICT
from robot.messages import Outcome, Verdict
from robot.recording.recorder import Recorder
from robot.recording.session_file import SessionFile
from robot.recording.sink import Sink
from robot.recording.told_ticks import TakenTicks, ToldTicks
from robot.recording.topics import LANES
from robot.tick_ring import TickReader, TickWriter, ring_bytes
from tests.support.stations import arm_state, command

Q = (0.0, -1.5, 1.5, -1.5, -1.5, 0.0)
MS = 1_000_000
LATCHED = Verdict(stamp_ns=30 * MS, sequence=-1, outcome=Outcome.REFUSED, reason="speed", is_latched=True)


class Ring:
    """Ticks of 2 ms, by a clock of its own."""

    def __init__(self):
        memory = bytearray(ring_bytes(500.0, seconds=1.0))
        self.at_ns = 0
        self.writer, self.reader = TickWriter(memory, now_ns=lambda: self.at_ns), TickReader(memory)

    def tick(self, n=1):
        for _ in range(n):
            self.at_ns += 2 * MS
            self.writer.measured(arm_state(Q, stamp_ns=self.at_ns))
            self.writer.commanded(command(Q, sequence=self.at_ns // MS, stamp_ns=self.at_ns), (), None)

    def batch(self, *, arrived_ns=0, age_ns=0):
        message = pack_ticks(self.reader.take(), n_missed=0)
        origin = Origin(schema=bytes(8), clock=1, begun_ns=0, source="robot")
        envelope = Envelope(origin=origin, sequence=0, stamp_ns=0)
        return Received(message=message, envelope=envelope, arrived_ns=arrived_ns, age_ns=age_ns)


@pytest.fixture
def recorder(tmp_path):
    made = Recorder(Sink(tmp_path / "ticks.mcap", may_wait=True), lanes=LANES)
    yield made
    made.close()


def read(recorder, path, *topics):
    recorder.close()
    with SessionFile(path) as session:
        return [(topic.name, raw.log_ns, message) for topic, raw, message in session.messages(*topics)]


def test_every_tick_has_its_measurement_its_command_and_its_verdict_at_their_own_times(recorder, tmp_path):
    ring = Ring()
    ring.tick(25)
    told = ToldTicks(recorder)
    assert told.take_batch(ring.batch()) == 25
    found = read(recorder, tmp_path / "ticks.mcap", ARM_STATE, REQUESTED, SENT, VERDICT)
    for topic in (ARM_STATE, REQUESTED, SENT, VERDICT):
        mine = [(at, message.stamp_ns) for name, at, message in found if name == topic.name]
        assert mine == [(k * 2 * MS, k * 2 * MS) for k in range(1, 26)], topic.name


def test_another_machines_ticks_are_put_where_their_batch_came(recorder, tmp_path):
    ring = Ring()
    ring.tick(3)
    ToldTicks(recorder).take_batch(ring.batch(arrived_ns=1000 * MS, age_ns=None))
    found = read(recorder, tmp_path / "ticks.mcap", ARM_STATE)
    assert [at for _, at, _ in found] == [996 * MS, 998 * MS, 1000 * MS]


def test_what_is_told_besides_the_ticks_has_a_name_of_its_own_once_they_come(recorder):
    ring, told = Ring(), ToldTicks(recorder)
    idle = arm_state(Q, stamp_ns=1)
    assert told.named(ARM_STATE, idle) is ARM_STATE, "nobody ticks yet"
    ring.tick(2)
    told.take_batch(ring.batch())
    for topic in (ARM_STATE, REQUESTED, SENT, VERDICT):
        assert told.named(topic, idle).name == f"bus/{topic.name}"
    assert told.named(PERCEPT, idle) is PERCEPT
    assert ToldTicks(recorder, is_sure=True).named(ARM_STATE, idle).name == "bus/arm/state"


def test_a_measurement_that_came_thinned_first_is_not_recorded_again(recorder, tmp_path):
    ring, told = Ring(), ToldTicks(recorder)
    ring.tick(4)
    told.named(ARM_STATE, arm_state(Q, stamp_ns=4 * MS))
    told.take_batch(ring.batch())
    stamps = [message.stamp_ns for _, _, message in read(recorder, tmp_path / "ticks.mcap", ARM_STATE)]
    assert stamps == [6 * MS, 8 * MS]


def test_a_refusal_is_in_it_at_its_own_time(recorder, tmp_path):
    ring, told = Ring(), ToldTicks(recorder)
    ring.tick()
    ring.writer.refused(LATCHED)
    told.take_batch(ring.batch())
    verdicts = [(at, message) for _, at, message in read(recorder, tmp_path / "ticks.mcap", VERDICT)]
    assert verdicts[1:] == [(2 * MS, LATCHED)]


def test_ticks_of_another_version_and_what_is_none_are_refused_in_words():
    ring = Ring()
    ring.tick()
    batch = ring.batch().message
    with pytest.raises(SchemaError, match="same version"):
        unpack_ticks(TickBatch(layout="0", n_missed=0, ticks=batch.ticks))
    with pytest.raises(MalformedError, match="batch"):
        unpack_ticks(TickBatch(layout=batch.layout, n_missed=0, ticks=batch.ticks[:-1]))


def test_a_file_that_follows_another_misses_no_tick(recorder, tmp_path):
    ring, told = Ring(), ToldTicks(recorder)
    ring.tick(2)
    told.take_batch(ring.batch())
    after = Recorder(Sink(tmp_path / "after.mcap", may_wait=True), lanes=LANES)
    told.go_on(after)
    ring.tick(2)
    told.take_batch(ring.batch())
    assert [at for _, at, _ in read(after, tmp_path / "after.mcap", ARM_STATE)] == [6 * MS, 8 * MS]


def test_ticks_of_an_own_process_are_taken_from_the_recordings_beginning_on(recorder, tmp_path):
    ring = Ring()
    ring.tick(3)
    taken = TakenTicks(ring.reader, recorder)
    taken()
    ring.tick(2)
    taken()
    assert [at for _, at, _ in read(recorder, tmp_path / "ticks.mcap", ARM_STATE)] == [8 * MS, 10 * MS]
