"""The gripper's client against a server that speaks its protocol on a real socket, driven by hand."""

import pytest

from config.loader import load_arm
from robot.errors import WireError
from robot.hal import robotiq
from robot.hal.robotiq import GripScale, RobotiqGripper
from robot.messages import GripCommand
from sim_twin.controller.wire.gripper_port import GripperMeasurement, GripperServer
from sim_twin.controller.wire.peer import Budget
from sim_twin.controller.wire.reactor import Reactor

TOOL = load_arm("ur5e").tool
HOST = "127.0.4.3"


class Fingers:
    """What stands behind the port: registers that a test reads and sets."""

    def __init__(self):
        self.asked, self.measured = None, GripperMeasurement(pos=3, pre=3, sta=0, obj=3)

    def request(self, request):
        self.asked = request

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
    bench.turn(lambda: bench.gripper.state is not None)
    assert bench.fingers.asked is None
    assert not bench.gripper.is_active
    assert bench.gripper.state.opening_m == pytest.approx(TOOL.stroke_m * (1 - 3 / 255))
    assert not bench.gripper.state.is_moving


def test_activation_is_asked_for_and_seen(bench):
    bench.gripper.activate()
    bench.turn(lambda: bench.fingers.asked is not None and bench.fingers.asked.act == 1)
    bench.fingers.measured = GripperMeasurement(pos=3, pre=3, sta=3, obj=3)
    bench.turn(lambda: bench.gripper.is_active)


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
