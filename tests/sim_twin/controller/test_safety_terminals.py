"""Safety inputs of the installation, and their faults: E-stop of the system, safeguard and its reset, reduced mode."""

import pytest

from sim_twin.controller.faults import FaultError, Faults
from sim_twin.controller.safety_terminals import SafetyTerminals, parse_safety_input
from sim_twin.controller.server import ControllerServer, Setup
from sim_twin.controller.states import RobotMode, RuntimeState, SafetyMode
from sim_twin.controller.ticks import TickTimes
from tests.support.virtual_robot import FOREVER, make_robot, run, state_of

WIRED = {"system_estop": "CI0", "safeguard": "CI2", "safeguard_reset": "CI4", "reduced": "CI6"}


def wired(pins=WIRED):
    robot = make_robot(safety=SafetyTerminals(pins))
    robot.submit_script(FOREVER)
    run(robot, 5, lambda: state_of(robot) is RuntimeState.PLAYING)
    run(robot)
    return robot, Faults(robot, None, TickTimes()).apply


def test_closed_inputs_are_high_and_stop_nothing():
    robot, _ = wired()
    assert robot.outputs["actual_configurable_digital_input_bits"]() == 0b11001111, "the reset is a button"
    assert robot.machine.modes.safety is SafetyMode.NORMAL
    robot.forced_inputs = 0xFFFF
    run(robot)
    assert robot.outputs["actual_configurable_digital_input_bits"]() == 0b11001111, "the table is not seen there"


def test_the_systems_emergency_stop_takes_the_power_until_it_is_closed_again():
    robot, fault = wired()
    assert "refusal" not in fault("terminal", name="system_estop")
    run(robot, 300)
    modes = robot.machine.modes
    assert (modes.safety, modes.robot) == (SafetyMode.SYSTEM_EMERGENCY_STOP, RobotMode.POWER_OFF)
    assert robot.outputs["safety_status_bits"]() == 1 << 5 | 1 << 7 | 1 << 10
    assert robot.outputs["actual_configurable_digital_input_bits"]() & 0b11 == 0
    fault("terminal", name="system_estop", on=True)
    assert modes.safety is SafetyMode.NORMAL


def test_the_truth_tells_which_inputs_are_wired_and_closed():
    _, fault = wired({"safeguard": "CI2", "safeguard_reset": "CI4"})
    assert fault("truth")["safety_inputs"] == {"safeguard": True, "safeguard_reset": False}
    fault("terminal", name="safeguard")
    assert fault("truth")["safety_inputs"] == {"safeguard": False, "safeguard_reset": False}
    assert wired({})[1]("truth")["safety_inputs"] == {}


def test_a_safeguard_with_a_reset_waits_for_its_button():
    robot, fault = wired()
    fault("terminal", name="safeguard")
    run(robot, 200)
    assert "close it first" in fault("terminal", name="safeguard_reset", on=True)["refusal"]
    fault("terminal", name="safeguard_reset")
    fault("terminal", name="safeguard", on=True)
    run(robot, 50)
    assert robot.machine.modes.safety is SafetyMode.SAFEGUARD_STOP
    fault("terminal", name="safeguard_reset", on=True)
    run(robot, 50)
    assert (robot.machine.modes.safety, state_of(robot)) == (SafetyMode.NORMAL, RuntimeState.PLAYING)


def test_a_safeguard_without_a_reset_goes_on_by_itself_and_reduced_mode_follows_its_input():
    robot, fault = wired({"safeguard": "CI2", "reduced": "CI6"})
    fault("terminal", name="safeguard")
    run(robot, 200)
    fault("terminal", name="safeguard", on=True)
    run(robot, 50)
    assert state_of(robot) is RuntimeState.PLAYING
    for is_on, safety in ((False, SafetyMode.REDUCED), (True, SafetyMode.NORMAL)):
        fault("terminal", name="reduced", on=is_on)
        assert robot.machine.modes.safety is safety


def test_without_terminals_the_same_happens_by_name():
    robot, fault = wired({})
    with pytest.raises(FaultError, match="--safety-input"):
        fault("terminal", name="system_estop")
    assert "close it first" not in str(fault("safeguard_reset"))
    fault("system_estop")
    assert robot.machine.modes.safety is SafetyMode.SYSTEM_EMERGENCY_STOP
    assert "refusal" not in fault("system_estop_release")
    assert robot.machine.modes.safety is SafetyMode.NORMAL


@pytest.mark.parametrize("text", ["", "system_estop", "system_estop=CI1", "door=CI0", "system_estop=CI0=CI2"])
def test_what_is_no_safety_input_is_refused(text):
    with pytest.raises(ValueError, match="safety input"):
        parse_safety_input(text)


def test_a_terminal_has_one_function():
    with pytest.raises(ValueError, match="once each"):
        SafetyTerminals({"system_estop": "CI0", "safeguard": "CI0"})
    with pytest.raises(ValueError, match="once each"):
        ControllerServer(Setup(safety_inputs={"system_estop": "CI0", "safeguard": "CI0"}))
