"""The virtual controller's process: its pace, its addresses, the version that it announces."""

import sys

import pytest
from typer.testing import CliRunner

from sim_twin.controller import server as module
from sim_twin.controller.cli import app
from sim_twin.controller.pacing import Pacer
from sim_twin.controller.server import ControllerServer, Setup, parse_version
from sim_twin.controller.states import SafetyMode
from sim_twin.controller.wire.rtde_codec import Level
from tests.support.virtual_robot import lines, run


def test_a_slept_through_slot_is_skipped_and_counted():
    now, slept = [0], []

    def sleep(seconds):
        slept.append(seconds)
        now[0] += round(seconds * 1e9)

    pacer = Pacer(period_ns=2_000_000, now_ns=lambda: now[0], sleep=sleep)
    pacer.wait()
    assert now[0] == 2_000_000
    now[0] += 9_000_000
    pacer.wait()
    assert pacer.n_missed == 3
    pacer.wait()
    assert now[0] == 12_000_000
    assert pacer.n_missed == 3


def test_only_loopback_is_listened_on_unless_asked():
    with pytest.raises(ValueError, match="loopback"):
        ControllerServer(Setup(host="10.1.2.3"))


@pytest.mark.parametrize("text", ["", "5", "a.b", "1.2.3.4.5", "5.-1", "10.9.0"])
def test_a_version_is_numbers(text):
    with pytest.raises(ValueError, match="version"):
        parse_version(text)
    assert str(parse_version("5.23.1")).startswith("5.23.1.")


def test_a_plane_of_the_set_up_stops_the_tool_that_is_driven_through_it():
    server = ControllerServer(Setup(planes=((0.0, 0.0, 2.0, 0.1),)))
    robot = server.robot
    run(robot, 2)
    above = robot.machine.drive.measured.tcp_pose
    assert above[2] > 0.15
    below = [*above[:2].tolist(), 0.02, *above[3:].tolist()]
    robot.submit_script(f"def f():\n movel(p{below}, a=1.2, v=0.25)\nend\n")
    run(robot, 1000, lambda: robot.machine.modes.safety is SafetyMode.PROTECTIVE_STOP)
    run(robot, 250)
    assert robot.machine.drive.is_standing
    assert 0.06 < robot.machine.drive.measured.tcp_pose[2] < 0.101
    assert [line for line in lines(robot) if line.startswith("C")] == [
        "C152A0: target moves too fast towards a safety plane to stop before it"
    ]
    server.close()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("def f():\n sync()\n movej([0,0)\nend\n", ("line 3", "movej([0,0)")),
        ("def f():\n sync()\n nonsense()\nend\n", ("line 3", "nonsense()")),
        ("def f():\n" + "x = (" * 3000 + "\nend\n", ("script:",)),
    ],
)
def test_a_script_that_is_none_is_told_with_its_line_and_ends_the_command(tmp_path, text, words):
    file = tmp_path / "bad.script"
    file.write_text(text)
    with pytest.raises(ValueError, match="script"):
        ControllerServer(Setup(script=text))
    result = CliRunner().invoke(app, ["--host", "127.0.0.10", "--script", str(file)])
    assert result.exit_code == 2
    assert result.output.startswith("error: script: ")
    assert result.output.count("\n") == 1
    assert all(word in result.output for word in words)


def test_rtdes_clients_hear_errors_in_words(monkeypatch):
    server, said = ControllerServer(Setup()), []
    monkeypatch.setattr(server.wires.rtde, "say", lambda message, **how: said.append((message, how["level"])))
    server.robot.machine.journal.error(153, 2, "position deviates")
    server.tick()
    server.tick()
    assert said == [("C153A2: position deviates", Level.ERROR)]
    server.close()


class FakeGc:
    def __init__(self):
        self.threshold, self.n_full = (700, 10, 10), 0

    def collect(self):
        self.n_full += 1

    def freeze(self):
        assert self.n_full == 1

    def get_threshold(self):
        return self.threshold

    def set_threshold(self, *threshold):
        self.threshold = threshold


def test_rubbish_is_looked_for_only_while_there_is_no_program(monkeypatch):
    fake, switch_s, left = FakeGc(), sys.getswitchinterval(), [12]
    monkeypatch.setattr(module, "gc", fake)
    monkeypatch.setattr(module, "SWEEP_TICKS", 1)
    server = ControllerServer(Setup())

    def is_over():
        left[0] -= 1
        if left[0] == 6:
            assert fake.n_full > 3
            server.robot.submit_script("def f():\n while True:\n  sync()\n end\nend\n")
            fake.n_full = 0
        return left[0] <= 0

    try:
        server.run(when_ready=lambda: None, is_over=is_over)
    finally:
        sys.setswitchinterval(switch_s)
        server.close()
    assert fake.n_full == 0, "neither while it compiles nor while it runs"
    assert fake.threshold[2] > 1e6, "nor by Python itself"


@pytest.mark.parametrize("plane", [(0.0, 0.0, 0.0, 0.1), (0.0, float("nan"), 1.0, 0.1), (0.0, 0.0, 1.0, float("inf"))])
def test_a_plane_without_a_normal_or_a_place_is_refused(plane):
    with pytest.raises(ValueError, match="plane"):
        ControllerServer(Setup(planes=(plane,)))
