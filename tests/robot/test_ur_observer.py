"""Whoever only looks at an arm: sees it, leaves nothing behind on its controller, and tells where it falls silent."""

import os
import signal
import time
from contextlib import closing

import msgspec
import numpy as np
import pytest

from config.loader import resolve
from robot.errors import RobotConfigError, SafetyError, StaleStateError, WireError
from robot.hal.sight import Watched
from robot.messages import ArmMode, PlantKind
from robot.rigs import build_plant
from robot.watching import StandStill
from sim_twin.controller.process import ControllerProcess
from sim_twin.controller.server import Setup
from tests.support.loopback import own_address

pytest.importorskip("rtde_receive", reason="the genuine client comes with `pip install autotelic[lab]`")

pytestmark = pytest.mark.realtime


@pytest.fixture(scope="module")
def controller():
    with ControllerProcess(Setup(host=own_address(), cell="ur_box")) as opened:
        yield opened


def observer_of(host, *, serial=None):
    resolved = resolve(rig="virtual_lab")
    expected = msgspec.structs.replace(resolved.rig.expected, serial=serial or resolved.rig.expected.serial)
    rig = msgspec.structs.replace(resolved.rig, address=host, expected=expected)
    plant = build_plant(rig=rig, arm=resolved.arm, scenario=resolved.scenario, cell=resolved.cell)
    assert isinstance(plant, Watched)
    return plant.observer()


def test_it_sees_the_arm_and_leaves_nothing_on_its_controller(controller):
    n_before = len(controller.fault("log")["lines"])
    with closing(observer_of(controller.host)) as observer:
        observer.connect()
        sight, truth = observer.see(), controller.fault("truth")
        assert np.allclose(sight.q_rad, truth["q_rad"], atol=1e-5)
        assert sight.mode is ArmMode.RUNNING
        assert not sight.is_program_running
        assert observer.identity.kind is PlantKind.VIRTUAL
        assert observer.identity.serial == "20215501234"
        assert observer.tool_off_m < 1e-6
    observer.close()
    with pytest.raises(StaleStateError):
        observer.see()
    assert controller.fault("truth")["runtime"] == "STOPPED"
    said = controller.fault("log")["lines"][n_before:]
    assert [line for line in said if "program" in str(line).lower()] == []


def test_another_arm_than_the_rigs_is_refused_and_a_calibrated_ones_tool_is_compared(controller):
    with closing(observer_of(controller.host, serial="20220000001")) as other, pytest.raises(RobotConfigError):
        other.connect()
    controller.fault("calibrate", mm=1.0)
    with closing(observer_of(controller.host)) as observer:
        observer.connect()
        assert 1e-4 < observer.tool_off_m < 0.01
    controller.fault("calibrate")


def test_an_arm_that_is_moved_while_it_is_watched_is_told(controller):
    still = StandStill()
    with closing(observer_of(controller.host)) as observer:
        observer.connect()
        still(observer.see())
        controller.fault("bias", rad=[0.0, 0.0, 0.002, 0.0, 0.0, 0.0])
        with pytest.raises(SafetyError, match=r"joint 3 of 6 moved by 2\.0 mrad"):
            look_on(observer, still, 2.0)
    controller.fault("bias")


def look_on(observer, still, for_s):
    end = time.monotonic() + for_s
    while time.monotonic() < end:
        still(observer.see())
        time.sleep(0.01)


def test_a_controller_that_stands_still_is_told_as_one_that_is_silent(controller):
    with closing(observer_of(controller.host)) as observer:
        observer.connect()
        os.kill(controller.pid, signal.SIGSTOP)
        try:
            with pytest.raises(StaleStateError, match="silent for"):
                look_on(observer, lambda _: None, 4.0)
        finally:
            os.kill(controller.pid, signal.SIGCONT)


def test_where_nobody_listens_it_says_so():
    with closing(observer_of(own_address())) as observer, pytest.raises(WireError):
        observer.connect()
