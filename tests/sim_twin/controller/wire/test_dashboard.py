"""The dashboard's exact words, remote control, and rough clients."""

import numpy as np
import pytest

from sim_twin.controller.wire import ControllerVersion, Outcome

pytestmark = pytest.mark.realtime

NOT_REMOTE = (
    "Command is not allowed due to safety reasons, "
    "please switch robot to Remote Control mode and reconnect to port 29999"
)
ACTING = {
    "power on": "Powering on",
    "power off": "Powering off",
    "brake release": "Brake releasing",
    "unlock protective stop": "Protective stop releasing",
    "close safety popup": "closing safety popup",
    "restart safety": "Restarting safety",
    "shutdown": "Shutting down",
    "play": "Starting program",
    "stop": "Stopped",
    "pause": "Pausing program",
    "load a b.urp": "Loading program: a b.urp",
    "load installation default.installation": "Loading installation: default.installation",
    "set operational mode manual": "Operational mode MANUAL is set",
    "set operational mode AUTOMATIC": "Operational mode AUTOMATIC is set",
    "clear operational mode": "No longer controlling the operational mode. Current operational mode: 'NONE'.",
}
TELLING = {
    "robotmode": "Robotmode: RUNNING",
    "safetymode": "Safetymode: NORMAL",
    "safetystatus": "Safetystatus: NORMAL",
    "running": "Program running: false",
    "programState": "STOPPED wipe.urp",
    "get loaded program": "Loaded program: /programs/wipe.urp",
    "isProgramSaved": "true wipe.urp",
    "is in remote control": "true",
    "get operational mode": "NONE",
    "get robot model": "UR5",
    "get serial number": "20215501234",
    "PolyscopeVersion": "URSoftware 5.11.0.108249 (Dec 01 2021)",
    "version": "5.11.0.108249",
    "popup hello there": "showing popup",
    "close popup": "closing popup",
    "addToLog a line": "Added log message",
}
FAILED = {
    "play": "Failed to execute: play",
    "stop": "Failed to execute: stop",
    "pause": "Failed to execute: pause",
    "load a.urp": "Error while loading program: a.urp",
    "load installation a": "Failed to load installation: a",
    "set operational mode manual": "Failed setting operational mode to manual",
    "set operational mode sideways": "Failed setting operational mode to sideways",
}


@pytest.mark.parametrize(("command", "reply"), (ACTING | TELLING).items())
def test_the_exact_words(bench, command, reply):
    client = bench.dashboard()
    assert client.ask(command) == reply
    assert client.ask(command.upper()).lower() == reply.lower()
    assert client.silent()


@pytest.mark.parametrize(("command", "reply"), FAILED.items())
def test_the_words_of_failure(bench, command, reply):
    bench.robot.outcome = Outcome.FAILED
    assert bench.dashboard().ask(command) == reply


@pytest.mark.parametrize(
    ("command", "reply"),
    [
        ("power on", "Powering on"),
        ("power off", "Powering off"),
        ("brake release", "Brake releasing"),
        ("unlock protective stop", "Protective stop releasing"),
        ("restart safety", "Restarting safety"),
        ("close safety popup", "closing safety popup"),
        ("popup x", "showing popup"),
        ("clear operational mode", "No longer controlling the operational mode. Current operational mode: 'NONE'."),
    ],
)
def test_a_command_with_one_known_reply_gives_it_though_nothing_follows(bench, command, reply):
    bench.robot.outcome = Outcome.FAILED
    assert bench.dashboard().ask(command) == reply


def test_a_program_that_is_not_there(bench):
    bench.robot.outcome = Outcome.NOT_FOUND
    assert bench.dashboard().ask("load Missing.urp") == "File not found: Missing.urp"
    assert bench.robot.asked == [("load", "Missing.urp")]


def test_a_protective_stop_is_not_unlocked_in_its_first_five_seconds(bench):
    bench.robot.outcome = Outcome.TOO_EARLY
    assert bench.dashboard().ask("unlock protective stop") == (
        "Cannot unlock protective stop until 5s after occurrence. "
        "Always inspect cause of protective stop before unlocking"
    )


def test_what_is_told_is_what_holds(bench):
    client = bench.dashboard()
    bench.robot.set(
        robot_mode="POWER_OFF",
        safety_mode="SAFEGUARD_STOP",
        safety_status="AUTOMATIC_MODE_SAFEGUARD_STOP",
        program_state="PAUSED",
        program=None,
        is_running=True,
        is_program_saved=False,
    )
    assert client.ask("robotmode") == "Robotmode: POWER_OFF"
    assert client.ask("safetymode") == "Safetymode: SAFEGUARD_STOP"
    assert client.ask("safetystatus") == "Safetystatus: AUTOMATIC_MODE_SAFEGUARD_STOP"
    assert client.ask("running") == "Program running: true"
    assert client.ask("get loaded program") == "No program loaded"
    assert client.ask("programState") == "PAUSED <unnamed>"
    assert client.ask("isProgramSaved") == "false <unnamed>"


