"""Six scenarios after those of ur_rtde's own test suite, to its tolerance, at every version that is announced."""

import time

import numpy as np
import pytest

from tests.support.genuine_client import HOME, make_station, moved, until
from tests.support.loopback import own_address

pytestmark = pytest.mark.realtime

pytest.importorskip("rtde_control", reason="the genuine client comes with `pip install autotelic[lab]`")

TOLERANCE = 0.005
SPEED_M_S, ACCELERATION_M_S2, BLEND_M = 0.4, 1.5, 0.02
PRESS_N = 20.0
SLOW = [pytest.param(v, marks=pytest.mark.slow) for v in ("3.15.8", "5.9.4", "5.22.0", "5.26.0")]


@pytest.fixture(scope="module", params=["5.11.0", "5.23.0", *SLOW])
def opened(request):
    with make_station(own_address(), request.param) as station:
        station.version = request.param
        yield station


@pytest.fixture
def station(opened):
    opened.recover()
    return opened


def watch(station, corner):
    """Return how near the tool came to a corner while an asynchronous path was under way."""
    nearest, begun = np.inf, time.monotonic()
    while station.control.getAsyncOperationProgress() >= 0 or nearest == np.inf:
        nearest = min(nearest, float(np.linalg.norm(station.pose[:3] - corner[:3])))
        assert time.monotonic() - begun < 8.0
        time.sleep(0.002)
    station.rest()
    return nearest


def test_move_j(station):
    goal = HOME + np.array([0.3, -0.1, 0.1, 0.05, 0.0, 0.2])
    assert station.control.moveJ(list(goal), 1.05, 1.4)
    assert station.rest() == pytest.approx(goal, abs=TOLERANCE)
    assert station.truth()["q_rad"] == pytest.approx(goal, abs=TOLERANCE)
    assert station.control.moveJ(list(HOME), 2.0, 6.0)
    assert station.rest() == pytest.approx(HOME, abs=TOLERANCE)


def test_move_l(station):
    start = station.pose
    goal = moved(start, 0.02, 0.05, 0.04)
    for pose in (goal, start):
        assert station.control.moveL(list(pose), SPEED_M_S, ACCELERATION_M_S2)
        station.rest()
        assert station.pose[:3] == pytest.approx(pose[:3], abs=TOLERANCE)
        assert station.q == pytest.approx(station.truth()["q_rad"], abs=TOLERANCE)


def test_move_path(station):
    from rtde_control import Path, PathEntry

    start = station.pose
    corner, end = moved(start, 0, 0.08, 0), moved(start, 0, 0.08, 0.08)
    path = Path()
    path.addEntry(PathEntry(PathEntry.MoveJ, PathEntry.PositionJoints, [*HOME, 1.0, 3.0, 0.0]))
    for place, blend in ((corner, BLEND_M), (end, 0.0)):
        entry = [*place, SPEED_M_S, ACCELERATION_M_S2, blend]
        path.addEntry(PathEntry(PathEntry.MoveL, PathEntry.PositionTcpPose, entry))
    station.control.movePath(path, True)
    assert 0.003 < watch(station, corner) < BLEND_M, "it comes near the corner and does not go through it"
    assert station.pose[:3] == pytest.approx(end[:3], abs=TOLERANCE)


def test_move_l_with_blend(station):
    start = station.pose
    corner, end = moved(start, 0, 0, 0.08), moved(start, 0, -0.08, 0.08)
    places = ((corner, BLEND_M), (end, 0.0))
    path = [[*place, SPEED_M_S, ACCELERATION_M_S2, blend] for place, blend in places]
    station.control.moveL(path, True)
    assert 0.003 < watch(station, corner) < BLEND_M
    assert station.pose[:3] == pytest.approx(end[:3], abs=TOLERANCE)


def test_force_mode(station):
    control, receive = station.control, station.receive
    station.over_the_table(0.016)
    start = station.pose
    control.zeroFtSensor()
    limits = [0.1, 0.1, 0.1, 0.3, 0.3, 0.3]

    def press():
        return control.forceMode([0.0] * 6, [0, 0, 1, 0, 0, 0], [0, 0, -PRESS_N, 0, 0, 0], 2, limits)

    try:
        is_pressing = until(lambda: press() and abs(receive.getActualTCPForce()[2] - PRESS_N) < 2.0, 10.0)
        felt = []
        for _ in range(50):
            press()
            time.sleep(0.004)
            felt.append(receive.getActualTCPForce()[2])
        pressing = station.pose
    finally:
        assert control.forceModeStop()
    assert is_pressing
    assert np.mean(felt) == pytest.approx(PRESS_N, abs=3.0)
    assert pressing[:2] == pytest.approx(start[:2], abs=TOLERANCE), "it complies along one axis only"
    assert pressing[2] < start[2] - 1e-3


def test_io(station):
    from rtde_io import RTDEIOInterface

    receive, io = station.receive, RTDEIOInterface(station.process.host)
    try:
        for n, set_out in ((1, io.setStandardDigitalOut), (2, io.setStandardDigitalOut)):
            assert set_out(n, True)
        assert io.setConfigurableDigitalOut(3, True)
        assert io.setToolDigitalOut(1, True)
        wanted = 1 << 1 | 1 << 2 | 1 << 11 | 1 << 17
        assert until(lambda: receive.getActualDigitalOutputBits() == wanted)
        assert io.setStandardDigitalOut(1, False)
        assert until(lambda: receive.getActualDigitalOutputBits() == wanted & ~2)
        assert station.truth()["digital_out"] == wanted & ~2
        assert io.setAnalogOutputVoltage(0, 0.5)
        assert until(lambda: receive.getStandardAnalogOutput0() == pytest.approx(5.0, abs=TOLERANCE))
        assert io.setSpeedSlider(0.3)
        assert until(lambda: receive.getSpeedScaling() == pytest.approx(0.3, abs=TOLERANCE))
        begun = time.monotonic()
        assert station.control.moveJ(list(HOME + np.array([0.15, 0, 0, 0, 0, 0])), 1.0, 4.0)
        assert time.monotonic() - begun > 0.8
    finally:
        io.setSpeedSlider(1.0)
        io.setToolDigitalOut(1, False)
        for n in range(8):
            io.setStandardDigitalOut(n, False)
            io.setConfigurableDigitalOut(n, False)
        until(lambda: receive.getSpeedScaling() == pytest.approx(1.0))
        io.disconnect()


def test_what_the_versions_script_calculates(station):
    control, version = station.control, station.version
    assert control.getInverseKinematics(list(station.pose)) == pytest.approx(station.q, abs=1e-3)
    if version in ("5.23.0", "5.26.0"):
        mass = np.array(control.getMassMatrix()).reshape(6, 6)
        assert np.abs(mass - mass.T).max() < 1e-6
        assert (np.linalg.eigvalsh(mass) > 0.0).all()
        # The client reads what was calculated last where it was quick (facts 1.12, 6): the mass matrix once more.
        assert until(lambda: abs(np.linalg.det(np.reshape(control.getJacobian(), (6, 6)))) > 1e-3, 2.0)
    if version == "5.26.0":
        before = station.q
        assert control.directTorque([0.0] * 6, [0.0] * 6, [0.0] * 6)
        time.sleep(0.2)
        assert control.isProgramRunning()
        assert station.q == pytest.approx(before, abs=TOLERANCE), "its weight is carried"
