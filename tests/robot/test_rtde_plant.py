"""What can be said of a UR5e as a plant before anybody connects to it."""

import msgspec
import pytest

from config.loader import resolve
from robot.errors import RobotConfigError
from robot.messages import PlantKind
from robot.rigs import build_plant

pytestmark = pytest.mark.realtime


@pytest.fixture(scope="module")
def resolved():
    return resolve(rig="virtual_lab", scenario="paper", learning="default")


def plant_of(resolved, **changes):
    rig = msgspec.structs.replace(resolved.rig, **changes)
    return build_plant(rig=rig, arm=resolved.arm, scenario=resolved.scenario)


def test_on_loopback_it_is_virtual_elsewhere_real_and_its_serial_is_not_made_up(resolved):
    assert plant_of(resolved).identity.kind is PlantKind.VIRTUAL
    elsewhere = plant_of(resolved, address="192.0.2.7").identity
    assert (elsewhere.kind, elsewhere.serial) == (PlantKind.REAL, "")


def test_a_rig_without_an_address_or_with_other_ticks_is_refused(resolved):
    with pytest.raises(RobotConfigError, match="address"):
        plant_of(resolved, address=None)
    with pytest.raises(RobotConfigError, match="tick_s"):
        plant_of(resolved, tick_s=0.01)


def test_a_robot_lays_no_table_out_and_says_who_could(resolved):
    with pytest.raises(RobotConfigError, match="bus"):
        plant_of(resolved).resetter.reset(seed=1, epoch=0, digital_out=0)
