"""Whole drives on the twin, judged on the physics' own joints."""

import itertools
import math
from types import SimpleNamespace

import msgspec
import numpy as np
import pytest
import yaml
from typer.testing import CliRunner

from config.loader import resolve
from robot.cli import app
from robot.errors import SafetyError
from robot.messages import Grip, StationMode
from robot.rigs import build_plant, build_station
from robot.teleop.driver import Driver, Unpaced
from robot.teleop.jog import Jog, JogLimits
from robot.teleop.script import ScriptedDevice
from sim_twin.operator import SimulatedOperator

STEP_S, FULL_M_S = 0.02, 0.25
LIMITS = JogLimits(full_m_s=FULL_M_S, full_rad_s=0.8, ramp_s=0.25, deadline_s=0.1, step_s=STEP_S)
RAMP_DOWN_S = 0.25
"""Braking from full speed within the arm's acceleration and jerk, and the servo's lag after it."""
STILL_RAD_S = 5e-3


@pytest.fixture
def ride(tmp_path):
    """Drives a twin by a script and tells of every step: the joints' speeds, commands, views."""
    stations = []

    def drive(steps, *, rearm=lambda _: False, during=lambda _: None):
        (tmp_path / "script.yaml").write_text(yaml.safe_dump({"steps": steps}))
        resolved = resolve(rig="twin", scenario="paper")
        plant = build_plant(rig=resolved.rig, arm=resolved.arm, scenario=resolved.scenario)
        told = SimpleNamespace(qvel=[], commands=[], views=[], tcp=[])
        write = plant.arm.write
        plant.arm.write = lambda command: (told.commands.append(command), write(command))
        station = build_station(resolved, plant=plant)
        stations.append(station)
        SimulatedOperator().arm_once(station)
        station.reset(seed=1, epoch=0)
        pace = Unpaced(step_s=STEP_S)

        def tell(view):
            told.views.append(view)
            told.qvel.append(np.abs(plant.world.data.qvel[:6]).max())
            told.tcp.append(view.measured.tcp_position_m)
            during(SimpleNamespace(station=station, plant=plant, n=len(told.views), told=told))

        told.station, told.plant = station, plant
        told.driver = Driver(
            station=station,
            device=ScriptedDevice(detail=str(tmp_path / "script.yaml"), now_ns=pace.now_ns, step_s=STEP_S),
            jog=Jog(LIMITS), pace=pace, step_s=STEP_S, rearm=rearm, tell=tell,
        )  # fmt: skip
        told.end = told.driver.run()
        return told

    yield drive
    for station in stations:
        station.close()


def speed_m_s(told, k):
    return math.dist(told.tcp[k - 10], told.tcp[k]) / (10 * STEP_S)


def first_still(told, begin):
    """Steps from a step until nothing moves any more, for good."""
    moving = [k for k in range(begin, len(told.qvel)) if told.qvel[k] > STILL_RAD_S]
    return (moving[-1] + 1 if moving else begin) - begin


def test_full_speed_is_full_speed_and_half_of_it_half(ride):
    whole = ride([{"for_s": 1.0, "linear": [0, 1, 0]}])
    half = ride([{"for_s": 1.0, "linear": [0, 1, 0], "speed_share": 0.5}])
    assert speed_m_s(whole, 49) == pytest.approx(FULL_M_S, rel=0.02)
    assert speed_m_s(half, 49) == pytest.approx(0.5 * speed_m_s(whole, 49), rel=0.02)


def test_what_is_let_go_of_is_at_rest_within_the_time_that_braking_takes(ride):
    told = ride([{"for_s": 1.0, "linear": [0, 1, 0]}, {"for_s": 1.0, "is_held": False}])
    assert told.qvel[49] > 0.1
    assert first_still(told, 50) * STEP_S <= RAMP_DOWN_S


def test_a_device_that_falls_silent_is_at_rest_within_its_deadline_and_that_time(ride):
    told = ride([{"for_s": 1.0, "linear": [0, 1, 0]}, {"for_s": 1.0, "is_silent": True}])
    assert told.views[54].resting == ""
    assert told.views[55].resting == "silent"
    assert first_still(told, 50) * STEP_S <= LIMITS.deadline_s + RAMP_DOWN_S


def test_after_a_clutch_the_first_command_is_where_the_arm_is(ride):
    told = ride([
        {"for_s": 0.6, "linear": [0, 1, 0]},
        {"for_s": 0.6, "linear": [1, 0, 1], "is_clutched": True},
        {"for_s": 0.6, "linear": [0, -1, 0]},
    ])  # fmt: skip
    per_step = 2  # ticks of 10 ms
    rest = told.commands[59 * per_step - 1].q_rad
    first = told.commands[60 * per_step].q_rad
    assert max(told.qvel[45:60]) < STILL_RAD_S
    assert np.abs(np.subtract(first, rest)).max() <= 1e-3
    assert np.abs(np.subtract(first, told.views[59].measured.q_rad)).max() <= 1e-3
    steps = np.abs(np.diff([c.q_rad for c in told.commands], axis=0)).max(axis=1)
    assert steps.max() <= 0.02
    assert speed_m_s(told, 89) == pytest.approx(FULL_M_S, rel=0.05)


def test_at_the_end_the_arm_is_at_rest_whatever_was_asked_last(ride):
    told = ride([{"for_s": 1.0, "linear": [0, 1, 0]}])
    assert told.end.is_at_rest
    assert np.abs(told.plant.world.data.qvel[:6]).max() < STILL_RAD_S


