"""Around every stop the last half minute is kept whole, in a file of its own that every reader opens."""

from itertools import pairwise

import msgspec
import pytest
from mcap.reader import make_reader

from config.loader import resolve
from robot.bus.station_rows import StationReport, StopAsk
from robot.bus.topics import ARM_STATE, STOP, VERDICT
from robot.messages import Executed, Outcome, StationMode, StationState, Verdict
from robot.recording.errors import UnfitError
from robot.recording.flight import AFTER_NS, BEFORE_NS, MOST_FILES, Flight
from robot.recording.messages import Event, GoalChosen, Purpose, StepMark
from robot.recording.recorder import Recorder
from robot.recording.recording import Recording
from robot.recording.session_file import SessionFile
from robot.recording.sink import Sink
from robot.recording.stops import StopsHeard
from robot.recording.told_ticks import ToldTicks
from robot.recording.topics import GOAL, LANES
from robot.tick_ring import Tick
from tests.support.stations import arm_state, command

Q = (0.0, -1.5, 1.5, -1.5, -1.5, 0.0)
S, TICK_NS = 1_000_000_000, 100_000_000
LATCHED = Verdict(stamp_ns=0, sequence=1, outcome=Outcome.REFUSED, reason="speed", detail="too fast", is_latched=True)
ASIDE = Verdict(stamp_ns=0, sequence=1, outcome=Outcome.REFUSED, reason="speed")


class Stage:
    """A session of a tick each tenth of a second, and its flight recorder's files."""

    def __init__(self, folder):
        self.folder, self.whys = folder, []
        self.flight = Flight()
        self.flight.follow(self.begin)
        self.recorder = Recorder(Sink(folder / "main.mcap", may_wait=True), lanes=LANES, keeps=self.flight)

    def begin(self, why, at_ns):
        self.whys.append((why, at_ns))
        return Recorder(Sink(self.folder / f"stop-{len(self.whys)}.mcap", may_wait=True), lanes=LANES)

    def run(self, from_s, to_s):
        for at_ns in range(round(from_s * S), round(to_s * S), TICK_NS):
            self.recorder.write(ARM_STATE, arm_state(Q, stamp_ns=at_ns), log_ns=at_ns)

    def say(self, topic, message, at_s):
        self.recorder.write(topic, message, log_ns=round(at_s * S))

    def end(self):
        self.flight.close()
        self.recorder.close()

    def times(self, n):
        with SessionFile(self.folder / f"stop-{n}.mcap") as session:
            return [raw.log_ns for raw in session.raw((ARM_STATE.name,))]


@pytest.fixture
def stage(tmp_path):
    made = Stage(tmp_path)
    yield made
    made.end()


def test_the_half_minute_before_a_stop_and_what_comes_right_after_it_are_in_its_file_undecimated(stage):
    stage.run(0, 50)
    stage.say(VERDICT, LATCHED, 50)
    stage.run(50, 60)
    stage.end()
    times = stage.times(1)
    assert times[0] == 50 * S - BEFORE_NS
    assert times[-1] == 50 * S + AFTER_NS
    assert {b - a for a, b in pairwise(times)} == {TICK_NS}
    assert stage.whys == [("speed: too fast", 50 * S)]


def test_a_stop_soon_after_the_beginning_has_all_there_was(stage):
    stage.run(0, 3)
    stage.say(STOP, StopAsk(number=1, by="a person"), 3)
    stage.end()
    assert stage.times(1)[0] == 0
    assert stage.whys == [("stop said by a person", 3 * S)]


def test_stops_that_follow_at_once_are_in_one_file_and_later_ones_in_another(stage):
    stage.run(0, 5)
    for k in range(5):
        stage.say(VERDICT, LATCHED, 5 + k)
        stage.run(5 + k, 6 + k)
    stage.run(10, 20)
    stage.say(VERDICT, LATCHED, 20)
    stage.end()
    assert len(stage.whys) == 2
    assert stage.times(1)[-1] == 9 * S + AFTER_NS
    assert stage.times(2)[0] == 0


def test_the_file_of_a_stop_is_opened_by_the_mcap_package_too(stage):
    stage.run(0, 2)
    stage.say(VERDICT, LATCHED, 2)
    stage.end()
    with (stage.folder / "stop-1.mcap").open("rb") as opened:
        topics = [channel.topic for _, channel, _ in make_reader(opened).iter_messages()]
    assert topics.count(ARM_STATE.name) == 20
    assert topics.count(VERDICT.name) == 1


def test_the_session_itself_has_everything_as_without_a_flight_recorder(stage):
    stage.run(0, 40)
    stage.say(VERDICT, LATCHED, 40)
    stage.end()
    with SessionFile(stage.folder / "main.mcap") as session:
        assert len(list(session.raw())) == 401


