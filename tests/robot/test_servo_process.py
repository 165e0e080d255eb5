"""The servo process's server on a pipe: what it says of a latch, and when it ends."""

from multiprocessing import Pipe
from threading import Thread

import msgspec
import pytest

from robot.errors import ArmRefusedError, StaleStateError, WireError
from robot.hal.fake import FakePlant
from robot.messages import ArmMode, GripCommand, Heading
from robot.servo_client import ServoClient
from robot.servo_messages import (
    Close,
    Connect,
    Done,
    Engage,
    Reply,
    Request,
    Seed,
    Seeded,
    StrideReply,
    StrideRequest,
    pack_intent,
)
from robot.servo_process import ServoServer
from robot.tick_loop import TickLoop
from tests.support.stations import fake_rig

WAIT_S = 10.0


class DiedError(Exception):
    """The process would have ended here."""


class Served:
    """A server in a thread, over a fake arm that can be made to fail."""

    def __init__(self):
        rig = fake_rig()
        self.plant = FakePlant(arm=rig.arm, scenario=rig.scenario, rig=rig.rig)
        self.pulse, self.ended_by = [0], None
        self.ours, theirs = Pipe()
        loop = TickLoop(
            arm=self.plant.arm, config=rig.arm, scenario=rig.scenario, rule_sets=rig.rule_sets, rig=rig.rig,
            when_latched=lambda verdict: self.server.latched(verdict),
        )  # fmt: skip
        self.server = ServoServer(
            connection=theirs, plant=self.plant, loop=loop, arm=rig.arm, pulse=self.pulse, die=self.die
        )
        self.thread = Thread(target=self.run)
        self.thread.start()

    def die(self):
        raise DiedError

    def run(self):
        try:
            self.server.run()
        except DiedError:
            self.ended_by = "death"
        else:
            self.ended_by = "end"

    def ask(self, request: Request):
        self.ours.send_bytes(msgspec.msgpack.encode(request))
        return self.hear()

    def hear(self):
        assert self.ours.poll(WAIT_S)
        return msgspec.msgpack.decode(self.ours.recv_bytes(), type=Reply)

    def fail(self, error):
        def read():
            raise error

        self.plant.arm.read = read


@pytest.fixture
def served():
    made = Served()
    made.ask(Connect())
    assert isinstance(made.ask(Engage()), Done)
    assert isinstance(made.ask(Seed()), Seeded)
    yield made
    made.ours.close()
    made.thread.join(WAIT_S)


LOSSES = [
    (StaleStateError("no state"), "stale_state", "death"),
    (ArmRefusedError("no program"), "arm_refused", "end"),
    (WireError("no hand"), "wire", "end"),
]


@pytest.mark.parametrize(("error", "reason", "end"), LOSSES)
def test_an_arm_lost_between_time_steps_is_told_unasked_and_ends_the_process(served, error, reason, end):
    served.fail(error)
    told = served.hear()
    served.thread.join(WAIT_S)
    assert isinstance(told, StrideReply)
    assert told.stride.verdict.reason == reason
    assert not told.stride.is_begun
    assert not told.is_asked
    assert served.ended_by == end
    assert served.pulse[0] == 0


def test_an_arm_lost_in_a_time_step_is_told_as_its_end(served):
    grip = GripCommand(opening_m=0.085, force_n=20.0, speed_m_s=0.15)
    intent = Heading(heading_rad=0.0, distance_m=0.01, height_m=0.2)
    served.ours.send_bytes(
        msgspec.msgpack.encode(
            StrideRequest(intent=pack_intent(intent), grip=grip, n_ticks=1_000_000, is_hand_busy=False)
        )
    )
    assert not served.ours.poll(0.05)
    served.fail(StaleStateError("no state"))
    told = served.hear()
    served.thread.join(WAIT_S)
    assert told.stride.is_begun
    assert told.is_asked
    assert told.stride.verdict.reason == "stale_state"
    assert served.ended_by == "death"


def test_a_latch_that_crosses_a_time_step_on_the_way_answers_it_once(served, monkeypatch):
    client = ServoClient(fake_rig())
    client._connection = served.ours
    client.seed()
    served.plant.arm.mode = ArmMode.PROTECTIVE_STOP
    assert served.ours.poll(WAIT_S)
    intent = Heading(heading_rad=0.0, distance_m=0.01, height_m=0.2)
    grip = GripCommand(opening_m=0.085, force_n=20.0, speed_m_s=0.15)
    with monkeypatch.context() as crossing:
        crossing.setattr(client, "_overhear", lambda: None)
        came = client.stride(intent, grip, n_ticks=1, is_hand_busy=False)
        assert came.verdict.reason == "arm_mode"
        served.plant.arm.mode = ArmMode.RUNNING
        assert client.seed().mode is ArmMode.RUNNING  # and the refusal of the time step is not taken for this answer
    assert isinstance(served.ask(Close()), Done)


class Unserved:
    """A server that ticks when it is told to, over a fake arm: what a station's own time comes to."""

    def __init__(self):
        rig = fake_rig()
        self.plant = FakePlant(arm=rig.arm, scenario=rig.scenario, rig=rig.rig)
        self.ours, theirs = Pipe()
        self.loop = TickLoop(
            arm=self.plant.arm, config=rig.arm, scenario=rig.scenario, rule_sets=rig.rule_sets, rig=rig.rig
        )
        self.server = ServoServer(
            connection=theirs, plant=self.plant, loop=self.loop, arm=rig.arm, pulse=[0], die=lambda: None,
        )  # fmt: skip
        for request in (Connect(), Engage(), Seed()):
            self.server._answer(request)
            self.ours.recv_bytes()

    def stride(self, *, n_gap):
        """Carry out a time step of five ticks after a station took so many to decide; return its ticks and its end."""
        for _ in range(n_gap):
            self.server._tick()
        intent = Heading(heading_rad=0.0, distance_m=0.01, height_m=0.2)
        grip = GripCommand(opening_m=0.085, force_n=20.0, speed_m_s=0.15)
        self.server._answer(StrideRequest(intent=pack_intent(intent), grip=grip, n_ticks=5, is_hand_busy=False))
        n = 0
        while not self.ours.poll(0.0):
            self.server._tick()
            n += 1
        return n, msgspec.msgpack.decode(self.ours.recv_bytes(), type=Reply).stride


def strides(gaps):
    served = Unserved()
    return [served.stride(n_gap=n) for n in gaps]


def test_what_a_station_takes_to_decide_is_part_of_the_time_step_and_bends_no_path():
    at_once, later = strides([0] * 8), strides([0, 1, 2, 0, 1, 2, 1, 0])
    assert [n for n, _ in at_once] == [5] * 8
    assert [n for n, _ in later] == [5, 4, 3, 5, 4, 3, 4, 5]
    for (_, one), (_, other) in zip(at_once, later, strict=True):
        assert other.target_m == pytest.approx(one.target_m, abs=1e-9)


def test_an_intent_that_is_too_old_ends_in_a_rest_short_of_where_it_led():
    served = Unserved()
    for _ in range(8):
        _, stride = served.stride(n_gap=0)
    for _ in range(60):
        served.server._tick()
    rest_m = served.loop.report(None, is_begun=True).target_m
    assert stride.after.tcp_position_m[0] < rest_m[0] <= stride.target_m[0]
    assert served.plant.arm.read().tcp_position_m == pytest.approx(rest_m, abs=1e-3)
    assert served.stride(n_gap=0)[0] == 5
