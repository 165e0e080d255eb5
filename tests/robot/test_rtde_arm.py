"""What the backend says and leaves behind when a controller in front of it is broken; no servo process beside it."""

import pytest

from config.loader import load_arm
from robot.errors import WireError
from sim_twin.controller.process import ControllerProcess
from sim_twin.controller.server import Setup
from tests.support.loopback import own_address

pytest.importorskip("rtde_control", reason="the genuine client comes with `pip install autotelic[lab]`")

CONFIG = load_arm("ur5e")
DASHBOARD = 29999


@pytest.fixture(scope="module")
def controller():
    with ControllerProcess(Setup(host=own_address())) as opened:
        yield opened


@pytest.fixture
def arm(controller):
    from robot.hal.rtde import RtdeArm

    made = RtdeArm(arm=CONFIG, address=controller.host)
    made.connect()
    yield made
    made.close()


def test_a_dashboard_that_hung_up_is_said_by_name(controller, arm):
    controller.fault("drop", port=DASHBOARD)
    with pytest.raises(WireError, match="dashboard"):
        arm.engage()


def test_a_program_that_only_a_person_can_end_is_no_confirmed_stop(controller, arm):
    arm.engage()
    controller.fault("remote", on=False)
    controller.fault("safeguard_open")
    assert not arm.stop()
    controller.fault("safeguard_close")
    controller.fault("remote", on=True)
