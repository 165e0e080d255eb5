"""What is told the controller is read back, through the genuine client."""

import msgspec
import pytest

from config.loader import load_arm
from robot.errors import ArmRefusedError
from robot.hal.rtde_set_up import set_tool
from tests.support.loopback import own_address

pytest.importorskip("rtde_control", reason="the genuine client comes with `pip install autotelic[lab]`")


class OffCentre:
    """The genuine control client, that tells another centre of mass than it is asked to."""

    def __init__(self, control, off_m):
        self._control, self._off_m = control, off_m

    def __getattr__(self, name):
        return getattr(self._control, name)

    def setPayload(self, mass_kg, com_m):  # noqa: N802 - the client's name
        return self._control.setPayload(mass_kg, [com_m[0] + self._off_m, *com_m[1:]])


@pytest.fixture(scope="module")
def station():
    from tests.support.genuine_client import make_station

    with make_station(own_address()) as made:
        yield made


class Ticks:
    def wait_tick(self):
        """The deadline is in wall time; asking without a pause only asks more often."""


@pytest.mark.parametrize("off_m", [0.0, 9e-5, -9e-5])
def test_a_tool_whose_centre_is_read_back_is_set(station, off_m):
    tool = msgspec.structs.replace(load_arm("ur5e").tool, com_m=(0.001, -0.002, 0.07))
    set_tool(OffCentre(station.control, off_m), station.receive, Ticks(), tool)
    assert station.receive.getPayloadCog() == pytest.approx([0.001 + off_m, -0.002, 0.07], abs=1e-9)


def test_another_centre_of_mass_than_asked_is_refused(station):
    with pytest.raises(ArmRefusedError, match="m of the flange, the controller says"):
        set_tool(OffCentre(station.control, 2e-4), station.receive, Ticks(), load_arm("ur5e").tool)