@pytest.mark.parametrize("line", ["", "flyaway", "playing", "load_program x", "power", "loadx"])
def test_an_unknown_command_is_echoed(bench, line):
    assert bench.dashboard().ask(line) == f"could not understand: {line}"
    assert bench.robot.asked == []


def test_quit_says_goodbye_and_hangs_up(bench):
    client = bench.dashboard()
    assert client.ask("quit") == "Disconnected"
    assert client.ended()


@pytest.mark.parametrize("command", ACTING)
def test_in_local_control_nothing_acts(bench, command):
    bench.robot.set(is_remote=False)
    client = bench.dashboard()
    assert client.ask(command) == NOT_REMOTE
    assert bench.robot.asked == []


@pytest.mark.parametrize("command", TELLING)
def test_in_local_control_everything_is_told(bench, command):
    bench.robot.set(is_remote=False)
    assert bench.dashboard().ask(command) == TELLING[command].replace(
        "true", "false" if "remote" in command else "true"
    )


def test_a_connection_of_local_control_stays_refused_until_it_reconnects(bench):
    client = bench.dashboard()
    bench.robot.set(is_remote=False)
    assert client.ask("play") == NOT_REMOTE
    bench.robot.set(is_remote=True)
    assert client.ask("is in remote control") == "true"
    assert client.ask("play") == NOT_REMOTE
    assert bench.dashboard().ask("play") == "Starting program"


@pytest.mark.parametrize(
    ("command", "version", "before"),
    [("is in remote control", (5, 6), (5, 5)), ("safetystatus", (5, 4), (5, 3)), ("get serial number", (5, 6), (5, 5))],
)
def test_a_command_comes_with_its_version(make_bench, command, version, before):
    new, old = (make_bench(ControllerVersion(major=v[0], minor=v[1])) for v in (version, before))
    assert new.dashboard().ask(command) != f"could not understand: {command}"
    assert old.dashboard().ask(command) == f"could not understand: {command}"


def test_user_roles_are_of_a_cb3_and_know_no_remote_control(make_bench):
    bench = make_bench(ControllerVersion(major=3, minor=15, bugfix=8))
    bench.robot.set(is_remote=False)
    client = bench.dashboard()
    assert client.ask("setUserRole programmer") == "Setting user role: programmer"
    assert client.ask("play") == "Starting program"
    assert client.ask("is in remote control") == "could not understand: is in remote control"


def test_play_is_answered_once_it_is_known_whether_the_program_began(bench):
    client, other = bench.dashboard(), bench.dashboard()
    bench.robot.outcome = None
    client.send(b"play\nrobotmode\nrunning\n")
    assert client.silent()
    assert other.ask("robotmode") == "Robotmode: RUNNING"
    bench.wires.tick(1)
    assert client.silent()
    bench.robot.outcome = Outcome.FAILED
    bench.wires.tick(2)
    told = [client.line() for _ in range(3)]
    assert told == ["Failed to execute: play", "Robotmode: RUNNING", "Program running: false"]


def test_who_asks_on_and_on_behind_a_reply_that_waits_is_cut_off(bench):
    client, other = bench.dashboard(), bench.dashboard()
    bench.robot.outcome = None
    client.send(b"play\n" + b"running\n" * 90)
    assert client.silent()
    client.send(b"running\n" * 20)
    assert client.ended()
    assert other.ask("running") == "Program running: false"


def test_a_client_that_goes_while_its_reply_waits_is_forgotten(bench):
    client = bench.dashboard()
    bench.robot.outcome = None
    client.send(b"play\n")
    assert client.silent()
    client.socket.close()
    other = bench.dashboard()
    bench.robot.outcome = Outcome.DONE
    for step in range(5):
        bench.wires.poll()
        bench.wires.tick(step)
    assert other.ask("play") == "Starting program"


def test_lines_may_come_in_pieces_or_together(bench):
    client = bench.dashboard()
    for byte in b"robotmode\r\n":
        client.send(bytes([byte]))
        bench.wires.poll()
    assert client.line() == "Robotmode: RUNNING"
    client.send(b"robotmode\nrunning\n")
    assert [client.line(), client.line()] == ["Robotmode: RUNNING", "Program running: false"]


def test_a_line_without_end_costs_the_connection(bench):
    client, other = bench.dashboard(), bench.dashboard()
    client.send(b"x" * 10_000)
    assert client.ended()
    assert other.ask("running") == "Program running: false"


def test_thousands_of_malformed_lines_leave_the_second_client_undisturbed(bench):
    rng = np.random.default_rng(29999)
    rough, other = bench.dashboard(), bench.dashboard()
    words = [b"load", b"set operational mode", b"popup", b"\xff\xfe", b"\0", b" ", b"\r", b"\n", b"quit", b"{0}", b"%s"]
    for i in range(3000):
        picked = [words[k] for k in rng.integers(0, len(words), 3)]
        rough.send(b" ".join([*picked, rng.bytes(int(rng.integers(0, 60)))]) + b"\n")
        bench.wires.poll()
        rough.read()
        rough.stock = b""
        if rough.is_ended:
            rough.socket.close()
            rough = bench.dashboard()
        if i % 10 == 0:
            assert other.ask("robotmode") == "Robotmode: RUNNING"
