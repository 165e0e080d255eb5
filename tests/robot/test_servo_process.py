"""The servo process's server on a pipe: what it says of a latch, and when it ends."""

from multiprocessing import Pipe
from threading import Thread

import msgspec
import pytest

from robot.errors import ArmRefusedError, StaleStateError, WireError
from robot.hal.fake import FakePlant
from robot.messages import ArmMode, GripCommand, Heading
from robot.realtime import CpuPin
from robot.servo_client import ServoClient
from robot.servo_messages import (
    Close,
    Connect,
    Done,
    Engage,
    Failure,
    Reply,
    Request,
    Seed,
    Seeded,
    Stop,
    StrideReply,
    StrideRequest,
    pack_intent,
)
from robot.servo_process import ServoServer
from robot.tick_loop import TickLoop
from tests.support.stations import fake_rig

pytestmark = pytest.mark.realtime

WAIT_S = 10.0


class DiedError(Exception):
    """The process would have ended here."""


class Served:
    """A server in a thread, over a fake arm that can be made to fail."""

    def __init__(self):
        rig = fake_rig()
        self.plant = FakePlant(arm=rig.arm, scenario=rig.scenario, rig=rig.rig)
        self.pulse, self.halt, self.ended_by = [0], [0], None
        self.ours, theirs = Pipe()
        loop = TickLoop(
            arm=self.plant.arm, config=rig.arm, scenario=rig.scenario, rule_sets=rig.rule_sets, rig=rig.rig,
            profile=rig.profile, when_latched=lambda verdict: self.server.latched(verdict),
        )  # fmt: skip
        self.server = ServoServer(
            connection=theirs,
            plant=self.plant,
            loop=loop,
            arm=rig.arm,
            pulse=self.pulse,
            halt=self.halt,
            die=self.die,
            pin=CpuPin(0),
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
        msgspec.msgpack.encode(StrideRequest(intent=pack_intent(intent), grip=grip, n_ticks=1_000_000, sequence=1))
    )
    assert not served.ours.poll(0.05)
    served.fail(StaleStateError("no state"))
    told = served.hear()
    served.thread.join(WAIT_S)
    assert told.stride.is_begun
    assert told.is_asked
    assert told.stride.verdict.reason == "stale_state"
    assert served.ended_by == "death"


def test_a_stop_in_shared_memory_latches_at_the_next_tick(served):
    """Amid a time step as between two: the pipe is not asked, and the process goes on, out of command."""
    grip = GripCommand(opening_m=0.085, force_n=20.0, speed_m_s=0.15)
    intent = Heading(heading_rad=0.0, distance_m=0.01, height_m=0.2)
    served.ours.send_bytes(
        msgspec.msgpack.encode(StrideRequest(intent=pack_intent(intent), grip=grip, n_ticks=1_000_000, sequence=1))
    )
    assert not served.ours.poll(0.05)
    served.halt[0] = 1
    told = served.hear()
    assert (told.stride.verdict.reason, told.stride.verdict.is_latched) == ("stop", True)
    assert told.is_asked
    assert isinstance(served.ask(Stop()), Done)
    refused = served.ask(Engage())
    assert isinstance(refused, Failure)
    assert (refused.kind, refused.is_end) == ("SafetyError", False), "nobody takes it before the stop was carried out"
    served.halt[0] = 0
    assert isinstance(served.ask(Engage()), Done)
    assert isinstance(served.ask(Seed()), Seeded)
    assert isinstance(served.ask(Close()), Done)


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
        came = client.stride(intent, grip, n_ticks=1)
        assert came.verdict.reason == "arm_mode"
        served.plant.arm.mode = ArmMode.RUNNING
        assert client.seed().mode is ArmMode.RUNNING  # and the refusal of the time step is not taken for this answer
    assert isinstance(served.ask(Close()), Done)


@pytest.mark.parametrize("n_deaf", [0, 1, 2])
def test_a_latch_is_told_as_what_it_is_however_late_it_is_heard(served, monkeypatch, n_deaf):
    """It came between two looks at the pipe, and the time step was asked for all the same: its refusal ended a run."""
    client = ServoClient(fake_rig())
    client._connection = served.ours
    client.seed()
    served.plant.arm.mode = ArmMode.PROTECTIVE_STOP
    assert served.ours.poll(WAIT_S)
    hear, heard = served.ours.poll, []

    def deaf(timeout_s):
        heard.append(timeout_s)
        return hear(timeout_s) if timeout_s or len(heard) > n_deaf else False

    monkeypatch.setattr(served.ours, "poll", deaf, raising=False)
    grip = GripCommand(opening_m=0.085, force_n=20.0, speed_m_s=0.15)
    came = client.stride(Heading(heading_rad=0.0, distance_m=0.01, height_m=0.2), grip, n_ticks=1)
    assert came.verdict.reason == "arm_mode"
    served.plant.arm.mode = ArmMode.RUNNING
    assert client.seed().mode is ArmMode.RUNNING
    assert isinstance(served.ask(Close()), Done)


@pytest.mark.parametrize("is_confirmed", [True, False])
def test_a_stop_that_nobody_confirms_is_said_and_ends_the_process(served, is_confirmed):
    served.plant.arm.stop = lambda: is_confirmed
    told = served.ask(Stop())
    if is_confirmed:
        assert isinstance(told, Done)
        assert isinstance(served.ask(Close()), Done)
    else:
        served.thread.join(WAIT_S)
        assert (told.kind, told.is_end) == ("WireError", True)
        assert "at rest" in told.message
        assert served.ended_by == "death"


@pytest.mark.parametrize(("is_confirmed", "kind", "is_end"), [(True, "SafetyError", False), (False, "WireError", True)])
def test_a_stop_that_is_said_as_command_was_just_taken_gives_it_up_again(served, is_confirmed, kind, is_end):
    def engage():
        served.halt[0] = 1

    def stop():
        stops.append(is_confirmed)
        return is_confirmed

    stops = []
    assert isinstance(served.ask(Stop()), Done)
    served.plant.arm.engage, served.plant.arm.stop = engage, stop
    told = served.ask(Engage())
    assert (told.kind, told.is_end) == (kind, is_end)
    assert stops == [is_confirmed]
    if is_confirmed:
        assert isinstance(served.ask(Close()), Done)
    served.thread.join(WAIT_S)
    assert served.ended_by == ("end" if is_confirmed else "death")


def test_a_latch_whose_stop_nobody_confirms_ends_the_process(served):
    served.plant.arm.stop = lambda: False
    served.plant.arm.mode = ArmMode.PROTECTIVE_STOP
    assert served.hear().stride.verdict.reason == "arm_mode"
    served.thread.join(WAIT_S)
    assert served.ended_by == "death"


@pytest.mark.parametrize("error", [StaleStateError("no state"), WireError("no answer")])
@pytest.mark.parametrize("request_", [Engage(), Seed()])
def test_an_arm_lost_outside_a_time_step_is_told_and_ends_the_process(served, error, request_):
    def fail():
        raise error

    assert isinstance(served.ask(Stop()), Done)
    served.plant.arm.engage = served.plant.arm.read = fail
    told = served.ask(request_)
    served.thread.join(WAIT_S)
    assert (told.kind, told.is_end) == (type(error).__name__, True)
    assert served.ended_by == "death"


def test_an_arm_that_refuses_is_asked_again_by_the_same_process(served):
    def refuse():
        raise ArmRefusedError("local control")

    served.plant.arm.engage = refuse
    assert served.ask(Engage()) == Failure(kind="ArmRefusedError", message="local control")
    assert isinstance(served.ask(Close()), Done)
