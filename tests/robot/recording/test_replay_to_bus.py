"""A session is said again at its own times, as fast and from where it is wanted, and never to an arm."""

import socket
import time

import pytest
from typer.testing import CliRunner

from robot.bus import TOPICS, Bus, BusError, Role
from robot.bus.topics import ARM_STATE, ASK, BEAT, CAMERA_FRAME, INTENT, LAY_OUT, PERCEPT, STOP, TWIN_POSE, VERDICT
from robot.messages import Outcome, Verdict
from robot.recording.cli import app
from robot.recording.errors import UnfitError
from robot.recording.recorder import Recorder
from robot.recording.replay_to_bus import REPLAYED, BusReplay, replay_to_bus, said_in
from robot.recording.session_file import SessionFile
from robot.recording.sink import Sink
from robot.recording.topics import LANES
from tests.support.stations import arm_state, percept

S = 1_000_000_000
BEGIN_NS, PERIOD_NS = 7 * S, 100_000_000
Q = (0.0, -1.5, 1.5, -1.5, -1.5, 0.0)
N = 30


@pytest.fixture
def path(tmp_path):
    """Return a session of three seconds, ten percepts a second, measured every 2 ms, by the host's clock."""
    made = tmp_path / "session.mcap"
    recorder = Recorder(Sink(made, may_wait=True), lanes=LANES)
    recorder.note("session", {"serial": "4711", "clock": "host"})
    for n in range(N):
        at = BEGIN_NS + n * PERIOD_NS
        recorder.write(PERCEPT, percept({}, tcp_m=(n, 0.0, 0.0), stamp_ns=at - S // 50), log_ns=at)
        recorder.write(VERDICT, Verdict(stamp_ns=at, sequence=n, outcome=Outcome.PASSED), log_ns=at)
    for k in range(N * 50):
        at = BEGIN_NS + k * S // 500
        recorder.write(ARM_STATE, arm_state(Q, stamp_ns=at), log_ns=at)
    recorder.close()
    return made


class Clock:
    """Time that passes only when somebody waits."""

    def __init__(self):
        self.now_ns = 1000 * S

    def wait(self, seconds):
        self.now_ns += max(1, round(seconds * S))


def replayed(path, clock, *, rate=1.0, on_put=lambda replay, said: None, **span):
    said = []
    with SessionFile(path) as session:

        def put(topic, message, stamp_ns):
            said.append((topic.name, message, (clock.now_ns - 1000 * S) / S))
            on_put(replay, said)

        replay = BusReplay(session, put, rate=rate, now_ns=lambda: clock.now_ns, wait=clock.wait)
        came_to = replay.run(**span)
    return said, came_to


@pytest.mark.parametrize("rate", [0.5, 1.0, 4.0])
def test_messages_come_at_their_times_as_fast_as_is_asked(path, rate):
    said, came_to = replayed(path, Clock(), rate=rate)
    percepts = [at for name, _, at in said if name == PERCEPT.name]
    assert percepts == pytest.approx([n * 0.1 / rate for n in range(N)], abs=1e-3)
    assert came_to.late_ms < 1.0
    assert came_to.n_by_topic[VERDICT.name] == N


def test_a_message_says_that_it_is_as_old_as_it_was_then(path):
    said, _ = replayed(path, Clock())
    for name, message, at_s in said:
        if name == PERCEPT.name:
            assert message.stamp_ns == pytest.approx(1000 * S + at_s * S - S // 50, abs=S // 1000)


def test_a_span_is_said_from_its_beginning_to_its_end(path):
    said, _ = replayed(path, Clock(), from_s=1.0, to_s=1.5)
    assert [message.tcp_position_m[0] for name, message, _ in said if name == PERCEPT.name] == [10, 11, 12, 13, 14, 15]


def test_who_seeks_is_taken_there_at_once(path):
    def seek(replay, said):
        if len([1 for name, _, _ in said if name == PERCEPT.name]) == 3 and not sought:
            sought.append(1)
            replay.seek(2.5)

    sought = []
    said, _ = replayed(path, Clock(), on_put=seek)
    places = [message.tcp_position_m[0] for name, message, _ in said if name == PERCEPT.name]
    assert places == [0, 1, 2, 25, 26, 27, 28, 29]


def test_ticks_are_thinned_to_what_a_bus_carries(path):
    with SessionFile(path) as session:
        n = sum(1 for said in said_in(session) if said.topic is ARM_STATE)
    assert 0.9 * 3 * 2 * ARM_STATE.rate_hz <= n <= 3 * 2 * ARM_STATE.rate_hz + 1


def test_nothing_that_commands_an_arm_or_speaks_for_a_world_is_replayed():
    forbidden = {INTENT.name, STOP.name, BEAT.name, ASK.name, LAY_OUT.name, TWIN_POSE.name, CAMERA_FRAME.name}
    assert not forbidden & {topic.name for topic in REPLAYED}
    assert {topic.name for topic in REPLAYED} <= {topic.name for topic in TOPICS}


def test_a_session_that_says_nothing_of_the_kind_is_refused(tmp_path):
    path = tmp_path / "empty.mcap"
    Recorder(Sink(path, may_wait=True), lanes=LANES).close()
    with pytest.raises(UnfitError, match="percept"):
        replay_to_bus(path)


@pytest.fixture
def endpoint():
    with socket.create_server(("127.0.0.108", 0)) as free:
        return f"tcp/127.0.0.108:{free.getsockname()[1]}"


@pytest.mark.realtime
def test_who_listens_on_that_bus_hears_it_under_the_plants_serial(path, endpoint):
    from threading import Thread

    heard, is_over = [], []
    thread = Thread(target=lambda: replay_to_bus(path, endpoint=endpoint, should_stop=lambda: bool(is_over)))
    thread.start()
    end_s = time.monotonic() + 20.0
    while not heard and time.monotonic() < end_s:
        try:
            with Bus(endpoint, serial="4711", role=Role.VIEWER) as bus:
                subscriber = bus.subscriber(PERCEPT, heard.append)
                while not heard and thread.is_alive() and time.monotonic() < end_s:
                    time.sleep(0.02)
                subscriber.close()
        except BusError:
            time.sleep(0.05)  # it is not open yet
    is_over.append(True)
    thread.join()
    assert heard
    assert heard[0].message.tcp_position_m[0] < N


@pytest.mark.realtime
def test_where_a_rigs_own_bus_is_open_the_replay_is_refused(path, endpoint):
    with (
        Bus(endpoint, serial="4711", role=Role.TWIN, is_hub=True),
        pytest.raises(BusError),
    ):
        replay_to_bus(path, endpoint=endpoint)


def test_the_command_asks_for_no_rig_of_a_bus(path):
    done = CliRunner().invoke(app, ["replay", str(path), "--to", "bus", "--rig", "twin"])
    assert done.exit_code == 2
