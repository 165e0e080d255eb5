"""The gripper's client against a server that speaks its protocol on a real socket, driven by hand."""

import socket

import msgspec
import pytest

from config.loader import load_arm
from robot.errors import WireError
from robot.hal import robotiq
from robot.hal.robotiq import GripScale, RobotiqGripper
from robot.hal.rtde_command import RATE_HZ
from robot.messages import GripCommand
from sim_twin.controller.wire.gripper_port import GripperMeasurement, GripperRequest, GripperServer
from sim_twin.controller.wire.peer import Budget
from sim_twin.controller.wire.reactor import Reactor

pytestmark = pytest.mark.realtime

TOOL = load_arm("ur5e").tool
HOST = "127.0.4.3"


class Fingers:
    """What stands behind the port: registers that a test reads and sets."""

    def __init__(self):
        self.registers = GripperRequest(act=1)
        self.asked, self.measured = None, GripperMeasurement(pos=3, pre=3, sta=3, obj=3)

    @property
    def requested(self):
        return self.registers

    def request(self, request):
        self.asked = self.registers = request

    def measure(self):
        return self.measured


class Bench:
    """A gripper, its client, and the turns they take."""

    def __init__(self, monkeypatch):
        self.fingers, self.reactor = Fingers(), Reactor()
        self.port = self.reactor.listen(HOST, 0, GripperServer(target=self.fingers), Budget(bytes_a_poll=256))
        monkeypatch.setattr(robotiq, "GRIPPER_PORT", self.port.number)
        self.gripper = RobotiqGripper(GripScale.of(TOOL))
        self.gripper.connect(HOST)

    def turn(self, until):
        for _ in range(2000):
            self.reactor.poll()
            self.gripper.poll()
            if until():
                return
        raise AssertionError("it did not come within 2,000 turns")


@pytest.fixture
def bench(monkeypatch):
    made = Bench(monkeypatch)
    yield made
    made.gripper.close()
    made.reactor.close()


def poll_on(gripper):
    for _ in range(1000):
        gripper.poll()


def grip(opening_m, force_n=TOOL.force_n[0], speed_m_s=TOOL.speed_m_s[1]):
    return GripCommand(opening_m=opening_m, force_n=force_n, speed_m_s=speed_m_s)


def test_connecting_and_reading_ask_for_no_motion(bench):
    bench.fingers.registers = GripperRequest()
    bench.turn(lambda: bench.gripper.state is not None)
    assert bench.fingers.asked is None
    assert not bench.gripper.is_active
    assert bench.gripper.state.opening_m == pytest.approx(TOOL.stroke_m * (1 - 3 / 255))
    assert not bench.gripper.state.is_moving


class Strokes:
    """Lets a gripper take its time over an activation, turn by turn; `seen` is what it was in."""

    def __init__(self, bench, n_turns):
        self.bench, self.n_turns, self.seen = bench, n_turns, []

    def __call__(self):
        bench, fingers = self.bench, self.bench.fingers
        sta = 0 if not fingers.registers.act else 1 if self.n_turns > 0 else 3
        self.n_turns -= fingers.registers.act
        self.seen.append(sta)
        fingers.measured = GripperMeasurement(pos=3, pre=3, sta=sta, obj=3)
        bench.reactor.poll()
        bench.gripper.poll()


def test_an_activation_begins_with_a_reset_and_is_waited_for(bench):
    bench.turn(lambda: bench.gripper.is_active)
    strokes = Strokes(bench, 20)
    bench.gripper.activate(strokes)
    assert bench.gripper.is_active
    phases = [sta for i, sta in enumerate(strokes.seen) if i == 0 or sta != strokes.seen[i - 1]]
    assert phases[-3:] == [0, 1, 3]
    assert (bench.fingers.registers.act, bench.fingers.registers.gto) == (1, 0)


def test_an_activation_without_end_is_taken_back_and_said(bench):
    with pytest.raises(WireError, match="activation"):
        bench.gripper.activate(Strokes(bench, 10**9), limit_s=0.05)
    bench.turn(lambda: bench.fingers.registers.act == 0)


def test_an_activation_that_is_broken_off_is_taken_back(bench):
    strokes = Strokes(bench, 10**9)

    def see():
        strokes()
        if strokes.seen[-1] == 1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        bench.gripper.activate(see)
    bench.turn(lambda: bench.fingers.registers.act == 0)


