"""A press of a wired button arms an arm behind the genuine client, by the virtual controller's own terminals."""

import time

import pytest
import yaml

from config.loader import resolve
from robot.errors import SafetyError
from robot.messages import StationMode
from robot.person import PersonOperator
from robot.rigs import build_station
from tests.support.small_lab import controller_of, make_lab

pytestmark = [pytest.mark.realtime, pytest.mark.slow]

pytest.importorskip("rtde_control", reason="the genuine client comes with `pip install autotelic[lab]`")

HOST = "127.0.0.60"
CELL = """\
name: with_button
inputs:
  - {signal: 0, pin: DI0}
  - {signal: 1, pin: DI1}
  - {signal: 2, pin: DI2}
  - {signal: 9, pin: CI7, inverted: true}
outputs:
  - {signal: 0, pin: DO0}
  - {signal: 1, pin: DO1}
  - {signal: 2, pin: DO2}
arming_signal: 9
"""
RELEASED, PRESSED = 1 << 15, 0
"""What the controller has at CI7, where a contact opens when pressed."""


class Finger:
    """Presses and releases at the controller's terminal between two looks."""

    def __init__(self, controller, terminals):
        self.controller, self.terminals = controller, iter(terminals)
        self.told = []

    def tell(self, text):
        self.told.append(text)

    def await_key(self, text):
        self.told.append(text)

    def confirm(self, text):
        self.await_key(text)

    def ask(self, text):
        raise AssertionError(text)

    def wait(self, seconds):
        bits = next(self.terminals, None)
        if bits is not None:
            self.controller.fault("inputs", bits=bits)
        time.sleep(seconds)


def test_a_press_at_the_terminal_arms_and_one_held_from_before_does_not(tmp_path):
    rig = make_lab(tmp_path, HOST, cell=CELL)
    tree = yaml.safe_load(rig.read_text())
    rig.write_text(yaml.safe_dump(tree))
    resolved = resolve(rig=rig, scenario=tmp_path / "small.yaml")
    with controller_of(tmp_path, HOST) as controller, build_station(resolved) as station:
        controller.fault("inputs", bits=PRESSED)
        held = Finger(controller, [])
        begin = time.monotonic()
        with pytest.raises(SafetyError, match="within 10 s"):
            PersonOperator(held, wait=held.wait).arm_once(station)
        assert 9.5 < time.monotonic() - begin < 20.0
        assert station.state.mode is StationMode.DISARMED
        bounced = [RELEASED] * 10 + [PRESSED, RELEASED] * 3 + [PRESSED] * 20
        finger = Finger(controller, bounced)
        PersonOperator(finger, wait=finger.wait).arm_once(station)
        assert station.state.mode is StationMode.ENGAGED