def test_the_hand_closes_and_opens_as_asked_and_no_reflex_moves_it(ride):
    told = ride([
        {"for_s": 0.8, "is_held": False, "grip": "close"},
        {"for_s": 0.4, "is_held": False},
        {"for_s": 0.8, "is_held": False, "grip": "open"},
    ])  # fmt: skip
    assert told.views[38].measured.grip.opening_m < 0.005
    assert told.views[58].measured.grip.opening_m < 0.005
    assert told.views[-1].measured.grip.opening_m > 0.08
    assert {view.asked.grip for view in told.views} == {Grip.CLOSE, Grip.OPEN}


def test_a_latch_asks_a_person_and_starts_from_where_the_arm_is_then(ride):
    asked = []

    def stop_once(now):
        if now.n == 30:
            now.station.stop(by="a tester")

    def rearm(state):
        asked.append(state)
        SimulatedOperator().rearm(stations[0], seed=1, epoch=1)
        return True

    stations = []

    def during(now):
        stations[:] = [now.station]
        now.told.n_at_latch = getattr(now.told, "n_at_latch", None) or (len(now.told.commands) if now.n == 30 else None)
        stop_once(now)

    told = ride([{"for_s": 1.4, "linear": [0, 1, 0]}], rearm=rearm, during=during)
    assert [(state.mode, state.reason) for state in asked] == [(StationMode.LATCHED, "stopped by a tester")]
    assert told.end.n_latches == 1
    first = told.commands[told.n_at_latch].q_rad
    measured_then = told.views[30].measured.q_rad
    assert np.abs(np.subtract(first, measured_then)).max() <= 2e-3


def test_a_latch_that_nobody_clears_ends_the_drive_and_says_why(ride):
    def stop(now):
        if now.n == 10:
            now.station.stop(by="a tester")

    with pytest.raises(SafetyError, match="latched: stopped by a tester"):
        ride([{"for_s": 1.0, "linear": [0, 1, 0]}], during=stop)


def test_the_workspace_stops_a_driver_at_it_and_says_so(ride):
    told = ride([{"for_s": 4.0, "linear": [0, 1, 0]}])
    high_y = resolve(rig="twin", scenario="paper").arm.motion.workspace_m[1][1]
    assert told.views[-1].result.executed.limiters == ("workspace",)
    assert high_y - 0.01 < told.views[-1].measured.tcp_position_m[1] <= high_y + 1e-3
    assert told.station.state.mode is StationMode.ENGAGED


# --------------------------------------------------------------------------------------------------- the command line

SCRIPT = {
    "steps": [
        {"for_s": 0.6, "linear": [0.5, 0.5, 0.0]},
        {"for_s": 0.3, "is_held": False},
        {"for_s": 0.5, "linear": [0.0, 0.0, 1.0], "frame": "tool", "speed_share": 0.5, "grip": "close"},
    ]
}


def teleop(*more):
    return CliRunner().invoke(app, ["teleop", *map(str, more)])


@pytest.fixture
def script(tmp_path):
    path = tmp_path / "drive.yaml"
    path.write_text(yaml.safe_dump(SCRIPT))
    return path


def test_a_scripted_drive_from_the_command_line_is_the_same_every_time(script):
    ends = []
    for _ in range(2):
        done = teleop("--rig", "twin", "--device", f"script:{script}", "--no-view", "--fast", "--json")
        assert done.exit_code == 0, done.stderr
        ends.append(msgspec.json.decode(done.stdout))
    assert ends[0] == ends[1]
    assert ends[0]["is_at_rest"]
    assert ends[0]["n_latches"] == 0
    assert ends[0]["n_steps"] >= 70


def test_speed_is_a_share_of_full_speed(script):
    script.write_text(yaml.safe_dump({"steps": [{"for_s": 1.0, "linear": [0.0, 1.0, 0.0]}]}))
    at = [
        msgspec.json.decode(
            teleop("--device", f"script:{script}", "--no-view", "--fast", "--json", "--speed", speed).stdout
        )["tcp_m"][1]
        for speed in ("0.25", "0.5", "1.0")
    ]
    (a, b, c) = at
    assert (c - b) == pytest.approx(2 * (b - a), rel=0.1)


@pytest.mark.parametrize(
    ("arguments", "words", "code"),
    [
        (("--device", "joystick"), ("expected one of keyboard, gamepad, spacemouse, script", "joystick"), 2),
        (("--device", "script"), ("script:FILE",), 2),
        (("--device", "script:/nowhere.yaml"), ("a file that can be read",), 2),
        (("--device", "keyboard"), ("expected a terminal as standard input",), 2),
        (("--device", "keyboard", "--fast"), ("lock-step", "script"), 2),
    ],
)
def test_what_is_wrong_is_one_line(arguments, words, code):
    done = teleop("--no-view", *arguments)
    assert done.exit_code == code
    for word in words:
        assert word in done.stderr


def test_a_script_with_a_wrong_key_is_told_by_its_place(script):
    script.write_text(yaml.safe_dump({"steps": [{"for_s": 1.0, "lineal": [1, 0, 0]}]}))
    done = teleop("--device", f"script:{script}", "--no-view")
    assert done.exit_code == 2
    assert "steps[0]" in done.stderr
    assert "did you mean linear?" in done.stderr


def test_the_scripted_device_spreads_its_steps_by_their_middle(script):
    device = ScriptedDevice(detail=str(script), now_ns=itertools.count(0, 20_000_000).__next__, step_s=STEP_S)
    said = list(itertools.takewhile(lambda asked: not asked.is_over, iter(device.read, None)))
    assert len(said) == 70
    assert sum(asked.is_held for asked in said) == 55
    assert said[-1].grip is Grip.CLOSE