def test_an_answer_that_is_lost_where_an_activation_is_broken_off_is_asked_for_again(bench):
    strokes = Strokes(bench, 10**9)

    def see():
        strokes()
        if strokes.seen[-1] == 1 and bench.gripper._is_query_out:
            bench.reactor.poll()
            assert taken_away(bench.gripper)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        bench.gripper.activate(see)
    before = bench.gripper.n_answers
    bench.turn(lambda: bench.gripper.n_answers > before)


def taken_away(gripper):
    """Return what had come and now never will."""
    try:
        return gripper._socket.recv(4096)
    except BlockingIOError:
        return b""


@pytest.mark.parametrize(
    ("pos", "obj", "opening_m", "gto"),
    [
        (120, 0, 0.0, 0),  # closes
        (120, 0, TOOL.stroke_m, 0),  # opens
        (255, 3, 0.0, 0),  # is there: it stands anyway
        (120, 2, 0.0, 1),  # holds
        (120, 1, TOOL.stroke_m, 1),  # holds from within
        (120, 2, TOOL.stroke_m, 0),  # lets go of what it held
    ],
)
def test_a_halt_stands_unless_something_is_held(bench, pos, obj, opening_m, gto):
    bench.fingers.measured = GripperMeasurement(pos=pos, pre=pos, sta=3, obj=obj)
    bench.gripper.command(grip(opening_m))
    n_answers = bench.gripper.n_answers
    bench.turn(lambda: bench.gripper.n_answers > n_answers + 1)
    bench.gripper.halt()
    bench.turn(lambda: bench.gripper.n_answers > n_answers + 3)
    assert (bench.fingers.registers.gto, bench.fingers.registers.act) == (gto, 1)
    bench.gripper.command(grip(opening_m))
    bench.turn(lambda: bench.fingers.registers.gto == 1)


def test_what_somebody_else_asked_for_is_not_halted(bench):
    bench.fingers.registers = GripperRequest(act=1, gto=1, pos=255)
    bench.fingers.measured = GripperMeasurement(pos=120, pre=255, sta=3, obj=0)
    bench.turn(lambda: bench.gripper.state is not None)
    bench.gripper.halt()
    bench.turn(lambda: bench.gripper.n_answers > 4)
    assert bench.fingers.asked is None


@pytest.mark.parametrize(("sta", "flt", "said"), [(0, 0, "STA 0"), (1, 0, "STA 1"), (3, 8, "too hot"), (3, 77, "77")])
def test_a_commanded_gripper_that_obeys_no_more_says_so(bench, sta, flt, said):
    bench.gripper.command(grip(0.0))
    bench.turn(lambda: bench.gripper.n_answers > 2)
    bench.fingers.measured = GripperMeasurement(pos=3, pre=3, sta=sta, obj=3, flt=flt)
    with pytest.raises(WireError, match=said):
        bench.turn(lambda: False)


def test_a_fault_that_comes_and_goes_is_seen_each_time_it_is_there(bench):
    bench.turn(until=lambda: bench.gripper.n_answers >= 3)  # the same answer again and again
    bench.gripper.command(GripCommand(opening_m=0.04, force_n=20.0, speed_m_s=0.05))
    for _ in range(2):
        bench.fingers.measured = msgspec.structs.replace(bench.fingers.measured, flt=5)
        with pytest.raises(WireError, match="fault 5"):
            bench.turn(until=lambda: False)
        assert not bench.gripper.is_active
        bench.fingers.measured = msgspec.structs.replace(bench.fingers.measured, flt=0)
        bench.turn(until=lambda: bench.gripper.is_active)


def poll_long(gripper):
    for _ in range(1000):
        gripper.poll()


def test_a_gripper_that_does_not_take_what_it_is_told_says_so(bench):
    server, peer = socket.create_server((HOST, 0)), None
    try:
        robotiq.GRIPPER_PORT = server.getsockname()[1]  # put back by the bench's own patch
        gripper = RobotiqGripper(GripScale.of(TOOL))
        gripper.connect(HOST)
        peer, _ = server.accept()
        gripper.poll()
        assert peer.recv(256).startswith(b"GET POS")
        gripper.command(GripCommand(opening_m=0.04, force_n=20.0, speed_m_s=0.05))
        assert b"SET" in peer.recv(256)
        peer.sendall(b"?\n")
        with pytest.raises(WireError, match="does not take it"):
            poll_long(gripper)
        gripper.close()
    finally:
        server.close()
        if peer is not None:
            peer.close()


