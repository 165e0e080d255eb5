"""What a recorder on the bus writes down of a learner is lived through again to the same learner, bit for bit."""

import socket
import threading
import time

import msgspec
import pytest

from learning.assembly import build_agent
from learning.checkpoint import encode
from learning.fingerprint import fingerprint
from learning.recorded import RecordedDecisions
from learning.replaying import replay_to_learning
from robot.bus import TOPICS, Bus, Role
from robot.bus.topics import PERCEPT, REQUESTED, SENT, VERDICT
from robot.node import NodeAsker, RemoteStation
from robot.recording.bus_account import BusAccount
from robot.recording.bus_recorder import BusRecorder
from robot.recording.checking import check
from robot.recording.cutting import merge
from robot.recording.session_file import SessionFile
from robot.recording.session_files import SessionFiles
from sim_twin.operator import SimulatedOperator
from tests.support.robot_node import SERIAL, Node
from tests.support.stations import fake_rig

pytestmark = pytest.mark.realtime

HOST, SEED = "127.0.0.105", 5


def resolved():
    """Return the fake rig with a learner of short epochs."""
    full = fake_rig()
    short = msgspec.structs.replace(full.learning.experiment, trials=2, steps=10)
    return msgspec.structs.replace(full, learning=msgspec.structs.replace(full.learning, experiment=short))


class Recorder:
    """A recorder node in a thread."""

    def __init__(self, endpoint, folder):
        self.bus = Bus(endpoint, serial=SERIAL, role=Role.RECORDER)
        self.bus.open()
        files = SessionFiles(folder, resolved(), person="nobody")
        self.recorder = BusRecorder(self.bus, files, [topic for topic in TOPICS if topic.is_recorded])
        self.is_over = threading.Event()
        self.thread = threading.Thread(target=self.recorder.run, args=(self.is_over.is_set,))
        self.thread.start()

    def close(self):
        self.is_over.set()
        self.thread.join()
        self.bus.close()


class Learner:
    """A learner over the bus that gives an account of itself."""

    def __init__(self, endpoint):
        self.bus = Bus(endpoint, serial=SERIAL, role=Role.LEARNING)
        self.bus.open()
        self.remote = RemoteStation(self.bus, asker=NodeAsker(self.bus, wait_s=5.0))
        self.account = BusAccount(self.remote.open_account(), resolved(), seed=SEED)
        self.station = self.account.station(self.remote)
        self.agent = build_agent(resolved(), self.station.spec, seed=SEED)
        self.heard = RecordedDecisions(self.account, [goal.name for goal in fake_rig().scenario.goals])
        self.agent.witness = self.heard
        SimulatedOperator().arm_once(self.remote)  # last: a lease ends while torch is imported
        self.account.open(0, encode(self.agent.state_dict()))
        self.n_done = 0

    def learn(self, n=1):
        for _ in range(n):
            goal = self.agent.choose_goal()
            self.agent.learn_epoch(self.station, epoch=self.n_done, seed=self.n_done, goal=goal)
            self.n_done += 1
            self.heard.captured(self.n_done, self.agent)
            self.account.kept(self.n_done, lambda: encode(self.agent.state_dict()))

    def until_written(self):
        until(lambda: not self.account.recorder.n_waiting or self.account.recorder.tell_again())

    def close(self):
        self.account.close()
        self.remote.close()


@pytest.fixture
def endpoint():
    with socket.create_server((HOST, 0)) as free:
        return f"tcp/{HOST}:{free.getsockname()[1]}"


def until(is_so, timeout_s=10.0):
    end_s = time.monotonic() + timeout_s
    while not is_so():
        assert time.monotonic() < end_s
        time.sleep(0.02)


def test_what_was_recorded_over_the_bus_is_replayed_to_the_same_learner(endpoint, tmp_path):
    node = Node(endpoint)
    recorder = Recorder(endpoint, tmp_path)
    learner = Learner(endpoint)
    learner.learn(2)
    learner.until_written()
    learner.close()
    recorder.close()
    node.close()
    path = max(tmp_path.glob("*.mcap"))
    replayed, agent = replay_to_learning(path)
    assert (replayed.is_identical, replayed.diverged, replayed.n_done) == (True, "", 2)
    assert fingerprint(agent.state_dict()) == fingerprint(learner.agent.state_dict())
    assert replayed.n_steps > 20
    with SessionFile(path) as session:
        checked = check(session)
        n = {t.name: sum(1 for _ in session.messages(t)) for t in (PERCEPT, REQUESTED, SENT, VERDICT)}
        bus_percepts = sum(1 for _ in session.raw(["bus/percept"]))
    # A busy machine is late, and a topic of which the newest counts may leave some out; what is learnt from may not.
    wrong = [f for f in checked.findings if f.severity == "error" and f.kind != "gap"]
    assert [
        f
        for f in wrong
        if f.kind != "lost messages"
        or f.topic not in ("arm/state", "command/requested", "command/sent", "verdict", "health")
    ] == []
    assert n[PERCEPT.name] == replayed.n_steps + 2
    assert bus_percepts >= replayed.n_steps
    # Of these the newest counts, and a busy machine may leave some out.
    assert min(n[REQUESTED.name], n[SENT.name], n[VERDICT.name]) > replayed.n_steps


@pytest.mark.slow
def test_a_recorder_that_is_started_in_the_midst_of_an_account_opens_a_file_at_the_next_epoch(endpoint, tmp_path):
    node = Node(endpoint)
    learner = Learner(endpoint)
    first = Recorder(endpoint, tmp_path)
    learner.learn()
    learner.until_written()
    first.close()
    second = Recorder(endpoint, tmp_path)
    learner.learn()
    learner.until_written()
    learner.learn(2)
    learner.close()
    second.close()
    node.close()
    paths = sorted(tmp_path.glob("*.mcap"))
    whole = {}
    for path in paths:
        with SessionFile(path) as session:
            whole[path] = session.about
    opened = [path for path, about in whole.items() if about["purpose"] == "learn"]
    continued = [path for path, about in whole.items() if "continues" in about]
    last, _ = replay_to_learning(opened[-1])
    assert last.is_identical
    assert last.sha256 == fingerprint(learner.agent.state_dict())
    assert whole[opened[-1]]["n_done"] != "0"
    merged = tmp_path / "merged"
    merge([*opened[:-1], *continued], merged)
    gone_on, _ = replay_to_learning(merged)
    assert (gone_on.diverged, gone_on.is_identical) == ("", True)
    assert gone_on.n_done >= 2


def test_a_learner_waits_for_no_recorder(endpoint):
    node = Node(endpoint)
    learner = Learner(endpoint)
    learner.learn()
    begun_s = time.monotonic()
    learner.close()
    assert time.monotonic() - begun_s < 2.0
    assert learner.account.recorder.n_waiting > 20
    node.close()
