"""What is told the controller is read back, through the genuine client."""

import math

import msgspec
import pytest

from config.loader import load_arm
from robot.errors import ArmRefusedError
from robot.hal.rtde_set_up import prove_watchdog, set_tool
from tests.support.genuine_client import until
from tests.support.loopback import own_address

pytestmark = pytest.mark.realtime

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
    tell(station, tool.mass_kg + 0.5, tool.com_m)
    set_tool(OffCentre(station.control, off_m), station.receive, Ticks(), tool)
    assert station.receive.getPayloadCog() == pytest.approx([0.001 + off_m, -0.002, 0.07], abs=1e-9)


def test_another_centre_of_mass_than_asked_is_refused(station):
    tool = msgspec.structs.replace(load_arm("ur5e").tool, com_m=(0.002, 0.0, 0.07))
    with pytest.raises(ArmRefusedError, match="m of the flange, the controller says"):
        set_tool(OffCentre(station.control, 2e-4), station.receive, Ticks(), tool)


@pytest.mark.parametrize(("told_kg", "left_n"), [(0.0, 29.4), (0.5, 0.0)])
def test_what_hangs_beside_a_payload_that_is_told_already_stays_in_the_force(station, told_kg, left_n):
    tool = load_arm("ur5e").tool
    tell(station, tool.mass_kg + told_kg, tool.com_m)
    try:
        station.process.fault("payload", kg=3.0)
        assert until(lambda: pulled_n(station) > 25.0)
        set_tool(station.control, station.receive, Ticks(), tool)
        assert until(lambda: abs(pulled_n(station) - left_n) < 3.0)
    finally:
        station.process.fault("payload")


def tell(station, mass_kg, com_m):
    assert station.control.setPayload(mass_kg, list(com_m))
    assert until(lambda: abs(station.receive.getPayload() - mass_kg) < 1e-6)


def pulled_n(station):
    return math.hypot(*station.receive.getActualTCPForce()[:3])


class Told:
    """What a controller says of itself, tick by tick of 2 ms, after its watchdog was armed."""

    PROTECTIVE = 1 << 2

    def __init__(self, *, stops_after_s, begins_after_s=0.0, safety=1):
        self._stops_s, self._begins_s, self._safety = stops_after_s, begins_after_s, safety
        self.now_s, self.armed_s = 0.0, math.inf

    def setWatchdog(self, hz):  # noqa: N802 - the client's name
        assert hz == 10.0
        self.armed_s = self.now_s
        return True

    def getTimestamp(self):  # noqa: N802
        return self.now_s

    def getRobotMode(self):  # noqa: N802
        return 7

    def getSafetyStatusBits(self):  # noqa: N802
        return self._safety if self._has_stopped else 1

    def getRuntimeState(self):  # noqa: N802
        return 1 if self._has_stopped or self.now_s < self._begins_s else 2

    def getTargetSpeedFraction(self):  # noqa: N802
        return 1.0

    def wait_tick(self):
        self.now_s += 0.002

    @property
    def _has_stopped(self):
        return self.now_s - self.armed_s >= self._stops_s


@pytest.mark.parametrize("begins_after_s", [0.0, 0.3])
def test_a_watchdog_that_ends_a_running_program_in_its_time_is_proven(begins_after_s):
    told = Told(stops_after_s=0.102, begins_after_s=begins_after_s)
    prove_watchdog(told, told, told)
    assert told.armed_s >= begins_after_s
    assert told.now_s - told.armed_s == pytest.approx(0.102, abs=0.003)


@pytest.mark.parametrize(
    ("told", "why"),
    [
        (Told(stops_after_s=0.002), "something else did after"),
        (Told(stops_after_s=0.46), "it ran on for 0.25 s"),
        (Told(stops_after_s=0.1, safety=Told.PROTECTIVE), "protective stop"),
    ],
)
def test_an_end_that_the_watchdog_did_not_make_proves_nothing(told, why):
    with pytest.raises(ArmRefusedError, match=why):
        prove_watchdog(told, told, told)