def test_one_that_nobody_commands_may_be_in_any_state(bench):
    bench.fingers.measured = GripperMeasurement(pos=3, pre=3, sta=0, obj=3, flt=8)
    bench.turn(lambda: bench.gripper.n_answers > 4)


def test_a_gripper_without_power_is_said(bench):
    bench.fingers.measured = GripperMeasurement(pos=3, pre=3, sta=0, obj=3, is_powered=False)
    with pytest.raises(WireError, match="power"):
        bench.turn(lambda: False)


def test_a_command_arrives_in_the_grippers_bytes_and_the_same_again_sends_nothing(bench):
    bench.gripper.command(grip(0.0))
    bench.turn(lambda: bench.fingers.asked is not None)
    asked = bench.fingers.asked
    assert (asked.pos, asked.spe, asked.force, asked.gto) == (255, 255, 0, 1)
    bench.fingers.asked = None
    bench.gripper.command(grip(0.0))
    bench.turn(lambda: bench.gripper.state is not None)
    assert bench.fingers.asked is None
    bench.gripper.command(grip(TOOL.stroke_m, force_n=TOOL.force_n[1]))
    bench.turn(lambda: bench.fingers.asked is not None)
    assert (bench.fingers.asked.pos, bench.fingers.asked.force) == (0, 255)


@pytest.mark.parametrize(
    ("obj", "is_moving", "has_object"), [(0, True, False), (1, False, False), (2, False, True), (3, False, False)]
)
def test_only_a_closing_that_was_stopped_holds_an_object(bench, obj, is_moving, has_object):
    bench.fingers.measured = GripperMeasurement(pos=120, pre=255, sta=3, obj=obj)
    bench.gripper.command(grip(0.0))  # its acknowledgement comes without an end of line, before the next answer
    bench.turn(lambda: bench.gripper.state is not None)
    assert (bench.gripper.state.is_moving, bench.gripper.state.has_object) == (is_moving, has_object)
    assert bench.gripper.state.opening_m == pytest.approx(TOOL.stroke_m * (1 - 120 / 255))


@pytest.mark.parametrize(("is_awaited", "least", "most"), [(False, 190, 260), (True, 500, 1000)])
def test_it_is_asked_now_and_then_and_more_often_where_somebody_waits(bench, is_awaited, least, most):
    bench.turn(lambda: bench.gripper.state is not None)
    before = bench.gripper.n_answers
    for _ in range(2000):
        bench.reactor.poll()
        bench.gripper.poll(is_awaited=is_awaited)
    assert least <= bench.gripper.n_answers - before <= most


def test_a_silent_gripper_and_a_closed_connection_are_errors(bench):
    bench.turn(lambda: bench.gripper.state is not None)
    with pytest.raises(WireError, match="powered"):
        poll_on(bench.gripper)
    bench.port.drop_peers()
    with pytest.raises(WireError, match=r"closed|got"):
        poll_on(bench.gripper)


@pytest.mark.parametrize(("is_commanded", "limit"), [(False, robotiq.SILENT_LIMIT), (True, robotiq.WATCHED_LIMIT)])
def test_silence_is_borne_for_so_many_polls_and_not_for_one_more(bench, is_commanded, limit):
    bench.turn(lambda: bench.gripper.state is not None)
    if is_commanded:
        bench.gripper.command(grip(0.0))
    bench.gripper.poll(is_awaited=True)  # the question that nobody answers
    for _ in range(limit):
        bench.gripper.poll()
    with pytest.raises(WireError, match=f"within {limit} polls"):
        bench.gripper.poll()


def test_a_commanded_gripper_that_falls_silent_is_told_within_100_ms():
    slowest_polls = robotiq.ASK_EVERY + robotiq.WATCHED_LIMIT + 1
    assert slowest_polls / RATE_HZ < 0.1


def test_nobody_there_is_said():
    with pytest.raises(WireError, match="URCap"):
        RobotiqGripper(GripScale.of(TOOL)).connect("127.0.4.9", timeout_s=0.2)


def test_a_second_connection_begins_anew_whatever_the_first_was_waiting_for(bench):
    bench.turn(lambda: bench.gripper.state is not None)
    bench.gripper.poll()
    bench.gripper.command(grip(0.0))
    bench.gripper.close()
    bench.gripper.connect(HOST)
    assert bench.gripper.state is None
    bench.turn(lambda: bench.gripper.state is not None)
    bench.fingers.asked = None
    bench.gripper.command(grip(0.0))
    bench.turn(lambda: bench.fingers.asked is not None)