def test_what_still_holds_is_in_it_however_long_ago_it_was_written(stage):
    stage.say(GOAL, GoalChosen(epoch=1, goal=0, name="old"), 0)
    stage.say(GOAL, GoalChosen(epoch=2, goal=1, name="in force"), 1)
    stage.run(1, 50)
    stage.say(VERDICT, LATCHED, 50)
    stage.end()
    with SessionFile(stage.folder / "stop-1.mcap") as session:
        assert [goal.name for _, _, goal in session.messages(GOAL)] == ["in force"]


def test_where_no_file_can_be_begun_that_is_told_and_recording_goes_on(tmp_path):
    def refuse(why, at_ns):
        raise UnfitError("expected room, the disk is full")

    told = []
    flight = Flight(tell=told.append)
    flight.follow(refuse)
    recorder = Recorder(Sink(tmp_path / "main.mcap", may_wait=True), lanes=LANES, keeps=flight)
    recorder.write(VERDICT, LATCHED, log_ns=0)
    recorder.write(VERDICT, LATCHED, log_ns=S)
    flight.close()
    recorder.close()
    assert told == ["flight recorder: expected room, the disk is full"]


def test_no_more_files_are_begun_than_a_disk_should_hold_of_them(tmp_path):
    stage = Stage(tmp_path)
    stage.flight.n_files = MOST_FILES - 1
    for at_s in (0, 10, 20):
        stage.say(VERDICT, LATCHED, at_s)
    stage.end()
    assert len(stage.whys) == 1


def report(mode):
    state = StationState(mode=mode, reason="said so")
    return StationReport(revision=1, begun=1, state=state)


@pytest.mark.parametrize(
    ("message", "why"),
    [
        (LATCHED, "speed: too fast"),
        (ASIDE, None),
        (Event(what="step failed", detail="gone"), "step failed: gone"),
        (Event(what="anything else"), None),
        (StopAsk(number=3, by="x"), "stop said by x"),
        (report(StationMode.LATCHED), "latched: said so"),
        (report(StationMode.ENGAGED), None),
        (arm_state(Q), None),
    ],
)
def test_what_counts_as_a_stop(message, why):
    assert StopsHeard().why(message) == why


def test_a_stop_that_is_said_again_or_that_lasts_is_told_once():
    heard = StopsHeard()
    assert [heard.why(StopAsk(number=3, by="x")) is None for _ in range(3)] == [False, True, True]
    modes = (StationMode.LATCHED, StationMode.LATCHED, StationMode.ARMED, StationMode.LATCHED)
    assert [heard.why(report(mode)) is None for mode in modes] == [False, True, True, False]


def test_a_time_step_whose_verdict_latched_counts_and_one_that_was_merely_void_does_not():
    executed = Executed(duration_s=0.05, moved_m=(0.0,) * 3, target_m=(0.0,) * 3)
    heard = StopsHeard()
    assert heard.why(StepMark(executed=executed, verdicts=(), is_void=True)) is None
    assert heard.why(StepMark(executed=executed, verdicts=(LATCHED,), is_void=True)) == "speed: too fast"


@pytest.mark.parametrize(("recorded", "n_in_session"), [("whole", 200), ("around_stops", 4)])
def test_a_session_has_every_tick_or_few_and_a_stop_s_file_has_every_one(tmp_path, recorded, n_in_session):
    """Ticks of 2 ms come over a wire, every fiftieth is told by its robot node besides, and then the arm latches."""
    then = resolve(rig="virtual_lab", scenario="paper", learning="default")
    rig = msgspec.structs.replace(then.rig, recorded_ticks=recorded)
    path = tmp_path / "session.mcap"
    recording = Recording(path, msgspec.structs.replace(then, rig=rig), purpose=Purpose.WATCH, seed=0)
    told = ToldTicks(recording.wire_ticks, is_sure=True, is_aside=recording.are_ticks_aside)
    for k in range(1, 201):
        at = k * 2_000_000
        state = arm_state(Q, stamp_ns=at)
        told.take(Tick(at, at, state, command(Q, stamp_ns=at, sequence=k), (), LATCHED if k == 200 else None))
        if k % 50 == 0:
            recording.recorder.write(told.named(ARM_STATE, state), state, log_ns=at, stamp_ns=at)
    recording.close()
    (stop,) = (tmp_path / "stops").glob("session-*.mcap")
    with SessionFile(path) as session, SessionFile(stop) as kept:
        assert sum(1 for _ in session.raw([ARM_STATE.name])) == n_in_session
        assert [raw.log_ns // 2_000_000 for raw in kept.raw([ARM_STATE.name])] == list(range(1, 201))
        assert kept.about["stop"] == "speed: too fast"
        assert {attached.name for attached in kept.attachments()} >= {"config.yaml", "arm.xml"}
