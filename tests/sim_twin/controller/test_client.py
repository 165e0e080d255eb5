"""The genuine ur_rtde client against the virtual controller, over loopback and in wall time."""

import time

import numpy as np
import pytest

from sim_twin.controller.process import ControllerProcess
from sim_twin.controller.server import Setup
from tests.support.genuine_client import HOME, make_station, until
from tests.support.loopback import own_address

pytestmark = pytest.mark.realtime

pytest.importorskip("rtde_control", reason="the genuine client comes with `pip install autotelic[lab]`")

HOST = own_address()
TOLERANCE = 0.005
X = np.array([1.0, 0, 0, 0, 0, 0])
RUNNING_BIT, PROTECTIVE_BIT = 1 << 1, 1 << 2


@pytest.fixture(scope="module")
def opened():
    with make_station(HOST) as station:
        yield station


@pytest.fixture
def station(opened):
    opened.recover()
    return opened


def test_connecting_uploads_and_runs(station):
    assert station.control.isConnected()
    assert station.control.isProgramRunning()
    assert station.control.getRobotStatus() & RUNNING_BIT
    assert station.receive.getRobotMode() == 7
    assert station.receive.getSafetyMode() == 1


def test_an_asynchronous_move_is_stopped_on_its_way(station):
    goal = HOME + X * 1.0
    assert station.control.moveJ(list(goal), 0.8, 2.0, True)
    assert until(lambda: station.q[0] - HOME[0] > 0.1)
    assert station.control.getAsyncOperationProgress() >= 0
    station.control.stopJ(4.0)
    moved = station.rest()[0] - HOME[0]
    assert 0.1 < moved < 0.6
    assert station.control.getAsyncOperationProgress() < 0


def test_a_stream_of_servoj_is_followed(station):
    control, q = station.control, HOME.copy()
    for k in range(400):
        t = control.initPeriod()
        q = HOME + X * 0.15 * (1.0 - np.cos(np.pi * k / 400)) / 2.0
        assert control.servoJ(list(q), 0.0, 0.0, 0.002, 0.03, 1200.0)
        control.waitPeriod(t)
    assert until(lambda: np.abs(station.q - q).max() < TOLERANCE)
    assert control.servoStop()


def test_speeds_are_reached_and_stopped(station):
    control = station.control
    assert control.speedJ([0.4, 0, 0, 0, 0, 0], 2.0)
    assert until(lambda: abs(station.receive.getActualQd()[0] - 0.4) < 0.02)
    assert control.speedStop(4.0)
    station.rest()
    assert control.speedL([0.0, 0.0, 0.06, 0, 0, 0], 0.5)
    assert until(lambda: abs(station.receive.getActualTCPSpeed()[2] - 0.06) < 0.005)
    assert control.speedStop(4.0)
    station.rest()


def test_freedrive_gives_way_to_a_push(station):
    control = station.control
    before = station.q[0]
    assert control.freedriveMode()
    station.process.fault("push", nm=[6.0, 0, 0, 0, 0, 0])
    moved = until(lambda: station.q[0] - before > 0.02)
    station.process.fault("push")
    assert control.endFreedriveMode()
    assert moved
    station.rest()


def test_contact_on_the_way_down_is_detected(station):
    control = station.control
    station.over_the_table(0.04)
    assert control.moveUntilContact([0, 0, -0.05, 0, 0, 0])
    station.rest()
    height = station.pose[2]
    assert 0.0 < height < 0.03
    assert control.moveL([*station.pose[:2], height + 0.02, *station.pose[3:]], 0.25, 1.0)
    assert control.startContactDetection([0.0, 0, -1.0, 0, 0, 0])
    assert control.moveL([*station.pose[:2], height - 0.02, *station.pose[3:]], 0.05, 0.5, True)
    # No command meanwhile: the client's script loses its own answer to a contact in the slice after a command.
    assert until(lambda: station.receive.getActualTCPSpeed()[2] < -0.02)
    station.rest()
    assert control.readContactDetection() > 0
    assert control.stopContactDetection()
    assert station.pose[2] == pytest.approx(height, abs=TOLERANCE)


def test_inputs_of_the_table_are_told(station):
    station.process.fault("inputs", bits=0b101)
    assert until(lambda: station.receive.getActualDigitalInputBits() & 0b111 == 0b101)
    station.process.fault("inputs")


def test_a_protective_stop_holds_until_it_is_unlocked_by_hand(station):
    from dashboard_client import DashboardClient

    control, receive = station.control, station.receive
    dashboard = DashboardClient(HOST)
    dashboard.connect()
    control.triggerProtectiveStop()
    begun = time.monotonic()
    assert until(receive.isProtectiveStopped)
    assert not control.moveJ(list(HOME + X * 0.1))
    assert "PROTECTIVE_STOP" in dashboard.safetystatus()
    with pytest.raises(RuntimeError, match="5s"):
        dashboard.unlockProtectiveStop()
    time.sleep(max(0.0, begun + 5.1 - time.monotonic()))
    dashboard.unlockProtectiveStop()
    assert until(lambda: not receive.isProtectiveStopped())
    assert "NORMAL" in dashboard.safetystatus()
    assert control.reuploadScript()
    assert until(control.isProgramRunning)
    assert control.moveJ(list(HOME + X * 0.1), 2.0, 6.0)
    assert dashboard.running()
    assert "RUNNING" in dashboard.robotmode()
    dashboard.disconnect()


def test_a_starved_watchdog_stops_the_program(station):
    control = station.control
    assert control.setWatchdog(10.0)
    for _ in range(20):
        assert control.kickWatchdog()
        time.sleep(0.02)
    assert control.isProgramRunning()
    assert until(lambda: not control.isProgramRunning(), 1.0)
    assert not control.moveJ(list(HOME))
    assert any("watchdog" in line for line in station.process.fault("log")["lines"])
    assert control.reuploadScript()
    assert until(control.isProgramRunning)


def test_getters_agree_with_one_another(station):
    control, q, pose = station.control, station.q, station.pose
    flange = [0.0] * 6
    tool = control.getTCPOffset()
    assert tool == pytest.approx([0, 0, 0.1628, 0, 0, 0])
    assert control.getForwardKinematics(list(q), tool) == pytest.approx(pose, abs=1e-4)
    assert control.getForwardKinematics() == pytest.approx(pose, abs=1e-4)
    assert control.getInverseKinematics(list(pose), list(q + 0.05)) == pytest.approx(q, abs=1e-3)
    assert control.getInverseKinematicsHasSolution(list(pose), list(q))
    assert not control.getInverseKinematicsHasSolution([3.0, 0, 0, 0, 0, 0], list(q))
    assert control.isPoseWithinSafetyLimits(list(pose))
    assert not control.isJointsWithinSafetyLimits([0, 0, 4.0, 0, 0, 0])
    assert control.poseTrans(list(pose), flange) == pytest.approx(pose, abs=1e-9)
    assert until(control.isSteady)
    assert control.setTcp([0, 0, 0.1, 0, 0, 0])
    assert control.getTCPOffset() == pytest.approx([0, 0, 0.1, 0, 0, 0])
    assert control.setTcp(tool)


def test_a_payload_that_is_told_zeroes_the_force_of_what_hangs_untold(station):
    control, receive = station.control, station.receive
    assert control.zeroFtSensor()
    station.process.fault("payload", kg=1.0)
    assert until(lambda: receive.getActualTCPForce()[2] == pytest.approx(-9.81, abs=0.2))
    assert control.setPayload(1.925, [0, 0, 0.05])
    assert until(lambda: receive.getPayload() == pytest.approx(1.925))
    assert until(lambda: receive.getActualTCPForce()[2] == pytest.approx(0.0, abs=0.2))
    station.process.fault("payload")
    assert control.setTargetPayload(0.925, [0, 0, 0.058], [1e-3, 1e-3, 1e-3, 0, 0, 0])
    assert until(lambda: receive.getPayloadInertia()[0] == pytest.approx(1e-3))


def test_a_script_that_fails_says_where_and_stops(station):
    station.control.sendCustomScript("def f():\n  write_output_integer_register(0, 2)\n  a = sqrt(-1)\nend\n")
    lines = station.process.fault("log")["lines"]
    assert any("line 3" in line and "sqrt" in line for line in lines)


def test_links_that_are_cut_are_noticed(station):
    receive = station.receive
    station.process.fault("freeze", on=True, port=30004)
    stamp = receive.getTimestamp()
    time.sleep(0.1)
    assert receive.getTimestamp() - stamp < 0.05, "frozen interfaces tell nothing new"
    before = station.truth()["n_slices"]
    time.sleep(0.05)
    assert station.truth()["n_slices"] > before + 5, "physics goes on"
    station.process.fault("freeze", on=False)
    assert until(lambda: receive.getTimestamp() > stamp + 0.1)


def test_an_open_safeguard_pauses_a_move_that_then_goes_on(station):
    goal = HOME + X * 0.5
    assert station.control.moveJ(list(goal), 1.0, 4.0, True)
    assert until(lambda: station.q[0] - HOME[0] > 0.1)
    station.process.fault("safeguard_open")
    assert until(lambda: station.receive.getRuntimeState() == 4)
    between = station.rest()[0] - HOME[0]
    assert 0.1 < between < 0.45
    assert station.receive.getSafetyMode() == 5
    station.process.fault("safeguard_close")
    assert until(lambda: abs(station.q[0] - goal[0]) < TOLERANCE)
    assert until(lambda: station.control.getAsyncOperationProgress() < 0)


def test_a_program_that_is_stopped_from_outside_takes_no_command(station):
    station.process.fault("program_stop")
    assert until(lambda: not station.control.isProgramRunning())
    assert not station.control.moveJ(list(HOME))


def test_links_that_are_late_make_the_client_late(station):
    station.process.fault("delay", ms=20.0)
    begun = time.monotonic()
    assert station.control.isSteady() in (True, False)
    assert time.monotonic() - begun > 0.035, "the command and its answer, each 20 ms late"
    station.process.fault("delay")


def test_noise_is_in_the_readings_only(station):
    station.process.fault("noise", rad=0.002)
    read, true = [], []
    for _ in range(20):
        time.sleep(0.004)
        read.append(station.q)
        true.append(station.truth()["q_rad"])
    station.process.fault("noise")
    assert np.std(read, axis=0).min() > 5e-4
    assert np.std(true, axis=0).max() < 5e-4


def test_local_control_keeps_the_client_out():
    from rtde_control import RTDEControlInterface

    host = own_address()
    with ControllerProcess(Setup(host=host)) as process:
        process.fault("remote", on=False)
        with pytest.raises(RuntimeError, match="remote control"):
            RTDEControlInterface(host)
        process.fault("remote", on=True)
        process.fault("reserve", names=["input_int_register_0"])
        with pytest.raises((RuntimeError, ValueError)):
            RTDEControlInterface(host)
